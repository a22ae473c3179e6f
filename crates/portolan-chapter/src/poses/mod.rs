//! Where the poses of the lap come from: odometry corrected by scan matching, loop closures and a pose graph.
//!
//! | file | holds |
//! |---|---|
//! | `outline` | a planar scan prepared for matching |
//! | `scan_match` | two scans matched point to line |
//! | `loop_closure` | candidates, closures, the graph, twice |
//! | `pose_error` | poses against true ones |

mod loop_closure;
mod outline;
mod pose_error;
mod scan_match;

pub use loop_closure::{Closure, CorrectedLap, CorrectionSettings, Round, correct};
pub use outline::Outline;
pub use pose_error::{ErrorMeasures, PoseErrors};
pub use scan_match::{MatchRefusal, MatchSettings, ScanMatch, match_scans};
