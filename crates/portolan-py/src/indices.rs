//! Indices of cells along each axis, from their places in memory.

use rayon::prelude::*;

/// Cells of one task.
const TOGETHER: usize = 1 << 14;
/// Fewer are not shared out.
const SHARED: usize = 1 << 16;
/// The place of no cell.
const NONE: u32 = u32::MAX;

/// Division by one number as a product: a divisor that is not known when it is compiled takes twenty times as long.
#[derive(Clone, Copy)]
struct Divisor {
    by: u32,
    factor: u32,
    shift: u32,
}

impl Divisor {
    /// By 1 to 2^31.
    fn new(by: u32) -> Self {
        let shift = 31 + by.next_power_of_two().trailing_zeros();
        Self { by, factor: (1u64 << shift).div_ceil(u64::from(by)) as u32, shift }
    }

    /// Quotient and remainder, exact below 2^31: the factor is too large by less than `2^shift / 2^31` of it *(Granlund &
    /// Montgomery 1994)*.
    #[inline(always)]
    fn divide(self, n: u32) -> (u32, u32) {
        let quotient = ((u64::from(n) * u64::from(self.factor)) >> self.shift) as u32;
        (quotient, n.wrapping_sub(quotient.wrapping_mul(self.by)))
    }
}

/// By axis, the indices of the cells at these places (the first axis fastest), those of the last axis first if `reversed`;
/// -1 where there is none. O(cells).
pub(crate) fn indices<const D: usize>(
    places: &[u32],
    shape: [usize; D],
    reversed: bool,
    threads: usize,
) -> Vec<i32> {
    let mut all = vec![0; D * places.len()];
    if places.is_empty() {
        return all;
    }
    let mut planes: Vec<_> = all.chunks_mut(places.len()).collect();
    if reversed {
        planes.reverse();
    }
    let mut parts: Vec<_> = planes.into_iter().map(|plane| plane.chunks_mut(TOGETHER)).collect();
    let tasks: Vec<(&[u32], Vec<&mut [i32]>)> = places
        .chunks(TOGETHER)
        .map(|places| (places, parts.iter_mut().filter_map(Iterator::next).collect()))
        .collect();
    let small = places.len() <= 1 << 31;
    let fill = |(places, mut planes): (&[u32], Vec<&mut [i32]>)| {
        if small {
            let by = shape.map(|n| Divisor::new(n as u32));
            split(places, &mut planes, |axis, n| by[axis].divide(n));
        } else {
            let by = shape.map(|n| n as u32);
            split(places, &mut planes, |axis, n| (n / by[axis], n % by[axis]));
        }
    };
    if threads == 1 || places.len() < SHARED {
        tasks.into_iter().for_each(fill);
    } else {
        tasks.into_par_iter().for_each(fill);
    }
    all
}

/// What is left of the places goes from axis to axis, a chunk that stays in cache.
#[inline(always)]
fn split(places: &[u32], planes: &mut [&mut [i32]], divide: impl Fn(usize, u32) -> (u32, u32)) {
    let last = planes.len() - 1;
    for (to, &place) in planes[0].iter_mut().zip(places) {
        *to = place as i32;
    }
    for axis in 0..last {
        let (before, after) = planes.split_at_mut(axis + 1);
        let pairs = before[axis].iter_mut().zip(after[0].iter_mut());
        for ((here, next), &place) in pairs.zip(places) {
            let (quotient, remainder) = divide(axis, *here as u32);
            *here = if place == NONE { -1 } else { remainder as i32 };
            *next = if place == NONE { -1 } else { quotient as i32 };
        }
    }
}
