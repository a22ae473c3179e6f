//! The motion of the sensor within each scan, taken out where points have times and poses cover them.

use std::collections::BTreeMap;
use std::sync::{Mutex, OnceLock, PoisonError};

use portolan::geom::{Pose, Trajectory};
use portolan::scan::{Frame, Origin, PointScan};

/// How far beyond its poses a trajectory is followed at constant twist (seconds): the last scan of a log lasts longer than the
/// poses do.
pub(crate) const BEYOND: f64 = Trajectory::<3>::LONGEST_GAP;
/// No sensor that moves takes longer for a scan (seconds): what does is a cloud of many scans.
const LONGEST_SCAN: f64 = 2.0;
/// Scans in which nothing moves further than this stay as they are, with their rows and columns (meters).
const STILL: f64 = 1e-3;

/// What the times of points count from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PointClock {
    /// The stamp of their scan: 0 is the moment of the scan's pose. Negative times are before it.
    Stamp,
    /// The clock that the stamps are of.
    Absolute,
    /// A clock of the sensor's own: the earliest point of a scan is taken to be measured at the scan's stamp.
    Own,
}

impl PointClock {
    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Stamp => "relative to the stamp of their scan",
            Self::Absolute => "of the clock of the stamps",
            Self::Own => "of a clock of their own, so that the first point is taken to be at the stamp",
        }
    }

    /// Of the first and the last scan of a log: their stamps, and when their earliest points were measured. `duration` is that of
    /// the last scan (seconds).
    fn of(stamps: [f64; 2], starts: [f64; 2], duration: f64) -> Self {
        let near = |a: f64, b: f64| (a - b).abs() <= duration + 0.1;
        let advance = starts[1] - starts[0];
        // Starts that do not advance with the stamps are not of a clock that goes on.
        if advance.abs() < 0.5 * (stamps[1] - stamps[0]).abs() && near(starts[1], 0.0) {
            Self::Stamp
        } else if near(stamps[1], starts[1]) {
            Self::Absolute
        } else {
            Self::Own
        }
    }
}

/// What became of the motion within the scans that were read so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionStats {
    /// Scans whose points were moved to where they are at the scan's stamp.
    pub deskewed: u64,
    /// Scans with times in which nothing moved by more than a millimeter: they stay as they are.
    pub still: u64,
    /// Scans with times that stay as they are because no poses cover them, and the reason for the first of them.
    pub not_covered: (u64, Option<String>),
    /// The largest distance by which a point was moved (meters).
    pub largest: f64,
    /// What the times count from, where a scan has times and a stamp.
    pub clock: Option<PointClock>,
}

/// What became of the motion within a scan.
#[derive(Clone, Debug)]
pub(crate) enum Fate {
    /// Points were moved, by so much at most (meters).
    Moved(f64),
    /// Nothing moved by more than a millimeter.
    Still,
    /// Why no poses cover it.
    NotCovered(String),
}

impl Fate {
    /// Of a scan in which something moved so far (meters).
    pub(crate) fn of(most: f64) -> Self {
        if most > STILL { Self::Moved(most) } else { Self::Still }
    }
}

/// What became of scans, noted by scan, so that it is the same after any order of reading.
#[derive(Debug, Default)]
pub(crate) struct Fates(Mutex<BTreeMap<usize, Fate>>);

impl Fates {
    pub(crate) fn note(&self, scan: usize, fate: Fate) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(scan, fate);
    }

    pub(crate) fn stats(&self, clock: Option<PointClock>) -> MotionStats {
        let mut stats = MotionStats { clock, ..MotionStats::default() };
        for (i, fate) in self.0.lock().unwrap_or_else(PoisonError::into_inner).iter() {
            match fate {
                Fate::Moved(most) => {
                    stats.deskewed += 1;
                    stats.largest = stats.largest.max(*most);
                }
                Fate::Still => stats.still += 1,
                Fate::NotCovered(why) => {
                    stats.not_covered.0 += 1;
                    stats.not_covered.1.get_or_insert_with(|| format!("scan {i}: {why}"));
                }
            }
        }
        stats
    }
}

/// Takes the motion out of scans of one log.
#[derive(Debug, Default)]
pub(super) struct Deskew {
    trajectory: Option<Trajectory<3>>,
    clock: OnceLock<PointClock>,
    fates: Fates,
}

