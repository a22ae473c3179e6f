//! A tree at coarser levels: what a cell of any height holds.

use super::arena::{NONE, children};
use super::tree::{Tree, child_index};
use crate::cell::LogOddsValue;

/// What was observed inside one cell of a coarser level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary<V> {
    /// The smallest value of an observed cell.
    pub min: V,
    /// The largest value of an observed cell.
    pub max: V,
    /// Mean over the observed part, each finest cell counting alike (so leaves weigh by their volume, and what was
    /// never observed weighs nothing), in units of the rule's quantum: times the quantum that is the mean log odds.
    pub mean: f64,
    /// Share of the volume that was observed, above 0, at most 1.
    pub observed: f64,
}

/// A node that was found: a record of its own, or a value that holds for all of it.
pub(super) enum Node<V> {
    Inner(u32),
    Uniform(V),
}

impl<V: LogOddsValue, const D: usize> Tree<V, D> {
    /// The largest value inside the cell of edge `2^height` that holds the finest cell `cell`; `None`: nothing of it
    /// was observed, or it is outside. A planner that must not hit anything asks this. O(depth).
    ///
    /// Heights beyond the root's are the root's. With `height` 0 the same as [`super::Store::cell`].
    pub fn max_at(&self, cell: [i32; D], height: u32) -> Option<V> {
        if !self.inside(cell) {
            return None;
        }
        let mut value = self.root_value;
        let mut record = self.root;
        let mut at = self.depth;
        while record != NONE && at > height {
            at -= 1;
            let child = child_index(cell, at);
            value = self.arena.values(record)[child];
            record = self.record_of(record, child);
        }
        (!value.is_unobserved()).then_some(value)
    }

    /// Smallest, largest and mean value inside the cell of edge `2^height` that holds the finest cell `cell`, and how
    /// much of it was observed; `None`: nothing of it, or it is outside. O(depth + nodes below).
    ///
    /// Heights beyond the root's are the root's.
    pub fn summary(&self, cell: [i32; D], height: u32) -> Option<Summary<V>> {
        if !self.inside(cell) {
            return None;
        }
        match self.node(cell, height) {
            Node::Uniform(value) => uniform(value),
            Node::Inner(record) => self.summary_below(record),
        }
    }

    /// Calls `visit` with the lowest cell and the summary of every cell of edge `2^height` in which something was
    /// observed, depth first. A leaf that is larger is given once, with its own height as third argument. O(nodes).
    pub fn for_each_summary(&self, height: u32, mut visit: impl FnMut([i32; D], Summary<V>, u32)) {
        if self.root == NONE || height >= self.depth {
            if let Some(summary) = self.summary([0; D], self.depth) {
                visit([0; D], summary, self.depth);
            }
        } else {
            self.summaries_below(self.root, [0; D], self.depth, height, &mut visit);
        }
    }

    fn summaries_below(
        &self,
        record: u32,
        cell: [i32; D],
        height: u32,
        wanted: u32,
        visit: &mut impl FnMut([i32; D], Summary<V>, u32),
    ) {
        let height = height - 1;
        for c in 0..children::<D>() {
            let cell = std::array::from_fn(|k| cell[k] + (((c >> k) & 1) << height) as i32);
            let below = self.record_of(record, c);
            if below != NONE && height > wanted {
                self.summaries_below(below, cell, height, wanted, visit);
                continue;
            }
            let summary = match below {
                NONE => uniform(self.arena.values(record)[c]),
                below => self.summary_below(below),
            };
            if let Some(summary) = summary {
                visit(cell, summary, height);
            }
        }
    }

    pub(super) fn node(&self, cell: [i32; D], height: u32) -> Node<V> {
        if self.root == NONE {
            return Node::Uniform(self.root_value);
        }
        let mut record = self.root;
        let mut at = self.depth;
        while at > height {
            at -= 1;
            let child = child_index(cell, at);
            let below = self.record_of(record, child);
            if below == NONE {
                return Node::Uniform(self.arena.values(record)[child]);
            }
            record = below;
        }
        Node::Inner(record)
    }

    fn summary_below(&self, record: u32) -> Option<Summary<V>> {
        let mut all: Option<Summary<V>> = None;
        let share = 1.0 / children::<D>() as f64;
        for c in 0..children::<D>() {
            let below = match self.record_of(record, c) {
                NONE => uniform(self.arena.values(record)[c]),
                below => self.summary_below(below),
            };
            let Some(mut s) = below else { continue };
            // Shares are powers of two times whole numbers, so that their sums are exact.
            s.observed *= share;
            all = Some(match all {
                None => s,
                Some(a) => a.and(s),
            });
        }
        all
    }

