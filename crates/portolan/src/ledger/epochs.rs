//! The last so-and-so many minutes, exactly.

use super::{Ledger, LedgerError};
use crate::geom::Pose;
use crate::map::ScanKind;
use crate::mapper::MapperSettings;
use crate::scan::ScanStats;
use std::collections::VecDeque;

/// A ledger of the newest scans only. Time is cut into epochs; each is a ledger of its own beside the sum of all, and is taken
/// away as a whole when its end is older than what is kept. So forgetting is exact: what is left is the ledger of the scans
/// that are left, byte for byte.
///
/// Costs: every scan is fused twice, into the sum and into its epoch; memory for the sum and each epoch's own cells.
#[derive(Clone, Debug)]
pub struct Epochs<const D: usize> {
    sum: Ledger<D>,
    /// Start of each epoch (seconds), ascending, and its scans.
    epochs: VecDeque<(f64, Ledger<D>)>,
    seconds: f64,
    kept: f64,
}

impl<const D: usize> Epochs<D> {
    /// Epochs of `seconds` each; scans are kept for `kept` seconds, and up to an epoch longer.
    ///
    /// # Errors
    /// As [`Ledger::new`]. Durations that are not positive are taken for one second.
    pub fn new(settings: MapperSettings<D>, seconds: f64, kept: f64) -> Result<Self, LedgerError> {
        let positive = |v: f64| if v > 0.0 && v.is_finite() { v } else { 1.0 };
        let (seconds, kept) = (positive(seconds), positive(kept));
        Ok(Self { sum: Ledger::new(settings)?, epochs: VecDeque::new(), seconds, kept })
    }

    /// Adds a scan that was taken at `time` (seconds), and forgets the epochs that ended more than the time that is kept
    /// before it.
    ///
    /// # Errors
    /// As [`Ledger::add`]; [`LedgerError::Time`] where the scan is of an epoch before the newest one.
    pub fn add(
        &mut self,
        log: &str,
        index: u64,
        time: f64,
        world_from_sensor: &Pose<D>,
        scan: &(impl ScanKind<D> + Sync),
    ) -> Result<ScanStats, LedgerError> {
        let newest = self.epochs.back().map_or(f64::NEG_INFINITY, |(start, _)| *start);
        let start = (time / self.seconds).floor() * self.seconds;
        if !(start.is_finite() && start >= newest) {
            return Err(LedgerError::Time { time, newest });
        }
        if start > newest {
            self.epochs.push_back((start, Ledger::new(*self.sum.settings())?));
        }
        while let Some((oldest, _)) = self.epochs.front()
            && oldest + self.seconds + self.kept < time
        {
            if let Some((_, epoch)) = self.epochs.pop_front() {
                self.sum.take_out(&epoch)?;
            }
        }
        let stats = self.sum.add(log, index, world_from_sensor, scan)?;
        if let Some((_, epoch)) = self.epochs.back_mut() {
            epoch.add(log, index, world_from_sensor, scan)?;
        }
        Ok(stats)
    }

    /// What is kept.
    pub fn ledger(&self) -> &Ledger<D> {
        &self.sum
    }

    /// Number of epochs that are kept.
    pub fn len(&self) -> usize {
        self.epochs.len()
    }

    /// Whether nothing was added.
    pub fn is_empty(&self) -> bool {
        self.epochs.is_empty()
    }
}
