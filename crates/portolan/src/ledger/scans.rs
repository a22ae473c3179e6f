//! The list of scans in a ledger.

use super::LedgerError;
use crate::geom::Pose;
use std::collections::BTreeMap;

/// A scan that was fused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanRecord<const D: usize> {
    /// The pose that it was fused at.
    pub world_from_sensor: Pose<D>,
    /// Tells its readings from others ([`Fingerprint`](crate::scan::Fingerprint)).
    pub fingerprint: u64,
}

/// The scans of a ledger: by the name of their log, then by their number in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LedgerScans<const D: usize>(BTreeMap<String, BTreeMap<u64, ScanRecord<D>>>);

impl<const D: usize> LedgerScans<D> {
    /// Number of scans.
    pub fn len(&self) -> usize {
        self.0.values().map(BTreeMap::len).sum()
    }

    /// Whether there is no scan.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The names of the logs, ascending.
    pub fn logs(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// A scan; `None`: it is not in the ledger.
    pub fn get(&self, log: &str, index: u64) -> Option<&ScanRecord<D>> {
        self.0.get(log)?.get(&index)
    }

    /// Number of scans that have the readings of a scan of another log at the same pose: a log that was copied counts twice,
    /// and only its name tells it from another one. O(n log n).
    pub fn copies(&self) -> usize {
        let mut all: Vec<(u64, &Pose<D>, &str)> =
            self.iter().map(|(log, _, r)| (r.fingerprint, &r.world_from_sensor, log)).collect();
        all.sort_by_key(|(fingerprint, ..)| *fingerprint);
        let same =
            |a: &(u64, &Pose<D>, &str), b: &(u64, &Pose<D>, &str)| a.0 == b.0 && a.1 == b.1 && a.2 != b.2;
        let of_one =
            |alike: &[(u64, &Pose<D>, &str)]| alike[1..].iter().filter(|s| same(&alike[0], s)).count();
        all.chunk_by(|a, b| a.0 == b.0).map(of_one).sum()
    }

    /// All scans: log, number, record; ascending.
    pub fn iter(&self) -> impl Iterator<Item = (&str, u64, &ScanRecord<D>)> {
        self.0.iter().flat_map(|(log, scans)| scans.iter().map(move |(i, scan)| (log.as_str(), *i, scan)))
    }

    /// Adds a scan; `false`: it is there already, and stays as it is.
    pub fn insert(&mut self, log: &str, index: u64, record: ScanRecord<D>) -> bool {
        let scans = match self.0.get_mut(log) {
            Some(scans) => scans,
            None => self.0.entry(log.to_owned()).or_default(),
        };
        let new = !scans.contains_key(&index);
        if new {
            scans.insert(index, record);
        }
        new
    }

    /// Adds the scans of another list.
    ///
    /// # Errors
    /// Where a scan is in both; nothing is added then.
    pub fn merge(&mut self, other: &Self) -> Result<(), LedgerError> {
        for (log, index, record) in other.iter() {
            if self.get(log, index).is_some() {
                self.held(log, index, record.fingerprint)?;
                return Err(LedgerError::Twice { log: log.to_owned(), index });
            }
        }
        for (log, index, record) in other.iter() {
            self.insert(log, index, *record);
        }
        Ok(())
    }

    /// Takes the scans of another list out.
    ///
    /// # Errors
    /// Where one is not in this list, or with other readings, or at another pose; nothing is taken out then.
    pub fn take_out(&mut self, other: &Self) -> Result<(), LedgerError> {
        for (log, index, record) in other.iter() {
            let held = self.held(log, index, record.fingerprint)?;
            if held.world_from_sensor != record.world_from_sensor {
                return Err(LedgerError::OtherPose { log: log.to_owned(), index });
            }
        }
        for (log, index, _) in other.iter() {
            self.remove(log, index);
        }
        Ok(())
    }

    pub(super) fn remove(&mut self, log: &str, index: u64) {
        if let Some(scans) = self.0.get_mut(log) {
            scans.remove(&index);
            if scans.is_empty() {
                self.0.remove(log);
            }
        }
    }

    /// The record of a scan that must be there, with these readings.
    pub(super) fn held(&self, log: &str, index: u64, fingerprint: u64) -> Result<ScanRecord<D>, LedgerError> {
        match self.get(log, index) {
            None => Err(LedgerError::NotHeld { log: log.to_owned(), index }),
            Some(record) if record.fingerprint != fingerprint => {
                Err(LedgerError::OtherReadings { log: log.to_owned(), index })
            }
            Some(record) => Ok(*record),
        }
    }
}
