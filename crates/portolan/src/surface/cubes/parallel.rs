//! Work shared out to all cores with the feature `parallel`; what comes back is in order either way.

/// `make(scratch, i)` for every `i` below `count`.
#[cfg(feature = "parallel")]
pub(crate) fn map<S: Send, R: Send>(
    count: usize,
    scratch: impl Fn() -> S + Sync + Send,
    make: impl Fn(&mut S, usize) -> R + Sync + Send,
) -> Vec<R> {
    use rayon::prelude::*;
    if rayon::current_num_threads() == 1 || count < 2 {
        let mut s = scratch();
        return (0..count).map(|i| make(&mut s, i)).collect();
    }
    (0..count).into_par_iter().with_max_len(1).map_init(scratch, make).collect()
}

/// `change(scratch, item)` for every item.
#[cfg(feature = "parallel")]
pub(super) fn for_each<T: Send, S: Send>(
    work: &mut [T],
    scratch: impl Fn() -> S + Sync + Send,
    change: impl Fn(&mut S, &mut T) + Sync + Send,
) {
    use rayon::prelude::*;
    if rayon::current_num_threads() == 1 || work.len() < 2 {
        let mut s = scratch();
        return work.iter_mut().for_each(|w| change(&mut s, w));
    }
    work.par_iter_mut().with_max_len(1).for_each_init(scratch, change);
}

#[cfg(not(feature = "parallel"))]
pub(crate) fn map<S: Send, R: Send>(
    count: usize,
    scratch: impl Fn() -> S + Sync + Send,
    make: impl Fn(&mut S, usize) -> R + Sync + Send,
) -> Vec<R> {
    let mut s = scratch();
    (0..count).map(|i| make(&mut s, i)).collect()
}

#[cfg(not(feature = "parallel"))]
pub(super) fn for_each<T: Send, S: Send>(
    work: &mut [T],
    scratch: impl Fn() -> S + Sync + Send,
    change: impl Fn(&mut S, &mut T) + Sync + Send,
) {
    let mut s = scratch();
    work.iter_mut().for_each(|w| change(&mut s, w));
}
