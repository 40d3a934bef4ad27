//! The `driftless` program: parse, run, print the error, choose the exit code.

use driftless::cli;
use std::process::ExitCode;

fn main() -> ExitCode {
    let flags = match cli::parse(std::env::args_os()) {
        Ok(flags) => flags,
        Err(exit) => return exit,
    };
    match cli::run(&flags) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.tell(flags.is_json()),
    }
}
