//! Quadtree and octree of log odds in one type.

use super::arena::{Arena, NONE, Record, children};
use super::tree_build::{expand, subtree};
use super::{Store, StoreFull, tree_build::value_above};
use crate::cell::LogOddsValue;
use crate::geom::{Aabb, BlockKey, Grid, Lattice, block_cells};

/// Height of a block: `2^3` cells along each edge.
pub(super) const BLOCK_HEIGHT: u32 = 3;

/// A pruned tree of log odds over `2^depth` cells along each axis (Hornung et al. 2013; here inner records
/// only: 9 bytes each in 2-D, 13 in 3-D, with one-byte values).
///
/// Equal sibling leaves are always merged, bottom-up, which changes no answer; a later observation splits the
/// leaf again and copies its value. The value of an inner node is the largest of its children's. Space that
/// was never observed costs nothing.
#[derive(Clone, Debug)]
pub struct Tree<V: LogOddsValue, const D: usize> {
    pub(super) lattice: Lattice<D>,
    pub(super) depth: u32,
    pub(super) arena: Arena<V, D>,
    /// Record of the root, [`NONE`] while the root is a leaf.
    pub(super) root: u32,
    pub(super) root_value: V,
    /// The block being changed, x fastest.
    scratch: Vec<V>,
    /// Records from the root down to the block being changed, with the child taken.
    path: Vec<(u32, usize)>,
}

/// A leaf of the tree that was observed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf<V, const D: usize> {
    /// Its lowest cell.
    pub cell: [i32; D],
    /// Its edge is `2^height` cells; 0 is the finest.
    pub height: u32,
    /// Its value, the same for every cell that it covers.
    pub value: V,
}

impl<V: LogOddsValue, const D: usize> Tree<V, D> {
    /// An empty tree whose root covers `2^depth` cells of `resolution` meters along each axis, from `origin`
    /// (world) upwards. `None` unless 3 <= depth <= 28.
    pub fn new(origin: [f64; D], resolution: f64, depth: u32) -> Option<Self> {
        (BLOCK_HEIGHT..=28).contains(&depth).then(|| Self::empty(origin, resolution, depth))
    }

    /// [`Tree::new`] for a depth that was checked.
    pub(super) fn empty(origin: [f64; D], resolution: f64, depth: u32) -> Self {
        Self {
            lattice: Lattice::new(origin, resolution),
            depth,
            arena: Arena::new(),
            root: NONE,
            root_value: V::UNOBSERVED,
            scratch: vec![V::UNOBSERVED; block_cells::<D>()],
            path: Vec::new(),
        }
    }

    /// An empty tree on the lattice of a grid, deep enough to cover it.
    pub fn covering(grid: &Grid<D>) -> Option<Self> {
        let cells = grid.shape.iter().copied().max().unwrap_or(1).max(1);
        let depth = cells.next_power_of_two().trailing_zeros().max(BLOCK_HEIGHT);
        Self::new(grid.lattice.origin, grid.lattice.resolution, depth)
    }

    /// Levels below the root.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// The box that the root covers, as a grid of the finest cells.
    pub fn grid(&self) -> Grid<D> {
        Grid { lattice: self.lattice, shape: [1 << self.depth; D] }
    }

    /// Inner nodes.
    pub fn inner_nodes(&self) -> usize {
        self.arena.slots() - self.arena.free_slots()
    }

    /// Nodes as other trees count them: inner nodes and leaves that were observed.
    pub fn nodes(&self) -> usize {
        let mut leaves = 0;
        self.for_each_leaf(|_| leaves += 1);
        self.inner_nodes() + leaves
    }

    /// Calls `visit` with every observed leaf, depth first, children in index order.
    pub fn for_each_leaf(&self, mut visit: impl FnMut(Leaf<V, D>)) {
        if self.root == NONE {
            if !self.root_value.is_unobserved() {
                visit(Leaf { cell: [0; D], height: self.depth, value: self.root_value });
            }
        } else {
            self.leaves_below(self.root, [0; D], self.depth, &mut visit);
        }
    }

    fn leaves_below(&self, record: u32, cell: [i32; D], height: u32, visit: &mut impl FnMut(Leaf<V, D>)) {
        let height = height - 1;
        for c in 0..children::<D>() {
            let cell = std::array::from_fn(|k| cell[k] + (((c >> k) & 1) << height) as i32);
            let value = self.arena.values(record)[c];
            if self.arena.mask(record) >> c & 1 != 0 {
                self.leaves_below(self.arena.child(record, c), cell, height, visit);
            } else if !value.is_unobserved() {
                visit(Leaf { cell, height, value });
            }
        }
    }

    /// Gives memory that no node uses back to the system.
    pub fn compact(&mut self) {
        if let Ok(tight) =
            Self::from_records(self.lattice.origin, self.lattice.resolution, self.depth, &self.records())
        {
            *self = tight;
        }
    }

    pub(super) fn inside(&self, cell: [i32; D]) -> bool {
        cell.iter().all(|&c| c >= 0 && c >> self.depth == 0)
    }

    /// Overwrites a block with the cells of `block`, x fastest. The block must lie inside.
    pub(super) fn set_block(&mut self, key: BlockKey<D>, block: &[V]) {
        debug_assert!(self.inside(key.first_cell()), "the block is outside");
        self.descend_to(key.first_cell());
        let slot = self.block_slot();
        if let Err(record) = slot {
            self.arena.release_children(record);
        }
        self.fill_slot(slot, block);
    }

