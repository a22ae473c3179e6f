//! Bags of ROS as logs: which topics are scans, where their poses are, and what was chosen.
//!
//! A bag has what a robot published, not a log: scans in frames of sensors, and poses as a tree of transforms or as a topic. What
//! is not said by [`BagChoice`] is guessed here, once for 2-D and 3-D, and [`BagLogStats::guesses`] has every guess.
//!
//! | file | decides |
//! |---|---|
//! | `contents` | the kinds of topics; the tree of frames |
//! | `sensors` | which topics are scans of the log, and their dimension |
//! | `pose_source` | poses from the tree, or from a topic with what leads from the body to the sensor |
//! | `lasers` | 2-D: [`LaserLog`](crate::LaserLog) |
//! | `frames` | 3-D: a kind of [`ScanLog`](crate::scan_log::ScanLog) |
//! | `info` | what `info` shows |

mod choice;
mod clouds;
mod contents;
#[cfg(test)]
mod frame_tests;
mod frames;
mod info;
mod lasers;
mod pictures;
mod pose_source;
mod sensors;
mod stats;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use choice::BagChoice;
pub(crate) use contents::{Contents, is_bag};
pub(crate) use frames::open_bag;
pub use info::{BagInfo, EdgeOfBag, TopicOfBag};
pub use sensors::bag_dimension;
pub use stats::BagLogStats;
