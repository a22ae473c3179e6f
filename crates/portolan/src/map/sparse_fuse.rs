//! Steps of fusing a scan into bricks.

use super::MapError;
use crate::cell::{Evidence, HitMiss, LogOddsValue, Planes};
use crate::geom::{BlockKey, Pose, block_cells};
use crate::scan::{BeamCounts, Projection, RangeImage, ScanStats};
use crate::store::Bricks;
use crate::sweep::occupancy::{Bits, CellBox, Ray, Tally};

/// A brick's place among the marked ones, and whether all of it is free, among the seen ones.
pub(super) type Parts = (Option<u32>, Option<bool>);

/// Marked and seen bricks together, ascending, as both are.
pub(super) fn union(marked: &[BlockKey<3>], seen: &[(BlockKey<3>, bool)]) -> (Vec<BlockKey<3>>, Vec<Parts>) {
    let (mut i, mut j) = (0, 0);
    let (mut keys, mut parts) = (Vec::new(), Vec::new());
    while i < marked.len() || j < seen.len() {
        let key = match (marked.get(i), seen.get(j)) {
            (Some(a), Some(b)) => *a.min(&b.0),
            (Some(a), None) => *a,
            (None, Some(b)) => b.0,
            (None, None) => break,
        };
        let is_marked = marked.get(i) == Some(&key);
        let free = seen.get(j).filter(|b| b.0 == key).map(|b| b.1);
        keys.push(key);
        parts.push((is_marked.then_some(i as u32), free));
        i += usize::from(is_marked);
        j += usize::from(free.is_some());
    }
    (keys, parts)
}

/// The box around a sensor in which pixels without a surface say that space is free, as its diagonal. Not those of more than
/// `longest` metres, which are refused.
pub(super) fn free_reach(world_from_image: &Pose<3>, image: &RangeImage, longest: f64) -> Vec<Ray> {
    let used = |v: &f32| f64::from(-v) <= longest;
    let farthest = image.values.iter().copied().filter(used).fold(0.0f32, f32::min);
    if farthest == 0.0 || matches!(image.projection, Projection::Orthographic { .. }) {
        return Vec::new();
    }
    // Depths of a camera are shorter than its rays, by less than this for any that sees forwards.
    let r = 2.0 * f64::from(-farthest);
    let o = world_from_image.translation;
    vec![Ray { origin: o.map(|v| v - r), end: o.map(|v| v + r), hit: false, passes: false }]
}

/// Fuses bits brick by brick; returns the number of cells.
pub(super) fn fuse<V: LogOddsValue>(
    store: &mut Bricks<V, 3>,
    rule: &V::Rule,
    bounds: Option<CellBox>,
    keys: &[BlockKey<3>],
    bits: impl Fn(usize) -> Bits + Sync + Send,
) -> Result<u64, MapError> {
    let change = |i: usize, brick: &mut Option<V::Brick>, (): &mut ()| {
        let mut bits = bits(i);
        if let Some(mask) = bounds.and_then(|b| b.mask(keys[i])) {
            for w in 0..8 {
                bits.hit[w] &= mask[w];
                bits.miss[w] &= mask[w];
            }
        }
        let evidence = HitMiss::from_words(bits.hit, bits.miss);
        let observed = evidence.observed();
        if observed > 0 {
            V::fuse_brick(
                brick.get_or_insert_with(|| V::Brick::unobserved(block_cells::<3>())),
                &evidence,
                rule,
            );
        }
        observed
    };
    Ok(store.update(keys, || (), change)?)
}

pub(super) fn stats(hits: usize, count: usize, tally: Tally, cells: u64) -> ScanStats {
    let mut stats = ScanStats { scans: 1, cells, hits_outside: tally.hits_outside, ..Default::default() };
    let dropped = tally.refused.total();
    let hit = (hits as u64).saturating_sub(tally.refused_hits);
    let max_range = (count as u64).saturating_sub(hit + dropped);
    stats.beams = BeamCounts { hit, max_range, dropped, ..Default::default() };
    stats.refused = tally.refused;
    stats
}
