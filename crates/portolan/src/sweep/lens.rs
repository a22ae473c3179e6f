//! Where points of the sensor's frame fall into a range image: 64 at a time, or a whole box.

use crate::scan::{Projection, RangeImage, atan2};
use std::f64::consts::TAU;

/// Points that are projected together: an octant of a block.
pub(super) const LANES: usize = 64;

/// One number per lane.
pub(super) type Lanes = [f32; LANES];

/// A pinhole, a turning lidar or parallel rays. Coordinates are those of an image with a border of one pixel, so that
/// 0.5 to 1.5 is column 0. What falls outside lands on the border.
#[derive(Clone, Debug)]
pub(super) struct Lens {
    columns: usize,
    rows: usize,
    kind: Kind,
    /// See [`Lens::openings`], for each row.
    openings: Vec<[f32; 2]>,
}

#[derive(Clone, Debug)]
enum Kind {
    Pinhole { focal: [f64; 2], centre: [f64; 2] },
    Spherical(Box<Rings>),
    Orthographic { first: [f64; 2], step: [f64; 2], top: f64 },
}

#[derive(Clone, Debug)]
struct Rings {
    first_azimuth: f64,
    per_radian: f64,
    /// Columns of a full turn.
    period: f64,
    /// Columns before the first that belong to its side of the gap; 0 where the image closes on itself.
    margin: f64,
    elevations: Vec<f32>,
    /// Rows per radian, where all rings are equally far apart.
    uniform: Option<f64>,
    /// Last ring not below the start of each step of elevation, from the first ring downwards.
    ring_at: Vec<u16>,
    steps_per_radian: f32,
}

/// Pixels (with the border counted) that a box can fall on, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    pub columns: [usize; 2],
    pub rows: [usize; 2],
}

/// A lens that no image can have.
pub(super) const BAD_IMAGE: &str = "its rays are not finite, or rows, columns and values do not fit together";

impl Lens {
    /// The lens of an image; `None` where the image contradicts itself.
    pub(super) fn of(image: &RangeImage) -> Option<Self> {
        let (columns, rows) = (image.columns, image.rows);
        let cells = columns.checked_mul(rows)?;
        if cells == 0 || columns.max(rows) > 1 << 20 || cells > 1 << 28 || image.values.len() != cells {
            return None;
        }
        if !(image.colors.is_empty() || image.colors.len() == cells) {
            return None;
        }
        let kind = match &image.projection {
            Projection::Pinhole(c) => {
                let sane = c.fx.is_normal() && c.fy.is_normal() && c.cx.is_finite() && c.cy.is_finite();
                sane.then_some(Kind::Pinhole { focal: [c.fx, c.fy], centre: [c.cx + 1.0, c.cy + 1.0] })?
            }
            Projection::Spherical(s) => {
                let fits = s.elevations.len() == rows
                    && rows <= usize::from(u16::MAX)
                    && s.first_azimuth.is_finite()
                    && s.azimuth_step.is_normal()
                    && s.elevations.iter().all(|e| e.abs() < 1.58)
                    && s.elevations.windows(2).all(|w| w[0] > w[1])
                    && columns as f64 * s.azimuth_step.abs() < TAU * 1.0005 + 0.5 * s.azimuth_step.abs();
                fits.then(|| {
                    Kind::Spherical(Box::new(Rings::new(
                        columns,
                        &s.elevations,
                        s.first_azimuth,
                        s.azimuth_step,
                    )))
                })?
            }
            Projection::Orthographic { rays, top } => {
                let sane = rays.step.iter().all(|s| s.is_normal())
                    && rays.first.iter().chain([top]).all(|v| v.is_finite());
                sane.then_some(Kind::Orthographic { first: rays.first, step: rays.step, top: *top })?
            }
        };
        let mut lens = Self { columns, rows, kind, openings: Vec::new() };
        let turning = matches!(lens.kind, Kind::Spherical(_));
        let first = lens.opening(0);
        lens.openings =
            (0..rows).map(|row| if turning { lens.opening(row) } else { first }.map(|o| o as f32)).collect();
        Some(lens)
    }

