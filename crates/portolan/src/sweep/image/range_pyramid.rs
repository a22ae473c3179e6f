//! The nearest and the farthest value of any part of an image in a few reads.

use super::bands::each_row;
use multiversion::multiversion;

/// Smallest and largest values of squares of 2, 4, 8 ... pixels. Windows are looked up in the level whose squares are no
/// more than a third of it, so that what is read is little more than the window.
#[derive(Clone, Debug, Default)]
pub(super) struct RangePyramid {
    levels: Vec<Level>,
    used: usize,
}

#[derive(Clone, Debug, Default)]
struct Level {
    columns: usize,
    rows: usize,
    extremes: Vec<[f32; 2]>,
}

/// Squares along either side of a window that are read.
const SQUARES: usize = 4;

impl RangePyramid {
    /// Builds it from an image of `columns` a row: of the values without their sign, or of those above 0 only (no values
    /// lie between infinity and minus infinity).
    pub(super) fn build(&mut self, columns: usize, values: &[f32], surfaces_only: bool) {
        let rows = values.len() / columns;
        let first = self.level(0, columns.div_ceil(2), rows.div_ceil(2));
        let width = columns.div_ceil(2);
        let halve_row = |y: usize, out: &mut [[f32; 2]]| {
            let top = &values[2 * y * columns..][..columns];
            let bottom = values.get((2 * y + 1) * columns..(2 * y + 2) * columns).unwrap_or(top);
            halve(top, bottom, out, surfaces_only);
        };
        each_row(&mut first.extremes, width, halve_row, |(), ()| ());
        self.used = 1;
        loop {
            let below = &self.levels[self.used - 1];
            let (w, h) = (below.columns, below.rows);
            if w.max(h) <= SQUARES {
                break;
            }
            self.level(self.used, w.div_ceil(2), h.div_ceil(2));
            let (fine, coarse) = self.levels.split_at_mut(self.used);
            let (fine, coarse) = (&fine[self.used - 1], &mut coarse[0]);
            let halve_row = |y: usize, out: &mut [[f32; 2]]| {
                let y1 = (2 * y + 1).min(h - 1);
                let at = |x: usize, y: usize| fine.extremes[y * w + x];
                for (x, out) in out.iter_mut().enumerate() {
                    let x1 = (2 * x + 1).min(w - 1);
                    *out = join(join(at(2 * x, 2 * y), at(x1, 2 * y)), join(at(2 * x, y1), at(x1, y1)));
                }
            };
            let width = coarse.columns;
            each_row(&mut coarse.extremes, width, halve_row, |(), ()| ());
            self.used += 1;
        }
    }

    fn level(&mut self, i: usize, columns: usize, rows: usize) -> &mut Level {
        if i == self.levels.len() {
            self.levels.push(Level::default());
        }
        let level = &mut self.levels[i];
        (level.columns, level.rows) = (columns, rows);
        level.extremes.resize(columns * rows, [0.0; 2]);
        level
    }

    /// Bounds of the smallest and the largest value in `columns` x `rows`, both ends included; they must lie in the image.
    #[inline]
    pub(super) fn extremes(&self, columns: [usize; 2], rows: [usize; 2]) -> [f32; 2] {
        // The first level that can be coarse enough.
        let span = (columns[1] - columns[0]).max(rows[1] - rows[0]);
        let mut k = (span.max(1).ilog2() as usize).saturating_sub(1).clamp(1, self.used);
        let wide = |k: usize| (columns[1] >> k) - (columns[0] >> k) >= SQUARES;
        let high = |k: usize| (rows[1] >> k) - (rows[0] >> k) >= SQUARES;
        while k < self.used && (wide(k) || high(k)) {
            k += 1;
        }
        let level = &self.levels[k - 1];
        let mut found = [f32::INFINITY, f32::NEG_INFINITY];
        for y in rows[0] >> k..=rows[1] >> k {
            for e in &level.extremes[y * level.columns..][columns[0] >> k..=columns[1] >> k] {
                found = join(found, *e);
            }
        }
        found
    }
}

/// Two rows into one of half the length.
#[multiversion(targets = "simd")]
fn halve(top: &[f32], bottom: &[f32], out: &mut [[f32; 2]], surfaces_only: bool) {
    let extremes = |v: f32| {
        let unused = surfaces_only & !(v > 0.0);
        [if unused { f32::INFINITY } else { v.abs() }, if unused { f32::NEG_INFINITY } else { v.abs() }]
    };
    let pairs = top.chunks_exact(2).zip(bottom.chunks_exact(2));
    for (out, (t, b)) in out.iter_mut().zip(pairs) {
        *out = join(join(extremes(t[0]), extremes(t[1])), join(extremes(b[0]), extremes(b[1])));
    }
    let n = top.len();
    if n % 2 == 1 {
        out[n / 2] = join(extremes(top[n - 1]), extremes(bottom[n - 1]));
    }
}

#[inline(always)]
fn join(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bounds_hold_and_are_near(columns in 1usize..70, rows in 1usize..40, seed in any::<u32>(), w in prop::array::uniform4(0.0..1.0f64)) {
            let values: Vec<f32> =
                (0..columns * rows).map(|i| ((i as u32).wrapping_mul(2_654_435_761).wrapping_add(seed) >> 20) as f32).collect();
            let mut pyramid = RangePyramid::default();
            for _ in 0..2 {
                pyramid.build(columns, &values, false);
            }
            let at = |t: f64, n: usize| ((t * n as f64) as usize).min(n - 1);
            let (mut u, mut v) = ([at(w[0], columns), at(w[1], columns)], [at(w[2], rows), at(w[3], rows)]);
            u.sort_unstable();
            v.sort_unstable();
            let of = |u: [usize; 2], v: [usize; 2]| (v[0]..=v[1].min(rows - 1))
                .flat_map(|y| (u[0]..=u[1].min(columns - 1)).map(move |x| (x, y)))
                .fold([f32::INFINITY, f32::NEG_INFINITY], |e, (x, y)| join(e, [values[y * columns + x]; 2]));
            let [low, high] = pyramid.extremes(u, v);
            let [least, most] = of(u, v);
            prop_assert!(low <= least && high >= most);
            // No further than the window's own size around it.
            let grown = |w: [usize; 2]| {
                let size = (u[1] - u[0]).max(v[1] - v[0]) + 2;
                [w[0].saturating_sub(size), w[1] + size]
            };
            let [least, most] = of(grown(u), grown(v));
            prop_assert!(low >= least && high <= most);
        }
    }
}
