//! Pixels of a turning lidar without a reading, between two readings of one surface.

use super::{MAX_OPENING, RangeImage, Spherical};

/// The widest gap that is bridged, in times of the wider of the two distances between neighboring rays (the map is
/// interpolated over one such distance anyway), or in radians, whichever is wider.
const WIDEST: f32 = 2.0;
const WIDEST_ANGLE: f32 = 0.04;
/// The tangent of the steepest incidence on a bridge (60 degrees): less than between neighbors, since more is guessed.
const STEEPEST: f32 = 1.73;
/// Readings this near to each other are of one surface, however steep (meters).
const STEP: f32 = 0.03;

/// A pixel that gets a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bridge {
    /// Its column.
    pub(crate) column: usize,
    /// The nearer of the columns with the readings that it lies between.
    pub(crate) nearest: usize,
    /// Meters along its ray.
    pub(crate) range: f32,
}

/// How gaps of an image's rows are bridged.
///
/// Lidars miss single pulses, drivers move points by part of a column, and people thin clouds out: a missing pixel then tears
/// four squares that are interpolated in, and a tenth of the pixels costs most of the surface.
pub(crate) struct Bridges<'a> {
    rays: &'a Spherical,
    closed: bool,
    widest: usize,
}

impl<'a> Bridges<'a> {
    /// For an image of these rays; `closed`: its last column is a neighbor of the first.
    pub(crate) fn of(rays: &'a Spherical, closed: bool) -> Self {
        let across = rays.azimuth_step.abs() as f32;
        let mut down: Vec<f32> = rays.elevations.windows(2).map(|w| w[0] - w[1]).collect();
        down.sort_unstable_by(f32::total_cmp);
        let down = down.get(down.len() / 2).copied().unwrap_or(across);
        // A gap of a single pixel is always narrow enough.
        let widest = ((WIDEST * across.max(down)).max(WIDEST_ANGLE) / across * 1.001) as usize;
        Self { rays, closed, widest }
    }

    /// The pixels of a row without a reading (0) between two surfaces that are near to each other, and no steeper than 60
    /// degrees: on the straight line between those. O(columns).
    pub(crate) fn each(&self, row: usize, values: &[f32], mut each: impl FnMut(Bridge)) {
        let n = values.len();
        let opening = self.rays.azimuth_step.abs() as f32 * self.rays.elevations[row].cos();
        let mut bridge = |from: usize, to: usize| {
            let (steps, a, b) = (to - from, values[from], values[to % n]);
            let angle = steps as f32 * opening;
            let of_one = f64::from(angle) <= MAX_OPENING
                && (a - b).abs() <= STEEPEST * angle * a.min(b) + STEP
                && a > 0.0
                && b > 0.0;
            if steps > self.widest || !of_one {
                return;
            }
            for k in 1..steps {
                // 1 / range is linear along a line, for angles as small as these.
                let at = k as f32 / steps as f32;
                let range = 1.0 / (1.0 / a + at * (1.0 / b - 1.0 / a));
                let nearest = if 2 * k <= steps { from } else { to };
                each(Bridge { column: (from + k) % n, nearest: nearest % n, range });
            }
        };
        let (mut first, mut last) = (None, None);
        for column in (0..n).filter(|&c| values[c] != 0.0) {
            match last {
                Some(from) if column > from + 1 => bridge(from, column),
                _ => {}
            }
            first = first.or(Some(column));
            last = Some(column);
        }
        if let (Some(first), Some(last), true) = (first, last, self.closed)
            && first + n > last + 1
        {
            bridge(last, first + n);
        }
    }

    /// Bridges all gaps of the values of an image of so many columns.
    pub(crate) fn fill(&self, values: &mut [f32], columns: usize) {
        let mut made = Vec::new();
        for (row, values) in values.chunks_exact_mut(columns).enumerate() {
            made.clear();
            self.each(row, values, |bridge| made.push(bridge));
            made.iter().for_each(|bridge| values[bridge.column] = bridge.range);
        }
    }
}

/// How well an image with bridges holds together.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Holds {
    /// Share of the pixels with a value that have a reading of their own.
    pub(super) own: f64,
    /// Share of the neighbors in rows of pixels with a value that have one too.
    pub(super) across: f64,
    /// The same in columns.
    pub(super) down: f64,
    /// How far readings are apart across the rays, at their median range (meters).
    pub(super) spacing: f64,
}