    /// The record of a child; [`NONE`] where the child is a leaf.
    #[inline(always)]
    pub(super) fn record_of(&self, record: u32, child: usize) -> u32 {
        if self.arena.mask(record) >> child & 1 != 0 { self.arena.child(record, child) } else { NONE }
    }
}

fn uniform<V: LogOddsValue>(value: V) -> Option<Summary<V>> {
    (!value.is_unobserved()).then(|| Summary { min: value, max: value, mean: value.units(), observed: 1.0 })
}

impl<V: LogOddsValue> Summary<V> {
    /// The summary of both together, for shares of the same volume.
    fn and(self, other: Self) -> Self {
        let observed = self.observed + other.observed;
        Self {
            min: if other.min < self.min { other.min } else { self.min },
            max: if other.max > self.max { other.max } else { self.max },
            mean: (self.mean * self.observed + other.mean * other.observed) / observed,
            observed,
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::cell::{LogOdds8, LogOdds32};
    use crate::geom::BlockKey;
    use crate::store::Store;
    use proptest::prelude::*;

    /// A tree of few different values, so that leaves of all sizes come about.
    pub(in crate::store) fn patchy<V: LogOddsValue, const D: usize>(
        blocks: &[(u8, u64)],
        value: impl Fn(u64) -> V,
    ) -> Tree<V, D> {
        let mut tree = Tree::new([-3.2; D], 0.1, 5).unwrap();
        for &(block, seed) in blocks {
            let key = BlockKey(std::array::from_fn(|k| i32::from(block >> (2 * k) & 3)));
            let mut cells = vec![V::UNOBSERVED; 1 << (3 * D)];
            for (i, cell) in cells.iter_mut().enumerate() {
                // One value per 4^D corner with even seeds, single cells with odd ones.
                let part = if seed & 1 == 0 { i >> 2 & 1 | i >> 4 & 2 } else { i };
                let noise = (seed ^ part as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
                if noise & 3 != 0 {
                    *cell = value(noise & 3);
                }
            }
            tree.set_block(key, &cells);
            tree.check_invariants();
        }
        tree
    }

    fn equals_brute_force<V: LogOddsValue, const D: usize>(tree: &Tree<V, D>) {
        for height in 0..=6u32 {
            let edge = 1i32 << height.min(tree.depth());
            let mut seen = 0;
            let n = (1 << tree.depth()) / edge;
            for i in 0..n.pow(D as u32) {
                let first: [i32; D] = std::array::from_fn(|k| i / n.pow(k as u32) % n * edge);
                let mut values = Vec::new();
                for j in 0..edge.pow(D as u32) {
                    let cell = std::array::from_fn(|k| first[k] + j / edge.pow(k as u32) % edge);
                    values.extend(tree.cell(cell));
                }
                let any = first.map(|v| v + edge - 1);
                let Some(s) = tree.summary(any, height) else {
                    assert!(values.is_empty() && tree.max_at(any, height).is_none());
                    continue;
                };
                seen += 1;
                let units = values.iter().map(|v| v.units());
                assert_eq!(s.min.units(), units.clone().fold(f64::INFINITY, f64::min));
                assert_eq!(s.max.units(), units.clone().fold(f64::NEG_INFINITY, f64::max));
                assert_eq!(tree.max_at(any, height), Some(s.max));
                assert_eq!(s.observed, values.len() as f64 / f64::from(edge).powi(D as i32));
                let mean = units.sum::<f64>() / values.len() as f64;
                assert!((s.mean - mean).abs() < 1e-9 * (1.0 + mean.abs()), "{} for {mean}", s.mean);
            }
            let (mut visited, mut share) = (0, 0.0);
            tree.for_each_summary(height, |cell, summary, at| {
                visited += 1;
                share += summary.observed * f64::from(1u32 << at.saturating_sub(height)).powi(D as i32);
                assert_eq!(tree.summary(cell, at), Some(summary));
            });
            assert!(visited <= seen && (visited > 0) == (seen > 0), "{visited} of {seen} at {height}");
            let cells = share * f64::from(edge).powi(D as i32);
            let mut observed = 0.0;
            tree.for_each_leaf(|l| observed += f64::from(1u32 << l.height).powi(D as i32));
            assert_eq!(cells, observed);
        }
        assert_eq!((tree.summary([-1; D], 2), tree.max_at([1 << 6; D], 2)), (None, None));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn summaries_equal_brute_force(blocks in prop::collection::vec((any::<u8>(), any::<u64>()), 0..20)) {
            equals_brute_force(&patchy::<_, 2>(&blocks, |v| LogOdds8(v as i8 * 30 - 50)));
            equals_brute_force(&patchy::<_, 3>(&blocks, |v| LogOdds32(v as f32 - 1.7)));
        }
    }
}
