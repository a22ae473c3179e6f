//! The accurate field: made, and kept up to date with its map.

use super::TOGETHER;
use super::bricks::{EsdfBrick, Nearest, Sides};
use super::cell_mask::CellMask;
use super::field::Esdf;
use super::measure::NodeDistances;
use super::obstacles::{ObstacleCells, with_neighbors};
use super::settings::EsdfUpdate;
use super::transform::{Feature, Input, Output, Witness, bounds, edge_distances, within};
use crate::cell::SignedDistance;
use crate::geom::{BlockKey, block_cells};
use crate::parallel;
use crate::store::Bricks;
use std::sync::Arc;

/// Cells around what is solved again in which distances to the surface may have changed: a cell's surface is looked for
/// around what its neighbours found, and an element reaches as far as its cell.
const AROUND: f32 = 3.0;

impl<const D: usize> Esdf<D> {
    /// Solves again what changed in the map and what is within reach of it.
    pub(super) fn follow(
        &mut self,
        store: &Bricks<SignedDistance, D>,
        cells: Option<&ObstacleCells<D>>,
    ) -> EsdfUpdate {
        let changed = store.changed_since(self.epoch);
        self.epoch = store.epoch();
        let first = self.keys.is_empty();
        let renewed = cells.map_or_else(Vec::new, |cells| self.take_candidates(cells));
        let mut looked_at = changed.clone();
        looked_at.extend_from_slice(&renewed);
        looked_at.sort_unstable();
        looked_at.dedup();
        let (moved, uncovered) = self.look_at(store, &looked_at);
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
        let pointed = {
            let mut may_be = with_neighbors(&looked_at);
            may_be.extend(with_neighbors(&touched));
            may_be.extend(with_neighbors(&dirty));
            let may_be = self.held(may_be);
            let mut pointed = self.find_points(store, &may_be);
            // What was a point may be in a brick that is gone.
            pointed.extend_from_slice(&moved);
            self.held(within(&pointed, (reach + 1.0).powi(2)))
        };
        self.solve_points(&pointed);
        self.has_points = self.bricks.iter().any(|brick| brick.sides.points.any());
        // To be measured when it is read.
        for key in stale.iter().chain(&pointed) {
            if let Some(slot) = self.slot(*key) {
                self.bricks[slot].distance = Arc::default();
            }
        }
        if self.settings().unknown {
            let around = within(&uncovered, (reach + 1.0).powi(2));
            let dirty = if first { self.keys() } else { self.held(around) };
            self.solve_unknown(&dirty);
        }
        EsdfUpdate { changed: changed.len(), touched: touched.len(), solved: dirty.len(), stale: stale.len() }
    }

    /// Looks at which cells of the changed bricks were observed. Bricks that hold one now and did not, or the other way
    /// round, are added or removed: returns them, and all in which other cells are observed.
    fn look_at(
        &mut self,
        store: &Bricks<SignedDistance, D>,
        changed: &[BlockKey<D>],
    ) -> (Vec<BlockKey<D>>, Vec<BlockKey<D>>) {
        let min_weight = self.min_weight();
        let sides = parallel::map(changed, TOGETHER, |&key| {
            let sides = store.brick(key).map_or(Sides::default(), |brick| Sides::of(brick, min_weight));
            // Points are looked for when the surface is there.
            self.slot(key).map_or(sides, |slot| sides.with_points_of(&self.bricks[slot].sides))
        });
        let (mut moved, mut uncovered) = (Vec::new(), Vec::new());
        for (&key, sides) in changed.iter().zip(sides) {
            let slot = self.slot(key);
            match (sides.any() || self.candidates.contains_key(&key), slot) {
                (true, None) => self.add(key, EsdfBrick::new(sides)),
                (false, Some(slot)) => self.remove(key, slot),
                (false, None) => continue,
                (true, Some(slot)) => {
                    let before = &mut self.bricks[slot].sides;
                    if !before.same_cells(&sides) {
                        uncovered.push(key);
                    }
                    if **before != sides {
                        *before = Arc::new(sides);
                    }
                    continue;
                }
            }
            moved.push(key);
            uncovered.push(key);
        }
        (moved, uncovered)
    }

