//! Frames into maps, the next frame being read while one is fused.

use std::collections::BTreeMap;
use std::sync::mpsc::sync_channel;
use std::time::Instant;

use portolan::geom::Pose;
use portolan::map::MapError;
use portolan::scan::{BeamCounts, Frame, FrameFilter, ScanStats};
use portolan_io::IoError;
use portolan_io::scan_log::ScanLog;

use super::SpaceMaps;
use crate::progress::Progress;

/// Frames that are read ahead.
const AHEAD: usize = 3;

/// What fusing did.
#[derive(Debug, Default)]
pub(crate) struct Fusion {
    /// Of the map that comes last: scans and beams are the same for all.
    pub(crate) stats: ScanStats,
    /// Seconds per map, and of waiting for frames.
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    /// Cell observations per map.
    pub(crate) observations: BTreeMap<&'static str, u64>,
    /// Points that the last map could not use, since no row and column of their scan was theirs.
    pub(crate) without_pixel: u64,
    /// Poses of the frames that were fused, in order.
    pub(crate) poses: Vec<Pose<3>>,
    /// Frames that could not be read or fused, and why the first could not.
    pub(crate) unreadable: (u64, Option<String>),
    /// Why fusing ended early: the maps hold what was fused up to there.
    pub(crate) full: Option<String>,
}

impl Fusion {
    fn leave_out(&mut self, why: String) {
        self.unreadable.0 += 1;
        self.unreadable.1.get_or_insert(why);
    }

    /// A map has taken a frame since `start`.
    pub(super) fn add(&mut self, map: &'static str, start: Instant, stats: &ScanStats) {
        *self.seconds.entry(map).or_default() += start.elapsed().as_secs_f64();
        *self.observations.entry(map).or_default() += stats.cells;
    }
}

type Read = (usize, Result<(Frame, BeamCounts), IoError>);

/// Fuses these frames of the log, in order, into maps that may take `memory` bytes together. The result does not depend
/// on the number of threads.
pub(crate) fn fuse(
    maps: &mut SpaceMaps,
    log: &ScanLog,
    indices: &[usize],
    filter: &FrameFilter,
    (memory, threads): (usize, usize),
    progress: &Progress,
) -> Fusion {
    let mut report = Fusion::default();
    let read = |i: usize| (i, log.frame(i).map(|frame| filter.apply(frame)));
    if threads == 1 {
        fuse_all(maps, log, indices.iter().map(|&i| read(i)), memory, &mut report, progress);
        return report;
    }
    std::thread::scope(|scope| {
        let (send, receive) = sync_channel::<Read>(AHEAD);
        scope.spawn(move || {
            for &i in indices {
                // Nobody receives any more where fusing has ended early.
                if send.send(read(i)).is_err() {
                    break;
                }
            }
        });
        fuse_all(maps, log, receive.into_iter(), memory, &mut report, progress);
    });
    report
}

fn fuse_all(
    maps: &mut SpaceMaps,
    log: &ScanLog,
    frames: impl Iterator<Item = Read>,
    memory: usize,
    report: &mut Fusion,
    progress: &Progress,
) {
    let mut waiting = Instant::now();
    for (i, read) in frames {
        *report.seconds.entry("frames").or_default() += waiting.elapsed().as_secs_f64();
        match read {
            Ok((frame, counts)) => match maps.integrate(log.pose(i), &frame, memory, report) {
                Ok(mut stats) => {
                    // Points that share a row and column with a nearer one, or have none.
                    if matches!(&frame, Frame::Points(scan) if scan.image.is_none()) {
                        report.without_pixel += stats.beams.dropped.saturating_sub(counts.dropped);
                    }
                    // Nothing but the filter knows what it left out.
                    stats.beams = counts;
                    if stats.scans > 0 {
                        report.poses.push(*log.pose(i));
                    }
                    report.stats += stats;
                }
                Err(full @ MapError::Full(_)) => {
                    report.full = Some(full.to_string());
                    return;
                }
                Err(error) => report.leave_out(format!("{}: scan {i}: {error}", log.path().display())),
            },
            Err(error) => report.leave_out(error.to_string()),
        }
        progress.add(1);
        progress.holding(maps.total());
        waiting = Instant::now();
    }
}
