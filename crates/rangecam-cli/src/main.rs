//! The command `rangecam`.

use std::process::ExitCode;

fn main() -> ExitCode {
    rangecam_cli::main(std::env::args_os())
}
