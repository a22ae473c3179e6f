//! Points to pixels, 64 at a time, in steps of 1/64 of a pixel: what free space is looked up at.
//!
//! Nothing is interpolated there, so rows come from a table over the sine of the elevation, which saves every second arc
//! tangent of [`Projector::project`].

use super::lanes::LANES;
use super::projector::{Kind, Projector};
use super::rings::Rings;
use super::sine_rows::{SineRows, sine_spread};
use super::steps::{NOWHERE, STEPS, nearest_integer, steps};
use crate::scan::{Projection, RangeImage, atan2};

/// Pixel coordinates (in steps of a pixel) and depths (what the image's values measure) of points.
#[derive(Clone, Debug)]
pub(super) struct Pixels {
    pub column: [i32; LANES],
    pub row: [i32; LANES],
    pub depth: [f32; LANES],
}

/// A projector with rows by the sine of the elevation.
#[derive(Clone, Debug)]
pub(super) struct PixelProjector {
    pub projector: Projector,
    /// Empty where the sensor is no lidar.
    pub sine_rows: SineRows,
}

impl PixelProjector {
    /// The projector of an image that fits together ([`RangeImage::check`]).
    pub(super) fn of(image: &RangeImage) -> Self {
        let sine_rows = match &image.projection {
            Projection::Spherical(s) => SineRows::of(&s.elevations),
            _ => SineRows::default(),
        };
        Self { projector: Projector::of(image), sine_rows }
    }

    /// Rows that are as wide as one column.
    pub(super) fn rows_per_column(&self) -> f32 {
        match &self.projector.kind {
            Kind::Spherical(rings) => self.sine_rows.per_radian / (rings.per_radian as f32).abs(),
            Kind::Pinhole(c) => (c.fy as f32 / c.fx as f32).abs(),
            Kind::Parallel { rays, .. } => {
                let [x, y] = rays.step.map(|v| (1.0 / v) as f32);
                (y / x).abs()
            }
        }
    }

    /// Half of the columns and of the rows that a length of `half` across the beams takes, seen from the nearest point of a
    /// ball; `None` where that is the sensor itself.
    #[inline(always)]
    pub(super) fn pixels_across(&self, [x, y, z]: [f32; 3], radius: f32, half: f32) -> Option<(f32, f32)> {
        match &self.projector.kind {
            Kind::Spherical(rings) => {
                let (across, depth) = ((x * x + y * y).sqrt(), (x * x + y * y + z * z).sqrt());
                let nearest = across - radius;
                (nearest > half).then(|| {
                    let most = self.sine_rows.most(z / depth, sine_spread(across, z, depth, radius));
                    let columns_per_radian = (rings.per_radian as f32).abs();
                    (half / nearest * columns_per_radian, half / (depth - radius) * most)
                })
            }
            Kind::Pinhole(c) => {
                let near = z - radius;
                let [fx, fy] = [c.fx as f32, c.fy as f32];
                (near > half).then(|| (fx.abs() * half / near, fy.abs() * half / near))
            }
            Kind::Parallel { rays, .. } => {
                let [x, y] = rays.step.map(|v| (1.0 / v) as f32);
                Some((half * x.abs(), half * y.abs()))
            }
        }
    }

    /// Projects points of the sensor's frame: `offsets` from a center. What the image cannot show (behind a camera, above the
    /// first row) gets coordinates far outside of it.
    #[inline(always)]
    pub(super) fn pixels(&self, center: [f32; 3], offsets: &[[f32; LANES]; 3], out: &mut Pixels) {
        let at = |i: usize| [center[0] + offsets[0][i], center[1] + offsets[1][i], center[2] + offsets[2][i]];
        match &self.projector.kind {
            Kind::Spherical(rings) => {
                let Rings { first_azimuth, per_radian, period, .. } = **rings;
                let (first, per_radian, turn) = (first_azimuth as f32, per_radian as f32, period as f32);
                let half = self.sine_rows.middle();
                // What a full turn has more than its columns belongs to the last one.
                let last = self.projector.columns as i32 * STEPS - STEPS / 2 - 1;
                let last = if self.projector.misfit() > 1e-3 { last } else { i32::MAX };
                for i in 0..LANES {
                    let [x, y, z] = at(i);
                    let depth = (x * x + y * y + z * z).sqrt();
                    out.depth[i] = depth;
                    out.row[i] = nearest_integer((z / depth.max(f32::MIN_POSITIVE) + 1.0) * half);
                    let c = (atan2(y, x) - first) * per_radian;
                    // Into [-1/2, columns - 1/2) of a full turn.
                    let c = if c < -0.5 { c + turn } else { c };
                    let c = if c < -0.5 { c + turn } else { c };
                    let c = if c >= turn - 0.5 { c - turn } else { c };
                    out.column[i] = steps(c).min(last);
                }
                self.sine_rows.look_up(&mut out.row);
            }
            Kind::Pinhole(c) => {
                let ([fx, fy], [cx, cy]) = ([c.fx as f32, c.fy as f32], [c.cx as f32, c.cy as f32]);
                for i in 0..LANES {
                    let [x, y, z] = at(i);
                    let ahead = z > 1e-6;
                    let inverse = 1.0 / if ahead { z } else { 1.0 };
                    out.depth[i] = z;
                    out.column[i] = steps(fx * x * inverse + cx);
                    out.row[i] = steps(if ahead { fy * y * inverse + cy } else { NOWHERE });
                }
            }
            Kind::Parallel { rays, top } => {
                let first = rays.first.map(|v| v as f32);
                let per_metre = rays.step.map(|v| (1.0 / v) as f32);
                let top = *top as f32;
                for i in 0..LANES {
                    let [x, y, z] = at(i);
                    out.depth[i] = top - z;
                    out.column[i] = steps((x - first[0]) * per_metre[0]);
                    out.row[i] = steps((y - first[1]) * per_metre[1]);
                }
            }
        }
    }
}
