//! Where points of space fall in a range image.

use crate::scan::{Projection, RangeImage, atan2};
use std::f32::consts::TAU;

/// Points that are projected together.
pub(crate) const LANES: usize = 64;

/// Pixels have this many steps.
pub(crate) const STEPS: i32 = 1 << STEP_BITS;
/// Bits of a step.
pub(crate) const STEP_BITS: u32 = 6;

/// Pixel coordinates (in steps of a pixel) and depths (what the image's values measure) of points.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    pub(crate) column: [i32; LANES],
    pub(crate) row: [i32; LANES],
    pub(crate) depth: [f32; LANES],
}

/// How eight balls look from the sensor: the pixels around `(column, row)` up to the halves, and their depths. A ball that is
/// too near to say has infinite halves.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Views {
    pub(crate) column: [f32; 8],
    pub(crate) row: [f32; 8],
    pub(crate) half_columns: [f32; 8],
    pub(crate) half_rows: [f32; 8],
    pub(crate) near: [f32; 8],
    pub(crate) far: [f32; 8],
}

/// A projection made ready for many points in `f32`.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one a scan, and it is not moved")]
pub(crate) enum Lens {
    Spherical {
        first: f32,
        columns_per_radian: f32,
        columns: f32,
        rows_per_radian: f32,
        /// Row in steps by sine of the elevation, from -1 to 1.
        row_of: Vec<i32>,
        /// The most rows that a radian has, by sections of the sine of the elevation, from -1 to 1.
        most_rows: [f32; SECTIONS],
    },
    Pinhole {
        focal: [f32; 2],
        principal: [f32; 2],
    },
    Orthographic {
        first: [f32; 2],
        inverse_step: [f32; 2],
        top: f32,
    },
}

/// Sections of the sine of the elevation.
const SECTIONS: usize = 64;

/// A coordinate that is in no image (pixels).
const NOWHERE: f32 = 60_000.0;

impl Lens {
    pub(crate) fn of(image: &RangeImage) -> Self {
        match &image.projection {
            Projection::Pinhole(c) => {
                Self::Pinhole { focal: [c.fx as f32, c.fy as f32], principal: [c.cx as f32, c.cy as f32] }
            }
            Projection::Orthographic { rays, top } => Self::Orthographic {
                first: rays.first.map(|v| v as f32),
                inverse_step: rays.step.map(|v| (1.0 / v) as f32),
                top: *top as f32,
            },
            Projection::Spherical(s) => {
                let mut spacing: Vec<f32> =
                    s.elevations.windows(2).map(|w| w[0] - w[1]).filter(|d| *d > 0.0).collect();
                spacing.sort_by(f32::total_cmp);
                let finest = spacing.first().map_or(0.1, |d| d.min(0.1));
                let median = spacing.get(spacing.len() / 2).map_or(0.1, |d| d.min(0.1));
                Self::Spherical {
                    first: s.first_azimuth as f32,
                    columns_per_radian: (1.0 / s.azimuth_step) as f32,
                    columns: image.columns as f32,
                    rows_per_radian: 1.0 / median,
                    row_of: rows_by_sine(&s.elevations, finest),
                    most_rows: most_rows_by_sine(&s.elevations),
                }
            }
        }
    }

    /// Whether the last column is a neighbour of the first.
    pub(crate) fn is_closed(&self) -> bool {
        match self {
            Self::Spherical { columns, columns_per_radian, .. } => {
                (columns - columns_per_radian.abs() * TAU).abs() < 1.5
            }
            _ => false,
        }
    }

    /// Rows that are as wide as one column.
    pub(crate) fn rows_per_column(&self) -> f32 {
        match self {
            Self::Spherical { columns_per_radian, rows_per_radian, .. } => {
                rows_per_radian / columns_per_radian.abs()
            }
            Self::Pinhole { focal, .. } => (focal[1] / focal[0]).abs(),
            Self::Orthographic { inverse_step, .. } => (inverse_step[1] / inverse_step[0]).abs(),
        }
    }

    /// Half of the columns and of the rows that a length of `half` across the beams takes, seen from the nearest point of a
    /// ball; `None` where that is the sensor itself.
    #[inline(always)]
    pub(crate) fn view_cell(&self, [x, y, z]: [f32; 3], radius: f32, half: f32) -> Option<(f32, f32)> {
        match self {
            Self::Spherical { columns_per_radian, most_rows, .. } => {
                let (across, depth) = ((x * x + y * y).sqrt(), (x * x + y * y + z * z).sqrt());
                let nearest = across - radius;
                (nearest > half).then(|| {
                    let (sine, spread) = (z / depth, sine_spread(across, z, depth, radius));
                    let section = |s: f32| (((s + 1.0) * (0.5 * SECTIONS as f32)) as usize).min(SECTIONS - 1);
                    let (from, to) = (section(sine - spread), section(sine + spread));
                    let most = most_rows[from..=to].iter().copied().fold(0.0, f32::max);
                    (half / nearest * columns_per_radian.abs(), half / (depth - radius) * most)
                })
            }
            Self::Pinhole { focal, .. } => {
                let near = z - radius;
                (near > half).then(|| (focal[0].abs() * half / near, focal[1].abs() * half / near))
            }
            Self::Orthographic { inverse_step, .. } => {
                Some((half * inverse_step[0].abs(), half * inverse_step[1].abs()))
            }
        }
    }