impl Deskew {
    /// `trajectory`: of the sensor; `None` where poses have no times.
    pub(super) fn new(trajectory: Option<Trajectory<3>>) -> Self {
        Self { trajectory, ..Self::default() }
    }

    /// A frame without the motion of its sensor. `ends` reads what the clock of points is told from: the stamp of the first and the
    /// last scan and their frames.
    pub(super) fn apply(
        &self,
        i: usize,
        frame: Frame,
        (world_from_sensor, stamp): (&Pose<3>, Option<f64>),
        ends: impl FnOnce() -> Option<[(f64, Frame); 2]>,
    ) -> Frame {
        let Frame::Points(scan) = frame else { return frame };
        // Where each point has its own origin, or none, motion was taken out before or cannot be.
        let Some((start, duration)) = span(&scan).filter(|_| matches!(scan.origin, Origin::Common(_))) else {
            return Frame::Points(scan);
        };
        let (fate, scan) = match (&self.trajectory, stamp) {
            _ if duration > LONGEST_SCAN => {
                (Fate::NotCovered(format!("its points are from {duration:.1} s, which is no scan")), scan)
            }
            (None, _) | (_, None) => (Fate::NotCovered("the poses have no times".into()), scan),
            (Some(trajectory), Some(stamp)) => {
                let clock = *self.clock.get_or_init(|| clock_of(ends(), (stamp, start), duration));
                let taken_at = match clock {
                    PointClock::Stamp => stamp + scan.start_time,
                    PointClock::Absolute => scan.start_time,
                    PointClock::Own => stamp - (start - scan.start_time),
                };
                let mut moved = scan.clone();
                match moved.deskew(world_from_sensor, &mut trajectory.motion(BEYOND), taken_at) {
                    Ok(()) => match Fate::of(farthest(&scan, &moved)) {
                        fate @ Fate::Moved(_) => (fate, moved),
                        fate => (fate, scan),
                    },
                    Err(why) => (Fate::NotCovered(why.to_string()), scan),
                }
            }
        };
        self.fates.note(i, fate);
        Frame::Points(scan)
    }

    pub(super) fn stats(&self) -> MotionStats {
        self.fates.stats(self.clock.get().copied())
    }
}

/// When the earliest reading of a scan was taken, in the clock of its points, and how long the scan lasted (seconds); `None`
/// without times.
fn span(scan: &PointScan) -> Option<(f64, f64)> {
    let (first, last) =
        scan.times.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
    (first <= last).then(|| (scan.start_time + f64::from(first), f64::from(last) - f64::from(first)))
}

/// Where the ends of the log cannot be read, from this scan alone: its stamp and its start.
fn clock_of(ends: Option<[(f64, Frame); 2]>, one: (f64, f64), duration: f64) -> PointClock {
    let start = |frame: &Frame| match frame {
        Frame::Points(scan) => span(scan),
        Frame::Image(_) => None,
    };
    let both = ends.and_then(|[(a, first), (b, last)]| {
        let ((from, _), (to, duration)) = start(&first).zip(start(&last))?;
        Some(PointClock::of([a, b], [from, to], duration))
    });
    let alone = if one.1.abs() <= duration + 0.1 { PointClock::Stamp } else { PointClock::Own };
    both.unwrap_or(alone)
}

