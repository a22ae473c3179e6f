//! The bounded distance transform along one axis, many lines side by side.

use crate::geom::BLOCK_EDGE;
use multiversion::multiversion;

/// Lines that go through a register or two together.
pub(crate) const LANES: usize = 16;

/// Samples of lines side by side: one row of the line, all lanes.
pub(crate) type Row = [f32; LANES];

/// What goes along with the samples of a row.
pub(crate) type Features = [u32; LANES];

/// Panels of lines, `rows` rows each, one behind the other.
#[derive(Clone, Copy)]
pub(crate) struct Panels<'a> {
    pub(crate) values: &'a [Row],
    /// Of the same length, or empty where no features are carried.
    pub(crate) features: &'a [Features],
    pub(crate) rows: usize,
}

/// Eight rows per panel: what is known before a search, and afterwards what it found.
#[derive(Default)]
pub(crate) struct Found {
    pub(crate) values: Vec<Row>,
    pub(crate) features: Vec<Features>,
}

/// `out(q) = min over |k| <= reach of f(q + k) + k^2` for the eight rows from `first` on, in squared cells; what `out`
/// holds already stays where nothing is less.
///
/// Exact: `f` is not negative, and `k^2` is what a sample at that offset costs at least, so that a row is done as soon
/// as no lane exceeds it; sums are rounded, but rounding is monotone and minima commute with it. Rows that look no
/// further than what they have found are cheap near the surface and cost `2 reach` sums elsewhere.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn min_plus(f: Panels<'_>, first: usize, reach: usize, out: &mut Found) {
    search::<false>(f, first, reach, 0, 0.0, out);
}

/// [`min_plus`] that brings the feature of the sample that was the least, with `k << shift` added to it. Of samples that
/// cost the same, the first in the order 0, -1, 1, -2, 2 ... wins, whatever the reach is.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn min_plus_features(f: Panels<'_>, first: usize, reach: usize, shift: u32, out: &mut Found) {
    search::<true>(f, first, reach, shift, 0.0, out);
}

/// [`min_plus`] from boxes instead of centres: a sample `k` rows away costs `(|k| - 1/2)^2`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn min_plus_boxes(f: Panels<'_>, first: usize, reach: usize, out: &mut Found) {
    search::<false>(f, first, reach, 0, 0.5, out);
}

/// Offset of a lane that keeps what it had.
const KEPT: i32 = i32::MIN;

#[inline(always)]
fn search<const FEATURES: bool>(
    f: Panels<'_>,
    first: usize,
    reach: usize,
    shift: u32,
    half: f32,
    out: &mut Found,
) {
    for (panel, out_rows) in out.values.chunks_exact_mut(BLOCK_EDGE).enumerate() {
        let samples = &f.values[panel * f.rows..][..f.rows];
        for (r, out_row) in out_rows.iter_mut().enumerate() {
            let q = first + r;
            let (before, after) = samples.split_at(q);
            let below = &before[q.saturating_sub(reach)..];
            let above = &after[1..];
            let above = &above[..above.len().min(reach)];
            let mut best = *out_row;
            let mut at = [KEPT; LANES];
            relax::<FEATURES>(&mut best, &mut at, &after[0], 0.0, 0);
            let joint = below.len().min(above.len());
            let mut k = 0;
            while k < joint && exceeds(&best, cost(k, half)) {
                let end = (k + STEPS).min(joint);
                for j in k..end {
                    let step = j as i32 + 1;
                    relax::<FEATURES>(&mut best, &mut at, &below[below.len() - 1 - j], cost(j, half), -step);
                    relax::<FEATURES>(&mut best, &mut at, &above[j], cost(j, half), step);
                }
                k = end;
            }
            if k == joint {
                while k < below.len() && exceeds(&best, cost(k, half)) {
                    let step = k as i32 + 1;
                    relax::<FEATURES>(&mut best, &mut at, &below[below.len() - 1 - k], cost(k, half), -step);
                    k += 1;
                }
                while k < above.len() && exceeds(&best, cost(k, half)) {
                    relax::<FEATURES>(&mut best, &mut at, &above[k], cost(k, half), k as i32 + 1);
                    k += 1;
                }
            }
            *out_row = best;
            if FEATURES {
                let features = &f.features[panel * f.rows..][..f.rows];
                let out_features = &mut out.features[panel * BLOCK_EDGE + r];
                for lane in 0..LANES {
                    if at[lane] != KEPT {
                        let from = (q as i32 + at[lane]) as usize;
                        out_features[lane] = features[from][lane].wrapping_add((at[lane] as u32) << shift);
                    }
                }
            }
        }
    }
}

