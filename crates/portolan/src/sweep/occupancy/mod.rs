//! Occupancy of space, whole scans at a time, brick by brick.
//!
//! [`super::Rays`] is the textbook's sweep in any dimension, with its depth of walls, for dense arrays and trees. Here are
//! the fast ones for bricks: [`exact`](ExactRays) rays with the meaning that OctoMap gave them (what is passed is missed
//! once a scan, the cell of the end point is hit, a hit overrules misses), and [`projective`](Projective) misses for scans of
//! rows and columns, whose hits are exact as well.

mod exact;
mod guard;
mod hits_and_misses;
mod lens;
mod masks;
mod projective;
mod trace;

pub(crate) use exact::LONGEST_RAY;
pub use hits_and_misses::{HitsAndMisses, OccupancySweep};
use masks::Bits;
use projective::Projective;
