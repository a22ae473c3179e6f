//! Helpers of the tests of this folder.

use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::{BlockKey, Lattice};
use crate::store::Bricks;

/// SplitMix64 *(Steele, Lea, Flood 2014)*.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `[-1, 1)`.
    pub(super) fn value(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }
}

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
        let values: Vec<f32> = (0..512)
            .map(|i| {
                let c = key.cell(i);
                let inside = (0..3).all(|k| c[k] >= first[k] && c[k] < first[k] + shape[k] as i32);
                if inside { value(c) } else { f32::NAN }
            })
            .collect();
        let weights: Vec<f32> = values.iter().map(|v| if v.is_nan() { 0.0 } else { 1.0 }).collect();
        let distances: Vec<f32> = values.iter().map(|v| if v.is_nan() { 0.0 } else { *v }).collect();
        if weights.contains(&1.0) {
            store.insert(key, DistanceBrick::from_parts(&distances, &weights).unwrap()).unwrap();
        }
    }
    store
}
