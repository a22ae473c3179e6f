//! The portolan command line as a library: the binary runs it, and the Python package brings it along.
//!
//! Exit status: 0 done; 1 the input was bad (one line on stderr says where and what to do); 2 the call was bad; 130 and 143 ended
//! by Ctrl-C (SIGINT) and by SIGTERM.

mod arguments;
mod commands;
mod dimension;
mod error;
mod esdf;
mod folder;
mod json;
pub mod library;
mod log;
mod mapping;
mod output;
mod progress;
mod saved;
mod source;
mod stop;
mod unknown;
mod up;

use std::ffi::OsString;
use std::io::{self, Write};

use clap::Parser;

/// Maps from range scans with known poses, in 2-D and 3-D: occupancy, signed distance fields, surfaces.
#[derive(Parser)]
#[command(name = "portolan", version, propagate_version = true, max_term_width = 100)]
#[command(after_help = "Example:\n  portolan map intel.log.gz --resolution 0.05 --out intel")]
struct Cli {
    #[command(subcommand)]
    command: commands::Command,
}

/// For who types the name alone.
const FIRST_STEPS: &str = "\
portolan makes maps of range scans with known poses. What to do first:
  portolan studio                                    look at maps while they are made, in the browser; needs no log
  portolan info LOG                                  what a log or a map holds
  portolan map LOG --resolution 0.05 --out DIR       a map of a log, in 2-D or 3-D
  portolan studio DIR                                look at it
All commands: portolan --help; one of them: portolan map --help
";

/// Runs the command line on these arguments, the name of the program first; gives the exit status.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    if arguments.len() < 2 {
        // Without a terminal it goes nowhere.
        let _ = io::stderr().write_all(FIRST_STEPS.as_bytes());
        return 2;
    }
    match Cli::try_parse_from(arguments) {
        Ok(cli) => cli.command.run().map_or_else(|error| error::report(&error), |()| 0),
        Err(error) => {
            // Without a terminal the help goes nowhere.
            let _ = error.print();
            error.exit_code().try_into().unwrap_or(2)
        }
    }
}

/// [`run`] for a process that does nothing else: Ctrl-C and SIGTERM are requests to end, which commands that have something to
/// save answer by saving it.
pub fn run_as_program(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    // Without it the system ends the process, as it does elsewhere.
    let _ = stop::listen();
    run(arguments)
}

/// Runs a command as [`run`] does, and gives back what went wrong instead of printing it.
///
/// # Errors
/// What the command would have said on stderr.
pub fn call(arguments: impl IntoIterator<Item = OsString>) -> anyhow::Result<()> {
    let cli = Cli::try_parse_from(arguments).map_err(|error| error::bad_call(error::in_words(&error)))?;
    cli.command.run()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn every_command_is_well_formed() {
        super::Cli::command().debug_assert();
    }
}
