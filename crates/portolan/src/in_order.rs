//! Work shared out to all cores with the feature `parallel`; what comes back is in order either way.

/// `work(item)` of every item. With the feature `parallel` a core takes at least `together` items at once.
#[cfg(feature = "parallel")]
pub(crate) fn in_order<T: Sync, U: Send>(
    items: &[T],
    together: usize,
    work: impl Fn(&T) -> U + Sync + Send,
) -> Vec<U> {
    use rayon::prelude::*;
    items.par_iter().with_min_len(together).map(work).collect()
}

/// `work(item)` of every item. With the feature `parallel` a core takes at least `together` items at once.
#[cfg(not(feature = "parallel"))]
pub(crate) fn in_order<T, U>(items: &[T], _together: usize, work: impl Fn(&T) -> U) -> Vec<U> {
    items.iter().map(work).collect()
}
