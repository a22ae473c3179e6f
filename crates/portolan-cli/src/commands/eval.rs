//! `eval`: how good a map is.

use std::path::PathBuf;

use anyhow::bail;
use portolan::geom::vector::distance;
use portolan::surface::{
    Contour, ContourSettings, RayCast, RayCastSettings, cast_ray, doubled_length, marching_squares,
};
use portolan_io::{MapFile, read_geojson};
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
    /// File to compare the surface with: a contour (GeoJSON) in 2-D; a mesh (PLY) or point cloud (PLY, PCD, XYZ, ..) in
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

/// Predicts the ranges of scans by casting rays through the map.
fn predict(args: &Args, file: &MapFile<2>, path: &Path) -> anyhow::Result<Value> {
    let Some(tsdf) = &file.tsdf else { bail!("{}: the map has no tsdf", args.map.display()) };
    let log = log::read(path, &args.source)?;
    let saved = |key: &str| file.header.settings.get(key).and_then(Value::as_f64);
    let limits = LimitArgs {
        min_range: args.limits.min_range.or(saved("min_range")),
        max_range: args.limits.max_range.or(saved("max_range")),
        ..args.limits
    };
    let limits = limits.limits(&log);
    let selection = Selection {
        every: args.every.or(file.header.every),
        hold_out: args.hold_out.or(file.header.hold_out),
    };
    let fresh = file.header.hold_out.is_some() && selection.hold_out == file.header.hold_out;
    let (all, held_out) = selection.split(log.len());
    let indices = if selection.hold_out.is_some() { held_out } else { all };
    let scans = log::scans(&log, &indices, &limits);
    if scans.is_empty() {
        let n = log.len();
        return Err(bad_call(format!(
            "{}: no scan is left to predict (the log has {n}); give a smaller --hold-out",
            path.display()
        )));
    }

    let resolution = tsdf.grid().lattice.resolution;
    let mut errors = Vec::new();
    let (mut hits, mut unknown, mut outside, mut free) = (0u64, 0u64, 0u64, 0u64);
    let progress = Progress::new(scans.len(), "predicting", args.output);
    for (world_from_sensor, scan) in &scans {
        progress.add(1);
        for beam in scan.beams().filter(|b| b.is_hit()) {
            hits += 1;
            let direction = world_from_sensor.rotate(beam.direction);
            let settings = RayCastSettings { unknown_tolerance: 2.0 * resolution, ..Default::default() };
            match cast_ray(tsdf, world_from_sensor.translation, direction, &settings) {
                RayCast::Hit(range) => errors.push(range - beam.range),
                RayCast::Unknown(_) => unknown += 1,
                RayCast::Outside(_) => outside += 1,
                RayCast::Free => free += 1,
            }
        }
    }
    drop(progress);
    if errors.is_empty() {
        return Err(anyhow::Error::msg(format!(
            "{}: none of {hits} hits of {} scans could be predicted; is this the log of that map?",
            path.display(),
            scans.len()
        )));
    }
    let within = |cells: f64| errors.iter().filter(|e| e.abs() <= cells * resolution).count() as f64;
    let (predicted, all) = (errors.len() as f64, hits as f64);
    let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
    let signed = Spread::of(errors.iter().copied());
    let absolute = Spread::of(errors.iter().map(|e| e.abs()));
    Ok(json!({
        "log": path.display().to_string(),
        "scans": scans.len(),
        "held_out": fresh,
        "beams": hits,
        "predicted": errors.len(),
        "predicted_share": share(predicted, all),
        "unknown": unknown,
        "outside": outside,
        "free": free,
        "median_error": absolute.median,
        "p95_error": absolute.p95,
        "bias": signed.median,
        "mean_error": signed.mean,
        "within_one_cell": share(within(1.0), predicted),
        "within_two_cells": share(within(2.0), predicted),
        "within_one_cell_of_all": share(within(1.0), all),
        "within_two_cells_of_all": share(within(2.0), all),
    }))
}

fn prediction_text(p: &Value) -> String {
    let f = |key: &str| p[key].as_f64().unwrap_or(f64::NAN);
    let mut text = format!(
        "predicted {} of {} hits of {} scans ({:.1} %)\n\
         |error|: median {:.1} mm, 95 % {:.1} mm; bias (median) {:+.1} mm\n\
         within one cell {:.1} %, within two {:.1} % of the predicted ({:.1} % and {:.1} % of all)\n",
        p["predicted"],
        p["beams"],
        p["scans"],
        100.0 * f("predicted_share"),
        1000.0 * f("median_error"),
        1000.0 * f("p95_error"),
        1000.0 * f("bias"),
        100.0 * f("within_one_cell"),
        100.0 * f("within_two_cells"),
        100.0 * f("within_one_cell_of_all"),
        100.0 * f("within_two_cells_of_all"),
    );
    if p["held_out"] != true {
        text += "warning: the map does not say that these scans were held out; make it with --hold-out\n";
    }
    text
}

/// Distances between the contour and a reference, both ways.
fn compare(contour: &Contour, path: &Path) -> anyhow::Result<Value> {
    let lines = read_geojson(path)?;
    let reference: Vec<_> = lines.iter().flat_map(|l| l.windows(2)).map(|w| [w[0], w[1]]).collect();
    let ours: Vec<_> = contour.ends().collect();
    if reference.is_empty() {
        bail!("{}: the contour has no segment; give one with lines", path.display());
    }
    Ok(json!({
        "file": path.display().to_string(),
        "from_map": one_way(&ours, &reference),
        "to_map": one_way(&reference, &ours),
    }))
}

/// Samples along segments are this far apart at most (metres).
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
