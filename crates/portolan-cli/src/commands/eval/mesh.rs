//! Evaluating a 3-D map: its surface, against a reference, and its predictions of scans.

use std::path::Path;

use anyhow::bail;
use portolan::store::Store;
use portolan::surface::{
    CompareSettings, Mesh, MeshSettings, Reference, SurfaceComparison, SurfaceDistances, compare_surfaces,
    marching_cubes,
};
use portolan_io::{FileKind, MapFile, PlyMesh, PointCloudFile, TsdfBricks, detect, read_mesh, read_points};
use serde_json::{Value, json};

use super::{Args, Part, predict};
use crate::saved::no_tsdf;

pub(super) fn evaluate(args: &Args, file: &MapFile<3>) -> anyhow::Result<Vec<Part>> {
    let tsdf = file.tsdf_bricks.as_ref().ok_or_else(|| no_tsdf(&args.map, &file.header))?;
    let settings = MeshSettings { normals: false, colors: false, ..MeshSettings::of(tsdf) };
    let mesh = marching_cubes(&tsdf.store, None, &settings);
    let (triangles, area) = (mesh.triangles.len(), mesh.area());
    let mut parts = vec![Part {
        key: "surface",
        value: json!({ "triangles": triangles, "area": area }),
        text: format!("surface: {area:.1} square meters in {triangles} triangles\n"),
    }];
    if let Some(path) = &args.scans {
        parts.push(predict::in_3d(args, path, file, tsdf)?);
    }
    if let Some(path) = &args.reference {
        parts.push(compare(args, &mesh, tsdf, settings.min_weight, path)?);
    }
    Ok(parts)
}

/// Distances between the mesh and a reference, both ways.
fn compare(
    args: &Args,
    mesh: &Mesh,
    tsdf: &TsdfBricks<3>,
    min_weight: Option<f32>,
    path: &Path,
) -> anyhow::Result<Part> {
    let reference = Owned::read(path)?;
    let keep = |p: [f64; 3]| {
        let cell = tsdf.store.lattice().cell_of(p).and_then(|cell| tsdf.store.cell(cell));
        !args.crop || cell.is_some_and(|c| min_weight.is_none_or(|w| c.weight >= w))
    };
    let how = CompareSettings::default();
    let Some(comparison) = compare_surfaces(mesh, reference.borrow(), &how, keep) else {
        let left = if args.crop { ", or the map observed nothing of it" } else { "" };
        bail!("{}: the map or the reference has no surface{left}", path.display());
    };
    let value = comparison_json(&comparison, &how, path, reference.kind());
    Ok(Part { key: "reference", value, text: comparison_text(&comparison, &how) })
}

/// A reference from a file.
enum Owned {
    Mesh(Mesh),
    Points(PointCloudFile),
}

impl Owned {
    /// A mesh where the file has faces, else its points.
    fn read(path: &Path) -> anyhow::Result<Self> {
        if let FileKind::Mesh(_) = detect(path)? {
            let mesh = read_mesh(path)?;
            if mesh.triangles.is_empty() {
                bail!(
                    "{}: the mesh has no triangle to compare with; give one with faces, or points",
                    path.display()
                );
            }
            return Ok(Self::Mesh(about_a_vertex(&mesh)));
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
