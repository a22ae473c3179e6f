//! The summary of a mapping run: `summary.json`, and the text for people.

use std::collections::BTreeMap;
use std::fmt::Write;

use portolan::field::{PointKind, UnknownSpace};
use serde_json::{Value, json};

use portolan::scan::{Way, WhyRays};

use super::extent::{Extent, strays};
use super::memory::peak_memory;
use super::{Derived, FoundMovers, FusionReport, Settings};
use crate::arguments::shown_bytes;
use crate::dimension::Dimension;
use crate::esdf::{EsdfArg, SURFACE_ALONE, keeps_thin};
use crate::json;
use crate::log::Log;
use crate::saved::SavedMap;

/// Everything that a run found out.
pub(crate) struct Summary<'a> {
    pub(crate) log: &'a Log,
    pub(crate) settings: &'a Settings,
    pub(crate) extent: Extent,
    pub(crate) held_out: usize,
    pub(crate) fusion: &'a FusionReport,
    pub(crate) file: &'a SavedMap,
    pub(crate) derived: &'a Derived,
    /// What was not made or written, and why.
    pub(crate) notes: Vec<String>,
    pub(crate) bytes: BTreeMap<&'static str, usize>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    pub(crate) files: Vec<&'static str>,
}

impl Summary<'_> {
    /// What lowers the trust in the map.
    fn warnings(&self) -> Vec<String> {
        let mut warnings = self.log.warnings();
        let stats = &self.fusion.stats;
        if stats.refused_poses > 0 {
            warnings.push(format!(
                "{} scans have a pose that cannot be used (not rigid, or too far from the map)",
                stats.refused_poses
            ));
        }
        if let (n @ 1.., Some(error)) = &self.fusion.unreadable {
            warnings.push(format!("{n} scans could not be read (first: {error})"));
        }
        if stats.refused.total() > 0 {
            warnings.push(json::refused_words(&stats.refused));
        }
        let lost = self.fusion.without_pixel;
        if 20 * lost > stats.beams.hit {
            warnings.push(format!(
                "{lost} points have no row and column of their own in their scan (a nearer point has it, or they lie \
                 outside of all) and are not in the distances; --sweep exact uses all points"
            ));
        }
        if stats.hits_outside > 0 {
            warnings.push(format!("{} hits lie outside of --bounds", stats.hits_outside));
        }
        if let SavedMap::Three(file) = self.file {
            warnings.extend(file.tsdf_bricks.as_ref().and_then(|tsdf| strays(&tsdf.store)));
        }
        warnings.extend(self.fusion.agreement.warning(self.log));
        warnings.extend(self.fusion.movers.as_ref().and_then(FoundMovers::warning));
        warnings.extend(self.surface_warnings());
        let keeps = match self.file {
            SavedMap::Two(file) => keeps_thin(file),
            SavedMap::Three(file) => keeps_thin(file),
        };
        warnings.extend(
            (self.has_points() && !keeps && self.settings.thin > 0.0).then(|| SURFACE_ALONE.to_owned()),
        );
        warnings.extend(self.fusion.full.iter().map(|full| format!("fusing ended early: {full}")));
        warnings.extend(self.notes.iter().cloned());
        warnings
    }

    fn surface_warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let mut empty = self.derived.mesh.as_ref().is_some_and(|mesh| mesh.triangles.is_empty());
        if let Some(contour) = &self.derived.contour {
            let (thin, doubled) = (&contour.thin, contour.doubled.share());
            if thin.thin > 0.0 {
                warnings.push(format!(
                    "{:.1} m of contour ({:.1} %) belong to walls thinner than twice the truncation ({:.3} m), seen \
                     from both sides: their faces may be displaced by up to a few centimetres; a smaller --truncation \
                     helps",
                    thin.thin,
                    100.0 * thin.thin / thin.total,
                    2.0 * self.settings.truncation()
                ));
            }
            if doubled > 0.03 {
                warnings.push(format!(
                    "{:.1} % of the contour is doubled: the poses do not agree with each other",
                    100.0 * doubled
                ));
            }
            empty = contour.contour.segments.is_empty();
        }
        warnings.extend(empty.then(|| "no surface was found".to_owned()));
        warnings
    }

    /// `summary.json`.
    pub(crate) fn to_json(&self) -> Value {
        let stats = json::stats(&self.fusion.stats);
        let header = self.file.header();
        let settings = self.settings.to_json();
        let mut input = self.log.to_json();
        if self.settings.dimension == Dimension::Two {
            input["no_return"] = settings["no_return"].clone();
        } else {
            input["unreadable_scans"] = json!(self.fusion.unreadable.0);
        }
        let mut document = json!({
            "program": concat!("portolan ", env!("CARGO_PKG_VERSION")),
            "input": input,
            "dimension": if self.settings.dimension == Dimension::Two { 2 } else { 3 },
            "settings": settings,
            "scans": {
                "in_log": self.log.len(),
                "held_out": self.held_out,
                "fused": self.fusion.stats.scans,
                "refused_poses": self.fusion.stats.refused_poses,
                "in_map": header.scans,
                "moved": self.fusion.moved.map(|[moved, _]| moved),
            },
            "beams": stats["beams"],
            "refused_beams": stats["refused_beams"],
            "observations": self.fusion.observations,
            "obstacles": self.obstacles_json(),
            "extent": self.extent.to_json(),
            "bytes": self.bytes,
            "peak_memory": peak_memory(),
            "seconds": self.seconds,
            "scans_per_second": self.scans_per_second(),
            "sigma": self.fusion.sigma.as_ref().map(|sigma| match sigma {
                Ok(calibration) => calibration.to_json(),
                Err(why) => json!({ "unknown": why }),
            }),
            "movers": self.fusion.movers.as_ref().map(FoundMovers::to_json),
            "logs": header.logs,
            "warnings": self.warnings(),
            "files": self.files,
        });
        match self.settings.dimension {
            Dimension::Two => document["contour"] = self.contour_json(),
            Dimension::Three => {
                document["mesh"] = self.mesh_json();
                document["octree"] = json!(self.derived.octree.as_ref().map(|t| {
                    json!({ "nodes": t.tree.nodes(), "inner": t.tree.inner_nodes(), "shift": t.shift })
                }));
                document["motion"] = self.log.motion_json();
                document["agreement"] = self.fusion.agreement.to_json();
                document["sweeps"] = json::ways(&self.fusion.stats.ways);
                document["points_without_pixel"] = json!(self.fusion.without_pixel);
            }
        }
        document
    }

    /// Whether there are distances that are measured to more than the surface.
    fn has_points(&self) -> bool {
        self.derived.esdf.is_some() && self.settings.esdf == EsdfArg::Accurate
    }

    /// What the distances are measured to beside the surface.
    fn obstacles_json(&self) -> Value {
        let Some(esdf) = self.derived.esdf.as_ref().filter(|_| self.has_points()) else { return Value::Null };
        let points = esdf.points();
        let count = |kind| points.iter().filter(|(_, k)| *k == kind).count();
        json!({
            "thin_cells": count(PointKind::Thin),
            "loose_cells": count(PointKind::Loose),
            // Null where a map was not asked: there is nothing to agree with.
            "occupied_by": self.derived.agreement.map(|[log_odds, counts, both]| {
                json!({ "log_odds_alone": log_odds, "counts_alone": counts, "both": both })
            }),
            "unknown_as": UnknownSpace::default().word(),
        })
    }

    fn contour_json(&self) -> Value {
        let Some(checked) = &self.derived.contour else { return Value::Null };
        let (contour, thin) = (&checked.contour, &checked.thin);
        json!({
            "segments": contour.segments.len(),
            "length": contour.length() + 0.0, // the sum of nothing is -0.0
            "doubled_length": checked.doubled.doubled,
            "doubled_share": checked.doubled.share(),
            "thin_length": thin.thin,
            "thinnest": thin.thinnest.is_finite().then_some(thin.thinnest),
        })
    }

    fn mesh_json(&self) -> Value {
        let Some(mesh) = &self.derived.mesh else { return Value::Null };
        json!({
            "vertices": mesh.vertices.len(),
            "triangles": mesh.triangles.len(),
            "area": mesh.area(),
            "colors": !mesh.colors.is_empty(),
        })
    }

    fn seconds_of(&self, stages: &[&str]) -> f64 {
        stages.iter().filter_map(|name| self.seconds.get(name)).sum()
    }

    fn scans_per_second(&self) -> f64 {
        self.fusion.stats.scans as f64 / self.seconds_of(&["fuse"]).max(1e-9)
    }
}

