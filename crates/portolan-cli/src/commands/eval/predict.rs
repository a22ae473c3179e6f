//! The ranges of scans, predicted by casting rays through the map.

use std::path::Path;

use anyhow::bail;
use portolan::beam_model::{ForetoldRanges, RangeFloor};
use portolan::map::{Attenuation, DistanceMap, Tsdf2};
use portolan::store::Store;
use portolan::surface::{
    PredictionScore, RangeNoise, RangePredictions, RayCast, RayCastSettings, RayCaster, cast_ray,
};
use portolan_io::{MapFile, MapHeader, TsdfBricks};
use serde_json::{Value, json};

use super::spread::Spread;
use super::{Args, Part};
use crate::error::bad_call;
use crate::log::{self, LimitArgs, RangeArgs, Selection, Wanted};
use crate::mapping::Settings;
use crate::progress::Progress;

/// Rays are followed up to this range (meters), unless the map was made with less.
const FARTHEST: f64 = 100.0;
/// Close before its sensor a scan sees what no other has: unknown space up to here is passed over (meters).
const BLIND: f64 = 0.5;

/// Which scans of the log are predicted, and how they are read.
struct Task<'a> {
    args: &'a Args,
    log: &'a Path,
    header: &'a MapHeader,
    settings: Settings,
}

impl<'a> Task<'a> {
    fn new(args: &'a Args, log: &'a Path, header: &'a MapHeader) -> Self {
        Self { args, log, header, settings: Settings::of_saved(&header.settings) }
    }

    fn range(&self) -> RangeArgs {
        let (given, saved) = (self.args.limits.range, self.settings.shape.range);
        RangeArgs {
            min_range: given.min_range.or(saved.min_range),
            max_range: given.max_range.or(saved.max_range),
        }
    }

    fn selection(&self) -> Selection {
        Selection {
            every: self.args.every.or(self.header.every),
            hold_out: self.args.hold_out.or(self.header.hold_out),
        }
    }

    fn indices(&self, scans: usize) -> anyhow::Result<Vec<usize>> {
        let selection = self.selection();
        let (all, held_out) = selection.split(scans);
        let indices = if selection.hold_out.is_some() { held_out } else { all };
        if indices.is_empty() {
            return Err(bad_call(format!(
                "{}: no scan is left to predict (the log has {scans}); give a smaller --hold-out",
                self.log.display()
            )));
        }
        Ok(indices)
    }

    /// The document and the text. `scans`: the number of scans that could be read.
    fn part(
        &self,
        (predictions, foretold): (&RangePredictions, &ForetoldRanges),
        scans: usize,
        noise: &RangeNoise,
        resolution: f64,
    ) -> anyhow::Result<Part> {
        let Some(score) = predictions.score(resolution, noise) else {
            bail!(
                "{}: none of {} rays of {scans} scans could be predicted; is this the log of that map?",
                self.log.display(),
                predictions.rays()
            );
        };
        let hold_out = self.header.hold_out;
        let fresh = hold_out.is_some() && self.selection().hold_out == hold_out;
        let mut value = to_json(predictions, &score);
        value["log"] = json!(self.log.display().to_string());
        value["scans"] = json!(scans);
        value["held_out"] = json!(fresh);
        value["noise"] =
            json!({ "sigma": noise.sigma, "outliers": noise.outliers, "max_range": noise.max_range });
        let floor = RangeFloor { outliers: noise.outliers, max_range: noise.max_range };
        value["attenuation"] = foretold.score(&floor).map_or(Value::Null, |score| {
            json!({
                "beams": foretold.rays(),
                "log_density": score.log_density,
                "median_error": score.median_error,
                "within_10_cm": score.within_10_cm,
            })
        });
        let text = text(&value);
        Ok(Part { key: "scans", value, text })
    }
}

/// Predicts 2-D scans.
pub(super) fn in_2d(args: &Args, path: &Path, file: &MapFile<2>, tsdf: &Tsdf2) -> anyhow::Result<Part> {
    let task = Task::new(args, path, &file.header);
    let log = log::read_2d(path, &args.source, task.settings.shape.deskew)?;
    let limits = LimitArgs { range: task.range(), no_return: args.limits.no_return };
    let scans = log::scans(&log, &task.indices(log.len())?, &limits.limits(&log));
    let resolution = tsdf.grid().lattice.resolution;
    let settings = RayCastSettings {
        min_weight: Some(tsdf.min_weight()),
        unknown_tolerance: 2.0 * resolution,
        ..RayCastSettings::default()
    };
    let attenuation = attenuation_of(file)?;
    let (mut predictions, mut foretold) = (RangePredictions::default(), ForetoldRanges::default());
    let progress = Progress::new(scans.len(), "predicting", args.output);
    for (world_from_sensor, scan) in &scans {
        progress.add(1);
        if let Some(map) = &attenuation {
            foretold.add_scan(map, world_from_sensor, scan, settings.max_range);
        }
        for (i, beam) in scan.beams().enumerate().filter(|(_, b)| b.is_hit()) {
            let direction = world_from_sensor.rotate(beam.direction);
            let origin = world_from_sensor.transform_point(scan.origin(i));
            match cast_ray(tsdf, origin, direction, &settings) {
                RayCast::Hit(range) => predictions.pairs.push([range, beam.range]),
                RayCast::Unknown(_) => predictions.unknown.push(beam.range),
                RayCast::Outside(_) => predictions.outside.push(beam.range),
                RayCast::Free => predictions.free.push(beam.range),
            }
        }
    }
    drop(progress);
    let noise = RangeNoise::of_cells(resolution, settings.max_range);
    task.part((&predictions, &foretold), scans.len(), &noise, resolution)
}

