//! `mesh`: the contour or the mesh of a map again.

use std::path::PathBuf;

use anyhow::bail;
use portolan::surface::{Ambiguity, ContourSettings, MeshSettings, marching_cubes, marching_squares};
use portolan_io::MapFile;
use serde_json::json;

use crate::arguments::weight_or_zero;
use crate::dimension::{Given, ONLY_2D};
use crate::error::bad_call;
use crate::folder;
use crate::mapping::{polylines, write_contour, write_mesh};
use crate::output::Output;
use crate::saved::no_tsdf;
use crate::source::{Source, open};

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  portolan mesh intel contour.svg --min-weight 5\n  portolan mesh kitchen kitchen.glb"
)]
pub(crate) struct Args {
    #[command(flatten)]
    given: Given<()>,
    /// map.portolan or its folder
    map: PathBuf,
    /// File to write: .geojson or .svg for the contour of a 2-D map; .ply, .glb or .obj for the mesh of a 3-D map
    out: PathBuf,
    /// Cells with a smaller weight count as never observed [default: half the weight of one ordinary ray]
    #[arg(long, value_name = "W", value_parser = weight_or_zero, allow_negative_numbers = true)]
    min_weight: Option<f32>,
    /// Resolve ambiguous squares by a fixed table instead of by the field
    #[arg(long, help_heading = ONLY_2D)]
    fixed_table: bool,
    #[command(flatten)]
    output: Output,
}

/// Extracts the surface.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let source = open(&args.map)?;
    folder::warn(&args.map, args.output)?;
    source.check::<Args>(&args.given)?;
    match source {
        Source::Map2(file) => contour(args, &file),
        Source::Map3(file) => mesh(args, &file),
        other => {
            let kind = other.describe();
            bail!(
                "{}: is {kind}; to extract its surface, give a map.portolan or its folder",
                args.map.display()
            )
        }
    }
}

fn wrong_extension(args: &Args, names: &str) -> anyhow::Error {
    bad_call(format!("{}: give OUT the extension {names}", args.out.display()))
}

fn contour(args: &Args, file: &MapFile<2>) -> anyhow::Result<()> {
    let tsdf = file.tsdf.as_ref().ok_or_else(|| no_tsdf(&args.map, &file.header))?;
    let ambiguity = if args.fixed_table { Ambiguity::FixedTable } else { Ambiguity::Decide };
    let min_weight = args.min_weight.unwrap_or(tsdf.min_weight());
    let contour = marching_squares(tsdf, &ContourSettings { min_weight: Some(min_weight), ambiguity });
    let lines = polylines(&contour);
    if !write_contour(&args.out, &lines)? {
        return Err(wrong_extension(args, ".geojson or .svg"));
    }
    folder::forget(&args.out)?;
    let (segments, length) = (contour.segments.len(), contour.length() + 0.0); // the sum of nothing is -0.0
    let document = json!({
        "map": args.map.display().to_string(),
        "out": args.out.display().to_string(),
        "min_weight": min_weight,
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

fn mesh(args: &Args, file: &MapFile<3>) -> anyhow::Result<()> {
    let tsdf = file.tsdf_bricks.as_ref().ok_or_else(|| no_tsdf(&args.map, &file.header))?;
    let usual = MeshSettings::of(tsdf);
    let settings = MeshSettings { min_weight: args.min_weight.or(usual.min_weight), ..usual };
    let mesh = marching_cubes(&tsdf.store, file.color_bricks.as_ref().map(|c| &c.store), &settings);
    if !write_mesh(&args.out, &mesh)? {
        return Err(wrong_extension(args, ".ply, .glb or .obj"));
    }
    folder::forget(&args.out)?;
    let (triangles, area) = (mesh.triangles.len(), mesh.area());
    let document = json!({
        "map": args.map.display().to_string(),
        "out": args.out.display().to_string(),
        "min_weight": settings.min_weight,
        "vertices": mesh.vertices.len(),
        "triangles": triangles,
        "area": area,
    });
    args.output.print(&document, format!("{triangles} triangles, {area:.2} m², to {}\n", args.out.display()))
}
