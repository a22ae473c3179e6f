//! Where to start from: the optimiser finds the minimum next to its start.

mod chordal;
mod tree;

pub use tree::Chain;
