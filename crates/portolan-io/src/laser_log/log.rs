//! A whole log in memory.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use portolan::geom::vector::{along, distance};
use portolan::geom::{Pose, Trajectory};
use portolan::scan::{RangeLimits, Scan};

use super::fans::Fan;
use super::times::{TimeOrder, time_order};
use crate::carmen::CarmenStats;
use crate::ros_log::BagLogStats;
use crate::scan_log::{BEYOND, Fate, Fates, MotionStats, PointClock};
use crate::{IoError, Result};

/// The most readings that a log may hold: half a gigabyte of them.
pub(crate) const MOST_READINGS: usize = 1 << 26;
/// The most scans that a log may hold.
pub(crate) const MOST_SCANS: usize = 1 << 22;

/// A scan of a log, readings as they are in the file.
#[derive(Clone, Copy, Debug)]
pub struct RawLaserScan<'a> {
    /// Pose of the laser at [`RawLaserScan::time`].
    pub world_from_laser: Pose<2>,
    /// Bearings in the laser's frame (radians), one per beam, at even steps: ascending, or descending where the scanner turns
    /// clockwise.
    pub bearings: &'a [f64],
    /// Unit vectors of the bearings.
    pub directions: &'a [[f64; 2]],
    /// Readings (meters if the log keeps to its format), one per beam: not checked, may be NaN or infinite.
    pub readings: &'a [f64],
    /// The stamp (seconds of some clock), if there is one: of the first beam, where `time_increment` is given.
    pub time: Option<f64>,
    /// Beam `i` was measured `i * time_increment` seconds after the first, if the log says so.
    pub time_increment: Option<f64>,
    /// The range that the sensor declares (meters): readings below the first are invalid, those of the second or more are no
    /// echo. `None`: it declares nothing.
    pub declared: Option<[f64; 2]>,
}

impl RawLaserScan<'_> {
    /// The scan with its readings made beams, counter-clockwise: where bearings descend, its beams are in reverse order.
    ///
    /// The range that the sensor declares is believed, within `limits`: a `no_return` there that is finite is the caller's own and
    /// stands instead of the declared maximum.
    pub fn to_scan(&self, limits: &RangeLimits) -> Scan<2> {
        let limits = self.within_declared(limits);
        let scan = if self.is_clockwise() {
            let [bearings, readings] =
                [self.bearings, self.readings].map(|all| all.iter().rev().copied().collect());
            let (bearings, readings): (Vec<f64>, Vec<f64>) = (bearings, readings);
            let directions: Vec<[f64; 2]> = self.directions.iter().rev().copied().collect();
            Scan::from_laser_directions(&bearings, &directions, &readings, &limits)
        } else {
            Scan::from_laser_directions(self.bearings, self.directions, self.readings, &limits)
        };
        match self.time {
            Some(seconds) => scan.at_time(seconds),
            None => scan,
        }
    }

    /// Seconds after [`RawLaserScan::time`] at which each beam was measured, in the order of [`RawLaserScan::to_scan`]; `None` where
    /// the log does not say it.
    pub fn beam_times(&self) -> Option<Vec<f32>> {
        let step = self.time_increment?;
        let beams = self.readings.len();
        let place = |k: usize| if self.is_clockwise() { beams - 1 - k } else { k };
        Some((0..beams).map(|k| (place(k) as f64 * step) as f32).collect())
    }

    fn is_clockwise(&self) -> bool {
        self.bearings.first() > self.bearings.last()
    }

    /// Limits that keep to what the sensor declares.
    fn within_declared(&self, limits: &RangeLimits) -> RangeLimits {
        let Some([least, most]) = self.declared else { return *limits };
        let no_return = if limits.no_return.is_finite() { limits.no_return } else { most };
        // A reading at the declared minimum is valid, one at `RangeLimits::min` is not.
        RangeLimits { min: limits.min.max(least.next_down()), no_return, ..*limits }
    }
}

/// The largest distance between the end or the beginning of a beam before and after (meters).
fn farthest(before: &Scan<2>, after: &Scan<2>) -> f64 {
    let ends = |scan: &Scan<2>, i: usize| along(scan.origin(i), scan.beam(i).direction, scan.beam(i).range);
    let seen = (0..before.len()).filter(|&i| before.beam(i).free_range() > 0.0);
    seen.fold(0.0, |most: f64, i| {
        most.max(distance(before.origin(i), after.origin(i))).max(distance(ends(before, i), ends(after, i)))
    })
}

#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) world_from_laser: Pose<2>,
    pub(crate) first_reading: usize,
    pub(crate) fan: u32,
    pub(crate) time: Option<f64>,
    pub(crate) time_increment: Option<f64>,
    pub(crate) declared: Option<[f64; 2]>,
    /// Its place among [`LaserLog::trajectories`].
    pub(crate) laser: u32,
}

/// What else was found in a log, by its format.
#[derive(Clone, Debug, PartialEq)]
pub enum LaserLogStats {
    /// A CARMEN log.
    Carmen(Box<CarmenStats>),
    /// A bag of ROS.
    Bag(Box<BagLogStats>),
}

