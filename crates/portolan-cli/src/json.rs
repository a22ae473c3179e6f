//! Library values as JSON.

use portolan::geom::{Aabb, Grid};
use portolan::scan::{RefusedBeams, ScanStats, ScanWays, Way, WhyRays};
use portolan_io::scan_log::ScanLogStats;
use portolan_io::{BagLogStats, CarmenStats, LaserLog, LaserLogStats, TimeOrder};
use serde_json::{Map, Value, json};

/// An object of these fields.
pub(crate) fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

/// What became of scans and beams.
pub(crate) fn stats(stats: &ScanStats) -> Value {
    let (b, r) = (&stats.beams, &stats.refused);
    json!({
        "scans": stats.scans,
        "refused_poses": stats.refused_poses,
        "beams": {
            "total": b.total(), "hit": b.hit, "max_range": b.max_range, "no_return": b.no_return,
            "dropped": b.dropped, "self_hit": b.self_hit, "mover": b.mover, "hits_outside": stats.hits_outside,
        },
        "refused_beams": {
            "total": r.total(), "not_finite": r.not_finite, "negative": r.negative, "too_near": r.too_near,
            "too_far": r.too_far,
        },
    })
}

/// 3-D scans by how they became evidence, and why.
pub(crate) fn ways(ways: &ScanWays) -> Value {
    let rays = |why| ways.count(Way::Rays(why));
    json!({
        "rows_and_columns": { "of_the_log": ways.count(Way::Stated), "found_in_points": ways.count(Way::Found) },
        "exact_rays": {
            "asked_for": rays(WhyRays::Asked),
            "an_origin_for_each_point": rays(WhyRays::OwnOrigins),
            "colors": rays(WhyRays::Colors),
            "no_rows_and_columns_found": rays(WhyRays::NoRows),
            "rows_and_columns_would_lose_points": rays(WhyRays::SharedPixels),
            "rows_and_columns_would_have_gaps": rays(WhyRays::Gaps),
        },
        "points_without_rays": ways.count(Way::Points),
    })
}

/// Refused readings by cause, for people.
pub(crate) fn refused_words(r: &RefusedBeams) -> String {
    let mut causes = format!("{} not finite, {} negative, {} too near", r.not_finite, r.negative, r.too_near);
    if r.too_far > 0 {
        causes += &format!(", {} too far", r.too_far);
    }
    format!("{} readings could not be used ({causes})", r.total())
}

/// Adds the numbers of `other` to those of `sum`, field by field.
pub(crate) fn add_counts(sum: &mut Map<String, Value>, other: &Map<String, Value>) {
    for (key, value) in other {
        match (sum.get_mut(key), value) {
            (Some(Value::Object(a)), Value::Object(b)) => add_counts(a, b),
            (Some(a), b) if a.is_u64() && b.is_u64() => {
                *a = json!(a.as_u64().unwrap_or(0).saturating_add(b.as_u64().unwrap_or(0)));
            }
            _ => {
                sum.insert(key.clone(), value.clone());
            }
        }
    }
}

/// Takes the numbers of `other` from those of `sum`, field by field.
pub(crate) fn take_counts(sum: &mut Map<String, Value>, other: &Map<String, Value>) {
    for (key, value) in other {
        match (sum.get_mut(key), value) {
            (Some(Value::Object(a)), Value::Object(b)) => take_counts(a, b),
            (Some(a), b) if a.is_u64() && b.is_u64() => {
                *a = json!(a.as_u64().unwrap_or(0).saturating_sub(b.as_u64().unwrap_or(0)));
            }
            _ => {}
        }
    }
}

/// What else was found in a 2-D log.
pub(crate) fn log_stats(stats: &CarmenStats) -> Value {
    let by_cause: Map<_, _> =
        stats.refused.by_fault.iter().map(|(fault, n)| (fault.to_string(), json!(n))).collect();
    json!({
        "lines": stats.lines,
        "message": stats.message.word(),
        "skipped_scans": stats.skipped_scans,
        "refused_scans": {
            "total": stats.refused.total(),
            "by_cause": by_cause,
            "first": stats.refused.first.as_ref().map(ToString::to_string),
        },
        "other_messages": stats.other_messages,
        "declared_max_range": stats.declared_max_range,
        "times": match stats.times {
            TimeOrder::Absent => "absent",
            TimeOrder::Ascending => "ascending",
            TimeOrder::NotAscending => "not ascending",
        },
    })
}

/// What else was found in a 2-D log of any format.
pub(crate) fn laser_log_stats(log: &LaserLog) -> Value {
    match log.stats() {
        LaserLogStats::Carmen(stats) => log_stats(stats),
        LaserLogStats::Bag(stats) => {
            let mut value = bag_log_stats(stats);
            value["declared_max_range"] = json!(log.declared_max_range().filter(|r| r.is_finite()));
            value
        }
    }
}

/// What was chosen and left out of a bag.
pub(crate) fn bag_log_stats(stats: &BagLogStats) -> Value {
    json!({
        "topics": stats.topics,
        "sensor_frames": stats.sensor_frames,
        "fixed_frame": stats.fixed_frame,
        "poses_from": stats.poses,
        "point_times": stats.point_times,
        "guesses": stats.guesses,
        "messages": stats.messages,
        "refused_scans": {
            "total": stats.refused_messages(),
            "by_cause": stats.refused,
            "first": stats.first_refused,
        },
        "scans_without_pose": {
            "total": stats.scans_without_pose(),
            "by_missing": stats.without_pose,
            "first": stats.first_without_pose,
        },
        "tilted_scans": stats.tilted,
        "worst_tilt": stats.worst_tilt,
        "notes": stats.notes,
    })
}

/// What else was found in a 3-D log.
pub(crate) fn space_log_stats(stats: &ScanLogStats) -> Value {
    json!({
        "scans": stats.scans,
        "missing_files": stats.missing_files,
        "poses": stats.poses,
        "scans_without_pose": stats.scans_without_pose,
        "poses_without_scan": stats.poses_without_scan,
        "unmatched_times": stats.unmatched_times,
        "mended_poses": stats.mended_poses,
        "worst_pose": stats.worst_pose,
        "refused_poses": {
            "total": stats.refused_poses.len(),
            "first": stats.refused_poses.first().map(ToString::to_string),
        },
        "scans_without_color": stats.scans_without_color,
        "colors_left_out": stats.colors_left_out,
        "notes": stats.notes,
        "pixels_beyond_lens": stats.pixels_beyond_lens,
        "warnings": stats.warnings,
    })
}

/// A box in meters.
pub(crate) fn aabb<const D: usize>(b: &Aabb<D>) -> Value {
    json!({ "min": b.min.to_vec(), "max": b.max.to_vec(), "size": b.extent().to_vec() })
}

/// A grid: its box, shape and resolution.
pub(crate) fn grid<const D: usize>(g: &Grid<D>) -> Value {
    let mut value = aabb(&g.aabb());
    value["cells"] = json!(g.shape.to_vec());
    value["resolution"] = json!(g.lattice.resolution);
    value
}
