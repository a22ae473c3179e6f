//! Fields for the tests of this folder.

use crate::cell::{DistanceBrick, Planes, SignedDistance};
use crate::geom::{BlockKey, Lattice, block_cells};
use crate::store::Bricks;

/// SplitMix64 *(Steele, Lea, Flood 2014)*.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// About normally distributed, deviation 1 (twelve uniform numbers).
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// What random bricks are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// Cells of a hundred that were not observed.
    pub(crate) holes: u64,
    /// Cells of a hundred of exactly zero.
    pub(crate) zeros: u64,
}

pub(crate) fn noise_brick<const D: usize>(random: &mut Random, noise: Noise) -> DistanceBrick {
    let mut brick: DistanceBrick = Planes::unobserved(block_cells::<D>());
    for i in 0..block_cells::<D>() {
        let distance = if random.next() % 100 < noise.zeros { 0.0 } else { (random.unit() - 0.5) as f32 };
        let cell = SignedDistance { distance, weight: 1.0 };
        brick.set(i, (random.next() % 100 >= noise.holes).then_some(cell));
    }
    brick
}

/// Bricks with these values (metres) at the centres of the cells of a box; not observed where it is NaN, and outside.
pub(crate) fn bricks<const D: usize>(
    lattice: Lattice<D>,
    first: [i32; D],
    shape: [i32; D],
    mut value: impl FnMut([i32; D]) -> f64,
) -> Bricks<SignedDistance, D> {
    let mut store = Bricks::new(lattice);
    let low = BlockKey::of_cell(first).0;
    let high: [i32; D] = BlockKey::of_cell(std::array::from_fn(|k| first[k] + shape[k] - 1)).0;
    let count: [i32; D] = std::array::from_fn(|k| high[k] - low[k] + 1);
    for n in 0..count.iter().product() {
        let mut left = n;
        let key = BlockKey(std::array::from_fn(|k| {
            let at = left % count[k];
            left /= count[k];
            low[k] + at
        }));
        let mut brick: DistanceBrick = Planes::unobserved(block_cells::<D>());
        for i in 0..block_cells::<D>() {
            let cell = key.cell(i);
            if (0..D).all(|k| cell[k] >= first[k] && cell[k] < first[k] + shape[k]) {
                let distance = value(cell) as f32;
                brick.set(i, (!distance.is_nan()).then_some(SignedDistance { distance, weight: 1.0 }));
            }
        }
        store.insert(key, brick).unwrap();
    }
    store
}
