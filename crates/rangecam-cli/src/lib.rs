#![doc = include_str!("../README.md")]

mod arguments;
mod bar;
mod commands;
mod escape;
mod exit;
mod output;
mod requests;
mod status_line;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;

use crate::arguments::Arguments;
use crate::output::Output;

/// Runs the command with the given arguments, the program's name first, and returns what the shell should see: 0 done,
/// 1 done but doubtful (of `diff`: the calibrations differ), 2 wrong input or usage, 3 refused by what the data show,
/// 4 failure of the machine, 5 done in part.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version come this way too; clap knows which stream and which code each wants.
            output::print_usage(&error);
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(exit::USAGE));
        }
    };
    let output = Output::new(&arguments);
    match commands::dispatch(arguments.command, &output) {
        Ok(code) => code,
        Err(error) => {
            output.refusal(error.as_ref());
            output.error(error.as_ref());
            exit::of_error(error.as_ref())
        }
    }
}
