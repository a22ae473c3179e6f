//! Fields for the tests of this folder.

use crate::cell::{DistanceBrick, Planes, SignedDistance};
use crate::geom::block_cells;

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
