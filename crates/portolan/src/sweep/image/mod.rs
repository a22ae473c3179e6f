//! Range images: where points fall in them, and what they say about cells.
//!
//! | step | for distances | for misses |
//! |---|---|---|
//! | the image fits together | [`crate::scan::RangeImage::check`] | the same |
//! | its projection | `projector`, `rings`, and `project` | the same, and `pixels`, `sine_rows` |
//! | readings made ready | `padded_image`: cleaned, torn where surfaces end | `window_minima`: the nearest within any window |
//! | nearest and farthest reading that a cube of cells may fall on | `window` of its box, in `range_pyramid` | `balls` around it, in `window_minima` |
//! | blocks that the image says something about | `search` | `search` |
//! | what it says about their cells | `observe`: interpolated at centers | `misses`: the nearest within a cell's width |
//!
//! Distances need the smallest and the largest value of few windows, of any size: a pyramid costs a third of the image.
//! Misses need the smallest one around *every* cell: tables over all places of a few sizes answer that by one read.

mod balls;
mod bands;
mod distances;
mod misses;
mod observe;
mod padded_image;
mod pixels;
mod project;
mod projector;
mod range_pyramid;
mod rings;
mod search;
mod sine_rows;
mod window;
mod window_minima;

pub use distances::{Projective, ProjectiveSettings};
pub(super) use misses::ProjectiveMisses;
