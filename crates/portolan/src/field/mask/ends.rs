//! Where the lines of a panel end: at cells of another label, and at the border of the array.
//!
//! A cell of another label is at distance 0 of itself, whatever the distance of that cell to its own nearest. The passes
//! know only the latter, which is not less; so their minima are not too small, and the nearest end of each line makes them
//! exact: beyond it nothing is nearer than the end itself.

use super::cell::Label;
use super::number::Number;
use multiversion::multiversion;

/// Lowers `best` to the squared distance to the nearest cell along the line that has another label. Cell `lane` of row `q`
/// is `cells[lane + q * stride]`; lanes beyond the row's cells are left alone.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn label_ends<T: Label, L: Number, const N: usize>(
    cells: &[T],
    stride: usize,
    border: bool,
    unit: f64,
    best: &mut [[L; N]],
) {
    let outside = if border { L::ZERO } else { L::FAR };
    let row = |q: usize| {
        let from = &cells[q * stride..];
        let mut row = [T::default(); N];
        match from.first_chunk::<N>() {
            Some(whole) => row = *whole,
            None => row[..from.len()].copy_from_slice(from),
        }
        row
    };
    let n = best.len();
    let mut since = [outside; N];
    let mut before = if n > 0 { row(0) } else { [T::default(); N] };
    for q in 0..n {
        let here = row(q);
        step(&mut since, &before, &here, unit, &mut best[q]);
        before = here;
    }
    since = [outside; N];
    for q in (0..n).rev() {
        let here = row(q);
        step(&mut since, &before, &here, unit, &mut best[q]);
        before = here;
    }
}

/// One row further along the lines.
#[inline(always)]
fn step<T: Label, L: Number, const N: usize>(
    since: &mut [L; N],
    before: &[T; N],
    here: &[T; N],
    unit: f64,
    best: &mut [L; N],
) {
    for i in 0..N {
        let count = if here[i] == before[i] { since[i] } else { L::ZERO };
        since[i] = count.next();
        let end = since[i].squared(unit);
        best[i] = if end < best[i] { end } else { best[i] };
    }
}

/// Lowers `best` to the squared distance to what lies before the first and behind the last row.
pub(super) fn border_ends<L: Number, const N: usize>(unit: f64, best: &mut [[L; N]]) {
    let n = best.len();
    for (q, row) in best.iter_mut().enumerate() {
        let end = L::count((q + 1).min(n - q)).squared(unit);
        row.iter_mut().for_each(|best| *best = if end < *best { end } else { *best });
    }
}
