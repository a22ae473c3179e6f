//! The commands, one file each.

mod convert;
mod demo;
mod eval;
mod gallery;
mod info;
mod map;
mod merge;
mod mesh;
mod pages;
mod query;
mod radiance;
mod studio;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// The textbook's experiment: a simulated lap, every representation, the gallery
    Demo(demo::Args),
    /// One log in every representation: what each costs and how true its answers are
    Gallery(gallery::Args),
    /// Fuse a log of range scans into maps, 2-D or 3-D
    Map(Box<map::Args>),
    /// Add up maps of sums, made of parts of a log or of several logs, or take one out of another
    Merge(merge::Args),
    /// Occupancy, distance and gradient of a map at given points
    Query(query::Args),
    /// What a file is and what it holds
    Info(info::Args),
    /// Convert a map, field or contour to another format
    Convert(convert::Args),
    /// Extract the contour or mesh of a map again, with other settings
    Mesh(mesh::Args),
    /// The differentiable renderer on a line: rendering as a measurement model
    Radiance(radiance::Args),
    /// Watch maps grow in the browser (a local web app)
    Studio(studio::Args),
    /// Measure how good a map is: on scans that were not fused, or against a reference surface
    Eval(eval::Args),
    /// What bash, zsh, fish, elvish or PowerShell need to complete commands and options
    Completions(pages::CompletionsArgs),
    /// Write manual pages
    Man(pages::ManArgs),
}

impl Command {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        match self {
            Self::Demo(args) => demo::run(args),
            Self::Gallery(args) => gallery::run(args),
            Self::Map(args) => map::run(args),
            Self::Merge(args) => merge::run(args),
            Self::Query(args) => query::run(args),
            Self::Info(args) => info::run(args),
            Self::Convert(args) => convert::run(args),
            Self::Mesh(args) => mesh::run(args),
            Self::Radiance(args) => radiance::run(args),
            Self::Studio(args) => studio::run(args),
            Self::Eval(args) => eval::run(args),
            Self::Completions(args) => pages::completions(args),
            Self::Man(args) => pages::man(args),
        }
    }
}
