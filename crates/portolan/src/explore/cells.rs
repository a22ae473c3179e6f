//! Free, occupied or unknown: the state of a cell.

use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::BlockKey;
use crate::store::Bricks;

/// The state of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    Free,
    Occupied,
    Unknown,
}

/// The state of a cell with this distance and weight.
#[inline(always)]
pub(super) fn known(distance: f32, weight: f32, min_weight: f32) -> Known {
    // False for NaN, too.
    if !(weight > 0.0 && weight >= min_weight) {
        Known::Unknown
    } else if distance > 0.0 {
        Known::Free
    } else {
        Known::Occupied
    }
}

/// Reads cells one after the other, as along a ray: the brick is looked up only where it changes.
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
        self.brick.map_or(Known::Unknown, |brick| {
            let i = BlockKey::offset(cell);
            known(brick.distances()[i], brick.weights()[i], self.min_weight)
        })
    }
}
