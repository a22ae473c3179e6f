//! `info` of a log.

use portolan::geom::Aabb;
use portolan_io::scan_log::{CameraFrom, Distortion, ScanLog};
use portolan_io::{LaserLog, detect_no_return};
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
        "path_length": log.path_length(),
        "extent_of_poses": json::aabb(&log.extent()),
        "time_span": log.time_span().map(|(first, last)| [first, last]),
        "camera": camera,
        "log": json::space_log_stats(log.stats()),
    })
}
