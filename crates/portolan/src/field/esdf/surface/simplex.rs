//! Distances to elements in f64, for queries at any point.

use crate::geom::vector::point_segment;
use crate::surface::point_triangle_sq;

/// Squared distance from a point to a segment or a triangle, in the unit of both.
#[inline]
pub(crate) fn simplex_distance_sq<const D: usize>(p: [f64; D], simplex: &[[f32; D]; D]) -> f64 {
    let corner = |i: usize| simplex[i].map(f64::from);
    if D == 2 {
        return point_segment(p, corner(0), corner(1)).0.powi(2);
    }
    let space = |p: [f64; D]| [0, 1, 2].map(|k| p[k]);
    point_triangle_sq(space(p), [0, 1, 2].map(|i| space(corner(i))))
}
