//! The same work on one core or on all of them, results in order.

/// `f` of `0..count`, in order.
pub(super) fn map<R: Send>(count: usize, f: impl Fn(usize) -> R + Send + Sync) -> Vec<R> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().map(f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    (0..count).map(f).collect()
}

/// `f` of every chunk of a slice and its place among the chunks.
pub(super) fn chunks<T: Send>(slice: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) + Send + Sync) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        slice.par_chunks_mut(size).enumerate().for_each(|(i, chunk)| f(i, chunk));
    }
    #[cfg(not(feature = "parallel"))]
    slice.chunks_mut(size).enumerate().for_each(|(i, chunk)| f(i, chunk));
}
