//! The two experiments of `demo` beside the gallery: a lap that drifts and is corrected, and a chair that moves.

mod drift;
mod forgetting;

pub use drift::{Drift, PoseSet};
pub use forgetting::{Forgetting, shown as shown_half_life};
