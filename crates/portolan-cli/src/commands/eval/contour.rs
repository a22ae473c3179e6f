//! Evaluating a 2-D map: its contour, against a reference, and its predictions of scans.

use std::path::Path;

use anyhow::bail;
use portolan::geom::vector::distance;
use portolan::surface::{Contour, ContourSettings, doubled_length, marching_squares};
use portolan_io::{MapFile, read_geojson};
use serde_json::{Value, json};

use super::nearest::SegmentIndex;
use super::spread::Spread;
use super::{Args, Part, predict};
use crate::saved::no_tsdf;

pub(super) fn evaluate(args: &Args, file: &MapFile<2>) -> anyhow::Result<Vec<Part>> {
    let tsdf = file.tsdf.as_ref().ok_or_else(|| no_tsdf(&args.map, &file.header))?;
    let contour = marching_squares(tsdf, &ContourSettings::of(tsdf));
    let doubled = doubled_length(&contour, 0.15);
    let (length, share) = (doubled.total, doubled.share());
    let mut parts = vec![Part {
        key: "contour",
        value: json!({ "length": length, "doubled_share": share }),
        text: format!("contour: {length:.1} m, {:.2} % of it doubled within 15 cm\n", 100.0 * share),
    }];
    if let Some(path) = &args.scans {
        parts.push(predict::in_2d(args, path, file, tsdf)?);
    }
    if let Some(path) = &args.reference {
        parts.push(compare(&contour, path)?);
    }
    Ok(parts)
}

/// Distances between the contour and a reference, both ways.
fn compare(contour: &Contour, path: &Path) -> anyhow::Result<Part> {
    let lines = read_geojson(path)?;
    let reference: Vec<_> = lines.iter().flat_map(|l| l.windows(2)).map(|w| [w[0], w[1]]).collect();
    let ours: Vec<_> = contour.ends().collect();
    if reference.is_empty() {
        bail!("{}: the file has no line; give a contour with lines", path.display());
    }
    let value = json!({
        "file": path.display().to_string(),
        "from_map": one_way(&ours, &reference),
        "to_map": one_way(&reference, &ours),
    });
    let text = comparison_text(&value);
    Ok(Part { key: "reference", value, text })
}

/// Samples along segments are this far apart at most (meters).
const SPACING: f64 = 0.02;
/// More samples than this are thinned out.
const MOST_SAMPLES: f64 = 500_000.0;

/// Distances from points along `from` to the nearest segment of `to`.
fn one_way(from: &[[[f64; 2]; 2]], to: &[[[f64; 2]; 2]]) -> Value {
    let index = SegmentIndex::new(to);
    let total: f64 = from.iter().map(|[a, b]| distance(*a, *b)).sum();
    let spacing = SPACING.max(total / MOST_SAMPLES);
    let mut samples = Vec::new();
    for &[a, b] in from {
        let n = (distance(a, b) / spacing).ceil().max(1.0) as usize;
        for i in 0..n {
            let t = (i as f64 + 0.5) / n as f64;
            let p = std::array::from_fn(|k| a[k] + t * (b[k] - a[k]));
            samples.extend(index.nearest_distance(p));
        }
    }
    let spread = Spread::of(samples.iter().copied());
    json!({
        "length": total,
        "samples": samples.len(),
        "mean": spread.mean,
        "median": spread.median,
        "p95": spread.p95,
        "largest": spread.largest,
    })
}

fn comparison_text(c: &Value) -> String {
    let line = |name: &str, key: &str| {
        let f = |field: &str| 1000.0 * c[key][field].as_f64().unwrap_or(f64::NAN);
        format!(
            "{name}: median {:.1} mm, mean {:.1} mm, 95 % {:.1} mm, largest {:.1} mm\n",
            f("median"),
            f("mean"),
            f("p95"),
            f("largest")
        )
    };
    line("map to reference", "from_map") + &line("reference to map", "to_map")
}
