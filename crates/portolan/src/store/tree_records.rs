//! A tree as a plain list of records, for files.

use super::arena::{Arena, NONE, Record, children};
use super::tree::Tree;
use super::tree_build::value_above;
use crate::cell::LogOddsValue;
use crate::geom::block_cells;

/// A tree in depth-first order: per inner record the values of its `2^D` children and the mask of those that
/// are inner; then, in child order, their records. A tree that is one leaf has no record.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeRecords<V> {
    /// Value of the root.
    pub root_value: V,
    /// `2^D` values per record.
    pub values: Vec<V>,
    /// One mask per record.
    pub masks: Vec<u8>,
}

/// What became of a node of a tree that is written down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slot<V> {
    /// One value for all of it; [`LogOddsValue::UNOBSERVED`] where nothing is known.
    Leaf(V),
    /// It has a record.
    Inner,
}

/// Writing a tree down, depth first: [`TreeRecords::begin`] for each inner node, [`TreeRecords::set`] for its children,
/// each after its own records, [`TreeRecords::end`].
impl<V: LogOddsValue> TreeRecords<V> {
    /// No record yet.
    pub fn new() -> Self {
        Self { root_value: V::UNOBSERVED, values: Vec::new(), masks: Vec::new() }
    }

    /// Opens the record of an inner node of a tree in `D` dimensions; its children are unobserved leaves until set.
    pub fn begin<const D: usize>(&mut self) -> usize {
        self.values.resize(self.values.len() + children::<D>(), V::UNOBSERVED);
        self.masks.push(0);
        self.masks.len() - 1
    }

    /// Sets a child of an open record.
    pub fn set<const D: usize>(&mut self, record: usize, child: usize, slot: Slot<V>) {
        match slot {
            Slot::Leaf(value) => self.values[record * children::<D>() + child] = value,
            Slot::Inner => self.masks[record] |= 1 << child,
        }
    }

    /// Closes a record. Where its children are equal leaves it goes, and the node becomes a leaf.
    pub fn end<const D: usize>(&mut self, record: usize) -> Slot<V> {
        let values = &self.values[record * children::<D>()..][..children::<D>()];
        let first = values[0];
        if self.masks[record] != 0 || values.iter().any(|v| !v.same(first)) {
            return Slot::Inner;
        }
        // No record below it is left, so that it is the last.
        self.masks.truncate(record);
        self.values.truncate(record * children::<D>());
        Slot::Leaf(first)
    }

    /// Sets the root, after all records.
    pub fn set_root(&mut self, slot: Slot<V>) {
        if let Slot::Leaf(value) = slot {
            self.root_value = value;
        }
    }
}

impl<V: LogOddsValue> Default for TreeRecords<V> {
    fn default() -> Self {
        Self::new()
    }
}

/// Why a list of records is not a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TreeRecordsError {
    /// The depth is out of range.
    #[error("tree depth {0} is not between 3 and 28")]
    Depth(u32),
    /// The number of values is not the number of masks times the number of children.
    #[error("tree has {masks} records but {values} values")]
    Lengths {
        /// Number of masks.
        masks: usize,
        /// Number of values.
        values: usize,
    },
    /// The list ends inside the tree.
    #[error("tree ends early: record {0} is missing")]
    Missing(usize),
    /// Records are left over.
    #[error("tree has {0} records too many")]
    Surplus(usize),
    /// A record below the finest level.
    #[error("tree record {0} lies below the finest level")]
    TooDeep(usize),
}

impl<V: LogOddsValue, const D: usize> Tree<V, D> {
    /// All records in depth-first order.
    pub fn records(&self) -> TreeRecords<V> {
        let mut records = TreeRecords { root_value: self.root_value, values: Vec::new(), masks: Vec::new() };
        if self.root != NONE {
            self.collect(self.root, &mut records);
        }
        records
    }

    fn collect(&self, record: u32, records: &mut TreeRecords<V>) {
        records.values.extend_from_slice(self.arena.values(record));
        records.masks.push(self.arena.mask(record));
        for c in 0..children::<D>() {
            if self.arena.mask(record) >> c & 1 != 0 {
                self.collect(self.arena.child(record, c), records);
            }
        }
    }

    /// A tree from its records, in exactly as much memory as it needs.
    ///
    /// # Errors
    /// Where the records are no tree of that depth.
    pub fn from_records(
        origin: [f64; D],
        resolution: f64,
        depth: u32,
        records: &TreeRecords<V>,
    ) -> Result<Self, TreeRecordsError> {
        let mut tree = Self::new(origin, resolution, depth).ok_or(TreeRecordsError::Depth(depth))?;
        let (masks, values) = (records.masks.len(), records.values.len());
        if masks.checked_mul(children::<D>()) != Some(values) {
            return Err(TreeRecordsError::Lengths { masks, values });
        }
        tree.root_value = records.root_value;
        if masks > 0 {
            let mut next = 0;
            tree.arena.reserve(masks);
            tree.root = tree.arena.allocate(1);
            read_below(&mut tree.arena, tree.root, records, &mut next, depth)?;
            tree.root_value = value_above(&tree.arena.read(tree.root), children::<D>());
            if next != masks {
                return Err(TreeRecordsError::Surplus(masks - next));
            }
        }
        debug_assert_eq!(block_cells::<D>(), 1 << (3 * D));
        Ok(tree)
    }

