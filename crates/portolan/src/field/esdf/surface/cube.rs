//! The surface between the nodes of one cell.

use crate::geom::vector::{cross3, dot, sub};
use crate::surface::{Ambiguity, cubes, squares};

/// Edges between the nodes of a cell, at most (of a cube).
const EDGES: usize = 12;

/// The surface between `2^D` neighbouring nodes, as marching squares and marching cubes have it; scratch that is used
/// again for every cell.
#[derive(Clone, Debug, Default)]
pub(super) struct CellSurface<const D: usize> {
    /// Segments or triangles, free space on the left or in front: in cells from the lowest node.
    pub(super) simplices: Vec<[[f32; D]; D]>,
    /// Edges with a crossing, a bit each.
    pub(super) crossed: u16,
    /// Where each crossed edge is crossed, in cells from its lower node.
    pub(super) place: [f32; EDGES],
    /// For each crossed edge, squared radius (cells) within which its crossing answers for this cell's surface: of the
    /// largest of the smallest balls around the simplices at it. `D / 4`, which is enough for any points of the cell,
    /// where simplices have corners that are no crossings.
    pub(super) radius_sq: [f64; EDGES],
}

/// Axis of an edge of a cell, and the corner where it starts (x + 2 y + 4 z).
#[inline]
pub(super) fn edge_start<const D: usize>(edge: usize) -> (usize, usize) {
    if D == 2 {
        // Marching squares goes around counter-clockwise.
        return [(0, 0), (1, 1), (0, 2), (1, 0)][edge];
    }
    let (axis, corner) = cubes::edge_start(edge as u8);
    (axis, usize::from(corner))
}

impl<const D: usize> CellSurface<D> {
    /// Sets it to the surface between nodes with these values (x fastest), which were all observed and are of both signs.
    pub(super) fn set(&mut self, d: &[f32; 8]) {
        self.simplices.clear();
        self.crossed = 0;
        self.radius_sq = [0.0; EDGES];
        match D {
            2 => {
                let around = [d[0], d[1], d[3], d[2]];
                let case =
                    around.iter().enumerate().fold(0, |case, (n, &v)| case | usize::from(v < 0.0) << n);
                self.cross(4, |a, b| squares::crossing_place(a, b) as f32, d);
                for s in squares::segments(case, &around, Ambiguity::Decide) {
                    self.add(std::array::from_fn(|k| usize::from(s[k])), &[]);
                }
            }
            _ => {
                let (triangles, centres) = cubes::cube_patch(d);
                self.cross(EDGES, cubes::crossing_place, d);
                for t in triangles {
                    self.add(std::array::from_fn(|k| usize::from(t[k])), centres);
                }
                if !centres.is_empty() {
                    self.radius_sq = [0.25 * D as f64; EDGES];
                }
            }
        }
    }

    fn cross(&mut self, edges: usize, place: impl Fn(f32, f32) -> f32, d: &[f32; 8]) {
        for edge in 0..edges {
            let (axis, corner) = edge_start::<D>(edge);
            let (a, b) = (d[corner], d[corner | 1 << axis]);
            if (a < 0.0) != (b < 0.0) {
                self.crossed |= 1 << edge;
                self.place[edge] = place(a, b);
            }
        }
    }

    /// The corner of a simplex: a crossing, or behind those a mean of crossings.
    fn corner(&self, v: usize, centres: &[Vec<u8>]) -> [f32; D] {
        if v < EDGES {
            let (axis, corner) = edge_start::<D>(v);
            let at = |k: usize| if k == axis { self.place[v] } else { (corner >> k & 1) as f32 };
            return std::array::from_fn(at);
        }
        let around = &centres[v - EDGES];
        let share = 1.0 / around.len() as f32;
        around.iter().fold([0.0; D], |mean, &edge| {
            let p = self.corner(usize::from(edge), centres);
            std::array::from_fn(|k| mean[k] + share * p[k])
        })
    }

