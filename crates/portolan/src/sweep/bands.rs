//! Rows of an image, shared between all threads.

/// Calls `each` for every row of a plane, with its index, and adds up what it returns. In parallel with the feature
/// `parallel`: `add` must not depend on the order. O(cells).
pub(super) fn each_row<T: Send, S: Default + Send>(
    plane: &mut [T],
    width: usize,
    each: impl Fn(usize, &mut [T]) -> S + Sync + Send,
    add: impl Fn(S, S) -> S + Sync + Send,
) -> S {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        // Waking a thread takes as long as some thousand pixels do.
        const BAND: usize = 1 << 14;
        if plane.len() >= 2 * BAND && rayon::current_num_threads() > 1 {
            let rows = plane.par_chunks_mut(width).enumerate().with_min_len(BAND.div_ceil(width));
            return rows.map(|(i, row)| each(i, row)).reduce(S::default, add);
        }
    }
    plane.chunks_mut(width).enumerate().map(|(i, row)| each(i, row)).fold(S::default(), add)
}
