//! Rows of an image, shared between all threads.

use crate::parallel;

/// Calls `each` for every row of a plane, with its index, and adds up what it returns, from the first row to the last.
/// O(cells).
pub(super) fn each_row<T: Send, S: Default + Send>(
    plane: &mut [T],
    width: usize,
    each: impl Fn(usize, &mut [T]) -> S + Sync,
    add: impl Fn(S, S) -> S + Sync,
) -> S {
    // Waking a thread takes as long as some thousand pixels do.
    const BAND: usize = 1 << 14;
    let rows = BAND.div_ceil(width);
    let mut sums: Vec<S> = (0..plane.len().div_ceil(rows * width)).map(|_| S::default()).collect();
    let bands = plane.chunks_mut(rows * width).enumerate().zip(&mut sums);
    parallel::each(bands, |((band, plane), sum)| {
        let made = plane.chunks_mut(width).enumerate().map(|(i, row)| each(band * rows + i, row));
        *sum = made.fold(S::default(), &add);
    });
    sums.into_iter().fold(S::default(), add)
}