    /// Projects points of the sensor's frame: `offsets` from a centre. What the image cannot show (behind a camera, above the
    /// first row) gets coordinates far outside of it.
    #[inline(always)]
    pub(crate) fn project(&self, centre: [f32; 3], offsets: &[[f32; LANES]; 3], seen: &mut Seen) {
        let at = |i: usize| [centre[0] + offsets[0][i], centre[1] + offsets[1][i], centre[2] + offsets[2][i]];
        match self {
            Self::Spherical { first, columns_per_radian, row_of, .. } => {
                let half = 0.5 * (row_of.len() - 1) as f32;
                let turn = columns_per_radian.abs() * TAU;
                for i in 0..LANES {
                    let [x, y, z] = at(i);
                    let depth = (x * x + y * y + z * z).sqrt();
                    seen.depth[i] = depth;
                    seen.row[i] = nearest_integer((z / depth.max(f32::MIN_POSITIVE) + 1.0) * half);
                    let c = (atan2(y, x) - first) * columns_per_radian;
                    // Into [-1/2, columns - 1/2) of a full turn.
                    let c = if c < -0.5 { c + turn } else { c };
                    let c = if c < -0.5 { c + turn } else { c };
                    let c = if c >= turn - 0.5 { c - turn } else { c };
                    seen.column[i] = steps(c);
                }
                for row in &mut seen.row {
                    *row = row_of.get(*row as u32 as usize).copied().unwrap_or(i32::MIN / 2);
                }
            }
            Self::Pinhole { focal, principal } => {
                for i in 0..LANES {
                    let [x, y, z] = at(i);
                    let ahead = z > 1e-6;
                    let inverse = 1.0 / if ahead { z } else { 1.0 };
                    seen.depth[i] = z;
                    seen.column[i] = steps(focal[0] * x * inverse + principal[0]);
                    seen.row[i] = steps(if ahead { focal[1] * y * inverse + principal[1] } else { NOWHERE });
                }
            }
            Self::Orthographic { first, inverse_step, top } => {
                for i in 0..LANES {
                    let [x, y, z] = at(i);
                    seen.depth[i] = top - z;
                    seen.column[i] = steps((x - first[0]) * inverse_step[0]);
                    seen.row[i] = steps((y - first[1]) * inverse_step[1]);
                }
            }
        }
    }

    /// How balls about points of the sensor's frame look, with `half` more across the beams.
    #[inline(always)]
    pub(crate) fn views(&self, [x, y, z]: &[[f32; 8]; 3], radius: f32, half: f32, views: &mut Views) {
        let wide = radius + half;
        match self {
            Self::Spherical { first, columns_per_radian, columns, row_of, .. } => {
                let middle = 0.5 * (row_of.len() - 1) as f32;
                let turn = columns_per_radian.abs() * TAU;
                // Of all turns the one in which it is nearest to the image's middle.
                let low = 0.5 * (columns - turn);
                let last = row_of.len() as i32 - 1;
                let mut sines = [[0i32; 2]; 8];
                for i in 0..8 {
                    let across = (x[i] * x[i] + y[i] * y[i]).sqrt();
                    let depth = (across * across + z[i] * z[i]).sqrt();
                    let far_enough = across > 1.2 * wide;
                    let (a, d) = if far_enough { (across, depth) } else { (1.0, 1.0) };
                    let c = (atan2(y[i], x[i]) - first) * columns_per_radian;
                    let c = if c < low { c + turn } else { c };
                    let c = if c < low { c + turn } else { c };
                    views.column[i] = if c >= low + turn { c - turn } else { c };
                    let (sine, spread) = (z[i] / d, sine_spread(across, z[i], d, wide));
                    let step = |s: f32| nearest_integer((s + 1.0) * middle).clamp(0, last);
                    sines[i] =
                        if far_enough { [step(sine + spread), step(sine - spread)] } else { [0, last] };
                    let width = if far_enough { arc_sine_above(wide / a) } else { f32::INFINITY };
                    views.half_columns[i] = width * columns_per_radian.abs();
                    views.near[i] = depth - radius;
                    views.far[i] = depth + radius;
                }
                for i in 0..8 {
                    // The first of the rows that the ball may be in, and the last.
                    let [above, below] = sines[i].map(|s| row_of.get(s as usize).copied().unwrap_or(0));
                    views.row[i] = (above + below) as f32 / (2 * STEPS) as f32;
                    views.half_rows[i] = (below - above) as f32 / (2 * STEPS) as f32;
                }
            }
            Self::Pinhole { focal, principal } => {
                for i in 0..8 {
                    let near = z[i] - wide;
                    let far_enough = near > 0.1 * wide;
                    let inverse = 1.0 / if far_enough { z[i] } else { 1.0 };
                    let (u, v) = (x[i] * inverse, y[i] * inverse);
                    // A point of the ball moves by at most the radius across and along, seen from the nearest depth.
                    let spread = if far_enough { wide / near } else { f32::INFINITY };
                    views.column[i] = focal[0] * u + principal[0];
                    views.row[i] = focal[1] * v + principal[1];
                    views.half_columns[i] = focal[0].abs() * (1.0 + u.abs()) * spread;
                    views.half_rows[i] = focal[1].abs() * (1.0 + v.abs()) * spread;
                    views.near[i] = z[i] - radius;
                    views.far[i] = z[i] + radius;
                }
            }
            Self::Orthographic { first, inverse_step, top } => {
                for i in 0..8 {
                    views.column[i] = (x[i] - first[0]) * inverse_step[0];
                    views.row[i] = (y[i] - first[1]) * inverse_step[1];
                    views.half_columns[i] = wide * inverse_step[0].abs();
                    views.half_rows[i] = wide * inverse_step[1].abs();
                    views.near[i] = top - z[i] - radius;
                    views.far[i] = top - z[i] + radius;
                }
            }
        }
    }
}

