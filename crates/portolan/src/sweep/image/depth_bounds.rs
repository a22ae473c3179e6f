//! Cubes of cells against the smallest and the largest depth of the pixels that they may fall on.

use super::projector::Projector;
use super::range_pyramid::RangePyramid;
use super::search::{Class, Classify, Cube};
use super::window::Window;
use crate::geom::Lattice;

/// An image that cubes of cells are compared with: their smallest and largest depth against those of their window.
pub(super) struct DepthBounds<'a> {
    pub projector: &'a Projector,
    pub pyramid: &'a RangePyramid,
    pub lattice: Lattice<3>,
    /// Where the sensor is (world).
    pub origin: [f64; 3],
    pub image_from_world: [[f64; 3]; 3],
    pub truncation: f64,
    /// Whether free space beyond the truncation counts.
    pub carves: bool,
}

impl Classify for DepthBounds<'_> {
    /// Extremes of a window that holds that of the cube.
    type Known = [f32; 2];

    /// A window that could hold any values: nearest 0, farthest infinitely far. Of neither is anything sure.
    fn nothing_known(&self) -> [f32; 2] {
        [f32::NEG_INFINITY, f32::INFINITY]
    }

    fn classify(&self, cube: Cube, known: [f32; 2], asked: u8) -> [(Class, [f32; 2]); 8] {
        std::array::from_fn(|i| match asked >> i & 1 {
            0 => (Class::Nothing, known),
            _ => self.class(cube.half(i), known),
        })
    }
}

impl DepthBounds<'_> {
    /// The class of a cube, and the extremes of its window: those of the window of its parent are `known`.
    fn class(&self, cube: Cube, known: [f32; 2]) -> (Class, [f32; 2]) {
        let r = self.lattice.resolution;
        let offset: [f64; 3] = std::array::from_fn(|k| {
            (self.lattice.origin[k] - self.origin[k])
                + (cube.first_cell[k] as f64 + 0.5 * cube.edge as f64) * r
        });
        // The box of the centers of its cells.
        let half = 0.5 * (cube.edge - 1) as f64 * r;
        let (mut center, mut halves) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let row = &self.image_from_world[k];
            center[k] = row[0] * offset[0] + row[1] * offset[1] + row[2] * offset[2];
            halves[k] = half * (row[0].abs() + row[1].abs() + row[2].abs());
        }
        let depth = self.projector.depth(center, halves, || {
            let (mut near, mut far) = (0.0, 0.0);
            for o in offset.map(f64::abs) {
                let (low, high) = ((o - half).max(0.0), o + half);
                (near, far) = (near + low * low, far + high * high);
            }
            [near.sqrt(), far.sqrt()]
        });
        // No corner is further away than the way to it along the axes.
        let far = offset[0].abs() + offset[1].abs() + offset[2].abs() + 3.0 * half;
        let (tau, slack) = (self.truncation, 1e-4 * r + 1e-6 * (depth[1].abs() + far));
        let class = |[least, most]: [f32; 2]| {
            let before = depth[1] < f64::from(least) - tau - slack;
            if depth[0] > f64::from(most) + tau + slack || (before && !self.carves) {
                Class::Nothing
            } else if before && depth[0] >= 0.0 {
                // (What lies behind a camera is before everything, too.)
                Class::Free
            } else {
                Class::Mixed
            }
        };
        // Mostly the parent's window is enough, which costs nothing.
        match class(known) {
            Class::Mixed => match self.projector.window(center, halves) {
                None => (Class::Nothing, known),
                Some(window) => {
                    let extremes = self.extremes(&window);
                    (class(extremes), extremes)
                }
            },
            sure => (sure, known),
        }
    }

    fn extremes(&self, window: &Window) -> [f32; 2] {
        let (pyramid, columns) = (self.pyramid, self.projector.columns);
        let [from, to] = window.columns;
        if to <= columns + 2 {
            return pyramid.extremes([from, to], window.rows);
        }
        // Past the seam: the rest is at the other end.
        let a = pyramid.extremes([from.min(columns + 1), columns + 1], window.rows);
        let b = pyramid.extremes([1, (to - columns).min(columns + 1)], window.rows);
        [a[0].min(b[0]), a[1].max(b[1])]
    }
}
