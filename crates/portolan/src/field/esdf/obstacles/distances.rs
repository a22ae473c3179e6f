//! How far the nearest obstacle is that is a point.

use crate::field::Esdf;
use crate::field::esdf::cell_distances::cell_distances;
use crate::field::esdf::transform::{FromCenters, within};
use crate::geom::BlockKey;

impl<const D: usize> Esdf<D> {
    /// Squared distances (cells) to the nearest point obstacle, of bricks (ascending).
    pub(in crate::field::esdf) fn solve_points(&mut self, dirty: &[BlockKey<D>]) {
        let reach = self.reach_cells() as f32;
        let whole = dirty.len() == self.keys.len();
        let around = if whole { dirty.to_vec() } else { self.held(within(dirty, (reach + 1.0).powi(2))) };
        for &key in dirty {
            if let Some(slot) = self.slot(key) {
                self.bricks[slot].points = None;
            }
        }
        let points = |key| self.slot(key).map(|s| self.bricks[s].sides.points).unwrap_or_default();
        if !around.iter().any(|&key| points(key).any()) {
            return;
        }
        let solved = cell_distances(FromCenters, &around, dirty, reach * reach, points, |_| None, |_| true);
        for (key, plane) in solved {
            if let Some(slot) = self.slot(key).filter(|_| plane.iter().any(|v| v.is_finite())) {
                self.bricks[slot].points = Some(plane);
            }
        }
    }
}
