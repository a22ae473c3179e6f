//! Rows of a lidar by the sine of the elevation.

use super::steps::{STEPS, steps};

/// Sections of the sine of the elevation.
const SECTIONS: usize = 64;

/// Tables over the sine of the elevation, from -1 to 1.
#[derive(Clone, Debug, Default)]
pub(super) struct SineRows {
    /// Row in steps of a pixel, at equal steps of the sine.
    row_of: Vec<i32>,
    /// The most rows that a radian has, by sections of the sine.
    most_rows: Vec<f32>,
    /// Rows that a radian has, mostly.
    pub per_radian: f32,
}

impl SineRows {
    /// Of rows at these elevations (radians, descending). At least 32 entries a row.
    pub(super) fn of(elevations: &[f32]) -> Self {
        let mut spacing: Vec<f32> = elevations.windows(2).map(|w| w[0] - w[1]).filter(|d| *d > 0.0).collect();
        spacing.sort_by(f32::total_cmp);
        let finest = spacing.first().map_or(0.1, |d| d.min(0.1));
        let median = spacing.get(spacing.len() / 2).map_or(0.1, |d| d.min(0.1));
        Self {
            row_of: rows_by_sine(elevations, finest),
            most_rows: most_rows_by_sine(elevations),
            per_radian: 1.0 / median,
        }
    }

    /// Position of the sine 0.
    #[inline(always)]
    pub(super) fn middle(&self) -> f32 {
        0.5 * (self.row_of.len() - 1) as f32
    }

    /// Last position.
    #[inline(always)]
    pub(super) fn last(&self) -> i32 {
        self.row_of.len() as i32 - 1
    }

    /// The row at a position between 0 and the last, in steps of a pixel.
    #[inline(always)]
    pub(super) fn row(&self, at: i32) -> i32 {
        self.row_of.get(at as usize).copied().unwrap_or(0)
    }

    /// Turns positions into rows; what has no position gets a row in no image.
    #[inline(always)]
    pub(super) fn look_up(&self, rows: &mut [i32]) {
        for row in rows {
            *row = self.row_of.get(*row as u32 as usize).copied().unwrap_or(i32::MIN / 2);
        }
    }

    /// The most rows that a radian has, up to `spread` around a sine.
    #[inline(always)]
    pub(super) fn most(&self, sine: f32, spread: f32) -> f32 {
        let section = |s: f32| (((s + 1.0) * (0.5 * SECTIONS as f32)) as usize).min(SECTIONS - 1);
        let (from, to) = (section(sine - spread), section(sine + spread));
        self.most_rows[from..=to].iter().copied().fold(0.0, f32::max)
    }
}

/// How far the sine of the elevation may be from a ball's center, for points of the ball: with `s` the sine of the angle that
/// the ball takes, `sin(e + a) <= sin e + cos e sin a + |sin e| (1 - cos a)`, and `1 - cos a <= s^2`.
#[inline(always)]
pub(super) fn sine_spread(across: f32, z: f32, depth: f32, radius: f32) -> f32 {
    let s = radius / depth;
    (across * s + z.abs() * s * s) / depth
}

/// Beyond the rows it is as between the last two.
fn most_rows_by_sine(elevations: &[f32]) -> Vec<f32> {
    let last = elevations.len() - 1;
    let bound = |i: usize| (2.0 * i as f32 / SECTIONS as f32 - 1.0).clamp(-1.0, 1.0).asin();
    let most = |section| {
        let (low, high) = (bound(section), bound(section + 1));
        let upper_of = |e: f32| elevations.partition_point(|&row| row >= e).saturating_sub(1);
        let (from, to) = (upper_of(high), upper_of(low).min(last.saturating_sub(1)));
        let spacing = elevations[from.min(to)..=(to + 1).min(last)].windows(2).map(|w| w[0] - w[1]);
        1.0 / spacing.filter(|d| *d > 0.0).fold(0.1, f32::min)
    };
    (0..SECTIONS).map(most).collect()
}

fn rows_by_sine(elevations: &[f32], finest: f32) -> Vec<i32> {
    let len = ((STEPS as f32 / finest) as usize).clamp(1024, 1 << 17);
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
        .map(|row: f32| steps(if row.is_finite() { row } else { f32::NEG_INFINITY }))
        .collect()
}