    /// A tree from records that were just written down, depth first, no deeper than `depth`.
    pub(super) fn of_sound_records(
        origin: [f64; D],
        resolution: f64,
        depth: u32,
        records: &TreeRecords<V>,
    ) -> Self {
        let tree = Self::from_records(origin, resolution, depth, records);
        debug_assert!(tree.is_ok(), "{:?}", tree.err());
        // Unreachable: an empty tree stands in so that no caller has an error that cannot happen.
        tree.unwrap_or_else(|_| Self::empty(origin, resolution, depth))
    }

    /// Checks what must always hold; for tests. Panics where it does not.
    #[doc(hidden)]
    pub fn check_invariants(&self) {
        let records = self.records();
        assert_eq!(records.masks.len() + self.arena.free_slots(), self.arena.slots(), "a record is lost");
        self.check_below(self.root, self.depth());
    }

    fn check_below(&self, record: u32, height: u32) {
        if record == NONE {
            return;
        }
        let read = self.arena.read(record);
        assert!(height >= 1, "a record below the finest level");
        let values = &read.values[..children::<D>()];
        assert!(read.mask != 0 || !values.iter().all(|v| v.same(values[0])), "equal leaves were not merged");
        assert!(height > 1 || read.mask == 0, "cells have no children");
        for c in 0..children::<D>() {
            if read.mask >> c & 1 != 0 {
                let child = self.arena.child(record, c);
                assert!(
                    read.values[c].same(value_above(&self.arena.read(child), children::<D>())),
                    "stale value"
                );
                self.check_below(child, height - 1);
            }
        }
    }
}

