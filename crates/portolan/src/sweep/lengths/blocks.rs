//! Which blocks are told apart cell by cell.

use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, Lattice};
use rustc_hash::FxHashSet;

/// Blocks in which a beam ever ended.
pub(crate) type HitBlocks<const D: usize> = FxHashSet<BlockKey<D>>;

/// A sweep that tells the cells of some blocks apart only.
pub(crate) trait KnowsHits<const D: usize> {
    /// The blocks in which a beam ever ended; a plan adds those of its scan.
    fn hit_blocks(&mut self) -> &mut HitBlocks<D>;
}

/// Whether the cells of a block are told apart: in 2-D always; in 3-D where a beam ever ended in it, since elsewhere nothing
/// stops beams, whatever their length, and free space is most of what there is. Also where only a part of it is inside of the
/// bounds, whose lengths would be spread over all of it.
#[inline]
pub(super) fn is_fine<const D: usize>(
    hit: &HitBlocks<D>,
    bounds: Option<&Aabb<D>>,
    lattice: &Lattice<D>,
    key: BlockKey<D>,
) -> bool {
    let reaches_out = |b: &Aabb<D>| {
        let (slack, edge) = (1e-3 * lattice.resolution, BLOCK_EDGE as f64 * lattice.resolution);
        let low = lattice.corner(key.first_cell());
        (0..D).any(|k| low[k] < b.min[k] - slack || low[k] + edge > b.max[k] + slack)
    };
    D == 2 || hit.contains(&key) || bounds.is_some_and(reaches_out)
}

/// A mean length as a whole number, up or down by chance, so that thin beams are not lost over many scans. The low bits are
/// chance enough, and the same ones every time.
#[inline(always)]
pub(super) fn shared_out(units: f64) -> u32 {
    let chance =
        ((units as f32).to_bits().wrapping_mul(0x9e37_79b9) >> 9) as f32 * (1.0 / (1u32 << 23) as f32);
    (units + f64::from(chance)) as u32
}
