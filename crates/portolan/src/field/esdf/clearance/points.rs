//! The distance to the nearest obstacle that is a point.

use super::around::{NodesAround, QueryPoint};
use super::interval::{APART, Interval};
use super::search::{FURTHEST, box_distance_sq};
use crate::field::Esdf;
use crate::field::esdf::bricks::Sides;
use crate::geom::{BLOCK_EDGE, BlockKey};

impl<const D: usize> Esdf<D> {
    /// What is known of the brick of a cell, and the cell's place in it.
    pub(super) fn sides_at(&self, cell: [i32; D]) -> Option<(&Sides, usize)> {
        let slot = self.slot(BlockKey::of_cell(cell))?;
        Some((&self.bricks[slot].sides, BlockKey::offset(cell)))
    }

    /// Distance (cells) to the nearest point obstacle; not looked for closer than by its bounds where it is beyond `needed`,
    /// where `enough` decides, or beyond `FURTHEST` cells.
    pub(super) fn to_points(
        &self,
        point: &QueryPoint<D>,
        nodes: &NodesAround<'_, D>,
        needed: f64,
        enough: Option<f64>,
    ) -> Interval {
        let mut interval = Interval { lower: f64::INFINITY, upper: f64::INFINITY };
        if !self.has_points {
            return interval;
        }
        interval.lower = point.lower_bound(|i| nodes.points_sq(self, i)).unwrap_or(0.0);
        if interval.lower > needed {
            return interval;
        }
        for i in 0..1 << D {
            let at_node = nodes.points_at(i).map_or(f64::INFINITY, |sq| f64::from(sq).sqrt());
            interval.upper = interval.upper.min(at_node * (1.0 + 1e-6) + point.to_node(i));
        }
        let decided = enough.is_some_and(|e| point.decides(interval, e));
        // Up to a cell both bounds are exact, as those of the surface.
        let loose = interval.lower < 1.0 || interval.upper - interval.lower > APART && !decided;
        if loose && interval.upper <= FURTHEST {
            let found = self.search_points(point, interval.upper);
            interval = Interval { lower: found, upper: found };
        }
        interval.upper = interval.upper.max(interval.lower);
        interval
    }

    /// Distance (cells) to the nearest point obstacle, given that one is within `upper`.
    fn search_points(&self, point: &QueryPoint<D>, upper: f64) -> f64 {
        let mut best = upper * upper;
        point.bricks_within(upper, |key| {
            let p = point.relative(key.first_cell());
            if box_distance_sq(p, BLOCK_EDGE as f64 - 1.0) >= best {
                return;
            }
            let Some(slot) = self.slot(key) else { return };
            for i in self.bricks[slot].sides.points.cells() {
                let off = |k: usize| p[k] - (i >> (3 * k) & 7) as f64;
                best = best.min((0..D).map(|k| off(k) * off(k)).sum());
            }
        });
        best.sqrt()
    }
}
