//! Initial poses: the optimizer finds the minimum nearest to them.

mod chordal;
mod tree;

pub use tree::Chain;
