//! The gallery as JSON.

use super::Gallery;
use serde_json::{Value, json};

/// The gallery for machines: meters, seconds, bytes; `null` where a map cannot answer, or a number is not finite.
pub fn document(gallery: &Gallery, log: &str, scans: usize) -> Value {
    let name = |i: usize| gallery.rows[i].name.as_str();
    let winners: Vec<_> = gallery
        .winners
        .iter()
        .map(|w| {
            let level: Vec<_> = w.level.iter().map(|&i| name(i)).collect();
            json!({ "workload": w.workload.name(), "row": name(w.row), "level": level, "ahead": w.ahead })
        })
        .collect();
    let never: Vec<_> = gallery.never_win.iter().map(|&i| name(i)).collect();
    let cloud = &gallery.cloud_crossover;
    let measured: Vec<_> =
        cloud.measured.iter().map(|&(n, s)| json!({ "points": n, "seconds": s })).collect();
    let fields: Vec<_> = gallery
        .fields
        .iter()
        .map(|f| {
            json!({
                "method": f.name(), "seconds": f.seconds, "gradient_norm": f.gradient,
                "against_contour": f.against_contour, "against_truth": f.against_truth,
            })
        })
        .collect();
    json!({
        "log": log,
        "scans": scans,
        "resolution": gallery.tsdf.config().resolution,
        "cells": gallery.tsdf.grid().shape,
        "truncation": gallery.tsdf.config().truncation,
        "rows": gallery.rows,
        "winners": winners,
        "never_win": never,
        "tree_crossovers": gallery.trees,
        "cloud_crossover": { "points": cloud.points, "measured": measured },
        "gradient_norm": { "tsdf": gallery.tsdf_gradient, "esdf": gallery.fields[0].gradient },
        "fields": fields,
        "turned": gallery.turned,
    })
}