/// The largest distance between a point or an origin before and after (meters).
fn farthest(before: &PointScan, after: &PointScan) -> f64 {
    let far = |a: [f64; 3], b: [f64; 3]| portolan::geom::vector::distance(a, b);
    let ends = |scan: &PointScan, i: usize| {
        let points = scan.points.len();
        if i < points { scan.points[i] } else { scan.free_ends[i - points] }.map(f64::from)
    };
    let count = before.points.len() + before.free_ends.len();
    (0..count).fold(0.0, |most: f64, i| {
        let origins = before.origin_of(i).zip(after.origin_of(i)).map_or(0.0, |(a, b)| far(a, b));
        most.max(origins).max(far(ends(before, i), ends(after, i)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(time: f64) -> Pose<3> {
        Pose { translation: [2.0 * time, 0.0, 0.0], ..Pose::IDENTITY }
    }

    fn scan(start_time: f64, times: &[f32]) -> Frame {
        let points = (0..times.len()).map(|i| [5.0, i as f32, 0.0]);
        let mut scan = PointScan::new(points, [0.0; 3]);
        (scan.start_time, scan.times) = (start_time, times.to_vec());
        Frame::Points(scan)
    }

    /// The x of the points of scan 5 at 100.5 s, of a sensor that drives at 2 m/s; starts are those of the scans 0 and 9.
    fn deskewed(starts: [f64; 3], times: &[f32]) -> (Vec<f32>, MotionStats) {
        let poses = (0..10).map(|k| (100.0 + 0.1 * f64::from(k), at(100.0 + 0.1 * f64::from(k))));
        let deskew = Deskew::new(Some(Trajectory::new(poses).unwrap()));
        let ends = || Some([(100.0, scan(starts[0], times)), (100.9, scan(starts[2], times))]);
        let moved = deskew.apply(5, scan(starts[1], times), (&at(100.5), Some(100.5)), ends);
        let Frame::Points(moved) = moved else { panic!("points stay points") };
        let x = moved.points.iter().map(|p| (p[0] * 1e3).round() / 1e3).collect();
        (x, deskew.stats())
    }

    #[test]
    fn the_clock_of_points_is_told_from_the_ends_of_the_log() {
        let times = [0.0, 0.05, 0.1];
        let forth = vec![5.0, 5.1, 5.2];
        for (starts, expected, clock) in [
            ([0.0, 0.0, 0.0], forth.clone(), PointClock::Stamp),
            ([-0.1, -0.1, -0.1], vec![4.8, 4.9, 5.0], PointClock::Stamp),
            // The scan began 30 ms before its stamp.
            ([99.97, 100.47, 100.87], vec![4.94, 5.04, 5.14], PointClock::Absolute),
            ([7.0, 7.5, 7.9], forth.clone(), PointClock::Own),
        ] {
            let (x, stats) = deskewed(starts, &times);
            assert_eq!((x, stats.clock), (expected, Some(clock)), "{starts:?}");
            assert_eq!((stats.deskewed, stats.not_covered.0), (1, 0));
            assert!((0.1..0.21).contains(&stats.largest), "{stats:?}");
        }
        // A log that begins with its clock: the first stamps are as near to zero as relative times are.
        assert_eq!(PointClock::of([0.0, 0.9], [0.0, 0.9], 0.1), PointClock::Absolute);
        assert_eq!(PointClock::of([0.0, 0.1], [0.0, 0.0], 0.1), PointClock::Stamp);
        assert_eq!(PointClock::of([0.0, 0.1], [0.0, 0.1], 0.1), PointClock::Absolute);
    }

    #[test]
    fn what_cannot_be_taken_out_is_left_and_told() {
        let (x, stats) = deskewed([0.0; 3], &[0.0, 1.5]);
        assert_eq!(x, [5.0, 5.0]);
        let why = stats.not_covered.1.unwrap();
        assert!(stats.not_covered.0 == 1 && why.starts_with("scan 5: it is 1.1"), "{why}");
        let (x, stats) = deskewed([0.0; 3], &[0.0, 90.0]);
        assert_eq!((x, stats.not_covered.0), (vec![5.0, 5.0], 1));
        let timeless = Deskew::new(None);
        let frame = timeless.apply(0, scan(0.0, &[0.0, 0.1]), (&at(0.0), None), || None);
        assert_eq!(frame, scan(0.0, &[0.0, 0.1]));
        assert_eq!(timeless.stats().not_covered.1.unwrap(), "scan 0: the poses have no times");
    }

    #[test]
    fn a_sensor_that_stands_keeps_its_scans() {
        let poses = (0..10).map(|k| (0.1 * f64::from(k), at(0.0)));
        let deskew = Deskew::new(Some(Trajectory::new(poses).unwrap()));
        let still = scan(0.0, &[0.0, 0.1]);
        let frame = deskew.apply(3, still.clone(), (&at(0.0), Some(0.3)), || None);
        assert_eq!((frame, deskew.stats().still), (still, 1));
        let Frame::Points(bare) = deskew.apply(4, scan(0.0, &[]), (&at(0.0), Some(0.4)), || None) else {
            panic!()
        };
        assert_eq!((bare.origin, deskew.stats().still), (Origin::Common([0.0; 3]), 1), "no times, no note");
    }
}
