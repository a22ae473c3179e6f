//! Sparse symmetric systems of small dense blocks: `A x = b` with one `B x B` block per pair of poses.
//!
//! Written here because the alternatives cost more than they save: `faer` takes 84 s of processor time to build,
//! `sprs-ldl` is LGPL, `nalgebra-sparse` has no fill-reducing order and works on single numbers. The order
//! comes from the `amd` crate.

mod block;
mod cholesky;
mod pattern;

pub(crate) use self::cholesky::Cholesky;
pub(crate) use block::{Block, cholesky, transposed};
pub(crate) use pattern::{Pattern, SymmetricBlocks};
