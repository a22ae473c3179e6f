//! What a caller may say about a bag.

/// Choices; the default guesses everything and tells it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagChoice {
    /// The topics with scans; empty: one is guessed.
    pub topics: Vec<String>,
    /// A topic with poses instead of the tree of frames.
    pub pose_topic: Option<String>,
    /// The frame of the map; default: `map` where it is above the sensor, else the root of the tree, or the frame of the poses.
    pub fixed_frame: Option<String>,
    /// The frame whose poses the topic has; default: what its messages say, else `base_link` or `base_footprint` where the tree
    /// has it above the sensor, else the sensor itself.
    pub base_frame: Option<String>,
    /// Added to the stamps of scans (seconds), before their poses are looked up; default: 0, but for planar lasers that turn all
    /// the way, say nothing of time within a scan, and are recorded sooner after their stamp than a turn takes: these are stamped
    /// at its end, and it is minus half a turn.
    pub time_offset: Option<f64>,
    /// Use what can be read of a bag that is cut or damaged.
    pub allow_truncated: bool,
}
