//! What a mapping run says: for machines and for people.

use std::collections::BTreeMap;
use std::fmt::Write;

use portolan::geom::Grid;
use portolan_io::{CarmenLog, MapFile};
use serde_json::{Value, json};

use super::{Derived, FusionReport, Settings};
use crate::arguments::shown_bytes;
use crate::{json, log};

/// Everything that a run found out.
pub(crate) struct Summary<'a> {
    pub(crate) log: &'a CarmenLog,
    pub(crate) settings: &'a Settings,
    pub(crate) grid: Grid<2>,
    pub(crate) held_out: usize,
    pub(crate) fusion: &'a FusionReport,
    pub(crate) file: &'a MapFile<2>,
    pub(crate) derived: &'a Derived,
    pub(crate) bytes: BTreeMap<&'static str, usize>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    pub(crate) files: Vec<&'static str>,
}

impl Summary<'_> {
    /// What the user should know before he trusts the map.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let (log, stats) = (self.log.stats(), &self.fusion.stats);
        if let Some(first) = &log.refused.first {
            warnings.push(format!("{} scan lines could not be used (first: {first})", log.refused.total()));
        }
        if log.skipped_scans > 0 {
            let n = log.skipped_scans;
            warnings.push(format!("{n} ROBOTLASER1 scans were left out: the log has FLASER scans"));
        }
        if stats.refused_poses > 0 {
            warnings.push(format!(
                "{} scans have a pose that cannot be used (not rigid, or too far from the map)",
                stats.refused_poses
            ));
        }
        if stats.refused.total() > 0 {
            warnings.push(json::refused_words(&stats.refused));
        }
        if stats.hits_outside > 0 {
            warnings.push(format!("{} hits lie outside of --bounds", stats.hits_outside));
        }
        let thin = &self.derived.thin;
        if thin.thin > 0.0 {
            warnings.push(format!(
                "{:.1} m of contour ({:.1} %) belong to walls thinner than twice the truncation ({:.3} m), seen from \
                 both sides: their faces may be displaced by up to a few centimetres; a smaller --truncation helps",
                thin.thin,
                100.0 * thin.thin / thin.total,
                2.0 * self.settings.truncation
            ));
        }
        if self.derived.doubled.share() > 0.03 {
            warnings.push(format!(
                "{:.1} % of the contour is doubled: the poses do not agree with each other",
                100.0 * self.derived.doubled.share()
            ));
        }
        if self.derived.contour.as_ref().is_some_and(|c| c.segments.is_empty()) {
            warnings.push("no surface was found".to_owned());
        }
        warnings
    }

    /// `summary.json`.
    pub(crate) fn to_json(&self) -> Value {
        let stats = json::stats(&self.fusion.stats);
        let mut input = json::log_stats(self.log.stats());
        input["path"] = json!(self.log.path().display().to_string());
        input["format"] = json!("carmen");
        input["scans"] = json!(self.log.len());
        input["path_length"] = json!(log::path_length(self.log));
        input["no_return"] = self.settings.to_json()["no_return"].clone();
        let thin = &self.derived.thin;
        let contour = self.derived.contour.as_ref().map(|c| {
            json!({
                "segments": c.segments.len(),
                "length": c.length() + 0.0, // the sum of nothing is -0.0
                "doubled_length": self.derived.doubled.doubled,
                "doubled_share": self.derived.doubled.share(),
                "thin_length": thin.thin,
                "thinnest": thin.thinnest.is_finite().then_some(thin.thinnest),
            })
        });
        json!({
            "program": concat!("portolan ", env!("CARGO_PKG_VERSION")),
            "input": input,
            "settings": self.settings.to_json(),
            "scans": {
                "in_log": self.log.len(),
                "held_out": self.held_out,
                "fused": self.fusion.stats.scans,
                "refused_poses": self.fusion.stats.refused_poses,
                "in_map": self.file.header.scans,
            },
            "beams": stats["beams"],
            "refused_beams": stats["refused_beams"],
            "observations": self.fusion.observations,
            "extent": json::grid(&self.grid),
            "contour": contour,
            "bytes": self.bytes,
            "seconds": self.seconds,
            "scans_per_second": self.scans_per_second(),
            "logs": self.file.header.logs,
            "warnings": self.warnings(),
            "files": self.files,
        })
    }

    fn scans_per_second(&self) -> f64 {
        self.fusion.stats.scans as f64 / self.seconds.get("fuse").copied().unwrap_or(0.0).max(1e-9)
    }
}

/// The summary for people.
pub(crate) fn report(summary: &Summary, folder: &str) -> String {
    let mut text = String::new();
    let s = |name: &str| summary.seconds.get(name).copied().unwrap_or(0.0);
    let [w, h] = summary.grid.aabb().extent();
    let [nx, ny] = summary.grid.shape;
    let stats = &summary.fusion.stats;
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{} of {} scans fused, {} held out; {} hits, {} beams without echo",
        stats.scans,
        summary.log.len(),
        summary.held_out,
        stats.beams.hit,
        stats.beams.no_return
    );
    let r = summary.settings.resolution;
    let _ = writeln!(text, "{w:.1} x {h:.1} m, {nx} x {ny} cells of {r} m");
    let _ = writeln!(text, "{}", summary.settings.forgetting());
    let sizes: Vec<_> =
        summary.bytes.iter().map(|(name, &n)| format!("{name} {}", shown_bytes(n as f64))).collect();
    let _ = writeln!(text, "{}", sizes.join(", "));
    if let Some(contour) = &summary.derived.contour {
        let doubled = 100.0 * summary.derived.doubled.share();
        let (n, length) = (contour.segments.len(), contour.length() + 0.0);
        let _ = writeln!(text, "contour of {n} segments, {length:.1} m, {doubled:.2} % doubled");
    }
    let _ = writeln!(
        text,
        "read {:.2} s, fused {:.2} s ({:.0} scans/s), derived {:.2} s, written {:.2} s",
        s("read"),
        s("fuse"),
        summary.scans_per_second(),
        s("contour") + s("contour_checks") + s("esdf"),
        s("write") + s("picture")
    );
    for warning in summary.warnings() {
        let _ = writeln!(text, "warning: {warning}");
    }
    let _ = writeln!(text, "wrote {} to {folder}", summary.files.join(", "));
    text
}
