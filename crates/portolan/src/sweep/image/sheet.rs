//! The surface between neighboring readings, for what is free before it.

use super::projector::{Kind, Projector};
use super::steps::{STEP_BITS, STEPS};
use crate::scan::{MAX_OPENING, MAX_SLOPE};

/// Neighbors that are not further apart than this are of one surface, however steep (meters).
const STEP: f32 = 0.03;

/// Squares of four neighboring pixels whose readings are of one surface.
#[derive(Clone, Debug, Default)]
pub(super) struct Sheet {
    /// From one row to the next: the columns, and where the image is closed the first one once more.
    stride: usize,
    rows: usize,
    /// What is linear on a plane: 1 / value (the value itself where rays are parallel).
    linear: Vec<f32>,
    /// Of the square that begins at each pixel: see [`across`].
    across: Vec<f32>,
    is_parallel: bool,
}

impl Sheet {
    /// Takes in the values of an image; 0 and less are no surface.
    pub(super) fn fill(&mut self, values: &[f32], projector: &Projector) {
        let (columns, rows) = (projector.columns, projector.rows);
        let parallel = projector.is_parallel();
        let stride = columns + usize::from(projector.is_closed());
        (self.stride, self.rows, self.is_parallel) = (stride, rows, parallel);
        let mut padded = Vec::with_capacity(stride * rows);
        for row in values.chunks_exact(columns) {
            padded.extend_from_slice(row);
            padded.extend_from_slice(&row[..stride - columns]);
        }
        self.linear.clear();
        let linear = |v: &f32| if parallel { *v } else { 1.0 / *v };
        self.linear.extend(padded.iter().map(|v| if *v > 0.0 { linear(v) } else { 0.0 }));
        self.across.clear();
        self.across.resize(padded.len(), 0.0);
        for row in 0..rows.saturating_sub(1) {
            let openings = projector.openings(row);
            let aside = |column: usize| match &projector.kind {
                Kind::Pinhole(c) => [(column as f64 + 0.5 - c.cx) / c.fx, (row as f64 + 0.5 - c.cy) / c.fy],
                _ => [0.0; 2],
            };
            let (v0, v1) = (&padded[row * stride..][..stride], &padded[(row + 1) * stride..][..stride]);
            for column in 0..stride - 1 {
                let four = [v0[column], v0[column + 1], v1[column], v1[column + 1]];
                self.across[row * stride + column] =
                    across(four, openings, parallel, aside(column).map(|v| v as f32));
            }
        }
    }

    /// Whether a point is so many meters before the surface through the four readings around it, across that surface. `column` and
    /// `row` in steps of a pixel.
    #[inline(always)]
    pub(super) fn is_behind(&self, column: i32, row: i32, depth: f32, across: f32) -> bool {
        if column < 0 || row < 0 {
            return false;
        }
        let k = (row >> STEP_BITS) as usize * self.stride + (column >> STEP_BITS) as usize;
        let last =
            (row >> STEP_BITS) as usize + 1 >= self.rows || (column >> STEP_BITS) as usize + 1 >= self.stride;
        if last {
            return false;
        }
        let [u, v] = [column, row].map(|at| (at & (STEPS - 1)) as f32 / STEPS as f32);
        let [a, b] = [self.linear[k], self.linear[k + 1]];
        let [c, d] = [self.linear[k + self.stride], self.linear[k + self.stride + 1]];
        let (above, below) = (a + u * (b - a), c + u * (d - c));
        let linear = above + v * (below - above);
        let share = if self.is_parallel { linear - depth } else { 1.0 - depth * linear };
        // Where the four are not of one surface this is zero.
        share * self.across[k] > across
    }
}

