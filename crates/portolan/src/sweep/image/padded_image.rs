//! A range image made ready for being looked up: cleaned, with a border, torn where surfaces end.

use super::bands::each_row;
use super::projector::Projector;
use crate::geom::vector::{cross3, dot, norm, sub};
use crate::scan::{
    BeamCounts, Bridge, Bridges, MAX_OPENING, MAX_SLOPE, Projection, RangeImage, RefusedBeams,
};
use crate::sweep::{ScanStats, WeightModel};
use multiversion::multiversion;

/// Neighbors nearer than this say more about the noise than about the surface (meters).
const BASELINE: f64 = 0.05;
/// Surfaces nearer than this are not used: their inverse would not be finite (meters).
const NEAREST: f64 = 1e-6;
/// How many pixels aside neighbors are looked for.
const REACH: usize = 8;

/// Values with a border of one pixel on the left and above, two on the right, one below; of a closed image the border
/// repeats the other side.
#[derive(Clone, Debug, Default)]
pub(super) struct PaddedImage {
    pub columns: usize,
    pub rows: usize,
    pub stride: usize,
    closed: bool,
    /// As in the image: a surface, 0 for nothing known, negative for free up to there. The border has no readings.
    pub value: Vec<f32>,
    /// What is linear on a plane: 1 / value of a surface (the value itself where rays are parallel), else 0. The sign is
    /// negative where this pixel, its right and lower neighbors and the one between those are not of one surface, unless
    /// nothing at all is known of the four.
    pub linear: Vec<f32>,
    /// Cosine of the incidence at each pixel; empty where the weights do not ask for it.
    pub cosine: Vec<f32>,
    /// Pixels without a reading that were given the value of a bridge, and the pixel whose color they have.
    bridged: Vec<(usize, usize)>,
    /// Colors, without border; empty where the image has no colors.
    pub colors: Vec<[u8; 3]>,
    /// Which pixels have a color, without border; empty: all.
    pub colored: Vec<bool>,
}

/// Which readings are used, and how far apart one surface may be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cleaning {
    pub min_range: f64,
    pub max_range: f64,
    /// Neighbors that are not further apart than this are of one surface, however steep (meters).
    pub step: f64,
    pub weights: WeightModel,
    pub colors: bool,
}

impl PaddedImage {
    /// Takes an image in. Readings that are no number, too near or too far are cleaned, and counted by cause.
    pub(super) fn fill(&mut self, image: &RangeImage, projector: &Projector, how: &Cleaning) -> ScanStats {
        let shape = (image.columns, image.rows, projector.is_closed());
        if shape != (self.columns, self.rows, self.closed) {
            (self.columns, self.rows, self.closed) = shape;
            self.stride = image.columns + 3;
            // All but the border is written for every image.
            for plane in [&mut self.value, &mut self.linear] {
                plane.clear();
                plane.resize(self.stride * (self.rows + 2), 0.0);
            }
        }
        let counted = self.clean(image, projector, how);
        self.tear(projector, how.step as f32);
        self.cosine.clear();
        if how.weights.parts().1 {
            self.find_cosines(image);
            if projector.is_closed() {
                Self::repeat_seam(&mut self.cosine, self.stride);
            }
        }
        self.colors.clear();
        self.colored.clear();
        if how.colors {
            self.colors.extend_from_slice(&image.colors);
            self.colored.extend_from_slice(&image.colored);
            self.color_bridges();
        }
        counted
    }

