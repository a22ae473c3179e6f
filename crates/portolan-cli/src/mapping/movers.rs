//! What moved: looked for in all scans first, then taken out of each.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;

use anyhow::bail;
use portolan::geom::Pose;
use portolan::map::{MapError, ScanKind};
use portolan::movers::Movers;
use portolan::scan::{BeamCounts, Movable, Scan};
use portolan_io::{PointCloudFile, write_ply_cloud};
use serde_json::{Value, json};

use crate::progress::Progress;

/// The file of the points that moved.
pub(crate) const MOVERS_FILE: &str = "movers.ply";

/// How to look for what moved.
pub(crate) struct Looking<'a> {
    /// Standard deviation of the error of poses (meters).
    pub(crate) pose_sigma: f64,
    /// The scans to look at.
    pub(crate) indices: &'a [usize],
    /// Bytes that the looks may take; maps have what they leave.
    pub(crate) memory: usize,
    pub(crate) progress: &'a Progress,
}

/// What is known of what moved, and the points that were taken out so far, scan by scan.
pub(crate) struct Judge<const D: usize> {
    movers: Movers<D>,
    gone: Mutex<BTreeMap<usize, Vec<[f64; D]>>>,
}

impl<const D: usize> Judge<D> {
    /// A judge that has looked at nothing; `first`: where the first scan was taken (meters).
    pub(super) fn new(how: &Looking, first: [f64; D]) -> anyhow::Result<Self> {
        Ok(Self { movers: Movers::new(how.pose_sigma, first, how.memory)?, gone: Mutex::default() })
    }

    /// Bytes that the maps have less.
    pub(super) fn memory_bytes(&self) -> usize {
        self.movers.memory_bytes()
    }

    /// Looks at a scan. A scan that cannot be used here cannot be mapped, and is told there.
    pub(super) fn look(&mut self, pose: &Pose<D>, scan: &impl ScanKind<D>) -> anyhow::Result<()> {
        match self.movers.look(pose, scan) {
            Err(MapError::Full(full)) => {
                bail!("looking for what moved: {full}; start again with more --memory, or without --movers")
            }
            Ok(_) | Err(_) => Ok(()),
        }
    }

    /// The scan without what moved. What the beams are afterwards is changed in `counts`.
    pub(super) fn without_movers<S: Movable<D>>(
        &self,
        index: usize,
        pose: &Pose<D>,
        scan: S,
        counts: &mut BeamCounts,
    ) -> S {
        let (rest, gone) = self.movers.split(pose, scan);
        let n = gone.len() as u64;
        counts.hit = counts.hit.saturating_sub(n);
        counts.mover += n;
        if let (false, Ok(mut all)) = (gone.is_empty(), self.gone.lock()) {
            all.insert(index, gone);
        }
        rest
    }

    /// The points that were taken out.
    pub(super) fn found(&self) -> FoundMovers {
        let all = self.gone.lock().map(|all| all.clone()).unwrap_or_default();
        let wide = |p: &[f64; D]| std::array::from_fn(|k| p.get(k).copied().unwrap_or(0.0));
        let (edge, open_cells) = (self.movers.edge(), self.movers.open_cells());
        FoundMovers { edge, open_cells, scans: all.len(), points: all.values().flatten().map(wide).collect() }
    }
}

/// A judge that has looked at these scans.
pub(super) fn look_2d(
    scans: impl Iterator<Item = (Pose<2>, Scan<2>)>,
    how: &Looking,
) -> anyhow::Result<Judge<2>> {
    let mut scans = scans.peekable();
    let first = scans.peek().map_or([0.0; 2], |(pose, _)| pose.translation);
    let mut judge = Judge::new(how, first)?;
    for (pose, scan) in scans {
        judge.look(&pose, &scan)?;
        how.progress.add(1);
    }
    Ok(judge)
}

/// Points of what moved.
#[derive(Debug, Default)]
pub(crate) struct FoundMovers {
    /// Edge of the cells that were looked at (meters), and how many of them were seen open.
    edge: f64,
    open_cells: usize,
    /// Scans that saw any.
    scans: usize,
    /// In the order of the scans (world, meters); z is 0 in 2-D.
    points: Vec<[f64; 3]>,
}

impl FoundMovers {
    /// Writes the points, as doubles where they lie far from zero.
    pub(crate) fn write(&self, path: &Path) -> anyhow::Result<()> {
        const FAR: f64 = 1000.0;
        let far = |v: f64| if v.abs() < FAR { 0.0 } else { v.round() };
        let offset = self.points.first().map_or([0.0; 3], |p| p.map(far));
        let near = |p: &[f64; 3]| std::array::from_fn(|k| (p[k] - offset[k]) as f32);
        let points = self.points.iter().map(near).collect();
        Ok(write_ply_cloud(path, &PointCloudFile { offset, points, ..PointCloudFile::default() })?)
    }

    /// The points, in the order of the scans (world, meters); z is 0 in 2-D.
    pub(crate) fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// What `summary.json` has of them.
    pub(crate) fn to_json(&self) -> Value {
        json!({ "returns": self.points.len(), "scans": self.scans, "cell": self.edge, "open_cells": self.open_cells })
    }

    /// Why nothing could be found, where it could not.
    pub(crate) fn warning(&self) -> Option<String> {
        (self.open_cells == 0).then(|| {
            format!(
                "--movers: no cell of {:.3} m was ever seen open together with its neighbors, so that nothing can be told to have \
                 moved: beams lie too far apart, or its SIGMA is too large",
                self.edge
            )
        })
    }

    /// The same for people; `hits` are the returns that are left.
    pub(crate) fn in_words(&self, hits: u64) -> String {
        let share = 100.0 * self.points.len() as f64 / (self.points.len() as f64 + hits as f64).max(1.0);
        format!(
            "{} returns of {} scans ({share:.2} % of all) are of what moved and are not in the maps: {MOVERS_FILE}",
            self.points.len(),
            self.scans
        )
    }
}
