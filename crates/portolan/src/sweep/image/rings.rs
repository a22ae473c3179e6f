//! The projection of a turning lidar.

use super::lanes::{LANES, Lanes, Projected};
use crate::scan::{Spherical, atan2};
use std::f64::consts::TAU;

/// Rings of a lidar, and its columns.
#[derive(Clone, Debug)]
pub(super) struct Rings {
    pub first_azimuth: f64,
    /// Columns per radian; negative where columns go clockwise.
    pub per_radian: f64,
    /// Columns of a full turn: those of the image to within half a column, where it is closed.
    pub period: f64,
    /// Whether the last column is a neighbor of the first.
    pub closed: bool,
    /// Columns before the first one that belong to its side of the gap; below 0.5 where columns overlap.
    margin: f64,
    elevations: Vec<f32>,
    /// Rows per radian, where all rings are equally far apart.
    uniform: Option<f64>,
    /// Last ring not below the start of each step of elevation, from the first ring downwards.
    ring_at: Vec<u16>,
    steps_per_radian: f32,
}

impl Rings {
    pub(super) fn new(spherical: &Spherical, columns: usize, closed: bool) -> Self {
        let (elevations, step) = (&spherical.elevations[..], spherical.azimuth_step);
        let turn = TAU / step.abs();
        // The gap is shared out to both sides. A border of one column is needed where there is a gap at all.
        let gap = turn - columns as f64;
        let margin = if gap > 0.0 { 0.5 * gap.max(1.0) + 0.5 } else { 0.5 * gap + 0.5 };
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
            first_azimuth: spherical.first_azimuth,
            per_radian: 1.0 / step,
            period: turn,
            closed,
            margin: if closed { 0.0 } else { margin },
            elevations: elevations.to_vec(),
            uniform,
            ring_at: ring_at.collect(),
            steps_per_radian: steps_per_radian as f32,
        }
    }

    /// How far neighboring rays are apart (radians): columns, and row `row` from the next.
    pub(super) fn opening(&self, row: usize) -> [f64; 2] {
        let row = row.min(self.elevations.len().saturating_sub(2));
        let gap = match self.elevations.get(row..row + 2) {
            Some(e) => f64::from(e[0] - e[1]),
            None => 1.0 / self.per_radian.abs(),
        };
        [f64::from(self.elevations[row].cos()) / self.per_radian.abs(), gap]
    }

    #[inline(always)]
    pub(super) fn project(&self, p: &[Lanes; 3], out: &mut Projected) {
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

    /// Columns and rows, the border counted, that a box may fall on; all columns where it may be on either side of the gap.
    pub(super) fn window(&self, center: [f64; 3], half: [f64; 3]) -> [[f64; 2]; 2] {
        let rho = center[0].hypot(center[1]);
        let radius = half[0].hypot(half[1]);
        let (near, far) = ((rho - radius).max(0.0), rho + radius);
        let (low, high) = (center[2] - half[2], center[2] + half[2]);
        let low = low.atan2(if low < 0.0 { near } else { far });
        let high = high.atan2(if high < 0.0 { far } else { near });
        let row = |e: f64| match self.uniform {
            Some(per_radian) => (f64::from(self.elevations[0]) - e) * per_radian + 1.0,
            None => f64::from(self.row(e as f32)) + 1.0,
        };
        let rows = [row(high), row(low)];
        let everything = [f64::NEG_INFINITY, f64::INFINITY];
        if rho <= radius * (1.0 + 1e-9) {
            return [everything, rows];
        }
        let column = (center[1].atan2(center[0]) - self.first_azimuth) * self.per_radian;
        let turns = ((column + self.margin) / self.period).floor();
        let column = column - turns * self.period + 1.0;
        let aside = (radius / rho).asin() * self.per_radian.abs();
        let columns = [column - aside, column + aside];
        let first = 1.0 - self.margin;
        let wraps = !self.closed && (columns[0] < first || columns[1] > first + self.period);
        [if wraps { everything } else { columns }, rows]
    }
}

/// The largest integer that is not above `x`, to rounding, for `|x|` below 2^22: `f32::floor` is a call on baseline
/// x86-64, and calls do not stand in vectors.
#[inline(always)]
fn floor(x: f32) -> f32 {
    const MAGIC: f32 = 12_582_912.0; // 1.5 * 2^23: adding it leaves no fraction
    (x - 0.5 + MAGIC) - MAGIC
}
