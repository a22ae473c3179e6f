//! The binary `portolan`.

use std::process::ExitCode;

fn main() -> ExitCode {
    portolan_cli::run(std::env::args_os()).into()
}
