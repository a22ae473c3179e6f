//! The binary `portolan`.

use std::process::ExitCode;

fn main() -> ExitCode {
    portolan_cli::run_as_program(std::env::args_os()).into()
}
