//! The bounded distance transform along one axis, many lines side by side.

use crate::geom::BLOCK_EDGE;
use multiversion::multiversion;

/// Lines that go through a register or two together.
pub(super) const LANES: usize = 16;

/// Samples of lines side by side: one row of the line, all lanes.
pub(super) type Row = [f32; LANES];

/// `out(q) = min over |k| <= reach of f(q + k) + k^2` for the eight rows from `first` on, in squared cells.
///
/// `f` holds panels of `rows` rows one behind the other, `out` eight rows per panel. Exact: `f` is not negative, and
/// `k^2` is what a sample at that offset costs at least, so that a row is done as soon as no lane exceeds it; sums
/// are rounded, but rounding is monotone and minima commute with it. Rows that look no further than what they have
/// found are cheap near the surface and cost `2 reach` sums elsewhere.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn min_plus(f: &[Row], rows: usize, first: usize, reach: usize, out: &mut [Row]) {
    for (f, out) in f.chunks_exact(rows).zip(out.chunks_exact_mut(BLOCK_EDGE)) {
        for (r, out) in out.iter_mut().enumerate() {
            let q = first + r;
            let (before, after) = f.split_at(q);
            let below = &before[q.saturating_sub(reach)..];
            let above = &after[1..];
            let above = &above[..above.len().min(reach)];
            let mut best = after[0];
            let joint = below.len().min(above.len());
            let mut k = 0;
            while k < joint && exceeds(&best, k) {
                let end = (k + STEPS).min(joint);
                for j in k..end {
                    relax(&mut best, &below[below.len() - 1 - j], j);
                    relax(&mut best, &above[j], j);
                }
                k = end;
            }
            if k == joint {
                while k < below.len() && exceeds(&best, k) {
                    relax(&mut best, &below[below.len() - 1 - k], k);
                    k += 1;
                }
                while k < above.len() && exceeds(&best, k) {
                    relax(&mut best, &above[k], k);
                    k += 1;
                }
            }
            *out = best;
        }
    }
}

/// Offsets between two looks at whether anything can still be found.
const STEPS: usize = 4;

/// Whether a sample `j + 1` rows away can be less than what some lane has.
#[inline(always)]
fn exceeds(best: &Row, j: usize) -> bool {
    let cost = cost(j);
    let mut any = false;
    for lane in best {
        any |= *lane > cost;
    }
    any
}

#[inline(always)]
fn relax(best: &mut Row, row: &Row, j: usize) {
    let cost = cost(j);
    for i in 0..LANES {
        let sum = row[i] + cost;
        best[i] = if sum < best[i] { sum } else { best[i] };
    }
}

#[inline(always)]
fn cost(j: usize) -> f32 {
    let k = (j + 1) as f32;
    k * k
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn is_the_plain_minimum(
            seeds in prop::collection::vec((0..2usize, 0..60usize, 0..LANES, prop_oneof![Just(0.0f32), 0.0..9.0f32, 0.0..2000.0f32]), 0..60),
            first in 0..52usize, reach in 0..70usize,
        ) {
            let rows = 60;
            let mut f = vec![[f32::INFINITY; LANES]; 2 * rows];
            for (panel, row, lane, value) in seeds {
                f[panel * rows + row][lane] = value;
            }
            let mut out = vec![[0.0; LANES]; 16];
            min_plus(&f, rows, first, reach, &mut out);
            for (n, got) in out.iter().enumerate() {
                let (panel, q) = (n / 8, first + n % 8);
                for lane in 0..LANES {
                    let near = q.saturating_sub(reach)..(q + reach + 1).min(rows);
                    let want = near.map(|p| {
                        let k = q.abs_diff(p) as f32;
                        f[panel * rows + p][lane] + k * k
                    });
                    prop_assert_eq!(got[lane], want.fold(f32::INFINITY, f32::min));
                }
            }
        }
    }
}
