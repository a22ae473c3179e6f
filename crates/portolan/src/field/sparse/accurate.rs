//! The accurate field: made, and kept up to date with its map.

use super::anchors::{Anchor, bounds};
use super::crossings::Crossings;
use super::edges::edge_distances;
use super::feature::Feature;
use super::kernels::observes;
use super::level::Input;
use super::pass::{map_each, map_each_with};
use super::planes::{EsdfBrick, Nearest};
use super::reach::{Reach, within};
use super::settings::EsdfUpdate;
use super::sparse_esdf::SparseEsdf;
use crate::cell::SignedDistance;
use crate::field::elements::Refine;
use crate::geom::{BlockKey, block_cells};
use crate::store::Bricks;
use std::sync::Arc;

/// Cells around what is solved again in which distances to the surface may have changed: a cell's surface is looked for
/// around what its neighbours found, and an element reaches as far as its cell.
const AROUND: f32 = 3.0;

impl<const D: usize> SparseEsdf<D> {
    /// Solves again what changed in the map and what is within reach of it.
    pub(super) fn follow(&mut self, store: &Bricks<SignedDistance, D>) -> EsdfUpdate {
        let changed = store.changed_since(self.epoch);
        self.epoch = store.epoch();
        let first = self.keys.is_empty();
        let mut uncovered = Vec::new();
        if self.settings.unknown {
            uncovered = changed.iter().copied().filter(|&key| self.uncovered(store, key)).collect();
        }
        let moved = self.come_and_go(store, &changed);
        let touched = self.surface.update(store, &changed);
        let reach = self.limit().sqrt();
        let (dirty, stale) = if first {
            (self.keys(), self.keys())
        } else {
            // An edge reaches into the brick above.
            let mut dirty = within(&touched, (reach + 1.0).powi(2));
            dirty.extend_from_slice(&moved);
            let mut stale = within(&touched, (reach + AROUND).powi(2));
            stale.extend(within(&moved, AROUND.powi(2)));
            stale.extend_from_slice(&changed);
            (self.held(dirty), self.held(stale))
        };
        self.solve(&dirty);
        let planes = map_each_with(&stale, Refine::new, |&key, refine| self.measured(store, key, refine));
        for (key, plane) in stale.iter().zip(planes) {
            if let Some(slot) = self.slot(*key) {
                self.bricks[slot].distance = plane;
            }
        }
        if self.settings.unknown {
            let around = within(&uncovered, (reach + 1.0).powi(2));
            let dirty = if first { self.keys() } else { self.held(around) };
            self.solve_unknown(store, &dirty);
        }
        EsdfUpdate {
            changed: changed.len(),
            touched: touched.len(),
            solved: dirty.len(),
            measured: stale.len(),
        }
    }

    /// Bricks that hold an observed cell now and did not, or the other way round, are added or removed. Returns them.
    fn come_and_go(
        &mut self,
        store: &Bricks<SignedDistance, D>,
        changed: &[BlockKey<D>],
    ) -> Vec<BlockKey<D>> {
        let min_weight = self.settings.min_weight;
        let observed = map_each(changed, |&key| {
            store.brick(key).is_some_and(|brick| observes(brick.weights(), min_weight))
        });
        let mut moved = Vec::new();
        let empty = EsdfBrick { distance: Arc::new([]), nearest: None, unknown: None };
        for (&key, observed) in changed.iter().zip(observed) {
            match (observed, self.slot(key)) {
                (true, None) => self.add(key, empty.clone()),
                (false, Some(slot)) => self.remove(key, slot),
                _ => continue,
            }
            moved.push(key);
        }
        moved
    }

    /// The nearest crossings of all cells of bricks (ascending).
    fn solve(&mut self, dirty: &[BlockKey<D>]) {
        let limit = self.limit();
        let whole = dirty.len() == self.keys.len();
        let around =
            if whole { dirty.to_vec() } else { self.held(within(dirty, (limit.sqrt() + 1.0).powi(2))) };
        let anchors = map_each(&around, |&key| {
            let crossings = self.surface.brick(key)?;
            Anchor::of_crossings(key, crossings)
        });
        let budgets = bounds(&around, anchors, limit);
        let mut wanted = dirty.iter().peekable();
        let outputs = around.iter().zip(budgets).filter(|(key, _)| wanted.next_if_eq(key).is_some());
        let outputs = outputs.map(|(&key, budget)| Reach { key, budget }).collect();
        let edges = around.iter().filter_map(|&key| Some(Input { key, source: self.surface.brick(key)? }));
        let edges: Vec<_> = edges.collect();
        let level = edge_distances(&edges, outputs, |_, _, power, features| {
            for (power, feature) in power.iter_mut().zip(features) {
                let beyond = *power > limit;
                *power = if beyond { f32::INFINITY } else { *power };
                *feature = if beyond { Feature::NONE.0 } else { *feature };
            }
        });
        let cells = block_cells::<D>();
        let planes: Vec<_> = level.values.chunks_exact(cells).zip(level.words.chunks_exact(cells)).collect();
        let nearest = map_each(&planes, |(power, feature)| {
            Arc::new(Nearest { power: (*power).into(), feature: (*feature).into() })
        });
        for (key, nearest) in level.keys.iter().zip(nearest) {
            if let Some(slot) = self.slot(*key) {
                self.bricks[slot].nearest = Some(nearest);
            }
        }
    }

    /// Signed distances of a brick.
    fn measured(
        &self,
        store: &Bricks<SignedDistance, D>,
        key: BlockKey<D>,
        refine: &mut Refine<D>,
    ) -> Arc<[f32]> {
        let mut plane = vec![f32::NAN; block_cells::<D>()];
        if let (Some(brick), Some(slot)) = (store.brick(key), self.slot(key)) {
            if let Some(nearest) = &self.bricks[slot].nearest {
                let beside = |axis: usize, side: usize| {
                    let mut at = key;
                    at.0[axis] += 2 * side as i32 - 1;
                    let nearest = self.bricks[self.slot(at)?].nearest.as_ref()?;
                    Some(&*nearest.feature)
                };
                refine.brick(&self.surface, key, &nearest.feature, beside, &mut plane);
            }
            let resolution = self.lattice.resolution as f32;
            let cells = brick.distances().iter().zip(brick.weights());
            for (value, (&d, &w)) in plane.iter_mut().zip(cells) {
                let length = *value * resolution;
                let length = if length <= self.max_distance { length } else { f32::INFINITY };
                let signed = if d < 0.0 { -length } else { length };
                *value = if (w > 0.0) & (w >= self.settings.min_weight) { signed } else { f32::NAN };
            }
        }
        plane.into()
    }

    /// Squared cells up to which the transform is exact: what certifies the largest distance.
    fn limit(&self) -> f32 {
        let reach = self.settings.reach_cells(self.lattice.resolution);
        (reach * reach + 0.25 * D as f64) as f32
    }

    /// Those of bricks that the field holds, ascending, each once.
    pub(super) fn held(&self, mut keys: Vec<BlockKey<D>>) -> Vec<BlockKey<D>> {
        keys.retain(|key| self.slots.contains_key(key));
        keys.sort_unstable();
        keys.dedup();
        keys
    }
}

#[cfg(test)]
#[path = "accurate_tests.rs"]
mod tests;
