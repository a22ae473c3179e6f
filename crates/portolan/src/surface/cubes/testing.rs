//! Helpers of the tests of this folder.

use crate::cell::SignedDistance;
use crate::geom::{BlockKey, Lattice};
use crate::store::Bricks;
use crate::testing::{Random, brick};

/// Corners of a cube: every third with alternating signs, every fifth with values of very different sizes.
pub(super) fn random_cube(random: &mut Random, n: usize) -> [f32; 8] {
    let mut d: [f32; 8] = std::array::from_fn(|_| random.value());
    if n.is_multiple_of(3) {
        (0..8usize)
            .filter(|c| (c.count_ones() % 2 == 0) == (d[*c] < 0.0))
            .collect::<Vec<_>>()
            .iter()
            .for_each(|&c| d[c] = -d[c]);
    }
    if n.is_multiple_of(5) {
        d = d.map(|v| v * v.abs());
    }
    d
}

/// Bricks with these values at the cells of a box, weight 1; not observed where the value is NaN, and outside.
pub(super) fn bricks(
    lattice: Lattice<3>,
    first: [i32; 3],
    shape: [usize; 3],
    value: impl Fn([i32; 3]) -> f32,
) -> Bricks<SignedDistance, 3> {
    let mut store = Bricks::new(lattice);
    let low: [i32; 3] = BlockKey::of_cell(first).0;
    let high: [i32; 3] = BlockKey::of_cell(std::array::from_fn(|k| first[k] + shape[k] as i32 - 1)).0;
    // Not in order, so that nothing may rely on it.
    for (z, y, x) in (low[2]..=high[2])
        .rev()
        .flat_map(|z| (low[1]..=high[1]).flat_map(move |y| (low[0]..=high[0]).map(move |x| (z, y, x))))
    {
        let key = BlockKey([x, y, z]);
        let brick = brick::<3>(|i| {
            let c = key.cell(i);
            let inside = (0..3).all(|k| c[k] >= first[k] && c[k] < first[k] + shape[k] as i32);
            Some((if inside { value(c) } else { f32::NAN }, 1.0)).filter(|(v, _)| !v.is_nan())
        });
        if brick.weights().contains(&1.0) {
            store.insert(key, brick).unwrap();
        }
    }
    store
}
