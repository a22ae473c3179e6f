//! Work distributed over all cores with the feature `parallel`. Results are in order and do not depend on the number of
//! threads: tasks are independent.
//!
//! Workers take tasks one after the other from a common iterator. The function that starts them is not generic, so that it
//! is compiled once, here, and not in every crate that uses a map; parallel iterators were a seventh of all that such a
//! crate compiled. Taking a task takes a lock: a task should last some microseconds at least.

use std::sync::{Mutex, PoisonError};

/// Number of threads.
#[cfg(feature = "parallel")]
pub(crate) fn threads() -> usize {
    rayon::current_num_threads()
}

/// Number of threads: 1.
#[cfg(not(feature = "parallel"))]
pub(crate) fn threads() -> usize {
    1
}

/// Runs `worker` on this thread and on up to `workers - 1` others at the same time; returns when all have returned.
#[cfg(feature = "parallel")]
fn at_once(workers: usize, worker: &(dyn Fn() + Sync)) {
    rayon::scope(|scope| {
        for _ in 1..workers {
            scope.spawn(|_| worker());
        }
        worker();
    });
}

/// Runs `worker`.
#[cfg(not(feature = "parallel"))]
fn at_once(_: usize, worker: &(dyn Fn() + Sync)) {
    worker();
}

/// Both, at the same time where there is a thread for it.
#[cfg(feature = "parallel")]
pub(crate) fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(a, b)
}

/// Both.
#[cfg(not(feature = "parallel"))]
pub(crate) fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
    (a(), b())
}

/// Calls `work(task, scratch)` for every task, with one scratch for each worker.
pub(crate) fn for_each<T: Send, S>(
    tasks: impl Iterator<Item = T> + Send,
    scratch: impl Fn() -> S + Sync,
    work: impl Fn(T, &mut S) + Sync,
) {
    for_each_on(usize::MAX, tasks, scratch, work);
}

/// [`for_each`] on so many threads at most. On one, the caller's, no other is woken.
pub(crate) fn for_each_on<T: Send, S>(
    most: usize,
    tasks: impl Iterator<Item = T> + Send,
    scratch: impl Fn() -> S + Sync,
    work: impl Fn(T, &mut S) + Sync,
) {
    let workers =
        if most < 2 { 1 } else { tasks.size_hint().1.unwrap_or(usize::MAX).min(threads()).min(most) };
    if workers < 2 {
        let mut scratch = scratch();
        return tasks.for_each(|task| work(task, &mut scratch));
    }
    let tasks = Mutex::new(tasks);
    // A task that panics does so outside of the lock, and ends them all.
    let next = || tasks.lock().unwrap_or_else(PoisonError::into_inner).next();
    at_once(workers, &|| {
        let Some(first) = next() else { return };
        let mut scratch = scratch();
        work(first, &mut scratch);
        while let Some(task) = next() {
            work(task, &mut scratch);
        }
    });
}

/// [`for_each`] without scratch.
pub(crate) fn each<T: Send>(tasks: impl Iterator<Item = T> + Send, work: impl Fn(T) + Sync) {
    for_each(tasks, || (), |task, ()| work(task));
}

/// Calls `change(item, scratch)` for every item, `together` items in one task.
pub(crate) fn change_each<T: Send, S>(
    items: &mut [T],
    together: usize,
    scratch: impl Fn() -> S + Sync,
    change: impl Fn(&mut T, &mut S) + Sync,
) {
    change_each_on(usize::MAX, items, together, scratch, change);
}

/// [`change_each`] on so many threads at most.
pub(crate) fn change_each_on<T: Send, S>(
    most: usize,
    items: &mut [T],
    together: usize,
    scratch: impl Fn() -> S + Sync,
    change: impl Fn(&mut T, &mut S) + Sync,
) {
    for_each_on(most, items.chunks_mut(together), scratch, |items, scratch| {
        items.iter_mut().for_each(|item| change(item, scratch));
    });
}

/// `make(item)` of every item, in order, `together` items in one task.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], together: usize, make: impl Fn(&T) -> R + Sync) -> Vec<R> {
    map_with(items, together, || (), |item, ()| make(item))
}

/// `make(i, scratch)` of every `i` below `count`, in order; each is a task.
pub(crate) fn map_numbers<R: Send, S>(
    count: usize,
    scratch: impl Fn() -> S + Sync,
    make: impl Fn(usize, &mut S) -> R + Sync,
) -> Vec<R> {
    map_numbers_on(usize::MAX, count, scratch, make)
}

/// [`map_numbers`] on so many threads at most.
pub(crate) fn map_numbers_on<R: Send, S>(
    most: usize,
    count: usize,
    scratch: impl Fn() -> S + Sync,
    make: impl Fn(usize, &mut S) -> R + Sync,
) -> Vec<R> {
    let mut made: Vec<Option<R>> = (0..count).map(|_| None).collect();
    let tasks = made.iter_mut().enumerate();
    for_each_on(most, tasks, scratch, |(i, made), scratch| *made = Some(make(i, scratch)));
    made.into_iter().flatten().collect()
}

/// [`map`] with one scratch for each worker.
pub(crate) fn map_with<T: Sync, R: Send, S>(
    items: &[T],
    together: usize,
    scratch: impl Fn() -> S + Sync,
    make: impl Fn(&T, &mut S) -> R + Sync,
) -> Vec<R> {
    if threads() == 1 || items.len() <= together {
        let mut scratch = scratch();
        return items.iter().map(|item| make(item, &mut scratch)).collect();
    }
    let mut made: Vec<Vec<R>> = items.chunks(together).map(|_| Vec::new()).collect();
    for_each(items.chunks(together).zip(&mut made), scratch, |(items, made), scratch| {
        *made = items.iter().map(|item| make(item, scratch)).collect();
    });
    made.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use crate::testing::with_threads;

    #[test]
    fn everything_is_done_once_and_comes_back_in_order() {
        for threads in [1, 2, 5] {
            for count in [0, 1, 7, 64, 1000] {
                let items: Vec<usize> = (0..count).collect();
                let (squares, changed) = with_threads(threads, || {
                    let mut changed = items.clone();
                    change_each(&mut changed, 3, || (), |item, ()| *item += 1);
                    (map(&items, 7, |i| i * i), changed)
                });
                assert_eq!(squares, items.iter().map(|i| i * i).collect::<Vec<_>>());
                assert_eq!(changed, items.iter().map(|i| i + 1).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn no_more_scratch_than_workers_is_made() {
        let made = AtomicUsize::new(0);
        let scratch = || made.fetch_add(1, Ordering::Relaxed);
        with_threads(3, || for_each(0..1000, scratch, |_, _| ()));
        assert!((1..=3).contains(&made.into_inner()));
    }

    #[test]
    fn tasks_may_share_out_work_themselves() {
        let sums = with_threads(2, || {
            map(&[1usize, 2, 3, 4], 1, |&i| map(&[i, i, i], 1, |j| j * 2).into_iter().sum::<usize>())
        });
        assert_eq!(sums, [6, 12, 18, 24]);
    }

    #[test]
    #[should_panic = "a task fails"]
    fn a_panic_in_a_task_reaches_the_caller() {
        with_threads(2, || each(0..100, |i| assert!(i != 50, "a task fails")));
    }
}
