//! The portolan command line as a library: the binary runs it, and the Python package brings it along.
//!
//! Exit status: 0 done; 1 the input was bad (one line on stderr says where and what to do); 2 the call was bad.

mod arguments;
mod commands;
mod dimension;
mod error;
mod esdf;
mod json;
pub mod library;
mod log;
mod mapping;
mod output;
mod progress;
mod saved;
mod source;
mod stale;
mod unknown;

use std::ffi::OsString;

use clap::Parser;

/// Maps from range scans with known poses, in 2-D and 3-D: occupancy, signed distance fields, surfaces.
#[derive(Parser)]
#[command(name = "portolan", version, propagate_version = true, max_term_width = 100)]
#[command(after_help = "Example:\n  portolan map intel.log.gz --resolution 0.05 --out intel")]
struct Cli {
    #[command(subcommand)]
    command: commands::Command,
}

/// Runs the command line on these arguments, the name of the program first; gives the exit status.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    match Cli::try_parse_from(arguments) {
        Ok(cli) => cli.command.run().map_or_else(|error| error::report(&error), |()| 0),
        Err(error) => {
            // Without a terminal the help goes nowhere.
            let _ = error.print();
            error.exit_code().try_into().unwrap_or(2)
        }
    }
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
