//! Why a ledger refuses something.

use crate::map::MapError;

/// Why a ledger refuses something. It is then as before.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LedgerError {
    /// A map cannot be made, or cannot take a scan.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The scan was fused before.
    #[error("scan {index} of {log} is in the map already")]
    Twice {
        /// The log.
        log: String,
        /// Which scan of it.
        index: u64,
    },
    /// The scan was never fused, or was taken away.
    #[error("scan {index} of {log} is not in the map")]
    NotHeld {
        /// The log.
        log: String,
        /// Which scan of it.
        index: u64,
    },
    /// Its readings are not those that were fused under this name.
    #[error("scan {index} of {log} has other readings than the scan that was fused under this name")]
    OtherReadings {
        /// The log.
        log: String,
        /// Which scan of it.
        index: u64,
    },
    /// It was fused at another pose.
    #[error("scan {index} of {log} was fused at another pose")]
    OtherPose {
        /// The log.
        log: String,
        /// Which scan of it.
        index: u64,
    },
    /// The pose is not rigid, or has no cell.
    #[error("the pose of scan {index} of {log} is not rigid, or too far from the map's origin")]
    Pose {
        /// The log.
        log: String,
        /// Which scan of it.
        index: u64,
    },
    /// Two ledgers do not fit together.
    #[error("the two maps have not the same {what}: {ours} and {theirs}")]
    Different {
        /// In what they differ.
        what: &'static str,
        /// What it is here.
        ours: String,
        /// What it is there.
        theirs: String,
    },
    /// Sums would become such as no observations have, or too large.
    #[error("in block {block:?} the map does not hold what is to be taken away, or would pass 2^62")]
    Sums {
        /// The first such block (its first cell's index, divided by 8).
        block: Vec<i32>,
    },
    /// The time is not finite, or lies before the newest epoch.
    #[error(
        "a scan of {time} s does not come after those of {newest} s: epochs take scans in the order of time"
    )]
    Time {
        /// Of the scan (seconds).
        time: f64,
        /// Start of the newest epoch (seconds).
        newest: f64,
    },
    /// A setting that sums cannot have.
    #[error("a map of sums has no {0}")]
    Without(&'static str),
    /// The first scan is a million cells from zero, and no origin was given.
    #[error(
        "the sensor is {meters:.0} m from zero, a million cells and more: give the origin of the cells, the same one for every part of the map"
    )]
    Far {
        /// The largest coordinate (meters).
        meters: f64,
    },
}
