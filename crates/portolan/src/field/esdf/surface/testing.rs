//! Fields for the tests of this folder.

use crate::cell::DistanceBrick;
use crate::testing::{Random, brick};

/// What random bricks are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// Cells of a hundred that were not observed.
    pub(crate) holes: u64,
    /// Cells of a hundred of exactly zero.
    pub(crate) zeros: u64,
}

pub(crate) fn noise_brick<const D: usize>(random: &mut Random, noise: Noise) -> DistanceBrick {
    brick::<D>(|_| {
        let distance = if random.next() % 100 < noise.zeros { 0.0 } else { (random.unit() - 0.5) as f32 };
        (random.next() % 100 >= noise.holes).then_some((distance, 1.0))
    })
}
