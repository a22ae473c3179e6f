//! What `demo` says: for machines and for people.

use std::fmt::Write;

use portolan::geom::Grid;
use portolan_chapter::experiment::{Drift, Forgetting, PoseSet};
use portolan_chapter::gallery::Gallery;
use portolan_sim::{LapConfig, World};
use serde_json::{Value, json};

use super::Run;
use crate::json;
use crate::mapping::{Derived, FusionReport, Settings};
use crate::saved::SavedMap;

/// Everything that a run found out.
pub(super) struct Found<'a> {
    pub(super) config: LapConfig,
    pub(super) settings: Settings,
    pub(super) grid: Grid<2>,
    pub(super) world: &'a World,
    pub(super) fusion: FusionReport,
    pub(super) file: SavedMap,
    pub(super) derived: Derived,
    pub(super) gallery: &'a Gallery,
    pub(super) drift: &'a Drift,
    pub(super) forgetting: Option<&'a Forgetting>,
}

impl Found<'_> {
    /// `summary.json`, with the fields that `map` writes.
    pub(super) fn to_json(&self, run: &Run) -> Value {
        let stats = json::stats(&self.fusion.stats);
        let lidar = &self.config.lidar;
        let mut bytes = self.file.bytes();
        bytes.extend(self.derived.bytes());
        let contour = self.derived.contour.as_ref().map(|c| {
            json!({
                "segments": c.contour.segments.len(),
                "length": c.contour.length(),
                "doubled_share": c.doubled.share(),
                "thin_length": c.thin.thin,
            })
        });
        let mut seconds = run.seconds.clone();
        seconds.extend(self.fusion.seconds.iter());
        seconds.extend(self.derived.seconds.iter());
        seconds.insert("total", run.total());
        json!({
            "program": concat!("portolan ", env!("CARGO_PKG_VERSION")),
            "input": {
                "simulated": "apartment",
                "seed": self.config.seed,
                "scans": self.config.scans,
                "poses": self.drift.chosen.name(),
                "lidar": {
                    "beams": lidar.beams, "noise": lidar.noise, "max_range": lidar.max_range,
                    "no_return_rate": lidar.no_return_rate, "dropped_rate": lidar.dropped_rate,
                },
                "wall_length": self.world.wall_length(),
            },
            "settings": self.settings.to_json(),
            "scans": {
                "in_log": self.config.scans, "held_out": 0, "fused": self.fusion.stats.scans,
                "refused_poses": self.fusion.stats.refused_poses, "in_map": self.file.header().scans,
            },
            "beams": stats["beams"],
            "refused_beams": stats["refused_beams"],
            "observations": self.fusion.observations,
            "extent": json::grid(&self.grid),
            "contour": contour,
            "poses": self.drift.to_json(),
            "ghost": self.forgetting.map(Forgetting::to_json),
            "bytes": bytes,
            "seconds": seconds,
            "logs": self.file.header().logs,
            "warnings": self.warnings(),
            "files": run.files,
        })
    }

    /// What should be known before the maps are trusted.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let outside = self.fusion.stats.hits_outside;
        if outside > 0 && self.drift.chosen == PoseSet::Odometry {
            warnings.push(format!("{outside} hits lie outside of the map: the odometry led them there"));
        }
        if let Some(thin) = self.derived.contour.as_ref().map(|c| &c.thin).filter(|t| t.thin > 0.0) {
            warnings.push(format!(
                "{:.1} m of contour ({:.1} %) belong to things thinner than twice the truncation, seen from both \
                 sides: their faces may be displaced by up to a few centimetres; a smaller truncation helps",
                thin.thin,
                100.0 * thin.thin / thin.total
            ));
        }
        let esdf = self.gallery.rows.iter().position(|r| r.name.starts_with("ESDF"));
        let headline = self.gallery.headline();
        if let Some(e) = esdf.and_then(|i| headline.rows[i].distance_error).filter(|e| e.worst_over > 0.0) {
            warnings.push(format!(
                "the ESDF's distances are up to {:.0} mm too large (and {:.0} mm too small); median error {:.1} mm, \
                 p99 {:.1} mm: keep that much margin",
                1e3 * e.worst_over,
                1e3 * e.worst_under,
                1e3 * e.median,
                1e3 * e.p99
            ));
        }
        warnings
    }

    /// The summary for people: the table first.
    pub(super) fn report(&self, run: &Run, folder: &str) -> String {
        let stats = &self.fusion.stats;
        let mut text = format!("{}\n", self.gallery);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "simulated lap of the Apartment, seed {:#x}: {} scans at {}, {} hits, {} without echo, {} lost",
            self.config.seed,
            stats.scans,
            self.drift.chosen.poses(),
            stats.beams.hit,
            stats.beams.no_return,
            stats.beams.dropped
        );
        let _ = writeln!(text, "{}", self.settings.forgetting());
        let ghost = self.forgetting.map_or_else(Vec::new, Forgetting::lines);
        for line in self.drift.lines().into_iter().chain(ghost) {
            let _ = writeln!(text, "{line}");
        }
        for warning in self.warnings() {
            let _ = writeln!(text, "warning: {warning}");
        }
        let s = |name: &str| run.seconds.get(name).copied().unwrap_or(0.0);
        let ghost = if self.forgetting.is_some() {
            format!(", ghost {:.2} s meanwhile", s("ghost"))
        } else {
            String::new()
        };
        let _ = writeln!(
            text,
            "simulated and corrected {:.2} s, fused {:.2} s, measured {:.2} s, in turned worlds {:.2} s, written {:.2} s{ghost}; {:.2} s in all",
            s("simulate"),
            s("fuse") + s("derive") + s("pose_sets"),
            s("gallery"),
            s("turned"),
            s("gallery_files") + s("map_files") + s("drift_files") + s("report"),
            run.total()
        );
        let _ = writeln!(text, "wrote {} to {folder}", run.files.join(", "));
        let _ = writeln!(text, "open {folder}/report.html");
        text
    }
}
