//! The ghost of the chair: how long a map believes in what is no longer there, and what forgetting costs.
//!
//! | file | holds |
//! |---|---|
//! | `settings` | the maps, the laps and the chair's place |
//! | `run` | the experiment: laps until the chair's cells are saturated, the move, laps until they have forgotten it |
//! | `watch` | the cells that a moved thing concerns, watched from scan to scan |
//! | `followed` | one such cell from re-observation to re-observation, and what a group of them has in common |
//! | `static_noise` | the price: how noisy a map that forgets is where nothing moves |

mod followed;
mod run;
mod settings;
mod static_noise;
mod watch;

pub use followed::GhostGroup;
pub use run::{Ghost, GhostRun, ghost};
pub use settings::{GhostSettings, chair};
pub use static_noise::{StaticNoise, static_noise};
pub use watch::GhostWatch;
