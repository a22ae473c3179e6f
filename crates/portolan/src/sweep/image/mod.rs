//! Range images: where points fall in them, and which cells they observe.
//!
//! | step | for distances | for misses |
//! |---|---|---|
//! | the image fits together | [`crate::scan::RangeImage::check`] | the same |
//! | its projection | `projector`, `rings`, and `project` (`lanes` of 64 points) | the same, and `pixels`, `sine_rows` (in `steps`) |
//! | readings made ready | `padded_image`: cleaned, torn where surfaces end | `window_minima`: the nearest within any window |
//! | nearest and farthest reading that a cube of cells may fall on | `window` of its box, in `range_pyramid` | `balls` around it, in `window_readings` |
//! | cubes of cells against them | `depth_bounds` | `placed_image` |
//! | blocks that are observed, by such cubes | `search` | `search` |
//! | their cells | `observe`: interpolated at centers | `placed_image`: the nearest within a cell's width |
//! | the sweep, which makes these steps | `distances` | `misses` |
//!
//! Distances need the smallest and the largest value of few windows, of any size: a pyramid costs a third of the image.
//! Misses need the same for cubes, and the smallest one around *every* cell: tables over all places of a few sizes answer that by one read.

mod balls;
mod bands;
mod depth_bounds;
mod distances;
mod lanes;
mod lengths;
mod misses;
mod observe;
mod padded_image;
mod pixels;
mod placed_image;
mod project;
mod projector;
mod range_pyramid;
mod rings;
mod search;
mod sheet;
mod sine_rows;
mod steps;
mod window;
mod window_minima;
mod window_readings;

pub use distances::{Projective, ProjectiveSettings};
pub(super) use lengths::ProjectiveLengths;
pub(super) use misses::ProjectiveMisses;
