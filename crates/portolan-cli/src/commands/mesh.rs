//! `mesh`: the contour or the mesh of a map again.

use std::path::PathBuf;

use anyhow::{anyhow, bail};
use portolan::surface::{Ambiguity, ContourSettings, MeshSettings, marching_cubes, marching_squares};
use portolan_io::MapFile;
use serde_json::json;

use crate::arguments::weight_or_zero;
use crate::error::bad_call;
use crate::mapping::{polylines, write_contour};
use crate::output::Output;
use crate::source::{Source, open};
use crate::space::{mesh_settings, write_mesh};

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  portolan mesh intel contour.svg --min-weight 5\n  portolan mesh kitchen kitchen.glb"
)]
pub(crate) struct Args {
    /// map.portolan or its folder
    map: PathBuf,
    /// File to write: .geojson or .svg in the plane, .ply, .glb or .obj in space
    out: PathBuf,
    /// Cells of smaller weight count as never observed; default: half of what one ordinary ray weighs
    #[arg(long, value_name = "W", value_parser = weight_or_zero, allow_negative_numbers = true)]
    min_weight: Option<f32>,
    /// Decide ambiguous squares by the fixed table instead of by the field
    #[arg(long)]
    fixed_table: bool,
    #[command(flatten)]
    output: Output,
}

/// Extracts the surface.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    match open(&args.map)? {
        Source::Map(file) => contour(args, &file),
        Source::SpaceMap(file) => mesh(args, &file),
        other => {
            let kind = other.describe();
            bail!(
                "{}: is {kind}; to extract its surface, give a map.portolan or its folder",
                args.map.display()
            )
        }
    }
}

fn no_tsdf(args: &Args) -> anyhow::Error {
    anyhow!("{}: the map has no tsdf; make it with --maps tsdf", args.map.display())
}

fn contour(args: &Args, file: &MapFile<2>) -> anyhow::Result<()> {
    let tsdf = file.tsdf.as_ref().ok_or_else(|| no_tsdf(args))?;
    let ambiguity = if args.fixed_table { Ambiguity::FixedTable } else { Ambiguity::Decide };
    let min_weight = args.min_weight.unwrap_or(tsdf.thresholds().surface);
    let contour = marching_squares(tsdf, &ContourSettings { min_weight: Some(min_weight), ambiguity });
    let lines = polylines(&contour);
    if !write_contour(&args.out, &lines)? {
        return Err(bad_call(format!("{}: give OUT the name .geojson or .svg", args.out.display())));
    }
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
    if args.fixed_table {
        return Err(bad_call("--fixed-table is for contours; the map is of space"));
    }
    let tsdf = file.tsdf_bricks.as_ref().ok_or_else(|| no_tsdf(args))?;
    let usual = mesh_settings(tsdf.weights);
    let settings = MeshSettings { min_weight: args.min_weight.or(usual.min_weight), ..usual };
    let mesh = marching_cubes(&tsdf.store, file.colors.as_ref().map(|c| &c.store), &settings);
    if !write_mesh(&args.out, &mesh)? {
        return Err(bad_call(format!("{}: give OUT the name .ply, .glb or .obj", args.out.display())));
    }
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
