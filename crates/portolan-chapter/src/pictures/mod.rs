//! Pictures of a run: every representation of one log, side by side or one by one, in the textbook's colors.

mod drift;
mod ghost;
mod layers;
mod scene;
mod sheet;

pub use drift::drift;
pub use ghost::ghost;
pub use layers::Layer;
pub use scene::Scene;
pub use sheet::{figure, sheet};
