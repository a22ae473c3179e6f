//! What a mapping run in space says: for machines and for people.

use std::collections::BTreeMap;
use std::fmt::Write;

use portolan::geom::Aabb;
use portolan_io::MapFile;
use portolan_io::scan_log::{ScanLog, ScanLogStats};
use serde_json::{Value, json};

use super::{Derived, Fusion, Settings, brick_extent};
use crate::arguments::shown_bytes;
use crate::json;

/// Everything that a run found out.
pub(crate) struct Summary<'a> {
    pub(crate) log: &'a ScanLog,
    pub(crate) settings: &'a Settings,
    pub(crate) held_out: usize,
    pub(crate) fusion: &'a Fusion,
    pub(crate) file: &'a MapFile<3>,
    pub(crate) derived: &'a Derived,
    /// What was not written, and why.
    pub(crate) notes: Vec<String>,
    pub(crate) bytes: BTreeMap<&'static str, usize>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    pub(crate) files: Vec<&'static str>,
}

impl Summary<'_> {
    /// What the user should know before he trusts the map.
    fn warnings(&self) -> Vec<String> {
        let mut warnings = log_warnings(self.log.stats());
        if let Some(lost) = self.log.unread_colors() {
            warnings
                .push(format!("{} colour pictures could not be read (first: {})", lost.pictures, lost.first));
        }
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
                "{lost} points share a row and column of their scan with a nearer point, or have none, and are not in the \
                 distances; \
                 --sweep exact uses all"
            ));
        }
        if stats.hits_outside > 0 {
            warnings.push(format!("{} hits lie outside of --bounds", stats.hits_outside));
        }
        if self.derived.mesh.as_ref().is_some_and(|m| m.triangles.is_empty()) {
            warnings.push("no surface was found".to_owned());
        }
        if let Some(full) = &self.fusion.full {
            warnings.push(format!("fusing ended early: {full}"));
        }
        warnings.extend(self.notes.iter().cloned());
        warnings
    }

    /// Box of what was seen: of the bricks that hold it.
    fn extent(&self) -> Aabb<3> {
        let mut extent = Aabb::EMPTY;
        if let Some(map) = &self.file.occupancy_bricks {
            extent = extent.union(brick_extent(&map.store));
        }
        if let Some(map) = &self.file.tsdf_bricks {
            extent = extent.union(brick_extent(&map.store));
        }
        extent
    }

    /// `summary.json`.
    pub(crate) fn to_json(&self) -> Value {
        let stats = json::stats(&self.fusion.stats);
        let mesh = self.derived.mesh.as_ref().map(|m| {
            json!({
                "vertices": m.vertices.len(),
                "triangles": m.triangles.len(),
                "area": m.area(),
                "colors": !m.colors.is_empty(),
            })
        });
        let tree =
            self.derived.tree.as_ref().map(|t| json!({ "nodes": t.nodes(), "inner": t.inner_nodes() }));
        json!({
            "program": concat!("portolan ", env!("CARGO_PKG_VERSION")),
            "input": {
                "name": self.log.name(),
                "format": self.log.kind().word(),
                "scans": self.log.len(),
                "path_length": self.log.path_length(),
                "poses": json::space_log_stats(self.log.stats()),
                "unreadable_scans": self.fusion.unreadable.0,
            },
            "dimension": 3,
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
            "points_without_pixel": self.fusion.without_pixel,
            "observations": self.fusion.observations,
            "extent": json::aabb(&self.extent()),
            "mesh": mesh,
            "octree": tree,
            "bytes": self.bytes,
            "peak_memory": super::peak_memory(),
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
    let stats = &summary.fusion.stats;
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{} of {} scans fused ({}), {} held out; {} hits",
        stats.scans,
        summary.log.len(),
        summary.log.kind().word(),
        summary.held_out,
        stats.beams.hit
    );
    let [x, y, z] = summary.extent().extent();
    let r = summary.settings.resolution;
    let _ = writeln!(text, "{x:.2} x {y:.2} x {z:.2} m in cells of {r} m");
    let sizes: Vec<_> =
        summary.bytes.iter().map(|(name, &n)| format!("{name} {}", shown_bytes(n as f64))).collect();
    let _ = writeln!(text, "{}", sizes.join(", "));
    if let Some(mesh) = &summary.derived.mesh {
        let (n, area) = (mesh.triangles.len(), mesh.area());
        let _ = writeln!(text, "mesh of {n} triangles, {area:.2} m²");
    }
    let per_scan: Vec<_> = ["tree", "tsdf"]
        .iter()
        .filter(|name| summary.seconds.contains_key(*name))
        .map(|name| format!("{name} {:.1} ms", 1e3 * s(name) / (stats.scans.max(1) as f64)))
        .collect();
    let _ = writeln!(
        text,
        "fused in {:.2} s ({:.1} scans/s; {} a scan), derived {:.2} s, written {:.2} s",
        s("fuse"),
        summary.scans_per_second(),
        per_scan.join(", "),
        s("octree") + s("mesh") + s("esdf"),
        s("write") + s("preview")
    );
    for warning in summary.warnings() {
        let _ = writeln!(text, "warning: {warning}");
    }
    let _ = writeln!(text, "wrote {} to {folder}", summary.files.join(", "));
    text
}

fn log_warnings(stats: &ScanLogStats) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut say = |n: u64, what: &str| {
        if n > 0 {
            warnings.push(format!("{n} {what}"));
        }
    };
    say(stats.missing_files, "files of scans that the log names are not there");
    say(stats.poses_without_scan, "poses belong to no scan");
    say(stats.scans_without_pose, "scans have no pose and were left out");
    say(stats.unmatched_times, "scans have no pose near in time and were left out");
    say(stats.scans_without_color, "scans have no colour picture");
    if let Some(first) = stats.refused_poses.first() {
        warnings.push(format!("{} poses could not be used (first: {first})", stats.refused_poses.len()));
    }
    if let Some(why) = &stats.colors_left_out {
        warnings.push(format!("colours were left out: {why}"));
    }
    warnings
}
