//! The commands, one file each.

mod demo;
mod gallery;
mod map;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// The chapter's experiment: a simulated lap, every representation, the gallery
    Demo(demo::Args),
    /// One log in every representation: what each costs and how true its answers are
    Gallery(gallery::Args),
    /// Fuse a log into maps and write them into a folder
    Map(map::Args),
}

impl Command {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        match self {
            Self::Demo(args) => demo::run(args),
            Self::Gallery(args) => gallery::run(args),
            Self::Map(args) => map::run(args),
        }
    }
}
