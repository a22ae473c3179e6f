//! Pixels that balls may fall on, eight at a time.

use super::pixels::PixelProjector;
use super::projector::Kind;
use super::sine_rows::sine_spread;
use super::steps::{STEPS, nearest_integer};
use crate::scan::atan2;

/// The pixels around `(column, row)` up to the halves that a ball may fall on, and its depths. A ball that is too near to
/// the sensor has infinite halves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BallWindows {
    pub column: [f32; 8],
    pub row: [f32; 8],
    pub half_columns: [f32; 8],
    pub half_rows: [f32; 8],
    pub near: [f32; 8],
    pub far: [f32; 8],
}

impl PixelProjector {
    /// The windows of balls about points of the sensor's frame, with `half` more across the beams.
    #[inline(always)]
    pub(super) fn ball_windows(
        &self,
        [x, y, z]: &[[f32; 8]; 3],
        radius: f32,
        half: f32,
        out: &mut BallWindows,
    ) {
        let wide = radius + half;
        match &self.projector.kind {
            Kind::Spherical(rings) => {
                let (first, per_radian) = (rings.first_azimuth as f32, rings.per_radian as f32);
                let middle = self.sine_rows.middle();
                let turn = rings.period as f32;
                // Of all turns the one in which it is nearest to the image's middle.
                let low = 0.5 * (self.projector.columns as f32 - turn);
                let last = self.sine_rows.last();
                let mut sines = [[0i32; 2]; 8];
                for i in 0..8 {
                    let across = (x[i] * x[i] + y[i] * y[i]).sqrt();
                    let depth = (across * across + z[i] * z[i]).sqrt();
                    let far_enough = across > 1.2 * wide;
                    let (a, d) = if far_enough { (across, depth) } else { (1.0, 1.0) };
                    let c = (atan2(y[i], x[i]) - first) * per_radian;
                    let c = if c < low { c + turn } else { c };
                    let c = if c < low { c + turn } else { c };
                    out.column[i] = if c >= low + turn { c - turn } else { c };
                    let (sine, spread) = (z[i] / d, sine_spread(across, z[i], d, wide));
                    let step = |s: f32| nearest_integer((s + 1.0) * middle).clamp(0, last);
                    sines[i] =
                        if far_enough { [step(sine + spread), step(sine - spread)] } else { [0, last] };
                    let width = if far_enough { arc_sine_above(wide / a) } else { f32::INFINITY };
                    out.half_columns[i] = width * per_radian.abs();
                    out.near[i] = depth - radius;
                    out.far[i] = depth + radius;
                }
                for i in 0..8 {
                    // The first of the rows that the ball may be in, and the last.
                    let [above, below] = sines[i].map(|s| self.sine_rows.row(s));
                    out.row[i] = (above + below) as f32 / (2 * STEPS) as f32;
                    out.half_rows[i] = (below - above) as f32 / (2 * STEPS) as f32;
                }
            }
            Kind::Pinhole(c) => {
                let ([fx, fy], [cx, cy]) = ([c.fx as f32, c.fy as f32], [c.cx as f32, c.cy as f32]);
                for i in 0..8 {
                    let near = z[i] - wide;
                    let far_enough = near > 0.1 * wide;
                    let inverse = 1.0 / if far_enough { z[i] } else { 1.0 };
                    let (u, v) = (x[i] * inverse, y[i] * inverse);
                    // A point of the ball moves by at most the radius across and along, seen from the nearest depth.
                    let spread = if far_enough { wide / near } else { f32::INFINITY };
                    out.column[i] = fx * u + cx;
                    out.row[i] = fy * v + cy;
                    out.half_columns[i] = fx.abs() * (1.0 + u.abs()) * spread;
                    out.half_rows[i] = fy.abs() * (1.0 + v.abs()) * spread;
                    out.near[i] = z[i] - radius;
                    out.far[i] = z[i] + radius;
                }
            }
            Kind::Parallel { rays, top } => {
                let first = rays.first.map(|v| v as f32);
                let per_metre = rays.step.map(|v| (1.0 / v) as f32);
                let top = *top as f32;
                for i in 0..8 {
                    out.column[i] = (x[i] - first[0]) * per_metre[0];
                    out.row[i] = (y[i] - first[1]) * per_metre[1];
                    out.half_columns[i] = wide * per_metre[0].abs();
                    out.half_rows[i] = wide * per_metre[1].abs();
                    out.near[i] = top - z[i] - radius;
                    out.far[i] = top - z[i] + radius;
                }
            }
        }
    }
}

/// An upper bound of the arc sine on `[0, 1]`, exact at both ends.
#[inline(always)]
fn arc_sine_above(s: f32) -> f32 {
    s + 0.571 * s * s * s
}
