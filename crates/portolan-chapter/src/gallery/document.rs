//! The gallery as JSON.

use super::{Cost, Gallery, Row};
use portolan_sim::ErrorSummary;
use serde_json::{Value, json};

/// The gallery for machines: meters, seconds, bytes; `null` where a map cannot answer.
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
    let trees: Vec<_> = gallery
        .trees
        .iter()
        .map(|t| {
            json!({
                "name": t.name, "node_bytes": t.node_bytes, "resolution": t.resolution,
                "predicted_resolution": t.predicted_resolution, "predicted_ratio": t.predicted_ratio,
                "measured_ratio": t.measured_ratio,
            })
        })
        .collect();
    let cloud = &gallery.cloud_crossover;
    let measured: Vec<_> =
        cloud.measured.iter().map(|&(n, s)| json!({ "points": n, "seconds": s })).collect();
    let finite = |v: f64| v.is_finite().then_some(v);
    let fields: Vec<_> = gallery
        .fields
        .iter()
        .map(|f| {
            json!({
                "method": f.name(), "seconds": f.seconds, "gradient_norm": finite(f.gradient),
                "against_contour": error(f.against_contour), "against_truth": error(f.against_truth),
            })
        })
        .collect();
    json!({
        "log": log,
        "scans": scans,
        "resolution": gallery.tsdf.config().resolution,
        "cells": gallery.tsdf.grid().shape,
        "truncation": gallery.tsdf.config().truncation,
        "rows": gallery.rows.iter().map(row).collect::<Vec<_>>(),
        "winners": winners,
        "never_win": never,
        "tree_crossovers": trees,
        "cloud_crossover": { "points": cloud.points, "measured": measured },
        "gradient_norm": { "tsdf": finite(gallery.tsdf_gradient), "esdf": finite(gallery.fields[0].gradient) },
        "fields": fields,
    })
}

fn error(error: Option<ErrorSummary>) -> Option<Value> {
    error.map(|e| {
        json!({
            "count": e.count, "median": e.median, "p95": e.p95, "p99": e.p99, "bias": e.bias,
            "worst_over": e.worst_over, "worst_under": e.worst_under,
        })
    })
}

fn row(row: &Row) -> Value {
    let cost = |cost: Option<Cost>| cost.map(|c| json!({ "seconds": c.seconds, "by": c.by }));
    json!({
        "name": row.name, "memory_bytes": row.memory_bytes, "derived": row.derived,
        "update": cost(row.update), "occupancy": cost(row.occupancy), "distance": cost(row.distance),
        "surface": cost(row.surface), "occupancy_wrong": row.occupancy_wrong,
        "distance_error": error(row.distance_error), "surface_error": error(row.surface_error),
        "note": row.note,
    })
}
