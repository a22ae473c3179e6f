//! Scans into maps: one loop for both dimensions.

use std::borrow::Borrow;
use std::collections::BTreeMap;
use std::sync::mpsc::sync_channel;
use std::time::Instant;

use portolan::Mapper;
use portolan::geom::Pose;
use portolan::map::{MapError, ScanKind};
use portolan::mapper::Fused;
use portolan::scan::{BeamCounts, Frame, FrameFilter, Scan, ScanStats};
use portolan_io::IoError;
use portolan_io::scan_log::ScanLog;

use super::{MapKind, Settings};
use crate::progress::Progress;

/// Frames that are read ahead.
const AHEAD: usize = 3;

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
    /// The maps have taken a scan: notes what each did. Gives the counts of the map that comes last.
    fn add<const D: usize>(&mut self, fused: &Fused, scan: &impl LogScan<D>) -> ScanStats {
        let occupancy = if D == 2 { "grid" } else { "tree" };
        let maps = [(occupancy, fused.occupancy), ("tsdf", fused.distances)];
        for ((name, stats), seconds) in maps.into_iter().zip(fused.seconds) {
            if let Some(stats) = stats {
                *self.seconds.entry(name).or_default() += seconds;
                *self.observations.entry(name).or_default() += stats.cells;
            }
        }
        let last = fused.stats();
        let Some(counts) = scan.counts() else { return last };
        // Points that share a row and column with a nearer one, or lie outside of all.
        if scan.has_loose_points() {
            self.without_pixel += last.beams.dropped.saturating_sub(counts.dropped);
        }
        // What the filter left out does not reach the maps.
        ScanStats { beams: *counts, ..last }
    }

    /// Grid and tree of a 2-D run are made of one map: both have had its observations.
    pub(crate) fn name_occupancy(&mut self, settings: &Settings) {
        let Some(&cells) = self.observations.get("grid") else { return };
        if settings.wants(MapKind::Tree) {
            self.observations.insert("tree", cells);
        }
        if !settings.wants(MapKind::Grid) {
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

/// A scan of a log: its number, its pose, and its readings, where they could be read.
type Read<const D: usize, S> = (usize, Pose<D>, Result<S, IoError>);

/// A scan of a log, and what a filter counted of it before the maps see it.
trait LogScan<const D: usize> {
    type Kind: ScanKind<D> + Sync;

    fn scan(&self) -> &Self::Kind;

    fn counts(&self) -> Option<&BeamCounts>;

    /// Whether points have lost rows and columns on the way into the maps.
    fn has_loose_points(&self) -> bool;
}

impl LogScan<2> for Scan<2> {
    type Kind = Self;

    fn scan(&self) -> &Self {
        self
    }

    fn counts(&self) -> Option<&BeamCounts> {
        None
    }

    fn has_loose_points(&self) -> bool {
        false
    }
}

/// A frame of a log and what its filter counted.
struct Filtered {
    frame: Frame,
    counts: BeamCounts,
}

impl LogScan<3> for Filtered {
    type Kind = Frame;

    fn scan(&self) -> &Frame {
        &self.frame
    }

    fn counts(&self) -> Option<&BeamCounts> {
        Some(&self.counts)
    }

    fn has_loose_points(&self) -> bool {
        matches!(&self.frame, Frame::Points(scan) if scan.image.is_none())
    }
}

/// Fuses 2-D scans, in order. The result does not depend on the number of threads.
pub(crate) fn fuse_2d(
    mapper: &mut Mapper<2>,
    scans: &[(Pose<2>, Scan<2>)],
    poses: &mut Vec<Pose<2>>,
    progress: &Progress,
) -> FusionReport {
    let scans = scans.iter().enumerate().map(|(i, (pose, scan))| (i, *pose, Ok(scan)));
    // On a worker thread: from there the maps of a scan are shared out to the others without a detour.
    rayon::scope(|_| fuse::<2, Scan<2>, _>(mapper, scans, "", poses, progress))
}

/// Frames of a 3-D log.
pub(crate) struct Frames<'a> {
    pub(crate) log: &'a ScanLog,
    pub(crate) indices: &'a [usize],
    pub(crate) filter: FrameFilter,
}

impl Frames<'_> {
    fn read(&self, &i: &usize) -> Read<3, Filtered> {
        let filtered = self.log.frame(i).map(|frame| {
            let (frame, counts) = self.filter.apply(frame);
            Filtered { frame, counts }
        });
        (i, *self.log.pose(i), filtered)
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
        let (send, receive) = sync_channel::<Read<3, Filtered>>(AHEAD);
        // Sending fails where fusing has ended early.
        scope.spawn(move || read.try_for_each(|frame| send.send(frame)));
        fuse(mapper, receive.into_iter(), &name, poses, progress)
    })
}

/// The loop. Poses of scans that were fused are added to `poses`.
fn fuse<const D: usize, L: LogScan<D>, S: Borrow<L>>(
    mapper: &mut Mapper<D>,
    scans: impl Iterator<Item = Read<D, S>>,
    log: &str,
    poses: &mut Vec<Pose<D>>,
    progress: &Progress,
) -> FusionReport {
    let mut report = FusionReport::default();
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let mut waiting = clock();
    for (i, pose, scan) in scans {
        *report.seconds.entry("frames").or_default() += clock() - waiting;
        let fused = scan.map(|scan| {
            let scan: &L = scan.borrow();
            let fused = mapper.integrate_timed(&pose, scan.scan(), &clock)?;
            Ok(report.add(&fused, scan))
        });
        match fused {
            Ok(Ok(stats)) => {
                if stats.scans > 0 {
                    poses.push(pose);
                }
                report.stats += stats;
            }
            Ok(Err(full @ MapError::Full(_))) => {
                report.full = Some(full.to_string());
                break;
            }
            Ok(Err(error)) => report.leave_out(format!("{log}: scan {i}: {error}")),
            Err(error) => report.leave_out(error.to_string()),
        }
        progress.add(1);
        progress.holding(|| mapper.memory_bytes());
        waiting = clock();
    }
    report
}