    /// Whether column 0 is the neighbour of the last one.
    pub(super) fn is_closed(&self) -> bool {
        matches!(&self.kind, Kind::Spherical(r) if r.margin == 0.0)
    }

    /// Whether all rays are parallel.
    pub(super) fn is_parallel(&self) -> bool {
        matches!(self.kind, Kind::Orthographic { .. })
    }

    /// How far neighbouring rays are apart: columns, and row `row` from the next; radians, metres where rays are parallel.
    #[inline(always)]
    pub(super) fn openings(&self, row: usize) -> [f32; 2] {
        self.openings[row.min(self.rows - 1)]
    }

    fn opening(&self, row: usize) -> [f64; 2] {
        match &self.kind {
            Kind::Pinhole { focal, .. } => focal.map(|f| 1.0 / f.abs()),
            Kind::Orthographic { step, .. } => step.map(f64::abs),
            Kind::Spherical(r) => {
                let row = row.min(r.elevations.len().saturating_sub(2));
                let gap = match r.elevations.get(row..row + 2) {
                    Some(e) => f64::from(e[0] - e[1]),
                    None => 1.0 / r.per_radian.abs(),
                };
                [f64::from(r.elevations[row].cos()) / r.per_radian.abs(), gap]
            }
        }
    }

    /// Length of a pixel's ray per unit of its value.
    pub(super) fn stretch(&self, column: usize, row: usize) -> f64 {
        match &self.kind {
            Kind::Pinhole { focal, centre } => {
                let x = (column as f64 + 1.0 - centre[0]) / focal[0];
                let y = (row as f64 + 1.0 - centre[1]) / focal[1];
                (1.0 + x * x + y * y).sqrt()
            }
            _ => 1.0,
        }
    }

    /// A box that holds everything with values up to `depth`, in the sensor's frame; where rays are parallel from `front`
    /// metres before the plane that values are measured from.
    pub(super) fn reach(&self, depth: f64, front: f64) -> ([f64; 3], [f64; 3]) {
        let (w, h) = (self.columns as f64, self.rows as f64);
        match &self.kind {
            Kind::Pinhole { focal, centre } => {
                let side = |k: usize, at: f64| (at - centre[k]) / focal[k] * depth;
                let (x, y) = ([side(0, 0.0), side(0, w + 1.0)], [side(1, 0.0), side(1, h + 1.0)]);
                let low = |s: [f64; 2]| s[0].min(s[1]).min(0.0);
                let high = |s: [f64; 2]| s[0].max(s[1]).max(0.0);
                ([low(x), low(y), 0.0], [high(x), high(y), depth])
            }
            Kind::Spherical(_) => ([-depth; 3], [depth; 3]),
            Kind::Orthographic { first, step, top } => {
                let ends = |k: usize, n: f64| [first[k] - step[k], first[k] + step[k] * n];
                let (x, y) = (ends(0, w), ends(1, h));
                ([x[0].min(x[1]), y[0].min(y[1]), top - depth], [x[0].max(x[1]), y[0].max(y[1]), top + front])
            }
        }
    }

