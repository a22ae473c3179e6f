//! A whole log in memory.

use std::path::{Path, PathBuf};

use portolan::geom::Pose;
use portolan::scan::{RangeLimits, Scan};

use super::stats::CarmenStats;
use crate::{IoError, Result};

/// Bearings that scans share, with their unit vectors.
#[derive(Clone, Debug)]
pub(super) struct Fan {
    pub(super) bearings: Vec<f64>,
    pub(super) directions: Vec<[f64; 2]>,
}

/// A scan of a log, readings as they are in the file.
#[derive(Clone, Copy, Debug)]
pub struct CarmenScan<'a> {
    /// Pose of the laser.
    pub world_from_laser: Pose<2>,
    /// Bearings in the laser's frame (radians, ascending), one per beam.
    pub bearings: &'a [f64],
    /// Unit vectors of the bearings.
    pub directions: &'a [[f64; 2]],
    /// Readings (meters if the log keeps to its format), one per beam: not checked, may be NaN.
    pub readings: &'a [f64],
    /// The stamp (seconds of some clock), if there is one.
    pub time: Option<f64>,
}

impl CarmenScan<'_> {
    /// The scan with its readings made beams.
    pub fn to_scan(&self, limits: &RangeLimits) -> Scan<2> {
        let scan = Scan::from_laser_directions(self.bearings, self.directions, self.readings, limits);
        match self.time {
            Some(seconds) => scan.at_time(seconds),
            None => scan,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) world_from_laser: Pose<2>,
    pub(super) first_reading: usize,
    pub(super) fan: u32,
    pub(super) time: Option<f64>,
}

/// A CARMEN log: poses and raw readings, so that limits can be chosen after reading.
///
/// ```
/// use portolan_io::{CarmenLog, Input, detect_no_return};
/// use portolan::scan::RangeLimits;
/// # fn main() -> Result<(), portolan_io::IoError> {
/// let text: &[u8] = b"FLASER 3 1.0 2.0 81.83 0 0 0 0 0 0 0.5 host 0.5\n";
/// let log = CarmenLog::parse(Input::from_reader(text, "text".as_ref())?)?;
/// let no_return = detect_no_return(&log).unwrap_or(f64::INFINITY);
/// let limits = RangeLimits { no_return, ..RangeLimits::default() };
/// let (world_from_laser, scan) = log.scans(&limits).next().expect("there is one scan");
/// assert_eq!(scan.hits_world(&world_from_laser).count(), 2);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct CarmenLog {
    pub(super) path: PathBuf,
    pub(super) entries: Vec<Entry>,
    pub(super) fans: Vec<Fan>,
    pub(super) readings: Vec<f64>,
    pub(super) stats: CarmenStats,
}

impl CarmenLog {
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
    pub fn raw(&self, i: usize) -> CarmenScan<'_> {
        let entry = &self.entries[i];
        let fan = &self.fans[entry.fan as usize];
        CarmenScan {
            world_from_laser: entry.world_from_laser,
            bearings: &fan.bearings,
            directions: &fan.directions,
            readings: &self.readings[entry.first_reading..][..fan.bearings.len()],
            time: entry.time,
        }
    }

    /// All scans in the order of the file, readings as they are.
    pub fn raw_scans(&self) -> impl ExactSizeIterator<Item = CarmenScan<'_>> + Clone {
        (0..self.len()).map(|i| self.raw(i))
    }

    /// All scans with the poses of the laser, `world_from_laser`.
    pub fn scans<'a>(
        &'a self,
        limits: &'a RangeLimits,
    ) -> impl ExactSizeIterator<Item = (Pose<2>, Scan<2>)> + 'a {
        self.raw_scans().map(|s| (s.world_from_laser, s.to_scan(limits)))
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
        for (entry, &pose) in self.entries.iter_mut().zip(world_from_laser) {
            entry.world_from_laser = pose;
        }
        Ok(self)
    }

    /// What else was found in the log.
    pub fn stats(&self) -> &CarmenStats {
        &self.stats
    }
}
