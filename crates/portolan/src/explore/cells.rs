//! What is known of a cell.

use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::BlockKey;
use crate::store::Bricks;

/// A cell as exploration sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    Free,
    Occupied,
    Unknown,
}

/// Cell `i` of a brick, with this least weight.
#[inline(always)]
pub(super) fn known(brick: &DistanceBrick, i: usize, min_weight: f32) -> Known {
    let weight = brick.weights()[i];
    // False for NaN, too.
    if !(weight > 0.0 && weight >= min_weight) {
        Known::Unknown
    } else if brick.distances()[i] > 0.0 {
        Known::Free
    } else {
        Known::Occupied
    }
}

/// Looks cells up one after the other, as a ray meets them: the brick is looked for only where it changes.
#[derive(Debug)]
pub(super) struct Reader<'a, const D: usize> {
    store: &'a Bricks<SignedDistance, D>,
    min_weight: f32,
    key: BlockKey<D>,
    brick: Option<&'a DistanceBrick>,
}

impl<'a, const D: usize> Reader<'a, D> {
    pub(super) fn new(store: &'a Bricks<SignedDistance, D>, min_weight: f32) -> Self {
        let key = BlockKey([0; D]);
        Self { store, min_weight, key, brick: store.brick(key) }
    }

    #[inline]
    pub(super) fn at(&mut self, cell: [i32; D]) -> Known {
        let key = BlockKey::of_cell(cell);
        if key != self.key {
            (self.key, self.brick) = (key, self.store.brick(key));
        }
        self.brick.map_or(Known::Unknown, |brick| known(brick, BlockKey::offset(cell), self.min_weight))
    }
}
