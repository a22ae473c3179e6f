//! Where cells live. A store takes a block's evidence in and knows nothing of sensors.

mod arena;
mod bricks;
mod dense;
mod dense_bricks;
mod tree;
mod tree_bricks;
mod tree_build;
mod tree_leaves;
mod tree_levels;
mod tree_records;
mod tree_remake;

pub use bricks::{Bricks, BricksFull};
pub use dense::Dense;
pub use tree::{Leaf, Tree};
pub use tree_bricks::TreeBricksError;
pub use tree_leaves::LeavesIn;
pub use tree_levels::Summary;
pub use tree_records::{Slot, TreeRecords, TreeRecordsError};

use crate::cell::Cell;
use crate::geom::{BlockKey, Lattice};

/// A map's memory: cells addressed by lattice index, changed by blocks of evidence.
pub trait Store<C: Cell, const D: usize> {
    /// Index to metres.
    fn lattice(&self) -> &Lattice<D>;

    /// A cell; `None`: never observed, or outside.
    fn cell(&self, cell: [i32; D]) -> Option<C>;

    /// Fuses one scan's evidence about a block; cells outside of the store are passed over.
    fn apply(&mut self, key: BlockKey<D>, evidence: &C::Evidence, rule: &C::Rule);

    /// Bytes held, measured from what is allocated.
    fn memory_bytes(&self) -> usize;
}
