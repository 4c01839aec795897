#![doc = include_str!("../README.md")]
// What checks and hands on arguments is written for every command.
#![cfg_attr(not(feature = "every-command"), allow(dead_code, unused_variables))]

mod arguments;
mod bar;
mod call;
mod commands;
mod escape;
mod exit;
#[cfg(feature = "every-command")]
mod further_commands;
mod output;
mod requests;
#[cfg(feature = "every-command")]
mod status_line;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;
use pipeline::commands::{made, memory, tiles};

use crate::arguments::Arguments;
use crate::output::Output;

/// Runs the command with the given arguments, the program's name first, and returns what the shell should see: 0 done,
/// 1 done but doubtful (of `diff`: the calibrations differ), 2 wrong input or usage, 3 refused by what the data show,
/// 4 failure of the machine, 5 done in part.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let typed: Vec<OsString> = arguments.into_iter().collect();
    let arguments = match Arguments::try_parse_from(&typed) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version come this way too; clap knows which stream and which code each wants.
            output::print_usage(&error);
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(exit::USAGE));
        }
    };
    let output = Output::new(&arguments);
    if let Some(threads) = arguments.threads
        && let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()
    {
        output.error(&error);
        return exit::of_error(&std::io::Error::other(error));
    }
    let call = call::call(&typed, &arguments);
    let (memory, threads) = (arguments.memory, arguments.threads);
    let tiles_above = arguments.tiles_above;
    let dispatch = || commands::dispatch(arguments.command, threads, &output);
    let dispatch = || memory::bounded(memory, || tiles::above(tiles_above, dispatch));
    match made::called(call, dispatch) {
        Ok(code) => code,
        Err(error) if exit::is_done_already(error.as_ref()) => output.done_already(error.as_ref()),
        Err(error) => {
            output.refusal(error.as_ref());
            output.error(error.as_ref());
            exit::of_error(error.as_ref())
        }
    }
}
