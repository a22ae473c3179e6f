//! Places of the sections on drift and on moved things. `None`: the run has nothing to say about it.

use super::{Facts, Section};

/// Odometry, loop closures, pose graph: pose error before and after, and what the map loses against true poses.
pub(super) fn pose_graph(_: &Facts) -> Option<Section> {
    None
}

/// The ghost of the chair: half-lives measured and predicted for each W_max, and their price in noise.
pub(super) fn ghost(_: &Facts) -> Option<Section> {
    None
}
