//! The pass along x, straight from the mask.

use super::cell::Label;
use super::number::Number;

/// Squared distances along one line to its nearest cell that is set, and where that one is (the lower of two).
///
/// `squares[k]` is `k^2` for every offset in the line. Runs are found and filled as a whole: ramps between two cells
/// that are set are copied from the table.
pub(super) fn scan<M: Copy, L: Number>(
    mask: &[M],
    is_set: impl Fn(M) -> bool + Copy,
    squares: &[L],
    out: &mut [L],
    nearest: &mut [u32],
) {
    let n = mask.len();
    let with_nearest = !nearest.is_empty();
    let mut at = 0;
    let mut before = None;
    while at < n {
        let first = at + run(&mask[at..], |cell| !is_set(cell));
        // The cells between what was set before and what is set next.
        let after = (first < n).then_some(first);
        let middle = match (before, after) {
            (Some(b), Some(_)) => (b + first) / 2 + 1,
            (Some(_), None) => n,
            _ => at,
        };
        match before {
            Some(b) => out[at..middle].copy_from_slice(&squares[at - b..middle - b]),
            None if after.is_none() => out[at..].fill(L::FAR),
            None => {}
        }
        if after.is_some() {
            let ramp = squares[1..=first - middle.min(first)].iter().rev();
            out[middle.min(first)..first].iter_mut().zip(ramp).for_each(|(out, &sq)| *out = sq);
        }
        let end = first + run(&mask[first..], is_set);
        out[first..end].fill(L::ZERO);
        if with_nearest {
            let middle = middle.min(first);
            nearest[at..middle].fill(before.map_or(u32::MAX, |b| b as u32));
            nearest[middle..first].fill(after.map_or(u32::MAX, |a| a as u32));
            nearest[first..end].iter_mut().zip(first as u32..).for_each(|(to, i)| *to = i);
        }
        before = end.checked_sub(1);
        at = end;
    }
}

/// Squared distances along one line to its nearest cell of another label: those of the background are 0. With `border`
/// there is such a cell before the first and behind the last one.
pub(super) fn scan_labels<T: Label, L: Number>(cells: &[T], border: bool, squares: &[L], out: &mut [L]) {
    let n = cells.len();
    let mut at = 0;
    while at < n {
        let label = cells[at];
        let length = run(&cells[at..], |cell| cell == label);
        let out = &mut out[at..at + length];
        if label == T::default() {
            out.fill(L::ZERO);
        } else {
            let (below, above) = (at > 0 || border, at + length < n || border);
            let half = match (below, above) {
                (true, true) => length.div_ceil(2),
                (true, false) => length,
                _ => 0,
            };
            let (rising, falling) = out.split_at_mut(half);
            rising.copy_from_slice(&squares[1..=half]);
            if above {
                let ramp = squares[1..=falling.len()].iter().rev();
                falling.iter_mut().zip(ramp).for_each(|(out, &sq)| *out = sq);
            } else {
                falling.fill(L::FAR);
            }
        }
        at += length;
    }
}

/// How many cells of one kind come first.
#[inline]
fn run<M: Copy>(cells: &[M], is: impl Fn(M) -> bool) -> usize {
    const CHUNK: usize = 32;
    let mut length = 0;
    for chunk in cells.as_chunks::<CHUNK>().0 {
        let mut ends = false;
        for cell in chunk {
            ends |= !is(*cell);
        }
        if ends {
            break;
        }
        length += CHUNK;
    }
    length + cells[length..].iter().take_while(|cell| is(**cell)).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn square(k: usize) -> u32 {
        u32::count(k).squared(1.0)
    }

    proptest! {
        #[test]
        fn is_the_nearest_of_the_line(mask in prop::collection::vec(prop::bool::weighted(0.04), 0..200), invert: bool) {
            let mask: Vec<bool> = mask.iter().map(|m| m ^ invert).collect();
            let n = mask.len();
            let squares: Vec<u32> = (0..=n).map(square).collect();
            let (mut out, mut nearest) = (vec![7; n], vec![7; n]);
            scan(&mask, |set| set, &squares, &mut out, &mut nearest);
            for q in 0..n {
                let want = (0..n).filter(|&p| mask[p]).min_by_key(|&p| (p.abs_diff(q), p));
                prop_assert_eq!(out[q], want.map_or(u32::FAR, |p| p.abs_diff(q).pow(2) as u32));
                prop_assert_eq!(nearest[q], want.map_or(u32::MAX, |p| p as u32));
            }
        }

        #[test]
        fn labels_end_where_others_begin(runs in prop::collection::vec((0..3u16, 1..40usize), 1..9), border: bool) {
            let cells: Vec<u16> = runs.iter().flat_map(|&(label, n)| std::iter::repeat_n(label, n)).collect();
            let n = cells.len() as isize;
            let squares: Vec<u32> = (0..=cells.len()).map(square).collect();
            let mut out = vec![7; cells.len()];
            scan_labels(&cells, border, &squares, &mut out);
            for q in 0..n {
                let label = cells[q as usize];
                let ends = (-1..=n).filter(|&p| match usize::try_from(p) {
                    Ok(i) if p < n => cells[i] != label,
                    _ => border,
                });
                let want = ends.map(|p| square(p.abs_diff(q))).min().unwrap_or(u32::FAR);
                prop_assert_eq!(out[q as usize], if label == 0 { 0 } else { want });
            }
        }
    }
}
