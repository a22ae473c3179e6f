//! `eval`: how good a map is.

use std::path::{Path, PathBuf};

use anyhow::bail;
use portolan::geom::vector::distance;
use portolan::surface::{
    Contour, ContourSettings, RayCast, RayCastSettings, cast_ray, doubled_length, marching_squares,
};
use portolan_io::{MapFile, read_geojson};
use serde_json::{Value, json};

use crate::error::bad_call;
use crate::log::{self, LimitArgs, LogArgs, Selection};
use crate::output::Output;
use crate::progress::Progress;
use crate::source::{Source, open};

mod nearest;
mod space;
mod spread;

use nearest::SegmentIndex;
use spread::Spread;

#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  portolan map intel.log.gz --resolution 0.05 --hold-out 10 --out intel\n  \
                  portolan eval intel --scans intel.log.gz\n  \
                  portolan eval kitchen --reference kitchen.ply --crop"
)]
pub(crate) struct Args {
    /// map.portolan or its folder
    map: PathBuf,
    /// Log with scans that were not fused: their ranges are predicted
    #[arg(long, value_name = "LOG", required_unless_present = "reference")]
    scans: Option<PathBuf>,
    /// What to compare with: a contour (GeoJSON); in space a mesh (PLY) or a cloud (PLY, PCD, XYZ, ..)
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    source: LogArgs,
    #[command(flatten)]
    limits: LimitArgs,
    /// Use every N-th scan of the log only; default: as the map did
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    every: Option<u64>,
    /// Predict every N-th scan; default: those that the map held out, else all
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    hold_out: Option<u64>,
    /// In space: leave out what the map did not observe of the reference
    #[arg(long, requires = "reference")]
    crop: bool,
    /// In space: rays of each scan to predict, at most, evenly taken
    #[arg(long, value_name = "N", default_value_t = 5000, value_parser = at_least_one)]
    rays: usize,
    #[command(flatten)]
    output: Output,
}

fn at_least_one(word: &str) -> Result<usize, String> {
    word.parse().ok().filter(|n| *n > 0).ok_or_else(|| "must be a whole number, 1 or more".into())
}

/// Evaluates the map.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    match open(&args.map)? {
        Source::Map(file) => plane(args, &file),
        Source::SpaceMap(file) => space::run(args, &file),
        other => bail!(
            "{}: is {}; to evaluate it, give a map.portolan or its folder",
            args.map.display(),
            other.describe()
        ),
    }
}

/// Evaluates a map of the plane.
fn plane(args: &Args, file: &MapFile<2>) -> anyhow::Result<()> {
    let Some(tsdf) = &file.tsdf else {
        bail!("{}: the map has no tsdf; make it with --maps tsdf", args.map.display());
    };
    let contour = marching_squares(tsdf, &ContourSettings::of(tsdf));
    let doubled = doubled_length(&contour, 0.15);
    let mut document = json!({
        "map": args.map.display().to_string(),
        "contour": { "length": doubled.total, "doubled_share": doubled.share() },
    });
    let mut text = format!(
        "contour: {:.1} m, {:.2} % of it doubled within 15 cm\n",
        doubled.total,
        100.0 * doubled.share()
    );
    if let Some(path) = &args.scans {
        let prediction = predict(args, file, path)?;
        text += &prediction_text(&prediction);
        document["scans"] = prediction;
    }
    if let Some(path) = &args.reference {
        let comparison = compare(&contour, path)?;
        text += &comparison_text(&comparison);
        document["reference"] = comparison;
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