/// Predicts 3-D scans.
pub(super) fn in_3d(
    args: &Args,
    path: &Path,
    file: &MapFile<3>,
    tsdf: &TsdfBricks<3>,
) -> anyhow::Result<Part> {
    let task = Task::new(args, path, &file.header);
    let wanted = Wanted { color: false, deskew: task.settings.shape.deskew, points_only: false };
    let log = log::read_3d(path, &args.source, wanted)?;
    if !log.knows_origins() {
        bail!(
            "{}: its points do not say where they were seen from, so that there are no ranges to predict; give --origin or \
             --poses",
            path.display()
        );
    }
    let filter = task.range().filter(task.settings.shape.self_filter.clone())?;
    let indices = task.indices(log.len())?;
    let resolution = tsdf.store.lattice().resolution;
    let settings = RayCastSettings {
        min_weight: Some(tsdf.min_weight()),
        max_range: filter.max_range.min(FARTHEST),
        // Where free space was not fused, all of it is unknown.
        unknown_tolerance: if task.settings.shape.carve { 2.0 * resolution } else { f64::INFINITY },
        blind: BLIND,
    };
    let rays = RayCaster::new(&tsdf.store, settings);
    let attenuation = attenuation_of(file)?;
    let (mut predictions, mut foretold) = (RangePredictions::default(), ForetoldRanges::default());
    let mut unreadable = Vec::new();
    let progress = Progress::new(indices.len(), "predicting", args.output);
    for &i in &indices {
        match log.filtered_frame(i, &filter) {
            Ok((frame, _)) => {
                let pose = log.pose(i);
                predictions.add(&rays, pose, &frame, args.rays);
                if let Some(map) = &attenuation {
                    foretold.add_frame(map, pose, &frame, args.rays, settings.max_range);
                }
            }
            Err(error) => unreadable.push(error),
        }
        progress.add(1);
    }
    drop(progress);
    let first = unreadable.first().map(ToString::to_string);
    if let (true, Some(error)) = (unreadable.len() == indices.len(), &first) {
        bail!("{error}");
    }
    let noise = RangeNoise::of_cells(resolution, settings.max_range);
    let mut part =
        task.part((&predictions, &foretold), indices.len() - unreadable.len(), &noise, resolution)?;
    part.value["unreadable"] = json!({ "scans": unreadable.len(), "first": first });
    Ok(part)
}

/// The map of hits per meter; `None`: the file holds none.
fn attenuation_of<const D: usize>(file: &MapFile<D>) -> anyhow::Result<Option<Attenuation<D>>> {
    let map = file.attenuation.as_ref().map(|map| Attenuation::from_store(map.store.clone(), map.rule));
    Ok(map.transpose()?)
}

fn to_json(predictions: &RangePredictions, score: &PredictionScore) -> Value {
    let (rays, predicted) = (predictions.rays() as f64, predictions.pairs.len() as f64);
    // The share of the predicted is a number of rays by their number: the same number by that of all rays.
    let of_all = |share: f64| (share * predicted).round() / rays;
    let signed = predictions.pairs.iter().map(|[predicted, measured]| predicted - measured);
    json!({
        "beams": predictions.rays(),
        "predicted": predictions.pairs.len(),
        "predicted_share": predicted / rays,
        "unknown": predictions.unknown.len(),
        "outside": predictions.outside.len(),
        "free": predictions.free.len(),
        "median_error": score.median_error,
        "p95_error": score.p95_error,
        "bias": score.bias,
        "mean_error": Spread::of(signed).mean,
        "within_one_cell": score.within_one_cell,
        "within_two_cells": score.within_two_cells,
        "within_one_cell_of_all": of_all(score.within_one_cell),
        "within_two_cells_of_all": of_all(score.within_two_cells),
        "negative_log_likelihood": score.negative_log_likelihood,
    })
}

fn text(p: &Value) -> String {
    let f = |key: &str| p[key].as_f64().unwrap_or(f64::NAN);
    let mut text = format!(
        "predicted {} of {} hits of {} scans ({:.1} %)\n\
         |error|: median {:.1} mm, 95 % {:.1} mm; bias (median) {:+.1} mm\n\
         within one cell {:.1} %, within two {:.1} % of the predicted ({:.1} % and {:.1} % of all)\n\
         negative log-likelihood {:.3} nats a ray\n",
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
        f("negative_log_likelihood"),
    );
    let hits = &p["attenuation"];
    if let (Some(density), Some(within), Some(error)) =
        (hits["log_density"].as_f64(), hits["within_10_cm"].as_f64(), hits["median_error"].as_f64())
    {
        text += &format!(
            "hits per meter: log density {density:.3} nats a beam ({:.0} % uniform up to {} m); median range within \
             10 cm {:.1} %, median |error| {:.1} mm\n",
            100.0 * p["noise"]["outliers"].as_f64().unwrap_or(f64::NAN),
            p["noise"]["max_range"],
            100.0 * within,
            1000.0 * error,
        );
    }
    if p["held_out"] != true {
        text += "warning: the map was not made with these scans held out; make it with --hold-out\n";
    }
    text
}
