//! Scans into maps, and what became of them.

use std::collections::BTreeMap;
use std::sync::mpsc::sync_channel;
use std::time::Instant;

use portolan::Mapper;
use portolan::geom::Pose;
use portolan::ledger::LedgerError;
use portolan::map::MapError;
use portolan::mapper::Fused;
use portolan::scan::{BeamCounts, Frame, FrameFilter, Scan, ScanStats};
use portolan_io::IoError;
use portolan_io::scan_log::ScanLog;

use super::agreement::Agreement;
use super::movers::{FoundMovers, Judge, Looking};
use super::{Calibration, OccupancyKinds};
use crate::progress::Progress;
use crate::stop;

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
    /// Of these, scans that could not be read.
    pub(crate) damaged: u64,
    /// Why fusing ended early: the maps hold what was fused up to there.
    pub(crate) full: Option<String>,
    /// Why nothing of this may be saved.
    pub(crate) contradiction: Option<String>,
    /// Scans that were moved, and scans of the log in the map, where scans were to be moved.
    pub(crate) moved: Option<[u64; 2]>,
    /// Whether 3-D scans agree with each other.
    pub(crate) agreement: Agreement,
    /// What moved and is not in the maps, where that was asked for.
    pub(crate) movers: Option<FoundMovers>,
    /// How sure the surface is, or why that is not known; `None` where the maps do not tell.
    pub(crate) sigma: Option<Result<Calibration, String>>,
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

    /// What became of a scan. `false` where a map is full and fusing ends.
    pub(super) fn note<const D: usize>(
        &mut self,
        fused: Result<Fused, LedgerError>,
        log: &str,
        scan: usize,
    ) -> bool {
        match fused {
            Ok(fused) => {
                let stats = self.add::<D>(&fused);
                self.stats += stats;
                true
            }
            Err(error) => self.refuse(&error, log, scan),
        }
    }

    /// The maps did not take a scan; why. `false` where fusing ends: a map is full, or another log has the name of this one.
    fn refuse(&mut self, error: &LedgerError, log: &str, scan: usize) -> bool {
        if let LedgerError::Map(MapError::Full(_)) = error {
            self.full = Some(error.to_string());
            return false;
        }
        if let LedgerError::OtherReadings { .. } = error {
            self.contradiction = Some(error.to_string());
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
        if stop::asked().is_some() {
            break;
        }
        let fused = mapper.integrate_all(batch, &|| start.elapsed().as_secs_f64());
        for (i, (fused, (pose, _))) in fused.into_iter().zip(batch).enumerate() {
            let before = report.stats.scans;
            if !report.note::<2>(fused.map_err(LedgerError::from), log, k * BATCH + i) {
                return report;
            }
            poses.extend((report.stats.scans > before).then_some(pose));
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
    /// Who knows what moved.
    pub(crate) judge: Option<Box<Judge<3>>>,
}

/// A frame: its number, its pose, and what is left of its readings and what the filter counted, where they could be read.
type Read = (usize, Pose<3>, Result<(Frame, BeamCounts), IoError>);

impl Frames<'_> {
    fn read(&self, &i: &usize) -> Read {
        (i, *self.log.pose(i), self.frame(i))
    }

    /// What is left of the readings of a frame, and what the filter counted.
    pub(super) fn frame(&self, i: usize) -> Result<(Frame, BeamCounts), IoError> {
        let (frame, mut counts) = self.log.filtered_frame(i, &self.filter)?;
        let frame = match &self.judge {
            Some(judge) => judge.without_movers(i, self.log.pose(i), frame, &mut counts),
            None => frame,
        };
        Ok((if self.points_only { frame.without_rays() } else { frame }, counts))
    }

    /// Looks for what moved in these frames, so that it is left out of all from now on. Frames that cannot be read are told when
    /// they are fused.
    /// Returns the bytes that this takes from now on.
    pub(super) fn look(&mut self, how: &Looking) -> anyhow::Result<usize> {
        let first = how.indices.first().map_or([0.0; 3], |&i| self.log.pose(i).translation);
        let mut judge = Judge::new(how, first)?;
        for &i in how.indices {
            if let Ok((frame, _)) = self.log.filtered_frame(i, &self.filter) {
                judge.look(self.log.pose(i), &frame)?;
            }
            how.progress.add(1);
        }
        let bytes = judge.memory_bytes();
        self.judge = Some(Box::new(judge));
        Ok(bytes)
    }
}

/// What frames can be fused into.
pub(super) trait TakesFrames {
    /// Fuses a frame of the log.
    fn take(
        &mut self,
        index: usize,
        pose: &Pose<3>,
        frame: &Frame,
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Fused, LedgerError>;

    /// Whether a place was seen free up to now; `None`: not seen.
    fn is_free(&self, p: [f64; 3]) -> Option<bool>;

    /// Edge of a cell (meters).
    fn resolution(&self) -> f64;

    /// Bytes held.
    fn memory_bytes(&self) -> usize;
}

impl TakesFrames for Mapper<3> {
    fn take(
        &mut self,
        _: usize,
        pose: &Pose<3>,
        frame: &Frame,
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Fused, LedgerError> {
        Ok(self.integrate_timed(pose, frame, clock)?)
    }

    fn is_free(&self, p: [f64; 3]) -> Option<bool> {
        let distance = self.tsdf().map(|map| map.signed_distance(p));
        Agreement::is_free(distance, self.occupancy().map(|map| map.probability(p)))
    }

    fn resolution(&self) -> f64 {
        self.settings().resolution
    }

    fn memory_bytes(&self) -> usize {
        Self::memory_bytes(self)
    }
}

/// Fuses these frames of a log, in order, the next being read while one is fused. The result does not depend on the
/// number of threads.
pub(crate) fn fuse_3d(
    maps: &mut impl TakesFrames,
    frames: &Frames,
    poses: &mut Vec<Pose<3>>,
    threads: usize,
    progress: &Progress,
) -> FusionReport {
    let name = frames.log.path().display().to_string();
    let mut read = frames.indices.iter().map(|i| frames.read(i));
    let report = if threads == 1 {
        fuse(maps, read, &name, poses, progress)
    } else {
        std::thread::scope(|scope| {
            let (send, receive) = sync_channel::<Read>(AHEAD);
            // Sending fails where fusing has ended early.
            scope.spawn(move || read.all(|frame| send.send(frame).is_ok()));
            fuse(maps, receive.into_iter(), &name, poses, progress)
        })
    };
    FusionReport { movers: frames.judge.as_ref().map(|judge| judge.found()), ..report }
}

/// The loop. Poses of frames that were fused are added to `poses`.
fn fuse(
    maps: &mut impl TakesFrames,
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
        if stop::asked().is_some() {
            break;
        }
        *report.seconds.entry("frames").or_default() += clock() - waiting;
        let take = |(frame, counts): (Frame, BeamCounts)| {
            report.agreement.look(&pose, &frame, maps.resolution(), |p| maps.is_free(p));
            (maps.take(i, &pose, &frame, &clock), frame, counts)
        };
        match read.map(take) {
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
            Err(error) => {
                report.damaged += 1;
                report.leave_out(error.to_string());
            }
        }
        progress.add(1);
        progress.holding(|| maps.memory_bytes());
        waiting = clock();
    }
    report
}