/// A log of a planar laser (or several): poses and raw readings, so that limits can be chosen after reading.
///
/// ```
/// use portolan_io::{Input, LaserLog, detect_no_return};
/// use portolan::scan::RangeLimits;
/// # fn main() -> Result<(), portolan_io::IoError> {
/// let text: &[u8] = b"FLASER 3 1.0 2.0 81.83 0 0 0 0 0 0 0.5 host 0.5\n";
/// let log = LaserLog::parse_carmen(Input::from_reader(text, "text".as_ref())?)?;
/// let no_return = detect_no_return(&log).unwrap_or(f64::INFINITY);
/// let limits = RangeLimits { no_return, ..RangeLimits::default() };
/// let (world_from_laser, scan) = log.scans(&limits).next().expect("there is one scan");
/// assert_eq!(scan.hits_world(&world_from_laser).count(), 2);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct LaserLog {
    pub(crate) path: PathBuf,
    pub(crate) entries: Vec<Entry>,
    pub(crate) fans: Vec<Fan>,
    pub(crate) readings: Vec<f64>,
    /// Of each laser; empty where the log says nothing of times within scans.
    pub(crate) trajectories: Vec<Trajectory<2>>,
    /// What became of the motion within scans; `None`: it stays.
    pub(crate) fates: Option<Arc<Fates>>,
    pub(crate) stats: LaserLogStats,
}

impl LaserLog {
    /// The file that the log comes from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of scans, at least one.
    #[allow(clippy::len_without_is_empty)] // a log without scans is an error
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Scan `i` in the order of the file. Panics for an `i` beyond the last.
    pub fn raw(&self, i: usize) -> RawLaserScan<'_> {
        let entry = &self.entries[i];
        let fan = &self.fans[entry.fan as usize];
        RawLaserScan {
            world_from_laser: entry.world_from_laser,
            bearings: &fan.bearings,
            directions: &fan.directions,
            readings: &self.readings[entry.first_reading..][..fan.bearings.len()],
            time: entry.time,
            time_increment: entry.time_increment,
            declared: entry.declared,
        }
    }

    /// All scans in the order of the file, readings as they are.
    pub fn raw_scans(&self) -> impl ExactSizeIterator<Item = RawLaserScan<'_>> + Clone {
        (0..self.len()).map(|i| self.raw(i))
    }

    /// All scans with the poses of the laser, `world_from_laser`.
    pub fn scans<'a>(
        &'a self,
        limits: &'a RangeLimits,
    ) -> impl ExactSizeIterator<Item = (Pose<2>, Scan<2>)> + 'a {
        (0..self.len()).map(|i| (self.raw(i).world_from_laser, self.scan(i, limits)))
    }

    /// The same log with other poses of the laser, one per scan (a pose file beside a raw log).
    ///
    /// # Errors
    /// [`IoError::Unwritable`] where the numbers of poses and scans differ.
    pub fn with_poses(mut self, world_from_laser: &[Pose<2>]) -> Result<Self> {
        if world_from_laser.len() != self.len() {
            let advice = format!("give one pose for each of the {} scans of the log", self.len());
            let value = world_from_laser.len().to_string();
            return Err(IoError::unwritable(&self.path, "the number of external poses", value, advice));
        }
        self.trajectories.clear();
        for (entry, &pose) in self.entries.iter_mut().zip(world_from_laser) {
            entry.world_from_laser = pose;
        }
        Ok(self)
    }

    /// Scan `i` with its readings made beams, without the motion of the laser while it scanned: where the log says when beams were
    /// measured and poses cover them, each points to where it did in the frame of the scan's pose, and begins where the laser
    /// was ([`Scan::deskew`]); [`LaserLog::motion`] says what became of it. Panics for an `i` beyond the last.
    pub fn scan(&self, i: usize, limits: &RangeLimits) -> Scan<2> {
        let raw = self.raw(i);
        let scan = raw.to_scan(limits);
        let (Some(fates), Some(times), Some(taken_at)) = (&self.fates, raw.beam_times(), raw.time) else {
            return scan;
        };
        let mut moved = scan.clone();
        let fate = match self.trajectory(i) {
            None => Fate::NotCovered("the poses have no times".into()),
            Some(track) => {
                match moved.deskew(&times, &raw.world_from_laser, &mut track.motion(BEYOND), taken_at) {
                    Err(why) => Fate::NotCovered(why.to_string()),
                    Ok(()) => Fate::of(farthest(&scan, &moved)),
                }
            }
        };
        let moves = matches!(fate, Fate::Moved(_));
        fates.note(i, fate);
        if moves { moved } else { scan }
    }

    /// The same log with the motion of the laser left within its scans.
    pub fn without_deskew(self) -> Self {
        Self { fates: None, ..self }
    }

    /// What became of the motion within the scans that were read so far; `None` where it is left in.
    pub fn motion(&self) -> Option<MotionStats> {
        Some(self.fates.as_ref()?.stats(Some(PointClock::Stamp)))
    }

    /// The poses of the laser of scan `i` while it scans, on the clock of [`RawLaserScan::time`]; `None` where the log says nothing
    /// of times within a scan.
    pub fn trajectory(&self, i: usize) -> Option<&Trajectory<2>> {
        let entry = self.entries.get(i).filter(|e| e.time_increment.is_some())?;
        self.trajectories.get(entry.laser as usize).filter(|t| !t.is_empty())
    }

    /// What else was found in the log.
    pub fn stats(&self) -> &LaserLogStats {
        &self.stats
    }

    /// The word of its format: `carmen`, `bag`.
    pub fn format(&self) -> &'static str {
        match self.stats {
            LaserLogStats::Carmen(_) => "carmen",
            LaserLogStats::Bag(_) => "bag",
        }
    }

    /// Whether the stamps ascend.
    pub fn times(&self) -> TimeOrder {
        time_order(&self.entries)
    }

    /// The smallest maximum range that scans declare (meters); `None` where none declares one.
    pub fn declared_max_range(&self) -> Option<f64> {
        if let LaserLogStats::Carmen(stats) = &self.stats {
            return stats.declared_max_range;
        }
        self.entries.iter().filter_map(|e| e.declared).map(|d| d[1]).min_by(f64::total_cmp)
    }
}
