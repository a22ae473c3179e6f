//! The commands, one file each.

mod convert;
mod demo;
mod eval;
mod gallery;
mod info;
mod map;
mod mesh;
mod query;
mod radiance;
mod studio;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// The textbook's experiment: a simulated lap, every representation, the gallery
    Demo(demo::Args),
    /// One log in every representation: what each costs and how true its answers are
    Gallery(gallery::Args),
    /// Fuse a log into maps and write them into a folder
    Map(Box<map::Args>),
    /// Ask a map at points: occupancy, distance, gradient
    Query(query::Args),
    /// Say what a file is and what it holds
    Info(info::Args),
    /// Turn one format into another
    Convert(convert::Args),
    /// Extract the contour of a map again, with other settings
    Mesh(mesh::Args),
    /// The differentiable renderer on a line: rendering as a measurement model
    Radiance(radiance::Args),
    /// A web app on this machine that shows maps while they are made
    Studio(studio::Args),
    /// Measure a map against scans that were not fused, or against a reference contour
    Eval(eval::Args),
}

impl Command {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        match self {
            Self::Demo(args) => demo::run(args),
            Self::Gallery(args) => gallery::run(args),
            Self::Map(args) => map::run(args),
            Self::Query(args) => query::run(args),
            Self::Info(args) => info::run(args),
            Self::Convert(args) => convert::run(args),
            Self::Mesh(args) => mesh::run(args),
            Self::Radiance(args) => radiance::run(args),
            Self::Studio(args) => studio::run(args),
            Self::Eval(args) => eval::run(args),
        }
    }
}