    fn clean(&mut self, image: &RangeImage, projector: &Projector, how: &Cleaning) -> ScanStats {
        let (w, stride) = (self.columns, self.stride);
        // Along a row the least and the most that a ray is longer than its value: whole rows need no closer look.
        let all_fit = |row: usize, values: &[f32]| {
            let stretch = [0, w / 2, w - 1].map(|c| projector.stretch(c, row));
            let most = stretch.into_iter().fold(1.0, f64::max);
            let (low, high) =
                (how.min_range.max(NEAREST) as f32, (how.max_range / most * (1.0 - 1e-6)) as f32);
            all_within(values, low, high)
        };
        let inside = stride..stride * (self.rows + 1);
        let clean_row = |row: usize, to: &mut [f32]| {
            let mut refused = RefusedBeams::default();
            let (from, to) = (&image.values[row * w..][..w], &mut to[1..=w]);
            if all_fit(row, from) {
                to.copy_from_slice(from);
            } else {
                for (column, (to, &v)) in to.iter_mut().zip(from).enumerate() {
                    *to = clean(v, projector.stretch(column, row), how, &mut refused);
                }
            }
            refused
        };
        let refused = each_row(&mut self.value[inside.clone()], stride, clean_row, |mut a, b| {
            a += b;
            a
        });
        let (value, parallel) = (&self.value, projector.is_parallel());
        let linear_row = |row: usize, linear: &mut [f32]| {
            make_linear(&value[(row + 1) * stride + 1..][..w], &mut linear[1..=w], parallel)
        };
        let (hits, free) =
            each_row(&mut self.linear[inside], stride, linear_row, |a, b| (a.0 + b.0, a.1 + b.1));
        // Bridges are no readings: they are made after those were counted.
        self.bridge(image, projector.is_closed());
        if projector.is_closed() {
            Self::repeat_seam(&mut self.value, stride);
            Self::repeat_seam(&mut self.linear, stride);
        }
        let dropped = (w * self.rows) as u64 - u64::from(hits) - u64::from(free);
        let beams = BeamCounts { hit: hits.into(), max_range: free.into(), dropped, ..BeamCounts::default() };
        ScanStats { scans: 1, beams, refused, ..Default::default() }
    }

    /// Gives pixels of a lidar without a reading the range of a bridge, where there is one.
    fn bridge(&mut self, image: &RangeImage, closed: bool) {
        self.bridged.clear();
        let Projection::Spherical(rays) = &image.projection else { return };
        let bridges = Bridges::of(rays, closed);
        let mut made = Vec::new();
        for row in 0..self.rows {
            let first = (row + 1) * self.stride + 1;
            made.clear();
            bridges.each(row, &self.value[first..][..self.columns], |bridge| made.push(bridge));
            for Bridge { column, nearest, range } in &made {
                self.value[first + column] = *range;
                self.linear[first + column] = 1.0 / range;
                self.bridged.push((row * self.columns + column, row * self.columns + nearest));
            }
        }
    }

    fn color_bridges(&mut self) {
        if self.colors.len() == self.columns * self.rows {
            self.bridged.iter().for_each(|&(to, from)| self.colors[to] = self.colors[from]);
        }
        if self.colored.len() == self.columns * self.rows {
            self.bridged.iter().for_each(|&(to, from)| self.colored[to] = self.colored[from]);
        }
    }

    /// Marks in the sign where four neighbors are not of one surface.
    fn tear(&mut self, projector: &Projector, step: f32) {
        let stride = self.stride;
        let parallel = projector.is_parallel();
        // Neighbors of one surface are not further apart than `slope` times the nearer one, and `step`.
        let slope = |opening: f32| match (parallel, f64::from(opening) <= MAX_OPENING) {
            (true, _) => (0.0, MAX_SLOPE as f32 * opening + step),
            (false, true) => (MAX_SLOPE as f32 * opening, step),
            (false, false) => (0.0, f32::NEG_INFINITY),
        };
        let value = &self.value;
        let mark_row = |row: usize, linear: &mut [f32]| {
            let [across, down] = projector.openings(row.saturating_sub(1));
            let ((ax, bx), (ay, by)) = (slope(across), slope(down));
            let (v0, v1) = (&value[row * stride..][..stride], &value[(row + 1) * stride..][..stride]);
            mark_torn(v0, v1, &mut linear[..stride - 1], [ax, bx, ay, by]);
        };
        each_row(&mut self.linear[..stride * (self.rows + 1)], stride, mark_row, |(), ()| ());
    }

    fn repeat_seam(plane: &mut [f32], stride: usize) {
        let w = stride - 3;
        for row in plane.chunks_exact_mut(stride) {
            row[0] = row[w];
            row[w + 1] = row[1];
            row[w + 2] = row[2.min(w)];
        }
    }