/// How far the plane through four readings (left, right; above, below) is from the sensor (meters); where rays are parallel the
/// cosine of their incidence. 0 where they are not of one surface. `x`, `y`: where the ray between them looks, beside 1
/// ahead; 0 for a lidar, whose values are along its rays.
///
/// A plane `n . p = h` has the value `v = h / (n . r)` along the ray `r`, so that `1 / v` is linear in `r` with the gradient `n / h`,
/// and a point with the value `w` there is `h - w n . r = h (1 - w / v)` before it. Of several slopes the steepest counts.
fn across(four: [f32; 4], [wide, high]: [f32; 2], parallel: bool, [x, y]: [f32; 2]) -> f32 {
    let [a, b, c, d] = four;
    let nearest = a.min(b).min(c.min(d));
    if !(nearest > 0.0) {
        return 0.0;
    }
    let unit = if parallel { 1.0 } else { nearest };
    let is_narrow = |opening: f32| parallel || f64::from(opening) <= MAX_OPENING;
    let of_one = |a: f32, b: f32, opening: f32| (a - b).abs() <= MAX_SLOPE as f32 * opening * unit + STEP;
    let whole = of_one(a, b, wide) && of_one(c, d, wide) && of_one(a, c, high) && of_one(b, d, high);
    if !(whole && is_narrow(wide) && is_narrow(high)) {
        return 0.0;
    }
    let [a, b, c, d] = four.map(|v| if parallel { v } else { 1.0 / v });
    let steeper = |p: f32, q: f32, opening: f32| (if p.abs() > q.abs() { p } else { q }) / opening;
    let (right, down) = (steeper(b - a, d - c, wide), steeper(c - a, d - b, high));
    let ahead = if parallel { 1.0 } else { 0.25 * (a + b + c + d) - right * x - down * y };
    1.0 / (right * right + down * down + ahead * ahead).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::pixels::{PixelProjector, Pixels};
    use super::*;
    use crate::geom::vector::{dot, unit};
    use crate::scan::{Orthographic, Pinhole, Projection, RangeImage, Spherical};
    use crate::sweep::image::lanes::LANES;
    use proptest::prelude::*;

    fn projection(kind: u8) -> Projection {
        match kind {
            0 => Projection::Pinhole(Pinhole { fx: 30.0, fy: 28.0, cx: 15.5, cy: 9.0 }),
            1 => Projection::Spherical(Spherical {
                elevations: (0..20u8).map(|r| 0.3 - 0.03 * f32::from(r)).collect(),
                first_azimuth: -0.48,
                azimuth_step: 0.03,
            }),
            _ => Projection::Orthographic {
                rays: Orthographic { first: [-1.0, -0.6], step: [0.06, 0.06] },
                top: 3.0,
            },
        }
    }

    /// What a plane `n . p = h` gives each pixel.
    fn plane(projection: &Projection, n: [f64; 3], h: f64) -> RangeImage {
        let empty = RangeImage::new(projection.clone(), 32, 20, vec![1.0; 640]);
        let value = |i: usize| {
            let at = |v: f64| dot(n, empty.point(i % 32, i / 32, v)) - h;
            // What is linear in the value: twice looked up.
            let (a, b) = (at(1.0), at(2.0));
            let v = 1.0 - a / (b - a);
            if v > 0.1 && v < 50.0 { v as f32 } else { 0.0 }
        };
        RangeImage::new(projection.clone(), 32, 20, (0..640).map(value).collect::<Vec<_>>())
    }

    fn sees_past(image: &RangeImage, point: [f64; 3], across: f64) -> bool {
        let projector = PixelProjector::of(image);
        let mut sheet = Sheet::default();
        sheet.fill(&image.values, &projector.projector);
        let mut at = Pixels { column: [0; LANES], row: [0; LANES], depth: [0.0; LANES] };
        projector.pixels(point.map(|v| v as f32), &[[0.0; LANES]; 3], &mut at);
        sheet.is_behind(at.column[0], at.row[0], at.depth[0], across as f32)
    }

    proptest! {
        /// Before a plane it is the distance to the plane that counts.
        #[test]
        fn before_a_plane_the_distance_across_counts(
            kind in 0u8..3, tilt in prop::array::uniform2(-0.9..0.9f64), h in 1.0..3.0f64, pixel in (4usize..26, 4usize..15), share in 0.3..0.95f64,
        ) {
            let projection = projection(kind);
            let ahead = match kind { 0 => [tilt[0], tilt[1], 1.0], 1 => [1.0, tilt[0], tilt[1]], _ => [tilt[0], tilt[1], -1.0] };
            let n = unit(ahead).unwrap();
            // Parallel rays begin 3 m above and look down.
            let h = if kind == 2 { h - 3.0 } else { h };
            let image = plane(&projection, n, h);
            let v = image.values[pixel.1 * 32 + pixel.0];
            prop_assume!(v > 0.2 && v < 8.0);
            let point = image.point(pixel.0, pixel.1, f64::from(v) * share);
            let across = h - dot(n, point);
            let around = [0, 1, 32, 33].map(|k| image.values[pixel.1 * 32 + pixel.0 + k]);
            let steep = around.iter().any(|w| *w <= 0.0 || (w - v).abs() > 0.15 * v);
            prop_assume!(across > 0.02 && !steep);
            // Directions in steps of a sphere are linear in a small square only, and the steepest of two slopes counts.
            let slack = if kind == 1 { 0.02 } else { 1e-3 };
            prop_assert!(sees_past(&image, point, (1.0 - slack) * across - 0.003), "{across} {v}");
            prop_assert!(!sees_past(&image, point, (1.0 + slack) * across + 0.003), "{across} {v}");
        }
    }

    #[test]
    fn across_an_edge_there_is_no_surface() {
        // A post at 1 m in columns 0 to 15, a wall at 4 m, and no reading from column 24 on.
        let values: Vec<f32> =
            (0..640).map(|i| if i % 32 < 16 { 1.0 } else { 4.0 * f32::from(i % 32 < 24) }).collect();
        let image = RangeImage::new(projection(0), 32, 20, values);
        let at = |column: f64, depth: f64| {
            let on = image.point(0, 9, depth);
            [(column - 15.5) / 30.0 * depth, on[1], depth]
        };
        assert!(sees_past(&image, at(14.5, 0.9), 0.05), "before the post");
        assert!(!sees_past(&image, at(14.5, 2.0), 0.05), "behind it");
        assert!(!sees_past(&image, at(15.5, 0.9), 0.05), "between post and wall");
        assert!(sees_past(&image, at(17.5, 3.9), 0.05), "before the wall");
        assert!(!sees_past(&image, at(17.5, 3.97), 0.05), "too near to it");
        assert!(!sees_past(&image, at(23.5, 2.0), 0.05), "beside what is not known");
    }
}
