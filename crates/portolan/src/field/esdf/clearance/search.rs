//! The exact distance to the surface, by looking at all elements that may be the nearest.

use super::around::QueryPoint;
use crate::field::Esdf;
use crate::field::esdf::surface::simplex_distance_sq;
use crate::geom::{BLOCK_EDGE, BlockKey};

/// Further away (cells) bounds are not tightened: they are as tight there, and a ball holds too many bricks.
pub(super) const FURTHEST: f64 = 24.0;

impl<const D: usize> QueryPoint<D> {
    /// Visits the bricks whose cells, or the nodes above them, are within `reach` (cells) along every axis, x fastest.
    pub(super) fn bricks_within(&self, reach: f64, mut visit: impl FnMut(BlockKey<D>)) {
        let from: [i32; D] = std::array::from_fn(|k| (self.floor(k, -reach) - BLOCK_EDGE as i32) >> 3);
        let to: [i32; D] = std::array::from_fn(|k| (self.floor(k, reach) + 1) >> 3);
        let mut key = BlockKey(from);
        loop {
            visit(key);
            let mut k = 0;
            while key.0[k] == to[k] {
                key.0[k] = from[k];
                k += 1;
                if k == D {
                    return;
                }
            }
            key.0[k] += 1;
        }
    }
}

impl<const D: usize> Esdf<D> {
    /// Distance (cells) to the nearest element, given one that is `upper` away. Looks into every brick that the ball of
    /// that radius meets; what is in it beside the nearest element is little.
    pub(super) fn search_elements(&self, point: &QueryPoint<D>, upper: f64) -> f64 {
        let mut best = upper * upper;
        point.bricks_within(upper, |key| self.search_brick(point, key, &mut best));
        best.sqrt()
    }

    #[inline]
    fn search_brick(&self, point: &QueryPoint<D>, key: BlockKey<D>, best: &mut f64) {
        let p = point.relative(key.first_cell());
        if box_distance_sq(p, BLOCK_EDGE as f64) >= *best {
            return;
        }
        let Some(brick) = self.surface.brick_elements(key) else { return };
        // Squared distances along each axis to the cells' intervals.
        let along: [[f64; BLOCK_EDGE]; D] =
            std::array::from_fn(|k| std::array::from_fn(|i| interval_distance_sq(p[k] - i as f64, 1.0)));
        for row in 0..BLOCK_EDGE.pow(D as u32 - 1) {
            let mut cells = brick.row(row);
            let across: f64 = (1..D).map(|k| along[k][row >> (3 * (k - 1)) & 7]).sum();
            while cells != 0 && across < *best {
                let x = cells.trailing_zeros() as usize;
                cells &= cells - 1;
                if across + along[0][x] < *best {
                    let at = x | row << 3;
                    let p = std::array::from_fn(|k| p[k] - (at >> (3 * k) & 7) as f64);
                    nearest_of(brick.cell(at), p, best);
                }
            }
        }
    }
}

/// Lowers `best` to the squared distance of the nearest of some simplices of one cell.
#[inline]
fn nearest_of<const D: usize>(simplices: &[[[f32; D]; D]], p: [f64; D], best: &mut f64) {
    for simplex in simplices {
        // No point of a simplex in a cell is nearer than its corners by more.
        let corner = |c: &[f32; D]| (0..D).map(|k| (p[k] - f64::from(c[k])).powi(2)).sum::<f64>();
        let nearest = simplex.iter().map(corner).fold(f64::INFINITY, f64::min);
        if nearest - 0.25 * (D as f64) < *best + 1e-6 {
            *best = best.min(simplex_distance_sq(p, simplex));
        }
    }
}

/// Squared distance from `v` to the interval from zero to `edge`.
#[inline(always)]
fn interval_distance_sq(v: f64, edge: f64) -> f64 {
    (-v).max(v - edge).max(0.0).powi(2)
}

/// Squared distance from `p` to the box from zero to `edge` along each axis.
#[inline(always)]
pub(super) fn box_distance_sq<const D: usize>(p: [f64; D], edge: f64) -> f64 {
    p.iter().map(|&v| interval_distance_sq(v, edge)).sum()
}
