//! `completions` and `man`: what a shell and a manual need to know of the command line, made of its own description.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Command, CommandFactory};
use clap_complete::Shell;
use portolan_io::write_atomic;

use crate::Cli;

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  portolan completions bash > ~/.local/share/bash-completion/completions/portolan\n  \
                  portolan completions zsh > ~/.zfunc/_portolan"
)]
pub(crate) struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints what the shell reads.
pub(crate) fn completions(args: &CompletionsArgs) -> anyhow::Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "portolan", &mut script);
    Ok(io::stdout().write_all(&script)?)
}

#[derive(clap::Args)]
#[command(after_help = "Example:\n  portolan man --out ~/.local/share/man/man1")]
pub(crate) struct ManArgs {
    /// Folder for the pages, portolan.1 and one for each command; created if missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Writes the pages.
pub(crate) fn man(args: &ManArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&args.out).with_context(|| {
        format!("{}: cannot create the folder; name one that can be written to", args.out.display())
    })?;
    let mut cli = Cli::command();
    cli.build();
    write_page(&cli, "portolan", &args.out)?;
    for command in cli.get_subcommands().filter(|command| command.get_name() != "help") {
        write_page(command, &format!("portolan-{}", command.get_name()), &args.out)?;
    }
    Ok(())
}

fn write_page(command: &Command, name: &str, folder: &Path) -> anyhow::Result<()> {
    let page = clap_mangen::Man::new(command.clone());
    let mut text = Vec::new();
    page.render(&mut text)?;
    Ok(write_atomic(folder.join(format!("{name}.1")), |w| w.write_all(&text))?)
}