    /// Projects points: image coordinates, the length of the ray up to the point (metres), and what a pixel's value is
    /// multiplied with for the length of the ray up to its surface.
    #[inline(always)]
    pub(super) fn project(&self, p: &[Lanes; 3]) -> Projected {
        let mut out =
            Projected { u: [0.0; LANES], v: [0.0; LANES], length: [0.0; LANES], scale: [1.0; LANES] };
        match &self.kind {
            Kind::Pinhole { focal, centre } => {
                let ([fx, fy], [cx, cy]) = (focal.map(|f| f as f32), centre.map(|c| c as f32));
                for l in 0..LANES {
                    let (x, y, z) = (p[0][l], p[1][l], p[2][l]);
                    let inverse = 1.0 / z;
                    out.u[l] = if z > 0.0 { fx * x * inverse + cx } else { 0.0 };
                    out.v[l] = fy * y * inverse + cy;
                    out.length[l] = (x * x + y * y + z * z).sqrt();
                    out.scale[l] = out.length[l] * inverse;
                }
            }
            Kind::Spherical(rings) => rings.project(p, &mut out),
            Kind::Orthographic { first, step, top } => {
                let origin = [0, 1].map(|k| (1.0 - first[k] / step[k]) as f32);
                let per_metre = step.map(|s| (1.0 / s) as f32);
                for l in 0..LANES {
                    out.u[l] = p[0][l] * per_metre[0] + origin[0];
                    out.v[l] = p[1][l] * per_metre[1] + origin[1];
                    out.length[l] = *top as f32 - p[2][l];
                }
            }
        }
        let seam = if self.is_closed() { 1.0 } else { 0.75 };
        let (right, bottom) = (self.columns as f32 + seam, self.rows as f32 + 0.75);
        for l in 0..LANES {
            // NaN becomes 0, which is the border.
            out.u[l] = out.u[l].max(0.0).min(right);
            out.v[l] = out.v[l].max(0.0).min(bottom);
        }
        out
    }

    /// Distances between points and the rays of pixels near them (metres).
    #[inline(always)]
    pub(super) fn aside(&self, steps: &Steps, seen: &Projected) -> Lanes {
        let mut aside = [0.0; LANES];
        // Checked without a way out of the loops: so the loads are gathers.
        let openings = &self.openings[..];
        if matches!(self.kind, Kind::Spherical(_)) {
            for l in 0..LANES {
                let row = (steps.row[l] & 0x3fff_ffff) as usize;
                let row = row.min(openings.len() - 1);
                let a = if row < openings.len() { openings[row][0] } else { 0.0 };
                let b = if row < openings.len() { openings[row][1] } else { 0.0 };
                aside[l] = across(steps.right[l] * a, steps.below[l] * b) * seen.length[l];
            }
            return aside;
        }
        let [a, b] = self.openings(0);
        let parallel = self.is_parallel();
        for l in 0..LANES {
            let depth = if parallel { 1.0 } else { seen.length[l] / seen.scale[l] };
            aside[l] = across(steps.right[l] * a, steps.below[l] * b) * depth;
        }
        aside
    }

    /// Smallest and largest value that a pixel would have whose surface were in the box of [`Lens::window`]; `ranges`: how
    /// near and far the box is.
    #[inline]
    pub(super) fn depth(&self, centre: [f64; 3], half: [f64; 3], ranges: impl Fn() -> [f64; 2]) -> [f64; 2] {
        match &self.kind {
            Kind::Pinhole { .. } => [centre[2] - half[2], centre[2] + half[2]],
            Kind::Spherical(_) => ranges(),
            Kind::Orthographic { top, .. } => [top - centre[2] - half[2], top - centre[2] + half[2]],
        }
    }

