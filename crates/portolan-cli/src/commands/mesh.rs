//! `mesh`: the contour of a map again.

use std::path::PathBuf;

use anyhow::bail;
use portolan::surface::{Ambiguity, ContourSettings, marching_squares};
use serde_json::json;

use crate::arguments::weight_or_zero;
use crate::error::bad_call;
use crate::mapping::{polylines, write_contour};
use crate::output::Output;
use crate::source::open_map;

#[derive(clap::Args)]
#[command(after_help = "Example:\n  portolan mesh intel contour.svg --min-weight 5")]
pub(crate) struct Args {
    /// map.portolan or its folder
    map: PathBuf,
    /// File to write: .geojson or .svg
    out: PathBuf,
    /// Cells of smaller weight count as never observed
    #[arg(long, value_name = "W", value_parser = weight_or_zero, allow_negative_numbers = true)]
    #[arg(default_value = "0.5")]
    min_weight: f32,
    /// Decide ambiguous squares by the fixed table instead of by the field
    #[arg(long)]
    fixed_table: bool,
    #[command(flatten)]
    output: Output,
}

/// Extracts the contour.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let file = open_map(&args.map, "extract its contour")?;
    let Some(tsdf) = &file.tsdf else {
        bail!("{}: the map has no tsdf; make it with --maps tsdf", args.map.display());
    };
    let ambiguity = if args.fixed_table { Ambiguity::FixedTable } else { Ambiguity::Decide };
    let contour = marching_squares(tsdf, &ContourSettings { min_weight: args.min_weight, ambiguity });
    let lines = polylines(&contour);
    if !write_contour(&args.out, &lines)? {
        return Err(bad_call(format!("{}: give OUT the name .geojson or .svg", args.out.display())));
    }
    let (segments, length) = (contour.segments.len(), contour.length() + 0.0); // the sum of nothing is -0.0
    let document = json!({
        "map": args.map.display().to_string(),
        "out": args.out.display().to_string(),
        "min_weight": args.min_weight,
        "segments": segments,
        "polylines": lines.len(),
        "length": length,
    });
    let shown = args.out.display();
    args.output.print(
        &document,
        format!("{segments} segments in {} lines, {length:.1} m, to {shown}\n", lines.len()),
    )
}