/// How a 3-D scan became evidence, and why.
fn way_words(way: Way) -> &'static str {
    match way {
        Way::Stated => "through their rows and columns",
        Way::Found => "through rows and columns that were found in their points",
        Way::Rays(WhyRays::Asked) => "ray by ray, as asked for",
        Way::Rays(WhyRays::OwnOrigins) => "ray by ray: each point has an origin of its own",
        Way::Rays(WhyRays::Colors) => "ray by ray: their points have colors, and no rows and columns",
        Way::Rays(WhyRays::NoRows) => "ray by ray: no rows and columns were found in their points",
        Way::Rays(WhyRays::SharedPixels) => "ray by ray: rows and columns would lose points",
        Way::Rays(WhyRays::Gaps) => "ray by ray: rows and columns would have gaps",
        Way::Points => "as points without rays: nothing is freed",
    }
}

/// The summary for people.
pub(crate) fn report(summary: &Summary, folder: &str) -> String {
    let mut text = String::new();
    let stats = &summary.fusion.stats;
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{} of {} scans fused ({}), {} held out; {} hits, {} beams without echo",
        stats.scans,
        summary.log.len(),
        summary.log.format(),
        summary.held_out,
        stats.beams.hit,
        stats.beams.no_return
    );
    if let Some([moved, held]) = summary.fusion.moved {
        let _ = writeln!(text, "{moved} of the {held} scans of this log in the map were moved");
    }
    if let Some(movers) = &summary.fusion.movers {
        let _ = writeln!(text, "{}", movers.in_words(stats.beams.hit));
    }
    match &summary.fusion.sigma {
        Some(Ok(calibration)) => drop(writeln!(text, "{}", calibration.in_words())),
        Some(Err(why)) => drop(writeln!(text, "how sure the surface is is not known: {why}")),
        None => {}
    }
    for choice in summary.log.choices() {
        let _ = writeln!(text, "{choice}");
    }
    let r = summary.settings.resolution();
    let _ = match &summary.extent {
        Extent::Two(grid) => {
            let ([w, h], [nx, ny]) = (grid.aabb().extent(), grid.shape);
            writeln!(text, "{w:.1} x {h:.1} m, {nx} x {ny} cells of {r} m")
        }
        Extent::Three(bounds) => {
            let [x, y, z] = bounds.extent();
            writeln!(text, "{x:.2} x {y:.2} x {z:.2} m in cells of {r} m")
        }
        Extent::OnDisk => writeln!(text, "cells of {r} m"),
    };
    let _ = writeln!(text, "{}", summary.settings.forgetting());
    let ways = Way::ALL.map(|way| (stats.ways.count(way), way_words(way)));
    for (scans, words) in ways.into_iter().filter(|(scans, _)| *scans > 0) {
        let _ = writeln!(text, "{scans} scans {words}");
    }
    for note in summary.log.notes() {
        let _ = writeln!(text, "note: {note}");
    }
    if let Some(words) = summary.log.motion_words() {
        let _ = writeln!(text, "{words}");
    }
    let sizes: Vec<_> =
        summary.bytes.iter().map(|(name, &n)| format!("{name} {}", shown_bytes(n as f64))).collect();
    let _ = writeln!(text, "{}", sizes.join(", "));
    if let Some(checked) = &summary.derived.contour {
        let doubled = 100.0 * checked.doubled.share();
        let (n, length) = (checked.contour.segments.len(), checked.contour.length() + 0.0);
        let _ = writeln!(text, "contour of {n} segments, {length:.1} m, {doubled:.2} % doubled");
    }
    if let Some(esdf) = summary.derived.esdf.as_ref().filter(|_| summary.has_points()) {
        let points = esdf.points().len();
        let _ = match summary.settings.shape.points_only {
            true => writeln!(text, "distances to {points} cells that hold points"),
            false => {
                writeln!(
                    text,
                    "distances to the surface and to {points} cells that stop beams without one; unknown space is {}",
                    UnknownSpace::default().word()
                )
            }
        };
        if let Some([log_odds, counts, both]) = summary.derived.agreement {
            let _ = writeln!(
                text,
                "occupied cells: {both} by log odds and counts of hits, {log_odds} by log odds alone, {counts} by counts alone"
            );
        }
    }
    if let Some(mesh) = &summary.derived.mesh {
        let _ = writeln!(text, "mesh of {} triangles, {:.2} m²", mesh.triangles.len(), mesh.area() + 0.0);
    }
    let per_scan: Vec<_> = ["tree", "grid", "tsdf"]
        .iter()
        .filter_map(|name| summary.seconds.get(name).map(|s| (name, s)))
        .map(|(name, s)| format!("{name} {:.1} ms", 1e3 * s / (stats.scans.max(1) as f64)))
        .collect();
    let _ = writeln!(
        text,
        "read {:.2} s, fused {:.2} s ({:.1} scans/s; {} a scan), derived {:.2} s, written {:.2} s",
        summary.seconds_of(&["read"]),
        summary.seconds_of(&["fuse"]),
        summary.scans_per_second(),
        per_scan.join(", "),
        summary.seconds_of(&["contour", "contour_checks", "octree", "mesh", "esdf"]),
        summary.seconds_of(&["save", "write", "picture", "preview"])
    );
    for warning in summary.warnings() {
        let _ = writeln!(text, "warning: {warning}");
    }
    let _ = writeln!(text, "wrote {} to {folder}", summary.files.join(", "));
    text
}
