//! The portolan command line.

use clap::{Parser, Subcommand};

mod commands;

/// Fuses range scans into maps and asks them questions.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// The differentiable renderer on a line: rays, a fit, and how it goes wrong.
    Radiance(commands::radiance::Args),
}

fn main() -> anyhow::Result<()> {
    match Cli::parse().command {
        Command::Radiance(args) => commands::radiance::run(&args),
    }
}