    /// Where a box can fall: `centre` and half edges `half` along the sensor's axes hold it. `None`: not into the image. A window may pass the
    /// seam of an image that is closed: its last column is then counted on past the border.
    pub(super) fn window(&self, centre: [f64; 3], half: [f64; 3]) -> Option<Window> {
        let (u, v) = match &self.kind {
            Kind::Pinhole { focal, centre: c } => {
                let (front, back) = (centre[2] - half[2], centre[2] + half[2]);
                if back <= 0.0 {
                    return None;
                }
                let (per_front, per_back) = (1.0 / front, 1.0 / back);
                let side = |k: usize| {
                    if front <= 1e-9 {
                        return [f64::NEG_INFINITY, f64::INFINITY];
                    }
                    let (low, high) = (centre[k] - half[k], centre[k] + half[k]);
                    let low = low * if low < 0.0 { per_front } else { per_back };
                    let high = high * if high < 0.0 { per_back } else { per_front };
                    let (a, b) = (focal[k] * low + c[k], focal[k] * high + c[k]);
                    [a.min(b), a.max(b)]
                };
                (side(0), side(1))
            }
            Kind::Spherical(rings) => rings.window(centre, half),
            Kind::Orthographic { first, step, .. } => {
                let side = |k: usize| {
                    let at = |x: f64| (x - first[k]) / step[k] + 1.0;
                    let (a, b) = (at(centre[k] - half[k]), at(centre[k] + half[k]));
                    [a.min(b), a.max(b)]
                };
                (side(0), side(1))
            }
        };
        /// Rounding of the lanes (pixels).
        const SLACK: f64 = 0.02;
        let rows = clamped(v[0] - SLACK, v[1] + SLACK, self.rows)?;
        let columns = if self.is_closed() {
            let turn = self.columns as f64;
            if u[1] - u[0] + 2.0 * SLACK >= turn - 2.0 {
                [0, self.columns + 1]
            } else {
                let turns = ((u[0] - SLACK - 1.0) / turn).floor() * turn;
                let first = (u[0] - SLACK - turns).floor().max(0.0);
                [first as usize, (u[1] + SLACK - turns).floor() as usize + 1]
            }
        } else {
            clamped(u[0] - SLACK, u[1] + SLACK, self.columns)?
        };
        Some(Window { columns, rows })
    }
}

/// Pixels around `low..=high`, on an axis of `n` pixels and a border of one; `None` where none can speak.
fn clamped(low: f64, high: f64, n: usize) -> Option<[usize; 2]> {
    let last = n as f64 + 1.0;
    // What is not negative is rounded down by truncation; `floor` is a call on baseline x86-64.
    (high >= 0.5 && low <= last - 0.5)
        .then(|| [low.clamp(0.0, last) as usize, (high.clamp(0.0, last) as usize + 1).min(n + 1)])
}

#[inline(always)]
fn across(a: f32, b: f32) -> f32 {
    (a * a + b * b).sqrt()
}

/// From pixels to 64 points: columns, rows, and the row of each pixel (without the border).
pub(super) struct Steps {
    pub right: Lanes,
    pub below: Lanes,
    pub row: [u32; LANES],
}

/// What [`Lens::project`] says of 64 points.
pub(super) struct Projected {
    pub u: Lanes,
    pub v: Lanes,
    pub length: Lanes,
    pub scale: Lanes,
}

impl Rings {
    fn new(columns: usize, elevations: &[f32], first_azimuth: f64, step: f64) -> Self {
        let period = TAU / step.abs();
        let closed = (period - columns as f64).abs() < 0.5;
        let span = |e: &[f32]| f64::from(e[0]) - f64::from(e[e.len() - 1]);
        let gaps = elevations.windows(2).map(|w| f64::from(w[0] - w[1]));
        let (least, most) = gaps.fold((f64::INFINITY, 0.0f64), |(a, b), g| (a.min(g), b.max(g)));
        let mean = span(elevations) / (elevations.len().max(2) - 1) as f64;
        let uniform = if elevations.len() < 2 {
            Some(1.0 / step.abs())
        } else {
            (most - least < 1e-3 * mean).then(|| 1.0 / mean)
        };
        let steps =
            if elevations.len() < 2 { 1 } else { (span(elevations) / least).ceil().min(16384.0) as usize };
        let steps_per_radian = steps as f64 / span(elevations).max(1e-9);
        let mut ring = 0;
        let ring_at = (0..=steps).map(|k| {
            let e = f64::from(elevations[0]) - k as f64 / steps_per_radian;
            while ring + 2 < elevations.len() && f64::from(elevations[ring + 1]) >= e {
                ring += 1;
            }
            ring as u16
        });
        Self {
            first_azimuth,
            per_radian: 1.0 / step,
            period: if closed { columns as f64 } else { period },
            margin: if closed { 0.0 } else { 0.5 * (period - columns as f64).max(1.0) + 0.5 },
            elevations: elevations.to_vec(),
            uniform,
            ring_at: ring_at.collect(),
            steps_per_radian: steps_per_radian as f32,
        }
    }