/// Offsets between two looks at whether anything can still be found.
const STEPS: usize = 4;

/// Whether something that costs so much can be less than what some lane has.
#[inline(always)]
pub(crate) fn exceeds(best: &Row, cost: f32) -> bool {
    let mut any = false;
    for lane in best {
        any |= *lane > cost;
    }
    any
}

#[inline(always)]
fn relax<const FEATURES: bool>(best: &mut Row, at: &mut [i32; LANES], row: &Row, cost: f32, step: i32) {
    for i in 0..LANES {
        let sum = row[i] + cost;
        let less = sum < best[i];
        best[i] = if less { sum } else { best[i] };
        if FEATURES {
            at[i] = if less { step } else { at[i] };
        }
    }
}

/// Of a sample `j + 1` rows away.
#[inline(always)]
fn cost(j: usize, half: f32) -> f32 {
    let k = (j + 1) as f32 - half;
    k * k
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Panel, row, lane, value.
    type Sample = (usize, usize, usize, f32);

    fn samples() -> impl Strategy<Value = Vec<Sample>> {
        let value = prop_oneof![Just(0.0f32), 0.0..9.0f32, 0.0..2000.0f32];
        prop::collection::vec((0..2usize, 0..60usize, 0..LANES, value), 0..60)
    }

    proptest! {
        #[test]
        fn is_the_plain_minimum(
            samples in samples(), kept in samples(), first in 0..52usize, reach in 0..70usize,
        ) {
            let rows = 60;
            let mut f = vec![[f32::INFINITY; LANES]; 2 * rows];
            let mut features = vec![[0; LANES]; 2 * rows];
            for (n, (panel, row, lane, value)) in samples.into_iter().enumerate() {
                f[panel * rows + row][lane] = value;
                features[panel * rows + row][lane] = 1000 * n as u32;
            }
            let f = Panels { values: &f, features: &features, rows };
            let mut start = vec![[f32::INFINITY; LANES]; 16];
            for (panel, row, lane, value) in kept {
                start[panel * 8 + row % 8][lane] = value;
            }
            let fresh = || Found { values: start.clone(), features: vec![[7; LANES]; 16] };
            let (mut plain, mut carried, mut boxes) = (fresh(), fresh(), fresh());
            min_plus(f, first, reach, &mut plain);
            min_plus_features(f, first, reach, 1, &mut carried);
            min_plus_boxes(f, first, reach, &mut boxes);
            prop_assert_eq!(&plain.values, &carried.values);
            for n in 0..16 {
                let (panel, q) = (n / 8, first + n % 8);
                for lane in 0..LANES {
                    let near = (q.saturating_sub(reach)..(q + reach + 1).min(rows)).map(|p| {
                        let k = p as i32 - q as i32;
                        (p, k, f.values[panel * rows + p][lane])
                    });
                    // In the order of the search, so that the first of the least is its choice.
                    let mut near: Vec<_> = near.collect();
                    near.sort_by_key(|(_, k, _)| 2 * k.abs() + i32::from(*k > 0));
                    let mut want = (start[n][lane], 7);
                    for &(p, k, value) in &near {
                        let sum = value + (k * k) as f32;
                        if sum < want.0 {
                            want = (sum, features[panel * rows + p][lane].wrapping_add((k as u32) << 1));
                        }
                    }
                    prop_assert_eq!((carried.values[n][lane], carried.features[n][lane]), want);
                    let costs = near.iter().map(|(_, k, value)| value + (k.abs() as f32 - 0.5).max(0.0).powi(2));
                    prop_assert_eq!(boxes.values[n][lane], costs.fold(start[n][lane], f32::min));
                }
            }
        }
    }
}