fn read_below<V: LogOddsValue, const D: usize>(
    arena: &mut Arena<V, D>,
    record: u32,
    records: &TreeRecords<V>,
    next: &mut usize,
    height: u32,
) -> Result<(), TreeRecordsError> {
    let i = *next;
    let mask = *records.masks.get(i).ok_or(TreeRecordsError::Missing(i))?;
    *next += 1;
    if height <= 1 && mask != 0 || children::<D>() < 8 && mask >> children::<D>() != 0 {
        return Err(TreeRecordsError::TooDeep(i));
    }
    let mut contents = Record { values: [V::UNOBSERVED; 8], first_child: NONE, mask };
    contents.values[..children::<D>()]
        .copy_from_slice(&records.values[i * children::<D>()..][..children::<D>()]);
    let n = mask.count_ones();
    if n > 0 {
        contents.first_child = arena.allocate(n as usize);
        for k in 0..n {
            read_below(arena, contents.first_child + k, records, next, height - 1)?;
        }
        let mut k = 0;
        for c in 0..children::<D>() {
            if mask >> c & 1 != 0 {
                contents.values[c] = value_above(&arena.read(contents.first_child + k), children::<D>());
                k += 1;
            }
        }
    }
    arena.write(record, &contents);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Endpoint, Evidence, HitMiss, LogOdds8, LogOdds32, LogOddsRule, OccupancyModel};
    use crate::geom::{BlockKey, Grid};
    use crate::store::{Dense, Store};
    use proptest::prelude::*;

    /// Per scan: touched blocks, and how each is filled.
    type Scans = Vec<Vec<(u8, u64, u64, u8)>>;

    fn scans() -> impl Strategy<Value = Scans> {
        prop::collection::vec(
            prop::collection::vec((0u8..64, any::<u64>(), any::<u64>(), 0u8..6), 1..6),
            1..30,
        )
    }

    fn evidence<const D: usize>(hit: u64, miss: u64, style: u8) -> HitMiss {
        let mut e = HitMiss::silent(block_cells::<D>());
        for i in 0..block_cells::<D>() {
            let bit = 1u64 << (i % 64);
            match style {
                0 => e.mark_hit(i),
                1 | 2 => e.mark_miss(i),
                3 if i % 512 < 256 => e.mark_miss(i),
                _ if hit & miss & bit != 0 => e.mark_hit(i),
                _ if miss & bit != 0 => e.mark_miss(i),
                _ => {}
            }
        }
        e
    }

    /// Tree, dense grid and a naive array agree cell by cell after random updates; pruning is lossless; records
    /// survive a round trip.
    fn agrees<V: LogOddsValue, const D: usize>(scans: &Scans, rule: &V::Rule) {
        let grid = Grid::new([0.0; D], 1.0, [32; D]);
        let mut tree = Tree::<V, D>::covering(&grid).unwrap();
        let mut dense = Dense::<V, D>::new(grid);
        let mut naive: Vec<Option<V>> = vec![None; grid.len()];
        for scan in scans {
            for &(block, hit, miss, style) in scan {
                let key = BlockKey(std::array::from_fn(|k| i32::from(block >> (2 * k) & 3)));
                let e = evidence::<D>(hit, miss, style);
                tree.apply(key, &e, rule).unwrap();
                dense.apply(key, &e, rule).unwrap();
                for i in 0..block_cells::<D>() {
                    let o: Option<Endpoint> = e.one(i);
                    if let Some(o) = o {
                        let at = grid.index(key.cell(i)).unwrap();
                        naive[at] = Some(V::fuse(naive[at], o, rule).0);
                    }
                }
            }
            tree.check_invariants();
        }
        for (i, want) in naive.iter().enumerate() {
            let cell = grid.cell(i);
            assert_eq!((tree.cell(cell), dense.cell(cell)), (*want, *want), "cell {cell:?}");
        }
        let mut covered = 0;
        tree.for_each_leaf(|leaf| covered += 1usize << (D as u32 * leaf.height));
        assert_eq!(covered, naive.iter().flatten().count());
        let records = tree.records();
        let back = Tree::<V, D>::from_records([0.0; D], 1.0, tree.depth(), &records).unwrap();
        back.check_invariants();
        for (i, want) in naive.iter().enumerate() {
            assert_eq!(back.cell(grid.cell(i)), *want);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn tree_grid_and_naive_agree_2d(s in scans()) {
            agrees::<LogOdds8, 2>(&s, &LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap());
            agrees::<LogOdds32, 2>(&s, &LogOddsRule::<f32>::new(&OccupancyModel::default()).unwrap());
        }
        #[test]
        fn records_from_anywhere_never_panic(masks in prop::collection::vec(any::<u8>(), 0..50), depth in 0u32..12) {
            let values = vec![LogOdds8(3); masks.len() * 4];
            let records = TreeRecords { root_value: LogOdds8(0), values, masks };
            let _ = Tree::<LogOdds8, 2>::from_records([0.0; 2], 1.0, depth, &records);
        }
    }
    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn tree_grid_and_naive_agree_3d(s in scans()) {
            agrees::<LogOdds8, 3>(&s, &LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap());
        }
    }

    #[test]
    fn a_tree_as_small_as_a_block() {
        let rule = LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap();
        let mut tree = Tree::<LogOdds8, 2>::new([0.0; 2], 1.0, 3).unwrap();
        for style in [4, 0, 4, 1, 0, 0, 0, 4] {
            tree.apply(BlockKey([0, 0]), &evidence::<2>(0x1234, 0x00ff_1234, style), &rule).unwrap();
            tree.check_invariants();
        }
        assert!(Tree::<LogOdds8, 2>::new([0.0; 2], 1.0, 2).is_none());
    }

    #[test]
    fn saturated_free_space_becomes_one_leaf() {
        let rule = LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap();
        let mut tree = Tree::<LogOdds8, 2>::new([0.0; 2], 0.05, 5).unwrap();
        for _ in 0..5 {
            for x in 0..4 {
                for y in 0..4 {
                    tree.apply(BlockKey([x, y]), &evidence::<2>(0, 0, 1), &rule).unwrap();
                }
            }
        }
        assert_eq!((tree.nodes(), tree.inner_nodes()), (1, 0));
        assert_eq!(tree.cell([31, 31]), Some(LogOdds8(-73)));
    }

    #[test]
    fn long_runs_do_not_leak_and_nodes_are_small() {
        let rule = LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap();
        let mut tree = Tree::<LogOdds8, 2>::new([0.0; 2], 0.05, 6).unwrap();
        let round = |tree: &mut Tree<LogOdds8, 2>, n: u64| {
            for k in 0..64u64 {
                let noise = (n * 64 + k).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                let key = BlockKey([(k % 8) as i32, (k / 8) as i32]);
                tree.apply(
                    key,
                    &evidence::<2>(noise, !noise.rotate_left(17), (noise >> 60) as u8 % 6),
                    &rule,
                )
                .unwrap();
            }
            tree.arena.slots()
        };
        let early = (0..20).map(|n| round(&mut tree, n)).max().unwrap();
        let late = (20..400).map(|n| round(&mut tree, n)).max().unwrap();
        assert!(late <= early + early / 4, "{early} slots grew to {late}");
        tree.compact();
        tree.check_invariants();
        let per_node =
            |bytes: usize, n: usize| (bytes - size_of::<Tree<LogOdds8, 2>>() - 64) as f64 / n as f64;
        assert!(per_node(tree.memory_bytes(), tree.inner_nodes()) <= 9.0 * 1.13);
    }
}
