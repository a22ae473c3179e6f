//! Which bricks the passes of the transform must fill, and how far each needs to look.

use crate::geom::{BLOCK_EDGE, BlockKey};

/// A brick whose values a pass must find, exact up to this squared distance (cells).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Output<const D: usize> {
    pub(crate) key: BlockKey<D>,
    pub(crate) budget: f32,
}

/// Sorts bricks into lines along `axis`: the other indices first, the last of them slowest, so that all lines of one
/// slab of the last axis follow each other.
pub(crate) fn line_order<const D: usize>(key: &BlockKey<D>, axis: usize) -> [i32; D] {
    let mut order = [key.0[axis]; D];
    let others = (0..D).rev().filter(|&k| k != axis);
    for (to, k) in order.iter_mut().zip(others) {
        *to = key.0[k];
    }
    order
}

/// Whether two bricks lie on one line along `axis`.
pub(crate) fn same_line<const D: usize>(a: &BlockKey<D>, b: &BlockKey<D>, axis: usize) -> bool {
    (0..D).all(|k| k == axis || a.0[k] == b.0[k])
}

/// Squared distance between the nearest cells of two bricks that lie `bricks` apart on one line.
pub(crate) fn gap_sq(bricks: i32) -> f32 {
    let gap = (bricks.abs() - 1).max(0) * BLOCK_EDGE as i32 + i32::from(bricks != 0);
    (gap * gap) as f32
}

/// How many bricks away a squared distance reaches.
pub(crate) fn bricks_within(budget: f32) -> i32 {
    let cells = budget.max(0.0).sqrt();
    if cells < 1.0 { 0 } else { ((cells - 1.0) / BLOCK_EDGE as f32) as i32 + 1 }
}

/// What a pass along `axis` must be given so that it can fill `stage`, which is sorted by lines along `axis`: every
/// brick within reach, less what the way along the axis costs at least. In the same order.
pub(crate) fn needed<const D: usize>(stage: &[Output<D>], axis: usize) -> Vec<Output<D>> {
    let mut needed = Vec::with_capacity(2 * stage.len());
    let farthest = stage.iter().map(|r| bricks_within(r.budget)).max().unwrap_or(0);
    // Budgets of neighbouring bricks of a line, from `start` on; negative: not needed.
    let (mut start, mut budgets) = (0, Vec::new());
    for line in stage.chunk_by(|a, b| same_line(&a.key, &b.key, axis)) {
        for reach in line {
            let (at, far) = (reach.key.0[axis], bricks_within(reach.budget));
            if at - farthest >= start + budgets.len() as i32 || budgets.is_empty() {
                // Nothing that follows reaches back to what is collected.
                flush(line[0].key, axis, start, &mut budgets, &mut needed);
                start = at - farthest;
            }
            let length = (at + far - start + 1) as usize;
            budgets.resize(budgets.len().max(length), -1.0f32);
            for step in -far..=far {
                let slot = &mut budgets[(at + step - start) as usize];
                *slot = slot.max(reach.budget - gap_sq(step));
            }
        }
        flush(line[0].key, axis, start, &mut budgets, &mut needed);
    }
    needed
}

fn flush<const D: usize>(
    line: BlockKey<D>,
    axis: usize,
    start: i32,
    budgets: &mut Vec<f32>,
    needed: &mut Vec<Output<D>>,
) {
    for (i, &budget) in budgets.iter().enumerate().filter(|(_, b)| **b >= 0.0) {
        let mut key = line;
        key.0[axis] = start + i as i32;
        needed.push(Output { key, budget });
    }
    budgets.clear();
}

/// The bricks with a cell no further from some cell of `keys` than a squared distance, unordered.
pub(crate) fn within<const D: usize>(keys: &[BlockKey<D>], budget: f32) -> Vec<BlockKey<D>> {
    let mut reaches: Vec<_> = keys.iter().map(|&key| Output { key, budget }).collect();
    for axis in 0..D {
        reaches.sort_unstable_by_key(|r| line_order(&r.key, axis));
        reaches = needed(&reaches, axis);
    }
    reaches.into_iter().map(|r| r.key).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    #[test]
    fn reaching_a_brick_is_reaching_its_nearest_cell() {
        assert_eq!([0, 1, -1, 2, 3].map(gap_sq), [0.0, 1.0, 1.0, 81.0, 289.0]);
        for cells in 0..40 {
            let far = bricks_within((cells * cells) as f32);
            assert!(gap_sq(far) <= (cells * cells) as f32 && gap_sq(far + 1) > (cells * cells) as f32);
        }
    }

    proptest! {
        #[test]
        fn needed_is_what_brute_force_needs(
            stage in prop::collection::btree_map([0..3i32, -40..40i32, 0..2i32], 0.0..900.0f32, 0..40),
        ) {
            let mut reaches: Vec<_> = stage.iter().map(|(&k, &budget)| Output { key: BlockKey(k), budget }).collect();
            reaches.sort_unstable_by_key(|r| line_order(&r.key, 1));
            let got = needed(&reaches, 1);
            prop_assert!(got.is_sorted_by_key(|r| line_order(&r.key, 1)));
            let mut want = BTreeMap::new();
            for r in &reaches {
                for step in -10..=10 {
                    let (mut key, left) = (r.key.0, r.budget - gap_sq(step));
                    key[1] += step;
                    if left >= 0.0 {
                        let best: &mut f32 = want.entry(key).or_insert(left);
                        *best = best.max(left);
                    }
                }
            }
            let got: BTreeMap<_, _> = got.iter().map(|r| (r.key.0, r.budget)).collect();
            prop_assert_eq!(got, want);
        }
    }
}