    /// Cosines from the surface through the neighbors on all four sides, as far as they are of one surface.
    fn find_cosines(&mut self, image: &RangeImage) {
        let (w, h, stride) = (self.columns, self.rows, self.stride);
        self.cosine.resize(self.value.len(), 1.0);
        let value = |c: usize, r: usize| f64::from(self.value[(r + 1) * stride + c + 1]);
        for row in 0..h {
            for column in 0..w {
                let v = value(column, row);
                if v <= 0.0 {
                    continue;
                }
                let here = image.point(column, row, v);
                let neighbor = |dc: isize, dr: isize| {
                    let mut last = None;
                    for n in 1..=REACH as isize {
                        let (Some(c), Some(r)) =
                            (column.checked_add_signed(dc * n), row.checked_add_signed(dr * n))
                        else {
                            break;
                        };
                        if c >= w || r >= h || value(c, r) <= 0.0 {
                            break;
                        }
                        let p = image.point(c, r, value(c, r));
                        let far = norm(sub(p, here));
                        // As steep as 80 degrees at most: the chord is longer than what it spans across the rays.
                        let across = norm(sub(image.point(c, r, v), image.point(column, row, v)));
                        if far > MAX_SLOPE * across + 0.03 {
                            break;
                        }
                        last = Some(p);
                        if far >= BASELINE {
                            break;
                        }
                    }
                    last
                };
                let side = |a: Option<[f64; 3]>, b: Option<[f64; 3]>| match (a, b) {
                    (None, None) => None,
                    (a, b) => Some(sub(a.unwrap_or(here), b.unwrap_or(here))),
                };
                let along = side(neighbor(1, 0), neighbor(-1, 0));
                let down = side(neighbor(0, 1), neighbor(0, -1));
                let ray = sub(here, image.point(column, row, 0.5 * v));
                let cosine = match (along, down) {
                    (Some(a), Some(b)) => {
                        let normal = cross3(a, b);
                        dot(normal, ray).abs() / (norm(normal) * norm(ray)).max(1e-30)
                    }
                    // A line of neighbors: the sine of the angle to it.
                    (Some(a), None) | (None, Some(a)) => {
                        let along = dot(a, ray) / (norm(a) * norm(ray)).max(1e-30);
                        (1.0 - along * along).max(0.0).sqrt()
                    }
                    (None, None) => 1.0,
                };
                // Never quite 0: a grazing beam still shows that there is something.
                self.cosine[(row + 1) * stride + column + 1] = cosine.clamp(0.02, 1.0) as f32;
            }
        }
    }
}

/// Whether all values are 0 or between these (NaN is not).
#[multiversion(targets = "simd")]
fn all_within(values: &[f32], low: f32, high: f32) -> bool {
    let bad = |v: f32| u32::from(!((v == 0.0) | (v.abs() > low) & (v.abs() < high)));
    values.iter().fold(0, |any, &v| any | bad(v)) == 0
}

/// A row of values as what is linear on a plane; returns how many are surfaces, and how many free.
#[multiversion(targets = "simd")]
fn make_linear(values: &[f32], linear: &mut [f32], parallel: bool) -> (u32, u32) {
    let (mut hits, mut free) = (0, 0);
    for (q, &v) in linear.iter_mut().zip(values) {
        hits += u32::from(v > 0.0);
        free += u32::from(v < 0.0);
        let value = if parallel { v } else { 1.0 / v };
        *q = if v > 0.0 { value } else { 0.0 };
    }
    (hits, free)
}

/// Turns the sign of a row of `linear` where the four pixels below and right of it are not of one surface. Neighbors in a
/// row are where they are not further apart than `how[0]` times the nearer one and `how[1]`, in a column `how[2]`, `how[3]`.
#[multiversion(targets = "simd")]
fn mark_torn(above: &[f32], below: &[f32], linear: &mut [f32], how: [f32; 4]) {
    let n = linear.len();
    let (a, b, c, d) = (&above[..n], &above[1..=n], &below[..n], &below[1..=n]);
    let near = |x: f32, y: f32, k: f32, s: f32| (x - y).abs() <= k * x.min(y) + s;
    for i in 0..n {
        let (a, b, c, d) = (a[i], b[i], c[i], d[i]);
        let hits = (a > 0.0) & (b > 0.0) & (c > 0.0) & (d > 0.0);
        let [kx, sx, ky, sy] = how;
        let whole = hits & near(a, b, kx, sx) & near(c, d, kx, sx) & near(a, c, ky, sy) & near(b, d, ky, sy);
        let unknown = (a == 0.0) & (b == 0.0) & (c == 0.0) & (d == 0.0);
        // (What was there may have the mark of another image: in the border.)
        linear[i] = if whole | unknown { linear[i].abs() } else { -linear[i].abs() };
    }
}

/// One reading; `stretch` is the length of its ray per unit of its value.
fn clean(v: f32, stretch: f64, how: &Cleaning, refused: &mut RefusedBeams) -> f32 {
    let range = f64::from(v.abs()) * stretch;
    if !v.is_finite() {
        refused.not_finite += 1;
        0.0
    } else if v > 0.0 && range <= how.min_range.max(NEAREST) {
        refused.too_near += 1;
        0.0
    } else if range > how.max_range {
        -(how.max_range / stretch) as f32
    } else {
        v
    }
}