impl Holds {
    /// Of a turning lidar's image of readings (0: none). Neighbors above the first row and below the last one are not counted.
    /// O(pixels).
    pub(super) fn of(image: &RangeImage, rays: &Spherical) -> Self {
        let closed = image.is_full_turn();
        let mut values = image.values.clone();
        Bridges::of(rays, closed).fill(&mut values, image.columns);
        let filled = |v: &f32| *v != 0.0;
        let count = |a: &[f32], b: &[f32]| a.iter().zip(b).filter(|(a, b)| filled(a) && filled(b)).count();
        let all = |v: &[f32]| v.iter().filter(|v| filled(v)).count();
        let rows: Vec<&[f32]> = values.chunks_exact(image.columns).collect();
        // Each pair of neighbors is one for both.
        let (mut across, mut beside) = (0, 0);
        for row in &rows {
            across += 2 * count(row, &row[1..]);
            beside += 2 * all(row);
            if closed {
                across += 2 * count(&row[row.len() - 1..], row);
            } else {
                beside -= usize::from(filled(&row[0])) + usize::from(filled(&row[row.len() - 1]));
            }
        }
        let down: usize = rows.windows(2).map(|w| 2 * count(w[0], w[1])).sum();
        let above_or_below: usize = rows.windows(2).map(|w| all(w[0]) + all(w[1])).sum();
        let share = |n: usize, of: usize| n as f64 / of.max(1) as f64;
        let own = share(all(&image.values), all(&values));
        let mut ranges: Vec<f32> = image.values.iter().copied().filter(filled).collect();
        let middle = ranges.len() / 2;
        let range = match ranges.is_empty() {
            true => 0.0,
            false => f64::from(*ranges.select_nth_unstable_by(middle, f32::total_cmp).1),
        };
        let ends = [rays.elevations[0], rays.elevations[rays.elevations.len() - 1]].map(f64::from);
        let rows = (ends[0] - ends[1]) / (rays.elevations.len() as f64 - 1.0).max(1.0);
        let spacing = range * (rays.azimuth_step.abs() * rows / own.max(1e-3)).sqrt();
        Self { own, across: share(across, beside), down: share(down, above_or_below), spacing }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Rows 0.02 apart, columns 0.01.
    fn rays(columns: f64) -> Spherical {
        Spherical { elevations: vec![0.02, 0.0, -0.02], first_azimuth: 0.0, azimuth_step: TAU / columns }
    }

    fn bridged(values: &[f32], closed: bool) -> Vec<f32> {
        let mut values = values.to_vec();
        let mut made = Vec::new();
        Bridges::of(&rays(628.0), closed).each(1, &values, |b| made.push(b));
        made.iter().for_each(|b| values[b.column] = b.range);
        values
    }

    #[test]
    fn gaps_in_a_surface_are_bridged_on_the_straight_line() {
        // A wall at x = 3.
        let wall = |c: usize| 3.0 / (0.01 * c as f32 - 0.1).cos();
        let whole: Vec<f32> = (0..20).map(wall).collect();
        let mut holed = whole.clone();
        [0, 3, 7, 8, 9, 19].iter().for_each(|&c| holed[c] = 0.0);
        let found = bridged(&holed, false);
        // Linear in the angle instead of along the chord: off by 3 m * 0.04^2 / 8 at most.
        for c in 1..19 {
            assert!((found[c] - whole[c]).abs() < 6.1e-4, "{c}: {} {}", found[c], whole[c]);
        }
        assert_eq!((found[0], found[19]), (0.0, 0.0), "nothing is known on the other side");
    }

    #[test]
    fn wide_gaps_steps_and_free_rays_are_not_bridged() {
        // Five steps of 0.01 are wider than 0.04; a step of 20 cm is steeper than 60 degrees.
        for row in [
            [3.0, 0.0, 0.0, 0.0, 0.0, 3.0],
            [3.0, 0.0, 3.2, 3.2, 3.2, 3.2],
            [3.0, 0.0, -3.0, 0.0, 3.0, 3.0],
            [0.0; 6],
        ] {
            assert_eq!(bridged(&row, false), row);
        }
        assert_eq!(bridged(&[3.0, 0.0, 0.0, 0.0, 3.0, 3.0], false), [3.0; 6]);
    }

    #[test]
    fn bridges_go_on_across_the_seam_of_a_full_turn() {
        let row = [0.0, 3.0, 3.0, 3.0, 3.0, 0.0];
        assert_eq!(bridged(&row, true), [3.0; 6]);
        assert_eq!(bridged(&row, false), row);
        assert_eq!(bridged(&[3.0, 0.0, 0.0, 0.0, 0.0, 0.0], true), [3.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn what_is_between_readings_counts_as_held() {
        let mut image = RangeImage::from_ranges(rays(628.0), 8, [3.0; 24]);
        image.values[9] = 0.0;
        let holds = Holds::of(&image, &rays(628.0));
        assert_eq!((holds.across, holds.down), (1.0, 1.0));
        assert!((holds.own - 23.0 / 24.0).abs() < 1e-12);
        // The middle row is empty: no pixel has a neighbor in its column.
        image.values[8..16].fill(0.0);
        let holds = Holds::of(&image, &rays(628.0));
        assert_eq!((holds.across, holds.down, holds.own), (1.0, 0.0, 1.0));
    }
}
