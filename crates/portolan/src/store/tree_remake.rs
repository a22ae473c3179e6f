//! The cells of a tree in another tree: other values, another place.

use super::arena::{NONE, children};
use super::tree::Tree;
use super::tree_levels::Node;
use super::tree_records::{Slot, TreeRecords};
use crate::cell::LogOddsValue;

impl<V: LogOddsValue, const D: usize> Tree<V, D> {
    /// The tree with every observed leaf's value changed by `change`; leaves that become equal are merged. O(nodes).
    ///
    /// Bytes to floats and back, log odds to "free" and "occupied".
    pub fn map_values<W: LogOddsValue>(&self, change: impl Fn(V) -> W) -> Tree<W, D> {
        let change = |v: V| if v.is_unobserved() { W::UNOBSERVED } else { change(v) };
        let mut records = TreeRecords::new();
        let root = match self.root {
            NONE => Slot::Leaf(change(self.root_value)),
            root => self.copy_below(root, &change, &mut records),
        };
        records.set_root(root);
        Tree::of_sound_records(self.lattice.origin, self.lattice.resolution, self.depth, &records)
    }

    /// The same cells in a tree whose root covers `2^depth` cells along each axis from cell `first` of this tree upwards;
    /// its cell 0 is this tree's cell `first`. `None` where an observed cell would be outside, or the depth is not
    /// between 3 and 28. O(nodes), times the depth where `first` is not a multiple of large leaves' edges.
    pub fn moved_to(&self, first: [i32; D], depth: u32) -> Option<Self> {
        if !(3..=28).contains(&depth) {
            return None;
        }
        let low = first.map(i64::from);
        if let Some((a, b)) = self.extent() {
            let fits = |k| low[k] <= i64::from(a[k]) && i64::from(b[k]) <= low[k] + (1 << depth);
            if !(0..D).all(fits) {
                return None;
            }
        }
        let mut records = TreeRecords::new();
        let root = self.copy_box(low, depth, &mut records);
        records.set_root(root);
        let origin = self.lattice.corner(first);
        Some(Self::of_sound_records(origin, self.lattice.resolution, depth, &records))
    }

    fn copy_below<W: LogOddsValue>(
        &self,
        record: u32,
        change: &impl Fn(V) -> W,
        records: &mut TreeRecords<W>,
    ) -> Slot<W> {
        let copy = records.begin::<D>();
        for c in 0..children::<D>() {
            let slot = match self.record_of(record, c) {
                NONE => Slot::Leaf(change(self.arena.values(record)[c])),
                below => self.copy_below(below, change, records),
            };
            records.set::<D>(copy, c, slot);
        }
        records.end::<D>(copy)
    }

    /// Writes down the cells from `low`, `2^height` along each axis.
    fn copy_box(&self, low: [i64; D], height: u32, records: &mut TreeRecords<V>) -> Slot<V> {
        if let Some(slot) = self.copy_node(low, height, records) {
            return slot;
        }
        let mut value = None;
        let high = low.map(|v| v + (1 << height));
        if self.uniform_in(low, high, &mut value) {
            return Slot::Leaf(value.unwrap_or(V::UNOBSERVED));
        }
        let copy = records.begin::<D>();
        for c in 0..children::<D>() {
            let low = std::array::from_fn(|k| low[k] + (((c as i64 >> k) & 1) << (height - 1)));
            let slot = self.copy_box(low, height - 1, records);
            records.set::<D>(copy, c, slot);
        }
        records.end::<D>(copy)
    }

    /// Writes down the box where it is a node of this tree, or a part of a leaf on the way to it.
    fn copy_node(&self, low: [i64; D], height: u32, records: &mut TreeRecords<V>) -> Option<Slot<V>> {
        let size = 1i64 << self.depth;
        let aligned = low.iter().all(|v| (0..size).contains(v) && v & ((1 << height) - 1) == 0);
        if !aligned || height > self.depth {
            return None;
        }
        Some(match self.node(low.map(|v| v as i32), height) {
            Node::Uniform(value) => Slot::Leaf(value),
            Node::Inner(record) => self.copy_below(record, &|v| v, records),
        })
    }

    /// Whether all cells from `low` up to `high` hold the same; `value` is what.
    fn uniform_in(&self, low: [i64; D], high: [i64; D], value: &mut Option<V>) -> bool {
        let size = 1i64 << self.depth;
        let sticks_out = (0..D).any(|k| low[k] < 0 || high[k] > size);
        if sticks_out {
            *value = Some(V::UNOBSERVED);
        }
        let inside = (0..D).all(|k| low[k] < size && high[k] > 0);
        match self.root {
            _ if !inside => true,
            NONE => agrees(value, self.root_value),
            root => self.uniform_below(root, [0; D], self.depth, low, high, value),
        }
    }

