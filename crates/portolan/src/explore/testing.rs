//! Random changes of random bricks.

use crate::cell::{DistanceBrick, Planes, SignedDistance};
use crate::geom::{BlockKey, block_cells};
use crate::store::Bricks;
use proptest::prelude::*;

/// A brick, and what is put into cells from one place to another: nothing, or a distance and a weight.
pub(super) type Edit = ([i32; 3], Vec<(usize, usize, Option<(f32, f32)>)>);

pub(super) fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let value = prop_oneof![
        Just((0.3, 1.0)),
        Just((0.3, 1.0)),
        Just((-0.1, 2.0)),
        Just((0.2, 0.3)),
        Just((0.0, 1.0))
    ];
    let run = (0..512usize, 1..300usize, prop::option::weighted(0.8, value));
    prop::collection::vec((prop::array::uniform3(-1..2i32), prop::collection::vec(run, 1..8)), 1..12)
}

pub(super) fn put<const D: usize>(store: &mut Bricks<SignedDistance, D>, (key, runs): &Edit) {
    let key = BlockKey(std::array::from_fn(|k| key[k]));
    let n = block_cells::<D>();
    let mut brick: DistanceBrick = store.brick(key).cloned().unwrap_or_else(|| Planes::unobserved(n));
    for (from, len, value) in runs {
        for i in *from..*from + len % n {
            brick.set(i % n, value.map(|(distance, weight)| SignedDistance { distance, weight }));
        }
    }
    store.insert(key, brick).unwrap();
}
