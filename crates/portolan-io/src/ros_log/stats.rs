//! What was chosen and left out.

use std::collections::BTreeMap;

/// What was found in a bag, chosen and left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagLogStats {
    /// The topics whose messages are the scans.
    pub topics: Vec<String>,
    /// The frames of the sensors.
    pub sensor_frames: Vec<String>,
    /// The frame of the map; empty where a file has the poses.
    pub fixed_frame: String,
    /// Where poses come from, in words.
    pub poses: String,
    /// How the times of points are read, in words; `None`: there are none.
    pub point_times: Option<String>,
    /// What was chosen without being told: a sentence each.
    pub guesses: Vec<String>,
    /// Messages of these topics.
    pub messages: u64,
    /// Scans without a pose at their time, by what is missing (the edge of the tree, or the topic).
    pub without_pose: BTreeMap<String, u64>,
    /// The first of them, with its gap.
    pub first_without_pose: Option<String>,
    /// Messages that could not be used, by cause.
    pub refused: BTreeMap<String, u64>,
    /// The first of them.
    pub first_refused: Option<String>,
    /// 2-D: scans whose plane is not level, though level enough to be used.
    pub tilted: u64,
    /// 2-D: the largest tilt of a scan that was used (radians).
    pub worst_tilt: f64,
    /// What else should be known: notes of the container, of definitions, of the tree.
    pub notes: Vec<String>,
}

/// Causes that are counted apart; beyond, they are counted together.
const MOST_CAUSES: usize = 32;

impl BagLogStats {
    pub(crate) fn refuse(&mut self, cause: &str, first: impl FnOnce() -> String) {
        count(&mut self.refused, cause);
        self.first_refused.get_or_insert_with(first);
    }

    pub(crate) fn no_pose(&mut self, missing: &str, first: impl FnOnce() -> String) {
        count(&mut self.without_pose, missing);
        self.first_without_pose.get_or_insert_with(first);
    }

    /// Scans without a pose.
    pub fn scans_without_pose(&self) -> u64 {
        self.without_pose.values().sum()
    }

    /// Messages that could not be used.
    pub fn refused_messages(&self) -> u64 {
        self.refused.values().sum()
    }
}

fn count(counts: &mut BTreeMap<String, u64>, cause: &str) {
    let cause = if counts.len() < MOST_CAUSES || counts.contains_key(cause) { cause } else { "other" };
    *counts.entry(cause.to_owned()).or_default() += 1;
}
