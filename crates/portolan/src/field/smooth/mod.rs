//! Interpolation whose gradient does not jump, and many points at once.

mod batch;
mod cubic;
mod neighbourhood;

pub use batch::{FieldSlots, Interpolation};
pub use cubic::Smooth;
