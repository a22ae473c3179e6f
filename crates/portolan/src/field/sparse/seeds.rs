//! What seeds the transform, and how far each brick needs to look for it.

use rustc_hash::FxHashMap;

use super::pass::{Level, for_each, layout};
use super::reach::Reach;
use super::sparse_esdf::SparseEsdfSettings;
use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};
use crate::store::{Bricks, Store};

/// A seed of a brick: from any cell there is no more than the way to it.
#[derive(Clone, Copy)]
struct Anchor<const D: usize> {
    cell: [i32; D],
    value: f32,
}

impl<const D: usize> Anchor<D> {
    /// The largest of the least squared distances in a brick is at most this.
    fn bound(&self, key: BlockKey<D>) -> f32 {
        let first = key.first_cell();
        let mut sum = self.value;
        for k in 0..D {
            let low = self.cell[k] - first[k];
            let far = low.abs().max((BLOCK_EDGE as i32 - 1 - low).abs()) as f32;
            sum += far * far;
        }
        sum
    }
}

/// The bricks with an observed cell, ascending; the seeds in those that have any, in the layout of the first pass;
/// and how far each brick must look, in squared cells and not beyond `limit`.
pub(super) struct Seeds<const D: usize> {
    pub(super) seeds: Level<D>,
    pub(super) bricks: Vec<Reach<D>>,
}

impl<const D: usize> Seeds<D> {
    /// Every observed cell within the band is a seed, `f = (D / r)^2`.
    pub(super) fn of(store: &Bricks<SignedDistance, D>, settings: &SparseEsdfSettings, limit: f32) -> Self {
        let cells = block_cells::<D>();
        let places: Vec<usize> = (0..cells).map(|i| layout::<D>(0, i)).collect();
        let inverse = (1.0 / store.lattice().resolution) as f32;
        let keys = store.keys();
        let mut found: Vec<Found<D>> = keys.iter().map(|_| Found::default()).collect();
        for_each(
            keys.iter().zip(&mut found).collect(),
            || (),
            |(&key, found), ()| {
                if let Some(brick) = store.brick(key) {
                    *found = Found::of(key, brick, settings, inverse, &places);
                }
            },
        );
        let mut seeds = Level { keys: Vec::new(), values: Vec::new() };
        let (mut observed, mut anchors) = (Vec::new(), Vec::new());
        for (key, found) in keys.into_iter().zip(found).filter(|(_, found)| found.observed) {
            observed.push(key);
            anchors.push(found.anchor);
            if !found.values.is_empty() {
                seeds.keys.push(key);
                seeds.values.extend(found.values);
            }
        }
        let bounds = bounds(&observed, anchors, limit);
        let bricks = observed.into_iter().zip(bounds).map(|(key, budget)| Reach { key, budget });
        Self { seeds, bricks: bricks.collect() }
    }
}

/// What one brick holds.
struct Found<const D: usize> {
    observed: bool,
    anchor: Option<Anchor<D>>,
    /// Its seeds; empty: none.
    values: Vec<f32>,
}

impl<const D: usize> Default for Found<D> {
    fn default() -> Self {
        Self { observed: false, anchor: None, values: Vec::new() }
    }
}

impl<const D: usize> Found<D> {
    fn of(
        key: BlockKey<D>,
        brick: &DistanceBrick,
        settings: &SparseEsdfSettings,
        inverse: f32,
        places: &[usize],
    ) -> Self {
        let mut found = Self::default();
        let mut best = f32::INFINITY;
        let cells = brick.distances().iter().zip(brick.weights());
        for (i, (&distance, &weight)) in cells.enumerate() {
            if !settings.observed(weight) {
                continue;
            }
            found.observed = true;
            let offset = distance * inverse;
            if !(offset.abs() <= settings.band_cells) {
                continue;
            }
            if found.values.is_empty() {
                found.values.resize(places.len(), f32::INFINITY);
            }
            let anchor = Anchor { cell: key.cell(i), value: offset * offset };
            found.values[places[i]] = anchor.value;
            let bound = anchor.bound(key);
            if bound < best {
                (best, found.anchor) = (bound, Some(anchor));
            }
        }
        found
    }
}

/// For each brick, what no least squared distance in it exceeds: by a seed of its own, or by one that its neighbours
/// handed on, from face to face. `limit` where that is less.
fn bounds<const D: usize>(keys: &[BlockKey<D>], mut anchors: Vec<Option<Anchor<D>>>, limit: f32) -> Vec<f32> {
    let slots: FxHashMap<BlockKey<D>, usize> = keys.iter().enumerate().map(|(i, &key)| (key, i)).collect();
    let bound = |anchor: &Option<Anchor<D>>, i: usize| {
        // A cell more than rounding could take away.
        anchor.as_ref().map_or(limit, |a| (a.bound(keys[i]) * 1.001 + 0.01).min(limit))
    };
    let mut bounds: Vec<f32> = anchors.iter().enumerate().map(|(i, a)| bound(a, i)).collect();
    let mut since: Vec<u32> = anchors.iter().map(|a| if a.is_some() { 0 } else { u32::MAX }).collect();
    let mut frontier: Vec<usize> = (0..keys.len()).filter(|&i| anchors[i].is_some()).collect();
    let mut round = 0;
    while !frontier.is_empty() {
        round += 1;
        let mut next = Vec::new();
        for &i in &frontier {
            for (k, step) in (0..D).flat_map(|k| [(k, -1), (k, 1)]) {
                let mut key = keys[i];
                key.0[k] += step;
                let Some(&j) = slots.get(&key) else { continue };
                let handed = bound(&anchors[i], j);
                if since[j] < round || handed >= bounds[j] {
                    continue;
                }
                if since[j] == u32::MAX {
                    since[j] = round;
                    next.push(j);
                }
                (bounds[j], anchors[j]) = (handed, anchors[i]);
            }
        }
        frontier = next;
    }
    bounds
}
