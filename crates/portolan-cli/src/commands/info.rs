//! `info`: what a file is.

use std::path::{Path, PathBuf};

use portolan::Status;
use portolan::field::EsdfGrid;
use portolan::geom::Aabb;
use portolan::store::Store;
use portolan_io::{
    EsdfFile, FileKind, MapCell, MapServerMap, OctomapTree, PlyMesh, Polyline, detect, mesh_area,
};
use serde_json::{Value, json};

use crate::folder::half_written;
use crate::json;
use crate::log::describe;
use crate::output::Output;
use crate::source::{Source, open};

mod bags;
mod logs;
mod maps;
mod text;
mod written;

#[derive(clap::Args)]
#[command(after_help = "Example:\n  portolan info intel.log.gz")]
pub(crate) struct Args {
    /// A log, a map, an image of a map, a folder that `map` wrote, or any file in it: mesh, field, tree, contour, pose graph (.g2o),
    /// summary.json, gallery.json
    file: PathBuf,
    #[command(flatten)]
    output: Output,
}

/// Prints what the file is.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let kind = detect(&args.file)?;
    let mut bag_text = None;
    let beside = if args.file.is_file() { written::about(&args.file)? } else { None };
    let mut document = match kind {
        _ if beside.is_some() => beside.unwrap_or_default(),
        FileKind::Bag => {
            let (mut document, text) = bags::about(&args.file)?;
            document["kind"] = json!(describe(&kind));
            bag_text = Some(text);
            document
        }
        FileKind::Svg => json!({ "kind": describe(&kind) }),
        _ => {
            let source = open(&args.file)?;
            let mut document = about(&source);
            document["kind"] = json!(source.describe());
            let warnings = [half_written(&args.file), source.warning()];
            let warnings: Vec<_> = warnings.into_iter().flatten().collect();
            document["warning"] = json!((!warnings.is_empty()).then(|| warnings.join("; ")));
            document
        }
    };
    document["file"] = json!(args.file.display().to_string());
    document["bytes"] = json!(size(&args.file));
    let mut said = format!("{}: {}\n", args.file.display(), document["kind"].as_str().unwrap_or_default());
    match bag_text {
        Some(about) => said.push_str(&about),
        None => text::lines(&document, "  ", &mut said),
    }
    args.output.print(&document, said)
}

fn size(path: &Path) -> Option<u64> {
    let file = if path.is_dir() { path.join("map.portolan") } else { path.to_owned() };
    std::fs::metadata(file).ok().map(|m| m.len())
}

fn about(source: &Source) -> Value {
    match source {
        Source::Map2(file) => maps::of_2d(file),
        Source::Map3(file) => maps::of_3d(file),
        Source::Esdf(EsdfFile::Two(field)) => of_esdf(field),
        Source::Esdf(EsdfFile::Three(field)) => of_esdf(field),
        Source::Server(map) => of_server(map),
        Source::Image(image) => json!({
            "pixels": [image.width, image.height],
            "white": image.max_value,
            "hint": "resolution and origin are in a yaml file, which is missing beside it",
        }),
        Source::Contour(contour) => of_contour(contour),
        Source::Octomap(file) => of_octomap(file),
        Source::Log2(log) => logs::of_2d(log),
        Source::Log3(log) => logs::of_3d(log),
        Source::Mesh(source) => of_mesh(&source.mesh),
    }
}

fn of_esdf<const D: usize>(field: &EsdfGrid<D>) -> Value {
    let known = || field.samples().iter().copied().filter(|d| !d.is_nan());
    let saturated = || (0..field.samples().len()).filter(|&i| field.status(i) == Status::Saturated).count();
    json!({
        "dimension": D,
        "extent": json::grid::<D>(field.grid()),
        "known": known().count(),
        "saturated": field.has_status().then(saturated),
        "smallest": known().min_by(f32::total_cmp),
        "largest": known().max_by(f32::total_cmp),
    })
}

fn of_server(map: &MapServerMap) -> Value {
    let count = |cell: MapCell| map.cells.iter().filter(|&&c| c == cell).count();
    json!({
        "extent": json::grid::<2>(&map.grid),
        "yaw": map.yaw,
        "free": count(MapCell::Free),
        "occupied": count(MapCell::Occupied),
        "unknown": count(MapCell::Unknown),
    })
}

fn of_mesh(mesh: &PlyMesh) -> Value {
    let mut extent = Aabb::EMPTY;
    let finite = |v: &&[f64; 3]| v.iter().all(|c| c.is_finite());
    mesh.vertices.iter().filter(finite).for_each(|&v| extent.include(v));
    json!({
        "vertices": mesh.vertices.len(),
        "triangles": mesh.triangles.len(),
        "area": mesh_area(mesh) + 0.0, // the sum of nothing is -0.0
        "extent": (!extent.is_empty()).then(|| json::aabb(&extent)),
        "normals": !mesh.normals.is_empty(),
        "colors": !mesh.colors.is_empty(),
        "refused_faces": mesh.refused_faces,
    })
}

fn of_contour(lines: &[Polyline]) -> Value {
    let mut extent = Aabb::EMPTY;
    lines.iter().flatten().for_each(|&p| extent.include(p));
    let steps = lines.iter().flat_map(|l| l.windows(2));
    let length: f64 = steps.clone().map(|w| portolan::geom::vector::distance(w[0], w[1])).sum();
    json!({
        "lines": lines.len(),
        "segments": steps.count(),
        "length": length,
        "extent": (!extent.is_empty()).then(|| json::aabb(&extent)),
    })
}

fn of_octomap(file: &OctomapTree) -> Value {
    let tree = file.tree();
    let (free, occupied) = file.leaves();
    let resolution = file.resolution();
    // Cells about the world's zero times the resolution: `tree.lattice()` counts from a corner far away, whose rounding shows.
    let half = 1 << (tree.depth() - 1);
    let corner = |cell: [i32; 3]| cell.map(|v| f64::from(v - half) * resolution);
    let (mut extent, mut extent_occupied) = (Aabb::EMPTY, Aabb::EMPTY);
    let mut observed_cells = 0.0;
    tree.for_each_leaf(|leaf| {
        let leaf_box = Aabb::new(corner(leaf.cell), corner(leaf.cell.map(|v| v + (1 << leaf.height))));
        observed_cells += 8f64.powi(leaf.height as i32);
        extent = extent.union(leaf_box);
        if leaf.value.0 >= 0.0 {
            extent_occupied = extent_occupied.union(leaf_box);
        }
    });
    json!({
        "class": file.class(),
        "resolution": resolution,
        "depth": tree.depth(),
        "leaves": { "total": free + occupied, "free": free, "occupied": occupied },
        "inner_nodes": file.inner_nodes(),
        "inner_nodes_that_could_be_merged": file.prunable_nodes(),
        "observed_cells": observed_cells,
        "extent": (!extent.is_empty()).then(|| json::aabb(&extent)),
        "extent_of_occupied": (!extent_occupied.is_empty()).then(|| json::aabb(&extent_occupied)),
        "bytes_in_memory": tree.memory_bytes(),
    })
}
