//! Scans into maps, and what became of them.

use std::collections::BTreeMap;
use std::sync::mpsc::sync_channel;
use std::time::Instant;

use portolan::Mapper;
use portolan::geom::Pose;
use portolan::map::MapError;
use portolan::mapper::Fused;
use portolan::scan::{BeamCounts, Frame, FrameFilter, Scan, ScanStats};
use portolan_io::IoError;
use portolan_io::scan_log::ScanLog;

use super::OccupancyKinds;
use crate::progress::Progress;

/// Frames that are read ahead.
const AHEAD: usize = 3;
/// 2-D scans that each map goes through by itself: enough that threads seldom wait for each other.
const BATCH: usize = 64;

/// What fusing did.
#[derive(Debug, Default)]
pub(crate) struct FusionReport {
    /// Of the map that comes last: scans and beams are the same for all.
    pub(crate) stats: ScanStats,
    /// Seconds per map, and of waiting for scans ("frames").
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    /// Cell observations per map.
    pub(crate) observations: BTreeMap<&'static str, u64>,
    /// Points that the last map could not use, since they have no row and column of their own in their scan.
    pub(crate) without_pixel: u64,
    /// Scans that could not be read or fused, and why the first could not.
    pub(crate) unreadable: (u64, Option<String>),
    /// Why fusing ended early: the maps hold what was fused up to there.
    pub(crate) full: Option<String>,
}

impl FusionReport {
    /// The maps have taken a scan, taken at this pose: notes what each did. The counts of the map that comes last.
    fn add<const D: usize>(&mut self, fused: &Fused) -> ScanStats {
        let occupancy = if D == 2 { "grid" } else { "tree" };
        let maps =
            [(occupancy, fused.occupancy), ("tsdf", fused.distances), ("attenuation", fused.attenuation)];
        for ((name, stats), seconds) in maps.into_iter().zip(fused.seconds) {
            if let Some(stats) = stats {
                *self.seconds.entry(name).or_default() += seconds;
                *self.observations.entry(name).or_default() += stats.cells;
            }
        }
        fused.stats()
    }

    /// The maps did not take a scan; why. `false` where a map is full and fusing ends.
    fn refuse(&mut self, error: &MapError, log: &str, scan: usize) -> bool {
        if let MapError::Full(_) = error {
            self.full = Some(error.to_string());
            return false;
        }
        self.leave_out(format!("{log}: scan {scan}: {error}"));
        true
    }

    /// Grid and tree of a 2-D run are made of one map: both have had its observations.
    pub(crate) fn name_occupancy(&mut self, kinds: OccupancyKinds) {
        let Some(&cells) = self.observations.get("grid") else { return };
        if kinds.tree {
            self.observations.insert("tree", cells);
        }
        if !kinds.grid {
            self.observations.remove("grid");
            let seconds = self.seconds.remove("grid");
            self.seconds.extend(seconds.map(|seconds| ("tree", seconds)));
        }
    }

    fn leave_out(&mut self, why: String) {
        self.unreadable.0 += 1;
        self.unreadable.1.get_or_insert(why);
    }
}

/// Fuses 2-D scans, in order. The result does not depend on the number of threads.
pub(crate) fn fuse_2d(
    mapper: &mut Mapper<2>,
    scans: &[(Pose<2>, Scan<2>)],
    log: &str,
    poses: &mut Vec<Pose<2>>,
    progress: &Progress,
) -> FusionReport {
    let mut report = FusionReport::default();
    let start = Instant::now();
    for (k, batch) in scans.chunks(BATCH).enumerate() {
        let fused = mapper.integrate_all(batch, &|| start.elapsed().as_secs_f64());
        for (i, (fused, (pose, _))) in fused.into_iter().zip(batch).enumerate() {
            match fused {
                Ok(fused) => {
                    let stats = report.add::<2>(&fused);
                    poses.extend((stats.scans > 0).then_some(pose));
                    report.stats += stats;
                }
                Err(error) if report.refuse(&error, log, k * BATCH + i) => {}
                Err(_) => return report,
            }
            progress.add(1);
        }
        progress.holding(|| mapper.memory_bytes());
    }
    report
}

/// Frames of a 3-D log.
pub(crate) struct Frames<'a> {
    pub(crate) log: &'a ScanLog,
    pub(crate) indices: &'a [usize],
    pub(crate) filter: FrameFilter,
    /// Whether points are inserted without their rays.
    pub(crate) points_only: bool,
}

/// A frame: its number, its pose, and what is left of its readings and what the filter counted, where they could be read.
type Read = (usize, Pose<3>, Result<(Frame, BeamCounts), IoError>);

impl Frames<'_> {
    fn read(&self, &i: &usize) -> Read {
        let filtered = |(frame, counts): (Frame, BeamCounts)| {
            (if self.points_only { frame.without_rays() } else { frame }, counts)
        };
        (i, *self.log.pose(i), self.log.filtered_frame(i, &self.filter).map(filtered))
    }
}

/// Fuses these frames of a log, in order, the next being read while one is fused. The result does not depend on the
/// number of threads.
pub(crate) fn fuse_3d(
    mapper: &mut Mapper<3>,
    frames: &Frames,
    poses: &mut Vec<Pose<3>>,
    threads: usize,
    progress: &Progress,
) -> FusionReport {
    let name = frames.log.path().display().to_string();
    let mut read = frames.indices.iter().map(|i| frames.read(i));
    if threads == 1 {
        return fuse(mapper, read, &name, poses, progress);
    }
    std::thread::scope(|scope| {
        let (send, receive) = sync_channel::<Read>(AHEAD);
        // Sending fails where fusing has ended early.
        scope.spawn(move || read.all(|frame| send.send(frame).is_ok()));
        fuse(mapper, receive.into_iter(), &name, poses, progress)
    })
}

/// The loop. Poses of frames that were fused are added to `poses`.
fn fuse(
    mapper: &mut Mapper<3>,
    frames: impl Iterator<Item = Read>,
    log: &str,
    poses: &mut Vec<Pose<3>>,
    progress: &Progress,
) -> FusionReport {
    let mut report = FusionReport::default();
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let mut waiting = clock();
    for (i, pose, read) in frames {
        *report.seconds.entry("frames").or_default() += clock() - waiting;
        match read.map(|(frame, counts)| (mapper.integrate_timed(&pose, &frame, &clock), frame, counts)) {
            Ok((Ok(fused), frame, counts)) => {
                let stats = report.add::<3>(&fused);
                // Points that share a row and column with a nearer one, or lie outside of all.
                if matches!(&frame, Frame::Points(scan) if scan.image.is_none()) {
                    report.without_pixel += stats.beams.dropped.saturating_sub(counts.dropped);
                }
                poses.extend((stats.scans > 0).then_some(pose));
                // What the filter left out does not reach the maps.
                report.stats += ScanStats { beams: counts, ..stats };
            }
            Ok((Err(error), ..)) if report.refuse(&error, log, i) => {}
            Ok((Err(_), ..)) => break,
            Err(error) => report.leave_out(error.to_string()),
        }
        progress.add(1);
        progress.holding(|| mapper.memory_bytes());
        waiting = clock();
    }
    report
}
