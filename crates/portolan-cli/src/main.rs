//! The portolan command line.
//!
//! Exit status: 0 done; 1 the input was bad (one line on stderr says where and what to do); 2 the call was bad.

mod arguments;
mod commands;
mod dimension;
mod error;
mod esdf;
mod json;
mod log;
mod mapping;
mod output;
mod progress;
mod saved;
mod source;
mod stale;
mod unknown;

use std::process::ExitCode;

use clap::Parser;

/// Maps from range scans with known poses, in 2-D and 3-D: occupancy, signed distance fields, surfaces.
#[derive(Parser)]
#[command(name = "portolan", version, propagate_version = true, max_term_width = 100)]
#[command(after_help = "Example:\n  portolan map intel.log.gz --resolution 0.05 --out intel")]
struct Cli {
    #[command(subcommand)]
    command: commands::Command,
}

fn main() -> ExitCode {
    match Cli::parse().command.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => error::report(&error),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn every_command_is_well_formed() {
        super::Cli::command().debug_assert();
    }
}
