//! Pictures of a run: every representation of one log, side by side or one by one, in the chapter's colours.

mod drift;
mod ghost;
mod layers;
mod scene;
mod sheet;

pub(crate) use drift::drift;
pub(crate) use ghost::ghost;
pub(crate) use layers::Layer;
pub(crate) use scene::Scene;
pub(crate) use sheet::{figure, sheet, shown_seconds};
