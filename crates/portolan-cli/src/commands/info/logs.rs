//! `info` of a log.

use portolan::geom::Aabb;
use portolan_io::scan_log::{CameraFrom, Distortion, ScanLog, ScanLogKind};
use portolan_io::{LaserLog, PosedCloud, detect_no_return, read_posed_clouds};
use serde_json::{Value, json};

use crate::json;
use crate::log::path_length;

pub(super) fn of_2d(log: &LaserLog) -> Value {
    let mut poses = Aabb::EMPTY;
    let mut beams = Vec::new();
    for scan in log.raw_scans() {
        poses.include(scan.world_from_laser.translation);
        beams.push(scan.readings.len());
    }
    let no_return = detect_no_return(log);
    let silent = |r: &&f64| no_return.is_some_and(|n| **r >= n);
    let readings: usize = beams.iter().sum();
    json!({
        "scans": log.len(),
        "beams_per_scan": [beams.iter().min(), beams.iter().max()],
        "readings": readings,
        "readings_not_finite": log.raw_scans().flat_map(|s| s.readings).filter(|r| !r.is_finite()).count(),
        "no_return": no_return,
        "readings_without_echo": log.raw_scans().flat_map(|s| s.readings).filter(silent).count(),
        "path_length": path_length(log),
        "extent_of_poses": json::aabb(&poses),
        "log": json::laser_log_stats(log),
    })
}

fn from_words(from: &CameraFrom) -> String {
    match from {
        CameraFrom::Caller => "the caller".to_owned(),
        CameraFrom::File(path) => path.display().to_string(),
        CameraFrom::DataSet(name) => (*name).to_owned(),
    }
}

fn lens_words(distortion: &Distortion) -> &'static str {
    match distortion {
        Distortion::None => "none",
        Distortion::Fisheye(_) => "fisheye",
        _ => "rational",
    }
}

pub(super) fn of_3d(log: &ScanLog) -> Value {
    let camera = log.camera().map(|camera| {
        let p = &camera.pinhole;
        let color = camera.color.as_ref().map(|color| {
            let p = &color.pinhole;
            json!({
                "fx": p.fx, "fy": p.fy, "cx": p.cx, "cy": p.cy, "from": from_words(&color.from),
                "lens": lens_words(&color.distortion), "position": color.color_from_depth.inverse().translation,
            })
        });
        json!({
            "fx": p.fx, "fy": p.fy, "cx": p.cx, "cy": p.cy, "from": from_words(&camera.from),
            "lens": lens_words(&camera.distortion), "color": color,
        })
    });
    json!({
        "scans": log.len(),
        "path_length": log.path_length() + 0.0, // the sum of nothing is -0.0
        "extent_of_poses": json::aabb(&log.extent()),
        "time_span": log.time_span().map(|(first, last)| [first, last]),
        "camera": camera,
        "clouds": clouds(log),
        "log": json::space_log_stats(log.stats()),
    })
}

/// Scans of a file that are described one by one.
const MOST_DESCRIBED: usize = 32;

/// What the clouds of a file hold; of a folder nothing. A file that cannot be read again is none.
fn clouds(log: &ScanLog) -> Option<Value> {
    if log.kind() != ScanLogKind::Clouds || !log.path().is_file() {
        return None;
    }
    let scans = read_posed_clouds(log.path()).ok()?;
    let described = scans.into_iter().take(MOST_DESCRIBED).enumerate();
    Some(Value::Object(described.map(|(i, scan)| (format!("cloud_{i}"), cloud(scan))).collect()))
}

fn cloud(scan: PosedCloud) -> Value {
    let (name, seen_from) = (scan.name.clone(), scan.origin);
    let has_pose = scan.file_from_scan.is_some();
    let held = &scan.cloud;
    let lists = [
        ("intensity", held.intensity.len()),
        ("time", held.times.len()),
        ("ring", held.rings.len()),
        ("color", held.colors.len()),
        ("normal", held.normals.len()),
    ];
    let fields: Vec<_> = lists.iter().filter(|(_, n)| *n > 0).map(|(name, _)| *name).collect();
    let last = held.times.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let times = (!held.times.is_empty()).then(|| [held.start_time, held.start_time + f64::from(last)]);
    let organised = held.grid.as_ref().map(|grid| [grid.columns, grid.rows]);
    let (points, refused) = (held.points.len(), held.refused);
    let viewpoint = held.viewpoint.map(|v| v.position);
    let mut extent = Aabb::EMPTY;
    if let Some(placed) = scan.in_file() {
        (0..placed.points.len()).for_each(|i| extent.include(placed.position(i)));
    }
    json!({
        "name": name,
        "points": points,
        "extent": (!extent.is_empty()).then(|| json::aabb(&extent)),
        "fields": format!("position{}", fields.iter().map(|f| format!(", {f}")).collect::<String>()),
        "time_span": times,
        "organised": organised,
        "viewpoint": viewpoint,
        "pose": has_pose,
        "seen_from": seen_from,
        "no_reading": refused.no_reading,
        "refused": refused.not_finite + refused.too_far,
    })
}
