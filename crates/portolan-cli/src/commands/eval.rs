//! `eval`: how good a map is.

use std::path::PathBuf;

use anyhow::bail;
use portolan_io::MapHeader;
use serde_json::{Value, json};

use crate::dimension::{Dimension, Given, ONLY_3D};
use crate::folder;
use crate::log::{LimitArgs, LogArgs};
use crate::output::Output;
use crate::source::{Source, open};

mod contour;
mod halves;
mod mesh;
mod nearest;
mod predict;
mod spread;

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  portolan map intel.log.gz --resolution 0.05 --hold-out 10 --out intel\n  \
                  portolan eval intel --scans intel.log.gz\n  \
                  portolan eval kitchen --reference kitchen.ply --crop\n  portolan eval intel --scans intel.log.gz --halves"
)]
pub(crate) struct Args {
    #[command(flatten)]
    given: Given<()>,
    /// map.portolan or its folder
    map: PathBuf,
    /// Log with scans that were not fused: the map predicts their ranges. Not needed where --reference is given, which will do
    #[arg(long, value_name = "LOG", required_unless_present = "reference")]
    scans: Option<PathBuf>,
    /// File to compare the surface with, with or without --scans: a contour (GeoJSON) in 2-D; a mesh (PLY, OBJ, GLB) or points (PLY, PCD, E57, ..) in
    /// 3-D
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    source: LogArgs,
    #[command(flatten)]
    limits: LimitArgs,
    /// Use only every N-th scan of the log [default: as the map did]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    every: Option<u64>,
    /// Predict only every N-th scan [default: those that the map held out, else all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    hold_out: Option<u64>,
    /// Tell how sure the surface is: map the first and the last two fifths of the log as the map was made, fit standard
    /// deviations to how far their surfaces lie apart, and check them where they were not fitted
    #[arg(long, requires = "scans")]
    halves: bool,
    /// Leave out the parts of the reference that the map did not observe
    #[arg(long, requires = "reference", help_heading = ONLY_3D)]
    crop: bool,
    /// Largest number of rays per scan to predict, evenly spread
    #[arg(long, value_name = "N", default_value_t = 5000, value_parser = at_least_one, help_heading = ONLY_3D)]
    rays: usize,
    #[command(flatten)]
    output: Output,
}

fn at_least_one(word: &str) -> Result<usize, String> {
    word.parse().ok().filter(|n| *n > 0).ok_or_else(|| "must be a whole number, 1 or more".into())
}

/// A part of the result, for machines and for people.
struct Part {
    key: &'static str,
    value: Value,
    text: String,
}

/// Evaluates the map.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let source = open(&args.map)?;
    folder::warn(&args.map, args.output)?;
    source.check::<Args>(&args.given)?;
    let with_halves = |mut parts: Vec<Part>, header: &MapHeader, dimension: Dimension| {
        if let (true, Some(log)) = (args.halves, &args.scans) {
            parts.push(halves::part(args, log, header, dimension)?);
        }
        anyhow::Ok(parts)
    };
    let parts = match source {
        Source::Map2(file) => with_halves(contour::evaluate(args, &file)?, &file.header, Dimension::Two)?,
        Source::Map3(file) => with_halves(mesh::evaluate(args, &file)?, &file.header, Dimension::Three)?,
        other => bail!(
            "{}: is {}; to evaluate it, give a map.portolan or its folder",
            args.map.display(),
            other.describe()
        ),
    };
    let mut document = json!({ "map": args.map.display().to_string() });
    let mut text = String::new();
    for part in parts {
        document[part.key] = part.value;
        text += &part.text;
    }
    args.output.print(&document, text)
}