    fn add(&mut self, corners: [usize; D], centres: &[Vec<u8>]) {
        let simplex = corners.map(|v| self.corner(v, centres));
        let radius_sq = enclosing_radius_sq(&simplex);
        for v in corners.into_iter().filter(|&v| v < EDGES) {
            self.radius_sq[v] = self.radius_sq[v].max(radius_sq);
        }
        self.simplices.push(simplex);
    }
}

/// Squared radius of the smallest ball around a segment or a triangle: half the longest side, or the circle through all
/// corners of a triangle whose angles are all acute.
///
/// The largest distance from a point of the triangle to its nearest corner would not do: the foot of a perpendicular
/// from outside may lie on a side, and then half the side is what lies between.
pub(super) fn enclosing_radius_sq<const D: usize>(simplex: &[[f32; D]; D]) -> f64 {
    let corner = |i: usize| simplex[i].map(f64::from);
    let side_sq = |i: usize, j: usize| {
        let s = sub(corner(i), corner(j));
        dot(s, s)
    };
    if D == 2 {
        return 0.25 * side_sq(0, 1);
    }
    let sides = [side_sq(1, 2), side_sq(2, 0), side_sq(0, 1)];
    let longest = sides.iter().fold(0.0, |a: f64, &b| a.max(b));
    if longest >= sides.iter().sum::<f64>() - longest {
        return 0.25 * longest;
    }
    let spread = |i: usize| {
        let s = sub(corner(i), corner(0));
        [0, 1, 2].map(|k| s[k])
    };
    let normal = cross3(spread(1), spread(2));
    sides.iter().product::<f64>() / (4.0 * dot(normal, normal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::distance;

    #[test]
    fn balls_hold_their_simplices() {
        assert_eq!(enclosing_radius_sq(&[[0.0f32, 0.0], [3.0, 4.0]]), 6.25);
        // Right-angled, obtuse, acute, and none at all.
        assert_eq!(enclosing_radius_sq(&[[0.0f32, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]), 6.25);
        assert_eq!(enclosing_radius_sq(&[[0.0f32, 0.0, 0.0], [4.0, 0.0, 0.0], [2.0, 0.5, 0.0]]), 4.0);
        let equilateral = [[1.0f32, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!((enclosing_radius_sq(&equilateral) - 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(enclosing_radius_sq(&[[1.0f32; 3]; 3]), 0.0);
    }

    /// A ridge seen from above its side: the nearest point lies half way along the ridge, and the corners answer for it
    /// only if they count half of it.
    #[test]
    fn a_ridge_needs_half_of_its_length() {
        let (a, b, x) = ([-1.0f32, 0.0, 0.0], [1.0f32, 0.0, 0.0], [0.0f64, 0.0, 1.0]);
        let sides = [0.3f32, -0.3].map(|y| [a, b, [0.0, y, -0.3]]);
        let bound = |radius_sq: &dyn Fn(&[[f32; 3]; 3]) -> f64| {
            let parabolas = sides.iter().flat_map(|t| t.iter().map(move |c| (t, c)));
            let at = parabolas.map(|(_, c)| {
                let around = sides.iter().filter(|t| t.contains(c)).map(radius_sq).fold(0.0, f64::max);
                distance(x, c.map(f64::from)).powi(2) - around
            });
            at.fold(f64::INFINITY, f64::min)
        };
        // The ridge is 1 away, its ends the square root of 2.
        assert!(bound(&enclosing_radius_sq) <= 1.0);
        // The largest distance of a point of the triangle to the nearest corner is less than half of the ridge.
        let naive = |t: &[[f32; 3]; 3]| {
            let n = 200;
            let points =
                (0..=n).flat_map(|i| (0..=n - i).map(move |j| (i as f32 / n as f32, j as f32 / n as f32)));
            let nearest = points.map(|(u, v)| {
                let p: [f64; 3] = std::array::from_fn(|k| {
                    f64::from(t[0][k] + u * (t[1][k] - t[0][k]) + v * (t[2][k] - t[0][k]))
                });
                t.iter().map(|c| distance(p, c.map(f64::from))).fold(f64::INFINITY, f64::min)
            });
            nearest.fold(0.0, f64::max).powi(2)
        };
        assert!(bound(&naive) > 1.1);
    }
}
