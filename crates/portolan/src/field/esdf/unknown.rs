//! How far the nearest cell is that was never observed.

use super::TOGETHER;
use super::field::Esdf;
use super::transform::{
    FromBoxes, Input, Output, Source, Witness, bounds, furthest_of_cells, layout, squared_distances, within,
};
use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::{BlockKey, block_cells};
use crate::parallel;
use crate::store::Bricks;
use std::sync::Arc;

/// Cells that were not observed, as boxes, of one brick of the map.
struct Boxes<'a> {
    brick: &'a DistanceBrick,
    min_weight: f32,
    /// Place of every cell in the layout of the first pass.
    places: &'a [u16],
}

impl Source for Boxes<'_> {
    fn values<'s>(&'s self, scratch: &'s mut [Vec<f32>; 2]) -> &'s [f32] {
        let values = &mut scratch[0];
        values.resize(self.places.len(), 0.0);
        for (&weight, &place) in self.brick.weights().iter().zip(self.places) {
            values[place as usize] = if observed(weight, self.min_weight) { f32::INFINITY } else { 0.0 };
        }
        values
    }
}

fn observed(weight: f32, min_weight: f32) -> bool {
    (weight > 0.0) & (weight >= min_weight)
}

impl<const D: usize> Esdf<D> {
    /// Distances to the nearest unknown cell of bricks (ascending): squared cells, to the cell as a box, from centers; 0 in
    /// unknown cells, infinite beyond the largest distance. Cells without a brick are unknown.
    ///
    /// The cost of a way is separable, `max(0, |k| - 1/2)^2` per axis, so that the passes are those of any other transform.
    pub(super) fn solve_unknown(&mut self, store: &Bricks<SignedDistance, D>, dirty: &[BlockKey<D>]) {
        let reach = self.reach_cells() as f32;
        let limit = reach * reach;
        let whole = dirty.len() == self.keys.len();
        let around = if whole { dirty.to_vec() } else { self.held(within(dirty, (reach + 1.0).powi(2))) };
        let farthest = furthest_of_cells::<D>();
        let witnesses = parallel::map(&around, TOGETHER, |&key| self.unknown_near(store, key, &farthest));
        let mut wanted = dirty.iter().peekable();
        let outputs = around.iter().zip(bounds(&around, witnesses, limit));
        // Ways are half a cell shorter along each axis than those from center to center, of which bricks know.
        let outputs = outputs
            .filter(|(key, _)| wanted.next_if_eq(key).is_some())
            .map(|(&key, bound)| Output { key, budget: (bound.sqrt() + 1.0).powi(2) })
            .collect();
        let places: Vec<u16> = (0..block_cells::<D>()).map(|i| layout::<D>(0, i) as u16).collect();
        let min_weight = self.min_weight();
        let boxes: Vec<_> = around
            .iter()
            .filter_map(|&key| {
                Some(Input { key, source: Boxes { brick: store.brick(key)?, min_weight, places: &places } })
            })
            .collect();
        let held = |key: &BlockKey<D>| self.slots.contains_key(key);
        let stage = squared_distances(FromBoxes, &boxes, outputs, held, |_, values| {
            values.iter_mut().for_each(|v| *v = if *v <= limit { *v } else { f32::INFINITY });
        });
        let planes: Vec<&[f32]> = stage.values.chunks_exact(block_cells::<D>()).collect();
        let planes = parallel::map(&planes, TOGETHER, |plane| Arc::<[f32]>::from(*plane));
        for (key, plane) in stage.keys.iter().zip(planes) {
            if let Some(slot) = self.slot(*key) {
                self.bricks[slot].unknown = Some(plane);
            }
        }
    }

    /// The unknown cell in a brick, or beside it in one that is not there, that is the least far from all of its cells.
    fn unknown_near(
        &self,
        store: &Bricks<SignedDistance, D>,
        key: BlockKey<D>,
        farthest: &[f32],
    ) -> Option<Witness<D>> {
        let at = |cell| Witness { cell, offset: [0.0; D], value: 0.0 };
        let weights = store.brick(key).map_or(&[][..], |brick| brick.weights());
        let cells = weights.iter().zip(farthest).enumerate();
        let unknown = cells.filter(|(_, (w, _))| !observed(**w, self.min_weight()));
        let nearest = unknown.min_by(|a, b| a.1.1.total_cmp(b.1.1));
        if let Some((i, _)) = nearest {
            return Some(at(key.cell(i)));
        }
        let beside = (0..D).flat_map(|k| [(k, -1), (k, 8)]).find_map(|(k, step)| {
            let mut cell = key.first_cell().map(|c| c + 3);
            cell[k] += step - 3;
            (!self.slots.contains_key(&BlockKey::of_cell(cell))).then_some(cell)
        });
        beside.map(at)
    }
}
