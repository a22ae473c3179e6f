//! The cells that a ray crosses, in order.

use super::Lattice;

/// Visits the cells that a ray crosses, each once, from face neighbor to face neighbor (Amanatides & Woo 1987).
///
/// A ray exactly along a face belongs to the cells above it, as points do. A ray exactly through an edge steps along the
/// axes in ascending order.
#[derive(Clone, Copy, Debug)]
pub struct RayWalk<const D: usize> {
    cell: [i32; D],
    step: [i32; D],
    /// Arc length at which the ray leaves the current cell, per axis (meters).
    t_next: [f64; D],
    t_delta: [f64; D],
}

impl<const D: usize> RayWalk<D> {
    /// A walk from `origin` (world) along the unit vector `dir`. `None` where the cell index of the origin is out of range.
    #[inline]
    pub fn new(lattice: &Lattice<D>, origin: [f64; D], dir: [f64; D]) -> Option<Self> {
        let cell = lattice.cell_of(origin)?;
        let at = lattice.to_cells(origin);
        let mut walk = Self { cell, step: [0; D], t_next: [f64::INFINITY; D], t_delta: [f64::INFINITY; D] };
        for k in 0..D {
            // A component whose inverse overflows counts as zero.
            let inverse = lattice.resolution / dir[k].abs();
            if inverse.is_finite() {
                let inside = at[k] - f64::from(cell[k]);
                walk.step[k] = if dir[k] > 0.0 { 1 } else { -1 };
                walk.t_delta[k] = inverse;
                walk.t_next[k] = inverse * if dir[k] > 0.0 { 1.0 - inside } else { inside };
            }
        }
        Some(walk)
    }

    /// The current cell.
    #[inline(always)]
    pub fn cell(&self) -> [i32; D] {
        self.cell
    }

    /// Arc length at which the ray leaves the current cell (meters).
    #[inline(always)]
    pub fn exit(&self) -> f64 {
        let mut t = self.t_next[0];
        for k in 1..D {
            t = t.min(self.t_next[k]);
        }
        t
    }

    /// Current cell, step along each axis, arc length at the next face and from face to face: for sweeps with a loop of their
    /// own over the same cells.
    #[inline(always)]
    pub(crate) fn into_parts(self) -> ([i32; D], [i32; D], [f64; D], [f64; D]) {
        (self.cell, self.step, self.t_next, self.t_delta)
    }

    /// Steps into the next cell.
    #[inline(always)]
    pub fn advance(&mut self) {
        let t = &self.t_next;
        // Constant per instance: one arm survives and every index is a literal, which a runtime axis would
        // not be (three times slower in 3-D).
        match D {
            2 => {
                if t[0] <= t[1] {
                    self.step_along(0);
                } else {
                    self.step_along(1);
                }
            }
            3 => {
                if t[0] <= t[1] {
                    if t[0] <= t[2] { self.step_along(0) } else { self.step_along(2) }
                } else if t[1] <= t[2] {
                    self.step_along(1);
                } else {
                    self.step_along(2);
                }
            }
            _ => unreachable!("lattices have two or three dimensions"),
        }
    }

    #[inline(always)]
    fn step_along(&mut self, axis: usize) {
        self.cell[axis] += self.step[axis];
        self.t_next[axis] += self.t_delta[axis];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::{along, unit};
    use crate::testing::point;
    use proptest::prelude::*;

    /// Every cell of the walk is crossed by the ray, neighbors share a face, and no sample of the ray
    /// falls into a cell that the walk left out.
    fn covers_the_ray<const D: usize>(origin: [f64; 3], target: [f64; 3]) {
        let (origin, target): ([f64; D], [f64; D]) = (point(origin), point(target));
        let lattice = Lattice::new([0.0; D], 0.25);
        let Some(dir) = unit(std::array::from_fn(|k| target[k] - origin[k])) else { return };
        let length = 4.0;
        let mut walk = RayWalk::new(&lattice, origin, dir).unwrap();
        let mut cells = vec![walk.cell()];
        while walk.exit() <= length {
            walk.advance();
            let moved: i32 = (0..D).map(|k| (walk.cell()[k] - cells[cells.len() - 1][k]).abs()).sum();
            assert_eq!(moved, 1);
            cells.push(walk.cell());
        }
        for i in 0..4000 {
            let p = along(origin, dir, length * f64::from(i) / 4000.0);
            let near_face = lattice.to_cells(p).iter().any(|v| (v - v.round()).abs() < 1e-9);
            assert!(near_face || cells.contains(&lattice.cell_of(p).unwrap()), "{p:?} is in no walked cell");
        }
        for c in &cells {
            let mut t = [0.0f64, length + 1e-9];
            for k in 0..D {
                let (a, b) = (lattice.corner(*c)[k] - origin[k], lattice.corner(*c)[k] + 0.25 - origin[k]);
                if dir[k].abs() > 1e-12 {
                    t[0] = t[0].max((a / dir[k]).min(b / dir[k]));
                    t[1] = t[1].min((a / dir[k]).max(b / dir[k]));
                }
            }
            assert!(t[0] <= t[1] + 1e-9, "the ray does not cross {c:?}");
        }
    }

    proptest! {
        #[test]
        fn covers_the_ray_2d_and_3d(
            o in prop::array::uniform3(-3.0..3.0f64), t in prop::array::uniform3(-3.0..3.0f64),
        ) {
            covers_the_ray::<2>(o, t);
            covers_the_ray::<3>(o, t);
        }
    }

    #[test]
    fn a_direction_too_small_for_its_inverse_does_not_step() {
        let mut walk = RayWalk::new(&Lattice::new([0.0; 2], 1.0), [0.5, 1.0], [1.0, -1e-320]).unwrap();
        for x in 1..10 {
            walk.advance();
            assert_eq!((walk.cell(), walk.exit()), ([x, 1], f64::from(x) + 0.5));
        }
    }

    #[test]
    fn along_an_axis() {
        let mut walk = RayWalk::new(&Lattice::new([0.0; 2], 1.0), [0.5, 1.0], [-1.0, 0.0]).unwrap();
        assert_eq!((walk.cell(), walk.exit()), ([0, 1], 0.5));
        walk.advance();
        assert_eq!((walk.cell(), walk.exit()), ([-1, 1], 1.5));
    }
}