    /// Takes over where something stops beams; returns the bricks in which that is not what it was, ascending.
    fn take_candidates(&mut self, cells: &ObstacleCells<D>) -> Vec<BlockKey<D>> {
        let mut keys = cells.keys();
        keys.extend(self.candidates.keys());
        keys.sort_unstable();
        keys.dedup();
        let before = |key: &BlockKey<D>| self.candidates.get(key).copied().unwrap_or_default();
        keys.retain(|key| before(key) != cells.brick(key));
        if !keys.is_empty() {
            let candidates = Arc::make_mut(&mut self.candidates);
            for key in &keys {
                match cells.brick(key) {
                    said if said.any() => drop(candidates.insert(*key, said)),
                    CellMask { .. } => drop(candidates.remove(key)),
                }
            }
        }
        keys
    }

    /// The nearest crossings of all cells of bricks (ascending).
    fn solve(&mut self, dirty: &[BlockKey<D>]) {
        let limit = self.limit();
        let whole = dirty.len() == self.keys.len();
        let around =
            if whole { dirty.to_vec() } else { self.held(within(dirty, (limit.sqrt() + 1.0).powi(2))) };
        let witnesses = parallel::map(&around, TOGETHER, |&key| {
            let crossings = self.surface.brick(key)?;
            Witness::of_crossings(key, crossings)
        });
        let budgets = bounds(&around, witnesses, limit);
        let mut wanted = dirty.iter().peekable();
        let outputs = around.iter().zip(budgets).filter(|(key, _)| wanted.next_if_eq(key).is_some());
        let outputs = outputs.map(|(&key, budget)| Output { key, budget }).collect();
        let edges = around.iter().filter_map(|&key| Some(Input { key, source: self.surface.brick(key)? }));
        let edges: Vec<_> = edges.collect();
        let solved = edge_distances(&edges, outputs, |_, power, features| {
            for (power, feature) in power.iter_mut().zip(&mut *features) {
                let beyond = *power > limit;
                *power = if beyond { f32::INFINITY } else { *power };
                *feature = if beyond { Feature::NONE.0 } else { *feature };
            }
            Arc::new(Nearest { power: (&*power).into(), feature: (&*features).into() })
        });
        for (key, nearest) in solved {
            if let Some(slot) = self.slot(key) {
                self.bricks[slot].nearest = Some(nearest);
            }
        }
    }

    /// Signed distances of a brick, measured to the surface around what the transform found.
    pub(super) fn measured(&self, slot: usize, scratch: &mut NodeDistances<D>) -> Box<[f32]> {
        let (key, brick) = (self.keys[slot], &self.bricks[slot]);
        let mut plane = vec![f32::INFINITY; block_cells::<D>()];
        if let Some(nearest) = &brick.nearest {
            let beside = |axis: usize, side: usize| {
                let mut at = key;
                at.0[axis] += 2 * side as i32 - 1;
                let nearest = self.bricks[self.slot(at)?].nearest.as_ref()?;
                Some(&*nearest.feature)
            };
            scratch.brick(&self.surface, key, &nearest.feature, beside, &mut plane);
        }
        if let Some(points) = &brick.points {
            plane.iter_mut().zip(&**points).for_each(|(value, sq)| *value = value.min(sq.sqrt()));
        }
        let resolution = self.lattice.resolution as f32;
        for (i, value) in plane.iter_mut().enumerate() {
            let length = *value * resolution;
            let length = if length <= self.max_distance { length } else { f32::INFINITY };
            let signed = if brick.sides.inside(i) { -length } else { length };
            *value = if brick.sides.known(i) { signed } else { f32::NAN };
        }
        plane.into()
    }

    /// Squared cells up to which the transform is exact: what certifies the largest distance.
    pub(super) fn limit(&self) -> f32 {
        let reach = self.reach_cells();
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
#[path = "follow_tests.rs"]
mod tests;
