//! The commands, one file each.

mod map;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Fuse a log into maps and write them into a folder
    Map(map::Args),
}

impl Command {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        match self {
            Self::Map(args) => map::run(args),
        }
    }
}