    fn uniform_below(
        &self,
        record: u32,
        cell: [i64; D],
        height: u32,
        low: [i64; D],
        high: [i64; D],
        value: &mut Option<V>,
    ) -> bool {
        if (0..D).all(|k| low[k] <= cell[k] && cell[k] + (1 << height) <= high[k]) {
            return false; // Its leaves would have been merged.
        }
        let height = height - 1;
        (0..children::<D>()).all(|c| {
            let cell: [i64; D] = std::array::from_fn(|k| cell[k] + (((c as i64 >> k) & 1) << height));
            let touched = (0..D).all(|k| cell[k] < high[k] && low[k] < cell[k] + (1 << height));
            match self.record_of(record, c) {
                _ if !touched => true,
                NONE => agrees(value, self.arena.values(record)[c]),
                below => self.uniform_below(below, cell, height, low, high, value),
            }
        })
    }
}

fn agrees<V: LogOddsValue>(value: &mut Option<V>, other: V) -> bool {
    value.get_or_insert(other).same(other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{LogOdds8, LogOdds32};
    use crate::store::Store;
    use crate::store::tree_levels::tests::patchy;
    use proptest::prelude::*;

    fn keeps_every_cell<const D: usize>(tree: &Tree<LogOdds8, D>, first: [i32; D], depth: u32) {
        let fits = tree
            .extent()
            .is_none_or(|(a, b)| (0..D).all(|k| first[k] <= a[k] && b[k] <= first[k] + (1 << depth)));
        let Some(moved) = tree.moved_to(first, depth) else {
            assert!(!fits);
            return;
        };
        assert!(fits);
        moved.check_invariants();
        let n = 1i32 << depth;
        for i in 0..n.pow(D as u32) {
            let cell: [i32; D] = std::array::from_fn(|k| i / n.pow(k as u32) % n);
            assert_eq!(moved.cell(cell), tree.cell(std::array::from_fn(|k| cell[k] + first[k])));
        }
        let (a, b) = (moved.lattice().corner([0; D]), tree.lattice().corner(first));
        assert!((0..D).all(|k| (a[k] - b[k]).abs() < 1e-9));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn moving_keeps_every_cell(
            blocks in prop::collection::vec((any::<u8>(), any::<u64>()), 0..12),
            first in prop::array::uniform3(-40..8i32), eights in any::<bool>(), depth in 5..7u32,
        ) {
            let first = if eights { first.map(|v| v & !7) } else { first };
            let value = |v| LogOdds8(v as i8);
            keeps_every_cell(&patchy::<_, 2>(&blocks, value), [first[0], first[1]], depth);
            keeps_every_cell(&patchy::<_, 3>(&blocks, value), first, depth);
        }

        #[test]
        fn other_values_merge_again(blocks in prop::collection::vec((any::<u8>(), any::<u64>()), 0..12)) {
            let tree = patchy::<_, 3>(&blocks, |v| LogOdds8(v as i8));
            let sign = |v: LogOdds8| LogOdds32(if v.0 > 1 { 3.5 } else { -2.0 });
            let changed = tree.map_values(sign);
            changed.check_invariants();
            assert!(changed.inner_nodes() <= tree.inner_nodes());
            for i in 0..32i32.pow(3) {
                let cell = [i & 31, i >> 5 & 31, i >> 10];
                assert_eq!(changed.cell(cell), tree.cell(cell).map(sign));
            }
        }
    }

    #[test]
    fn a_large_leaf_far_away_is_moved_whole() {
        let mut tree = Tree::<LogOdds8, 3>::new([0.0; 3], 1.0, 3).unwrap();
        tree.set_block(crate::geom::BlockKey([0; 3]), &[LogOdds8(5); 512]);
        let deep = tree.moved_to([-(1 << 27); 3], 28).unwrap();
        assert_eq!((deep.nodes(), deep.cell([1 << 27; 3])), (26, Some(LogOdds8(5))));
        let back = deep.moved_to([1 << 27; 3], 3).unwrap();
        assert_eq!((back.nodes(), back.lattice().origin), (1, [0.0; 3]));
        assert!(tree.moved_to([1; 3], 28).is_none() && tree.moved_to([0; 3], 29).is_none());
    }
}
