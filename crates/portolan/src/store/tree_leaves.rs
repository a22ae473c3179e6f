//! Walking over the leaves of a part of a tree.

use super::arena::{NONE, children};
use super::tree::{Leaf, Tree};
use crate::cell::LogOddsValue;

/// The observed leaves that touch a box of cells, depth first, children in index order.
#[derive(Clone, Debug)]
pub struct LeavesIn<'a, V: LogOddsValue, const D: usize> {
    tree: &'a Tree<V, D>,
    first: [i32; D],
    end: [i32; D],
    /// Records that are open: record, next child, lowest cell, height.
    open: Vec<(u32, usize, [i32; D], u32)>,
    /// The root, where it is a leaf.
    root: Option<V>,
}

impl<V: LogOddsValue, const D: usize> Tree<V, D> {
    /// The observed leaves that touch the box of cells from `first` up to, not including, `end`; a leaf is given whole
    /// where it sticks out. O(depth + leaves given) for a box that is not thinner than the leaves in it.
    pub fn leaves_in(&self, first: [i32; D], end: [i32; D]) -> LeavesIn<'_, V, D> {
        let mut leaves = LeavesIn { tree: self, first, end, open: Vec::new(), root: None };
        if leaves.touched([0; D], self.depth) {
            match self.root {
                NONE => leaves.root = Some(self.root_value).filter(|v| !v.is_unobserved()),
                root => leaves.open.push((root, 0, [0; D], self.depth)),
            }
        }
        leaves
    }

    /// The smallest box of cells (lowest, and one beyond the highest) that holds all observed leaves; `None`: there
    /// are none. O(nodes).
    pub fn extent(&self) -> Option<([i32; D], [i32; D])> {
        let mut extent: Option<([i32; D], [i32; D])> = None;
        self.for_each_leaf(|leaf| {
            let end = leaf.cell.map(|v| v + (1 << leaf.height));
            extent = Some(match extent {
                None => (leaf.cell, end),
                Some((a, b)) => (
                    std::array::from_fn(|k| a[k].min(leaf.cell[k])),
                    std::array::from_fn(|k| b[k].max(end[k])),
                ),
            });
        });
        extent
    }
}

impl<V: LogOddsValue, const D: usize> LeavesIn<'_, V, D> {
    fn touched(&self, cell: [i32; D], height: u32) -> bool {
        (0..D).all(|k| {
            cell[k] < self.end[k]
                && i64::from(self.first[k]) < i64::from(cell[k]) + (1i64 << height)
                && self.first[k] < self.end[k]
        })
    }
}

impl<V: LogOddsValue, const D: usize> Iterator for LeavesIn<'_, V, D> {
    type Item = Leaf<V, D>;

    fn next(&mut self) -> Option<Leaf<V, D>> {
        if let Some(value) = self.root.take() {
            return Some(Leaf { cell: [0; D], height: self.tree.depth, value });
        }
        while let Some((record, child, cell, height)) = self.open.last_mut() {
            let (record, c, height) = (*record, *child, *height - 1);
            if c == children::<D>() {
                self.open.pop();
                continue;
            }
            *child += 1;
            let cell = std::array::from_fn(|k| cell[k] + (((c >> k) & 1) << height) as i32);
            if !self.touched(cell, height) {
                continue;
            }
            let value = self.tree.arena.values(record)[c];
            match self.tree.record_of(record, c) {
                NONE if value.is_unobserved() => {}
                NONE => return Some(Leaf { cell, height, value }),
                below => self.open.push((below, 0, cell, height)),
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::LogOdds8;
    use crate::store::tree_levels::tests::patchy;
    use proptest::prelude::*;

    fn equals_a_filter<const D: usize>(tree: &Tree<LogOdds8, D>, first: [i32; D], end: [i32; D]) {
        let mut wanted = Vec::new();
        let (mut low, mut high) = ([i32::MAX; D], [i32::MIN; D]);
        tree.for_each_leaf(|l| {
            let top = l.cell.map(|v| v + (1 << l.height));
            if (0..D).all(|k| first[k] < end[k] && l.cell[k] < end[k] && first[k] < top[k]) {
                wanted.push(l);
            }
            low = std::array::from_fn(|k| low[k].min(l.cell[k]));
            high = std::array::from_fn(|k| high[k].max(top[k]));
        });
        assert!(tree.leaves_in(first, end).eq(wanted));
        assert_eq!(tree.extent().unwrap_or(([i32::MAX; D], [i32::MIN; D])), (low, high));
    }

    proptest! {
        #[test]
        fn a_box_holds_the_leaves_that_touch_it(
            blocks in prop::collection::vec((any::<u8>(), any::<u64>()), 0..12),
            a in prop::array::uniform3(-5..40i32), b in prop::array::uniform3(-5..40i32),
        ) {
            let value = |v| LogOdds8(v as i8);
            equals_a_filter(&patchy::<_, 2>(&blocks, value), [a[0], a[1]], [b[0], b[1]]);
            equals_a_filter(&patchy::<_, 3>(&blocks, value), a, b);
            equals_a_filter(&patchy::<_, 3>(&blocks, value), [i32::MIN; 3], [i32::MAX; 3]);
        }
    }

    #[test]
    fn a_root_that_is_a_leaf() {
        let mut tree = Tree::<LogOdds8, 2>::new([0.0; 2], 1.0, 3).unwrap();
        assert_eq!((tree.leaves_in([0; 2], [8; 2]).count(), tree.extent()), (0, None));
        tree.set_block(crate::geom::BlockKey([0, 0]), &[LogOdds8(5); 64]);
        assert_eq!(tree.leaves_in([7; 2], [9; 2]).map(|l| l.height).collect::<Vec<_>>(), [3]);
        assert_eq!((tree.leaves_in([8; 2], [9; 2]).count(), tree.extent()), (0, Some(([0; 2], [8; 2]))));
    }
}
