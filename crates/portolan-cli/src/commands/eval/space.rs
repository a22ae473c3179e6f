//! Evaluating a map of space: its surface against a reference, its predictions against scans.

use std::path::Path;

use anyhow::bail;
use portolan::map::Thresholds;
use portolan::scan::FrameFilter;
use portolan::store::Store;
use portolan::surface::{
    CompareSettings, Mesh, MeshSettings, RangeNoise, RangePredictions, RayCastSettings, RayCaster, Reference,
    SurfaceComparison, SurfaceDistances, compare_surfaces, marching_cubes,
};
use portolan_io::{MapFile, PlyMesh, PointCloudFile, TsdfBricks, open, read_ply_mesh, read_points};
use serde_json::{Value, json};

use super::{Args, prediction_text};
use crate::error::bad_call;
use crate::log::{self, Selection};
use crate::progress::Progress;
use crate::saved::Saved;
use crate::space::mesh_settings;

/// Rays are followed no further (metres), unless the map was made with less.
const FURTHEST: f64 = 100.0;

/// Evaluates the map.
pub(super) fn run(args: &Args, file: &MapFile<3>) -> anyhow::Result<()> {
    let Some(tsdf) = &file.tsdf_bricks else {
        bail!("{}: the map has no tsdf; make it with --maps tsdf", args.map.display());
    };
    let settings = MeshSettings { normals: false, colors: false, ..mesh_settings(tsdf.weights) };
    let mesh = marching_cubes(&tsdf.store, None, &settings);
    let mut document = json!({
        "map": args.map.display().to_string(),
        "surface": { "triangles": mesh.triangles.len(), "area": mesh.area() },
    });
    let mut text =
        format!("surface: {:.1} square metres in {} triangles\n", mesh.area(), mesh.triangles.len());
    if let Some(path) = &args.scans {
        let prediction = predict(args, file, tsdf, path)?;
        text += &prediction_text(&prediction);
        let nll = prediction["negative_log_likelihood"].as_f64().unwrap_or(f64::NAN);
        text += &format!("negative log-likelihood {nll:.3} nats a ray\n");
        document["scans"] = prediction;
    }
    if let Some(path) = &args.reference {
        let reference = Owned::read(path)?;
        let keep = |p: [f64; 3]| {
            let cell = tsdf.store.lattice().cell_of(p).and_then(|cell| tsdf.store.cell(cell));
            !args.crop || cell.is_some_and(|c| Some(c.weight) >= settings.min_weight)
        };
        let how = CompareSettings::default();
        let Some(comparison) = compare_surfaces(&mesh, reference.borrow(), &how, keep) else {
            let left = if args.crop { ", or the map observed nothing of it" } else { "" };
            bail!("{}: the map or the reference has no surface{left}", path.display());
        };
        text += &comparison_text(&comparison, &how);
        document["reference"] = comparison_json(&comparison, &how, path, reference.kind());
    }
    args.output.print(&document, text)
}

/// Close before its sensor a scan sees what no other has: unknown space up to here is passed over (metres).
const BLIND: f64 = 0.5;

/// A reference from a file.
enum Owned {
    Mesh(Mesh),
    Points(PointCloudFile),
}

impl Owned {
    /// A mesh where the file has faces, else its points.
    fn read(path: &Path) -> anyhow::Result<Self> {
        if open(path)?.read_up_to(4)?.starts_with(b"ply") {
            let mesh = read_ply_mesh(path)?;
            if !mesh.triangles.is_empty() {
                return Ok(Self::Mesh(about_a_vertex(&mesh)));
            }
        }
        Ok(Self::Points(read_points(path)?))
    }

    fn borrow(&self) -> Reference<'_> {
        match self {
            Self::Mesh(mesh) => Reference::Mesh(mesh),
            Self::Points(cloud) => Reference::Points { origin: cloud.offset, points: &cloud.points },
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Mesh(_) => "mesh",
            Self::Points(_) => "cloud",
        }
    }
}

/// The mesh with its vertices as `f32` about one of them.
fn about_a_vertex(mesh: &PlyMesh) -> Mesh {
    let finite = |v: &&[f64; 3]| v.iter().all(|c| c.is_finite());
    let origin = mesh.vertices.iter().find(finite).copied().unwrap_or_default();
    let near = |v: &[f64; 3]| std::array::from_fn(|k| (v[k] - origin[k]) as f32);
    let vertices = mesh.vertices.iter().map(near).collect();
    Mesh { origin, vertices, triangles: mesh.triangles.clone(), ..Mesh::default() }
}