    #[inline(always)]
    fn project(&self, p: &[Lanes; 3], out: &mut Projected) {
        let [x, y, z] = p;
        let mut rho = [0.0f32; LANES];
        for l in 0..LANES {
            let square = x[l] * x[l] + y[l] * y[l];
            rho[l] = square.sqrt();
            out.length[l] = (square + z[l] * z[l]).sqrt();
        }
        let (first, per_radian) = (self.first_azimuth as f32, self.per_radian as f32);
        let (period, margin) = (self.period as f32, self.margin as f32);
        for l in 0..LANES {
            let column = (atan2(y[l], x[l]) - first) * per_radian;
            let turns = floor((column + margin) * (1.0 / period));
            out.u[l] = column - turns * period + 1.0;
        }
        let mut elevation = [0.0f32; LANES];
        for l in 0..LANES {
            elevation[l] = atan2(z[l], rho[l]);
        }
        let top = self.elevations[0];
        if let Some(per_radian) = self.uniform {
            for l in 0..LANES {
                out.v[l] = (top - elevation[l]) * per_radian as f32 + 1.0;
            }
        } else {
            for l in 0..LANES {
                out.v[l] = self.row(elevation[l]) + 1.0;
            }
        }
    }

    /// Row of an elevation, linear between rings and on beyond the last ones; two rings at least.
    #[inline(always)]
    fn row(&self, elevation: f32) -> f32 {
        let e = &self.elevations;
        let step = ((e[0] - elevation) * self.steps_per_radian).max(0.0) as usize;
        let mut ring = usize::from(self.ring_at[step.min(self.ring_at.len() - 1)]);
        while ring + 2 < e.len() && e[ring + 1] >= elevation {
            ring += 1;
        }
        ring as f32 + (e[ring] - elevation) / (e[ring] - e[ring + 1])
    }

    fn window(&self, centre: [f64; 3], half: [f64; 3]) -> ([f64; 2], [f64; 2]) {
        let rho = centre[0].hypot(centre[1]);
        let radius = half[0].hypot(half[1]);
        let (near, far) = ((rho - radius).max(0.0), rho + radius);
        let (low, high) = (centre[2] - half[2], centre[2] + half[2]);
        let low = low.atan2(if low < 0.0 { near } else { far });
        let high = high.atan2(if high < 0.0 { far } else { near });
        let row = |e: f64| match self.uniform {
            Some(per_radian) => (f64::from(self.elevations[0]) - e) * per_radian + 1.0,
            None => f64::from(self.row(e as f32)) + 1.0,
        };
        let rows = [row(high), row(low)];
        if rho <= radius * (1.0 + 1e-9) {
            return ([f64::NEG_INFINITY, f64::INFINITY], rows);
        }
        let column = (centre[1].atan2(centre[0]) - self.first_azimuth) * self.per_radian;
        let turns = ((column + self.margin) / self.period).floor();
        let column = column - turns * self.period + 1.0;
        let aside = (radius / rho).asin() * self.per_radian.abs();
        // Near the gap of an image that is not closed a box may be seen on either side of it.
        let wraps = self.margin > 0.0
            && (column - aside < 1.0 - self.margin || column + aside > 1.0 - self.margin + self.period);
        let columns =
            if wraps { [f64::NEG_INFINITY, f64::INFINITY] } else { [column - aside, column + aside] };
        (columns, rows)
    }
}

/// The largest integer that is not above `x`, to rounding, for `|x|` below 2^22: `f32::floor` is a call on baseline
/// x86-64, and calls do not stand in vectors.
#[inline(always)]
fn floor(x: f32) -> f32 {
    const MAGIC: f32 = 12_582_912.0; // 1.5 * 2^23: adding it leaves no fraction
    (x - 0.5 + MAGIC) - MAGIC
}
