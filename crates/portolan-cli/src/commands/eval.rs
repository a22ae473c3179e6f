//! `eval`: how good a map is.

use std::path::PathBuf;

use anyhow::bail;
use serde_json::{Value, json};

use crate::dimension::{Given, ONLY_3D};
use crate::log::{LimitArgs, LogArgs};
use crate::output::Output;
use crate::source::{Source, open};

mod contour;
mod mesh;
mod nearest;
mod predict;
mod spread;

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  portolan map intel.log.gz --resolution 0.05 --hold-out 10 --out intel\n  \
                  portolan eval intel --scans intel.log.gz\n  \
                  portolan eval kitchen --reference kitchen.ply --crop"
)]
pub(crate) struct Args {
    #[command(flatten)]
    given: Given<()>,
    /// map.portolan or its folder
    map: PathBuf,
    /// Log with scans that were not fused: the map predicts their ranges
    #[arg(long, value_name = "LOG", required_unless_present = "reference")]
    scans: Option<PathBuf>,
    /// File to compare the surface with: a contour (GeoJSON) in 2-D; a mesh (PLY, OBJ, GLB) or points (PLY, PCD, E57, ..) in
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
    source.check::<Args>(&args.given)?;
    let parts = match source {
        Source::Map2(file) => contour::evaluate(args, &file)?,
        Source::Map3(file) => mesh::evaluate(args, &file)?,
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