/// Predicts the ranges of scans by casting rays through the map.
fn predict(args: &Args, file: &MapFile<3>, tsdf: &TsdfBricks<3>, path: &Path) -> anyhow::Result<Value> {
    let log = log::read_space(path, &args.source, false)?;
    let saved = |key: &str| file.header.settings.get(key);
    let number = |key: &str| saved(key).and_then(Value::as_f64);
    let filter = FrameFilter {
        min_range: args.limits.min_range.or(number("min_range")).unwrap_or(0.0),
        max_range: args.limits.max_range.or(number("max_range")).unwrap_or(f64::INFINITY),
        body: Saved(Some(&file.header.settings)).bodies()?,
    };
    let selection = Selection {
        every: args.every.or(file.header.every),
        hold_out: args.hold_out.or(file.header.hold_out),
    };
    let fresh = file.header.hold_out.is_some() && selection.hold_out == file.header.hold_out;
    let (all, held_out) = selection.split(log.len());
    let indices = if selection.hold_out.is_some() { held_out } else { all };
    if indices.is_empty() {
        let n = log.len();
        return Err(bad_call(format!(
            "{}: no scan is left to predict (the log has {n}); give a smaller --hold-out",
            path.display()
        )));
    }
    let resolution = tsdf.store.lattice().resolution;
    let carved = saved("carve").and_then(Value::as_bool).unwrap_or(true);
    let settings = RayCastSettings {
        min_weight: Some(Thresholds::of(tsdf.weights, tsdf.carve_weight).observed),
        max_range: filter.max_range.min(FURTHEST),
        // Where free space was not fused, all of it is unknown.
        unknown_tolerance: if carved { 2.0 * resolution } else { f64::INFINITY },
        blind: BLIND,
    };
    let rays = RayCaster::new(&tsdf.store, settings);
    let mut predictions = RangePredictions::default();
    let (mut unreadable, mut first) = (0u64, None);
    let progress = Progress::new(indices.len(), "predicting", args.output);
    for &i in &indices {
        match log.frame(i) {
            Ok(frame) => predictions.add(&rays, log.pose(i), &filter.apply(frame).0, args.rays),
            Err(error) => {
                unreadable += 1;
                first.get_or_insert(error);
            }
        }
        progress.add(1);
    }
    drop(progress);
    let noise = RangeNoise::of_cells(resolution, settings.max_range);
    let (rays, predicted) = (predictions.rays() as f64, predictions.pairs.len() as f64);
    if let (true, Some(error)) = (unreadable == indices.len() as u64, &first) {
        bail!("{error}");
    }
    let Some(score) = predictions.score(resolution, &noise) else {
        bail!(
            "{}: none of {rays} rays of {} scans could be predicted; is this the log of that map?",
            path.display(),
            indices.len()
        );
    };
    let of_all = |share: f64| share * predicted / rays;
    Ok(json!({
        "log": path.display().to_string(),
        "scans": indices.len() as u64 - unreadable,
        "unreadable": { "scans": unreadable, "first": first.map(|e| e.to_string()) },
        "held_out": fresh,
        "beams": predictions.rays(),
        "predicted": predictions.pairs.len(),
        "predicted_share": predicted / rays,
        "unknown": predictions.unknown.len(),
        "outside": predictions.outside.len(),
        "free": predictions.free.len(),
        "median_error": score.median_error,
        "p95_error": score.p95_error,
        "bias": score.bias,
        "within_one_cell": score.within_one_cell,
        "within_two_cells": score.within_two_cells,
        "within_one_cell_of_all": of_all(score.within_one_cell),
        "within_two_cells_of_all": of_all(score.within_two_cells),
        "negative_log_likelihood": score.negative_log_likelihood,
        "noise": { "sigma": noise.sigma, "outliers": noise.outliers, "max_range": noise.max_range },
    }))
}

fn comparison_json(c: &SurfaceComparison, how: &CompareSettings, path: &Path, kind: &str) -> Value {
    let way = |d: &SurfaceDistances| {
        json!({
            "samples": d.samples,
            "mean": d.mean,
            "median": d.median,
            "p95": d.p95,
            "largest": d.largest,
            "within": d.within,
        })
    };
    json!({
        "file": path.display().to_string(),
        "kind": kind,
        "thresholds": how.thresholds,
        "accuracy": way(&c.accuracy),
        "completeness": way(&c.completeness),
        "f_scores": c.f_scores,
        "cropped": c.cropped,
        "unusable": c.unusable,
    })
}

fn comparison_text(c: &SurfaceComparison, how: &CompareSettings) -> String {
    let way = |name: &str, d: &SurfaceDistances| {
        let within = how.thresholds.iter().zip(&d.within);
        let within: Vec<_> =
            within.map(|(t, share)| format!("{:.1} % within {:.0} cm", 100.0 * share, 100.0 * t)).collect();
        format!(
            "{name}: median {:.2} mm, mean {:.2} mm, 95 % {:.2} mm, largest {:.1} mm; {}\n",
            1000.0 * d.median,
            1000.0 * d.mean,
            1000.0 * d.p95,
            1000.0 * d.largest,
            within.join(", ")
        )
    };
    let scores: Vec<_> = how
        .thresholds
        .iter()
        .zip(&c.f_scores)
        .map(|(t, f)| format!("{f:.3} at {:.0} cm", 100.0 * t))
        .collect();
    let mut text = way("accuracy (map to reference)", &c.accuracy);
    text += &way("completeness (reference to map)", &c.completeness);
    text += &format!("F-score: {}\n", scores.join(", "));
    if c.cropped > 0 {
        text +=
            &format!("{} points of the reference lie where the map observed nothing: left out\n", c.cropped);
    }
    if c.unusable > 0 {
        text += &format!("{} triangles or points are not finite: left out\n", c.unusable);
    }
    text
}
