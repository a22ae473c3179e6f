//! Helpers of tests in several folders.

use crate::cell::{DistanceBrick, Evidence, Planes, SignedDistance};
use crate::geom::{BlockKey, Grid, block_cells};
use crate::map::{DenseTsdf, TsdfConfig};
use crate::sweep::Swept;
use std::collections::HashMap;

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

    /// Uniform in `[-1, 1)`.
    pub(crate) fn value(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }
}

/// Does work on so many threads.
#[cfg(feature = "parallel")]
pub(crate) fn with_threads<R: Send>(count: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap().install(work)
}

/// Does work on the one thread that there is.
#[cfg(not(feature = "parallel"))]
pub(crate) fn with_threads<R>(_: usize, work: impl FnOnce() -> R) -> R {
    work()
}

/// The first coordinates.
pub(crate) fn point<const D: usize>(p: [f64; 3]) -> [f64; D] {
    std::array::from_fn(|k| p[k])
}

/// A brick of these distances and weights; without one a cell was never observed.
pub(crate) fn brick<const D: usize>(mut cell: impl FnMut(usize) -> Option<(f32, f32)>) -> DistanceBrick {
    let mut brick: DistanceBrick = Planes::unobserved(block_cells::<D>());
    for i in 0..block_cells::<D>() {
        brick.set(i, cell(i).map(|(distance, weight)| SignedDistance { distance, weight }));
    }
    brick
}

/// An array of these distances with weight 1; cells of NaN were never observed.
pub(crate) fn tsdf<const D: usize>(
    grid: Grid<D>,
    truncation: f64,
    mut distance: impl FnMut([f64; D]) -> f64,
) -> DenseTsdf<D> {
    let mut tsdf = DenseTsdf::covering(&grid, TsdfConfig { truncation, ..TsdfConfig::textbook() }).unwrap();
    for cell in (0..grid.len()).map(|i| grid.cell(i)) {
        let d = distance(grid.lattice.center(cell));
        if !d.is_nan() {
            tsdf.fuse(cell, d, 1.0);
        }
    }
    tsdf
}

/// Everything that a sweep says, by cell.
pub(crate) fn said<const D: usize, W: Swept<D>>(
    sweep: &W,
) -> HashMap<[i32; D], <W::Evidence as Evidence>::One> {
    let mut scratch = sweep.scratch();
    let mut said = HashMap::new();
    for (i, &key) in sweep.blocks().iter().enumerate() {
        let e = sweep.evidence(i, &mut scratch);
        said.extend((0..block_cells::<D>()).filter_map(|k| Some((BlockKey::cell(key, k), e.one(k)?))));
    }
    said
}
