//! A radiance field

mod fit;
mod line;
mod model;
mod ray;
mod rng;
mod scene;
pub use fit::*;
pub use line::*;
pub use model::*;
pub use ray::*;
pub use scene::*;