/// Pixels to steps of a pixel.
#[inline(always)]
fn steps(pixels: f32) -> i32 {
    nearest_integer(pixels.clamp(-NOWHERE, NOWHERE) * STEPS as f32)
}

/// Rounds numbers up to 2^22, by the bits of a sum: `as` checks for numbers too large, which keeps it from being
/// vectorised.
#[inline(always)]
fn nearest_integer(v: f32) -> i32 {
    const SHIFT: f32 = 12_582_912.0; // 1.5 * 2^23
    (v + SHIFT).to_bits().wrapping_sub(SHIFT.to_bits()) as i32
}

/// How far the sine of the elevation may be from a ball's centre, for points of the ball: with `s` the sine of the angle that
/// the ball takes, `sin(e + a) <= sin e + cos e sin a + |sin e| (1 - cos a)`, and `1 - cos a <= s^2`.
#[inline(always)]
fn sine_spread(across: f32, z: f32, depth: f32, radius: f32) -> f32 {
    let s = radius / depth;
    (across * s + z.abs() * s * s) / depth
}

/// The most rows that a radian has in each section of the sine of the elevation. Beyond the rows it is as between the last two.
fn most_rows_by_sine(elevations: &[f32]) -> [f32; SECTIONS] {
    let last = elevations.len() - 1;
    let bound = |i: usize| (2.0 * i as f32 / SECTIONS as f32 - 1.0).clamp(-1.0, 1.0).asin();
    std::array::from_fn(|section| {
        let (low, high) = (bound(section), bound(section + 1));
        let upper_of = |e: f32| elevations.partition_point(|&row| row >= e).saturating_sub(1);
        let (from, to) = (upper_of(high), upper_of(low).min(last.saturating_sub(1)));
        let spacing = elevations[from.min(to)..=(to + 1).min(last)].windows(2).map(|w| w[0] - w[1]);
        1.0 / spacing.filter(|d| *d > 0.0).fold(0.1, f32::min)
    })
}

/// An upper bound of the arc sine on `[0, 1]`, exact at both ends.
#[inline(always)]
fn arc_sine_above(s: f32) -> f32 {
    s + 0.571 * s * s * s
}

/// Rows at equal steps of the sine of the elevation, at least 32 a row.
fn rows_by_sine(elevations: &[f32], finest: f32) -> Vec<i32> {
    let len = ((64.0 / finest) as usize).clamp(1024, 1 << 17);
    let last = elevations.len() - 1;
    let mut row = last;
    (0..len)
        .map(|i| {
            let e = (2.0 * i as f32 / (len - 1) as f32 - 1.0).clamp(-1.0, 1.0).asin();
            if last == 0 {
                return (elevations[0] - e) / finest;
            }
            while row > 0 && elevations[row] < e {
                row -= 1;
            }
            // Between `row` and the one below it; beyond the ends by the spacing at the end.
            let upper = row.min(last - 1);
            upper as f32 + (elevations[upper] - e) / (elevations[upper] - elevations[upper + 1])
        })
        .map(|row: f32| if row.is_finite() { steps(row) } else { steps(-NOWHERE) })
        .collect()
}
