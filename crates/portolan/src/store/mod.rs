//! Where cells live. A store takes a block's evidence in and knows nothing of sensors.

mod arena;
mod bricks;
mod dense;
mod dense_bricks;
mod sums;
mod tree;
mod tree_bricks;
mod tree_build;
mod tree_leaves;
mod tree_levels;
mod tree_records;
mod tree_remake;

pub use bricks::Bricks;
pub use dense::Dense;
pub use sums::SumStore;
pub(crate) use sums::Unfit;
pub use tree::{Leaf, Tree};
pub use tree_bricks::TreeBricksError;
pub use tree_leaves::LeavesIn;
pub use tree_levels::Summary;
pub use tree_records::{Slot, TreeRecords, TreeRecordsError};

use crate::cell::{Cell, Evidence};
use crate::geom::{Aabb, BlockKey, Lattice, block_cells};
use crate::sweep::Swept;

/// A map's memory: cells addressed by lattice index, changed by blocks of evidence.
pub trait Store<C: Cell, const D: usize> {
    /// Index to meters.
    fn lattice(&self) -> &Lattice<D>;

    /// A cell; `None`: never observed, or outside.
    fn cell(&self, cell: [i32; D]) -> Option<C>;

    /// The box (world) outside of which the store has no cells; `None`: it has none such.
    fn bounds(&self) -> Option<Aabb<D>> {
        None
    }

    /// Whether a cell lies within the store's bounds.
    fn contains(&self, _cell: [i32; D]) -> bool {
        true
    }

    /// The blocks with an observed cell for which this holds, ascending. O(cells). Of stores without bounds none, unless they
    /// know their blocks.
    fn blocks_with(&self, holds: impl Fn(C) -> bool) -> Vec<BlockKey<D>> {
        let lattice = self.lattice();
        let Some(bounds) = self.bounds() else { return Vec::new() };
        let (Some(low), Some(high)) = (lattice.cell_of(bounds.min), lattice.cell_of(bounds.max)) else {
            return Vec::new();
        };
        let (low, high) = (BlockKey::of_cell(low), BlockKey::of_cell(high));
        let edges: [usize; D] = std::array::from_fn(|k| (high.0[k] - low.0[k] + 1).max(0) as usize);
        let key = |mut n: usize| {
            BlockKey(std::array::from_fn(|k| {
                let at = n % edges[k];
                n /= edges[k];
                low.0[k] + at as i32
            }))
        };
        let has =
            |key: &BlockKey<D>| (0..block_cells::<D>()).any(|i| self.cell(key.cell(i)).is_some_and(&holds));
        (0..edges.iter().product()).map(key).filter(has).collect()
    }

    /// Fuses one scan's evidence about a block; cells outside of the store are passed over.
    ///
    /// # Errors
    /// [`StoreFull`] where the limit of memory leaves no room; the store is then as before.
    fn apply(&mut self, key: BlockKey<D>, evidence: &C::Evidence, rule: &C::Rule) -> Result<(), StoreFull>;

    /// Fuses all evidence of a swept scan, blocks in ascending order; returns the number of observed cells. The same cells
    /// as [`Store::apply`] block by block, whatever the number of threads.
    ///
    /// # Errors
    /// [`StoreFull`] at the first block that the limit of memory leaves no room for; those before it are fused.
    fn fuse<W>(&mut self, scan: &W, rule: &C::Rule) -> Result<u64, StoreFull>
    where
        W: Swept<D, Evidence = C::Evidence>,
    {
        let mut scratch = scan.scratch();
        let mut cells = 0;
        for (i, &key) in scan.blocks().iter().enumerate() {
            let evidence = scan.evidence(i, &mut scratch);
            let observed = evidence.observed();
            if observed > 0 {
                self.apply(key, evidence, rule)?;
                cells += observed as u64;
            }
        }
        Ok(cells)
    }

    /// Bytes that the store may hold; `usize::MAX`: any number.
    fn limit(&self) -> usize {
        usize::MAX
    }

    /// Allows no more than `bytes` from now on. Stores whose size is fixed when they are made ignore it.
    fn set_limit(&mut self, _bytes: usize) {}

    /// Bytes held, measured from what is allocated.
    fn memory_bytes(&self) -> usize;
}

/// A block of cells would not fit into the memory that the store may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the map needs more than {limit} bytes: its cells take {bytes}")]
pub struct StoreFull {
    /// Bytes allowed.
    pub limit: usize,
    /// Bytes held.
    pub bytes: usize,
}
