//! How far the nearest cell is that was never observed.

use super::cell_distances::cell_distances;
use super::field::Esdf;
use super::transform::{FromBoxes, within};
use crate::geom::BlockKey;

impl<const D: usize> Esdf<D> {
    /// Distances to the nearest unknown cell of bricks (ascending): squared cells, to the cell as a box, from centers; 0 in
    /// unknown cells, infinite beyond the largest distance. Cells without a brick are unknown.
    pub(super) fn solve_unknown(&mut self, dirty: &[BlockKey<D>]) {
        let reach = self.reach_cells() as f32;
        let whole = dirty.len() == self.keys.len();
        let around = if whole { dirty.to_vec() } else { self.held(within(dirty, (reach + 1.0).powi(2))) };
        let unknown =
            |key| self.slot(key).map(|s| self.bricks[s].sides.unobserved::<D>()).unwrap_or_default();
        let held = |key: &BlockKey<D>| self.slots.contains_key(key);
        let beside = |key| self.missing_beside(key);
        let solved = cell_distances(FromBoxes, &around, dirty, reach * reach, unknown, beside, held);
        for (key, plane) in solved {
            if let Some(slot) = self.slot(key) {
                self.bricks[slot].unknown = Some(plane);
            }
        }
    }

    /// A cell beside a brick, in one that is not there.
    fn missing_beside(&self, key: BlockKey<D>) -> Option<[i32; D]> {
        (0..D).flat_map(|k| [(k, -1), (k, 8)]).find_map(|(k, step)| {
            let mut cell = key.first_cell().map(|c| c + 3);
            cell[k] += step - 3;
            (!self.slots.contains_key(&BlockKey::of_cell(cell))).then_some(cell)
        })
    }
}
