//! The Euclidean distance transform over bricks, and the field that it makes.
//!
//! The passes of the separable transform run over lines of bricks: a pass fills only bricks that a later pass
//! looks at, no further than an upper bound of what will be found. Nothing is computed twice, as it is where tiles
//! with a halo are solved one by one.

mod accurate;
mod anchors;
mod clearance;
mod crossings;
mod dense;
mod edges;
mod feature;
mod from_dense;
mod kernels;
mod level;
mod min_plus;
mod pass;
mod planes;
mod reach;
mod roots;
mod search;
mod seeded;
mod seeds;
mod settings;
mod sparse_esdf;
mod surroundings;
mod transform;
mod unknown;

pub(crate) use crossings::{BrickCrossings, Crossings};
pub use dense::DenseEsdf;
pub(crate) use feature::Feature;
pub use settings::{EsdfMethod, EsdfUpdate, SparseEsdfSettings};
pub use sparse_esdf::SparseEsdf;

/// Bricks in one task of those that take microseconds each.
const TOGETHER: usize = 32;
