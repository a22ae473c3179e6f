//! The representations of one log, and what they were made of.

use portolan_chapter::gallery::{Gallery as Measured, GallerySettings, TreeCrossover};
use portolan_sim::World;
use serde_json::Value;

/// What was built and measured, and of what.
pub(super) struct Built {
    /// Of the map of fusion.
    pub(super) revision: u64,
    pub(super) settings: GallerySettings,
    pub(super) measured: Measured,
    /// Where and of what it is, for people.
    pub(super) of: Value,
    /// Seconds that building and measuring took.
    pub(super) seconds: f64,
    pub(super) truth: Option<World>,
    /// The textbook's node and ours over leaves of each size.
    pub(super) trees: Option<Vec<[TreeCrossover; 2]>>,
}