    /// Puts the cells of `block` into the slot at the end of the path, whose children were given back.
    fn fill_slot(&mut self, slot: Result<V, u32>, block: &[V]) {
        let contents = subtree(&mut self.arena, block, 0, BLOCK_HEIGHT);
        if let (Err(record), Ok(_)) = (slot, &contents) {
            match self.path.last() {
                Some(&(parent, child)) => self.arena.unset_child(parent, child),
                None => self.arena.release(record, 1),
            }
        } else if let (Err(record), Err(_), None) = (slot, &contents, self.path.last()) {
            self.arena.release(record, 1);
        }
        self.replace_block(contents);
    }

    /// Turns the slot at the end of the path into `value` or a subtree, and merges equal siblings on the way up.
    fn replace_block(&mut self, contents: Result<V, Record<V>>) {
        let Some(&(parent, child)) = self.path.last() else {
            // The block is the whole tree.
            self.root = match contents {
                Ok(value) => {
                    self.root_value = value;
                    NONE
                }
                Err(record) => {
                    self.root_value = value_above(&record, children::<D>());
                    let root = self.arena.allocate(1);
                    self.arena.write(root, &record);
                    root
                }
            };
            return;
        };
        match contents {
            Ok(value) => self.arena.set_value(parent, child, value),
            Err(record) => {
                self.arena.set_child(parent, child, &record);
                self.arena.set_value(parent, child, value_above(&record, children::<D>()));
            }
        }
        self.merge_upwards();
    }

    fn merge_upwards(&mut self) {
        while let Some((record, _)) = self.path.pop() {
            let values = self.arena.values(record);
            let first = values[0];
            let uniform = self.arena.mask(record) == 0 && values.iter().all(|v| v.same(first));
            let above = if uniform { first } else { value_above(&self.arena.read(record), children::<D>()) };
            match self.path.last() {
                Some(&(parent, child)) => {
                    if uniform {
                        self.arena.unset_child(parent, child);
                    }
                    self.arena.set_value(parent, child, above);
                }
                None => {
                    self.root_value = above;
                    if uniform {
                        self.arena.release(record, 1);
                        self.root = NONE;
                    }
                }
            }
        }
    }

    /// Walks down to the block, splitting leaves on the way, so that the path holds all records above it.
    fn descend_to(&mut self, first_cell: [i32; D]) {
        self.path.clear();
        if self.depth == BLOCK_HEIGHT {
            return;
        }
        let split = |value: V| Record { values: [value; 8], first_child: NONE, mask: 0 };
        if self.root == NONE {
            self.root = self.arena.allocate(1);
            self.arena.write(self.root, &split(self.root_value));
        }
        let mut record = self.root;
        for height in (BLOCK_HEIGHT..self.depth).rev() {
            let child = child_index(first_cell, height);
            self.path.push((record, child));
            if height == BLOCK_HEIGHT {
                return;
            }
            record = if self.arena.mask(record) >> child & 1 != 0 {
                self.arena.child(record, child)
            } else {
                let value = self.arena.values(record)[child];
                self.arena.set_child(record, child, &split(value))
            };
        }
    }

    /// The slot at the end of the path: its record, or its value where it is a leaf.
    fn block_slot(&self) -> Result<V, u32> {
        match self.path.last() {
            Some(&(parent, child)) if self.arena.mask(parent) >> child & 1 != 0 => {
                Err(self.arena.child(parent, child))
            }
            Some(&(parent, child)) => Ok(self.arena.values(parent)[child]),
            None if self.root != NONE => Err(self.root),
            None => Ok(self.root_value),
        }
    }
}

/// Which child of a node of height `height + 1` holds a cell.
#[inline(always)]
pub(super) fn child_index<const D: usize>(cell: [i32; D], height: u32) -> usize {
    let mut child = 0;
    for k in 0..D {
        child |= ((cell[k] >> height) as usize & 1) << k;
    }
    child
}

impl<V: LogOddsValue, const D: usize> Store<V, D> for Tree<V, D> {
    fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    #[inline]
    fn cell(&self, cell: [i32; D]) -> Option<V> {
        if !self.inside(cell) {
            return None;
        }
        let mut value = self.root_value;
        let mut record = self.root;
        let mut height = self.depth;
        while record != NONE {
            height -= 1;
            let child = child_index(cell, height);
            value = self.arena.values(record)[child];
            record = self.record_of(record, child);
        }
        (!value.is_unobserved()).then_some(value)
    }

    fn bounds(&self) -> Option<Aabb<D>> {
        Some(self.grid().aabb())
    }

    #[inline(always)]
    fn contains(&self, cell: [i32; D]) -> bool {
        self.inside(cell)
    }

    fn apply(&mut self, key: BlockKey<D>, evidence: &V::Evidence, rule: &V::Rule) -> Result<(), StoreFull> {
        if !self.inside(key.first_cell()) {
            return Ok(());
        }
        self.descend_to(key.first_cell());
        let mut scratch = std::mem::take(&mut self.scratch);
        let slot = self.block_slot();
        match slot {
            Ok(value) => scratch.fill(value),
            Err(record) => {
                expand(&self.arena, record, &mut scratch, 0, BLOCK_HEIGHT);
                self.arena.release_children(record);
            }
        }
        V::fuse_run(&mut scratch, 0, evidence, 0, block_cells::<D>(), rule);
        self.fill_slot(slot, &scratch);
        self.scratch = scratch;
        Ok(())
    }

    fn memory_bytes(&self) -> usize {
        self.arena.bytes() + size_of::<Self>() + self.scratch.capacity() * size_of::<V>()
    }
}
