//! The pass along x, straight from the mask.

use super::cell::MaskCell;
use super::integer::Integer;

/// Squared distances along one line to its nearest cell that is set, and where that one is (the lower of two).
///
/// `squares[k]` is `k^2` for every offset in the line. Runs are found and filled as a whole: ramps between two cells
/// that are set are copied from the table.
pub(super) fn scan<M: MaskCell, L: Integer>(mask: &[M], squares: &[L], out: &mut [L], nearest: &mut [u32]) {
    let n = mask.len();
    let with_nearest = !nearest.is_empty();
    let mut at = 0;
    let mut before = None;
    while at < n {
        let first = at + run(&mask[at..], false);
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
        let end = first + run(&mask[first..], true);
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

/// How many cells of one kind come first.
#[inline]
fn run<M: MaskCell>(mask: &[M], set: bool) -> usize {
    const CHUNK: usize = 32;
    let mut length = 0;
    for chunk in mask.as_chunks::<CHUNK>().0 {
        let mut ends = false;
        for cell in chunk {
            ends |= cell.is_set() != set;
        }
        if ends {
            break;
        }
        length += CHUNK;
    }
    length + mask[length..].iter().take_while(|cell| cell.is_set() == set).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn is_the_nearest_of_the_line(mask in prop::collection::vec(prop::bool::weighted(0.04), 0..200), invert: bool) {
            let mask: Vec<bool> = mask.iter().map(|m| m ^ invert).collect();
            let n = mask.len();
            let squares: Vec<u32> = (0..=n).map(u32::square).collect();
            let (mut out, mut nearest) = (vec![7; n], vec![7; n]);
            scan(&mask, &squares, &mut out, &mut nearest);
            for q in 0..n {
                let want = (0..n).filter(|&p| mask[p]).min_by_key(|&p| (p.abs_diff(q), p));
                prop_assert_eq!(out[q], want.map_or(u32::FAR, |p| p.abs_diff(q).pow(2) as u32));
                prop_assert_eq!(nearest[q], want.map_or(u32::MAX, |p| p as u32));
            }
        }
    }
}
