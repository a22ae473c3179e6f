//! Exact rays of a scan: hits, and the length in every cell.

use crate::cell::{HitLengths, LENGTH_UNITS};
use crate::geom::vector::along;
use crate::geom::{Aabb, BlockKey, Lattice, RayWalk};
use crate::parallel;
use crate::sweep::occupancy::Tally;
use crate::sweep::touched::Touched;
use crate::sweep::{LONGEST_RAY_CELLS, PlanError, PlanLimits, clip};

/// One beam in the world's frame (meters).
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray<const D: usize> {
    pub(super) origin: [f64; D],
    pub(super) end: [f64; D],
    /// Unit vector from the origin to the end, and how far that is.
    pub(super) direction: [f64; D],
    pub(super) length: f64,
    /// Whether there is a surface at the end.
    pub(super) hit: bool,
    /// Whether its length counts; else only its end does.
    pub(super) passes: bool,
}

/// Hits and lengths by block. Rays are shared out to threads with counts of their own, which are then added: whole
/// numbers, so that the order does not matter.
#[derive(Clone, Debug)]
pub(super) struct RayLengths<const D: usize> {
    parts: Vec<Touched<HitLengths, D>>,
}

/// Rays that are worth a thread.
const RAYS_A_PART: usize = 8192;

impl<const D: usize> RayLengths<D> {
    pub(super) fn new() -> Self {
        Self { parts: vec![Touched::new()] }
    }

    /// Takes `count` rays in. `None` stands for one that was refused and counted before. Stops where more than the limit's
    /// blocks are touched, and forgets them.
    pub(super) fn plan(
        &mut self,
        lattice: &Lattice<D>,
        limits: &PlanLimits<D>,
        count: usize,
        ray: impl Fn(usize) -> Ray<D> + Sync,
    ) -> Result<Tally, PlanError> {
        let parts = parallel::threads().min(count / RAYS_A_PART).max(1);
        self.parts.resize_with(parts.max(self.parts.len()), Touched::new);
        self.parts.iter_mut().for_each(Touched::clear);
        let mut tallies = vec![Tally::default(); parts];
        let jobs = self.parts[..parts].iter_mut().zip(&mut tallies).enumerate();
        parallel::each(jobs, |(i, (touched, tally))| {
            for i in i * count / parts..(i + 1) * count / parts {
                take(touched, lattice, limits.bounds.as_ref(), &ray(i), tally);
                if touched.keys().len() > limits.most_blocks {
                    break;
                }
            }
        });
        let (whole, others) = self.parts[..parts].split_at_mut(1);
        let mut fits = whole[0].keys().len() <= limits.most_blocks;
        for part in others {
            fits = fits && part.keys().len() <= limits.most_blocks;
            if fits {
                part.sort();
                for (i, key) in part.keys().iter().enumerate() {
                    whole[0].of_cell(key.first_cell()).add(part.evidence(i));
                }
                fits = whole[0].keys().len() <= limits.most_blocks;
            }
        }
        if !fits {
            // Together with the memory.
            *self = Self::new();
            return Err(PlanError::TooManyBlocks);
        }
        whole[0].sort();
        Ok(tallies.into_iter().fold(Tally::default(), Tally::and))
    }

    /// The blocks that were touched, ascending.
    pub(super) fn keys(&self) -> &[BlockKey<D>] {
        self.parts[0].keys()
    }

    /// What the `i`-th of them holds.
    pub(super) fn evidence(&self, i: usize) -> &HitLengths {
        self.parts[0].evidence(i)
    }
}

/// Takes one ray in: its length in every cell up to its end, as far as it is inside of the bounds, and the hit at its end.
#[inline]
fn take<const D: usize>(
    touched: &mut Touched<HitLengths, D>,
    lattice: &Lattice<D>,
    bounds: Option<&Aabb<D>>,
    ray: &Ray<D>,
    tally: &mut Tally,
) {
    let finite = ray.length.is_finite() && ray.origin.iter().all(|v| v.is_finite());
    let end = lattice.cell_of(ray.end).filter(|_| finite);
    let walked = end.is_some() && (!ray.passes || walk(touched, lattice, bounds, ray));
    let (true, Some(end)) = (walked && (bounds.is_some() || !is_long(lattice, ray.length)), end) else {
        *(if finite { &mut tally.refused.too_far } else { &mut tally.refused.not_finite }) += 1;
        tally.refused_hits += u64::from(ray.hit);
        return;
    };
    if ray.hit {
        match bounds {
            Some(b) if !b.contains(ray.end) => tally.hits_outside += 1,
            _ => touched.of_cell(end).add_hit(BlockKey::offset(end)),
        }
    }
}

/// Whether so many meters are more than are walked.
fn is_long<const D: usize>(lattice: &Lattice<D>, length: f64) -> bool {
    length > LONGEST_RAY_CELLS * lattice.resolution
}

/// Adds the length in every cell of a finite ray; `false` where it is too long, and nothing is added.
#[inline]
fn walk<const D: usize>(
    touched: &mut Touched<HitLengths, D>,
    lattice: &Lattice<D>,
    bounds: Option<&Aabb<D>>,
    ray: &Ray<D>,
) -> bool {
    let part = match bounds {
        Some(b) => clip(b, ray.origin, ray.direction, ray.length),
        None => Some((0.0, ray.length)),
    };
    let Some((near, far)) = part else { return true };
    if is_long(lattice, far - near) {
        return false;
    }
    let start = if near > 0.0 { along(ray.origin, ray.direction, near) } else { ray.origin };
    let Some(mut walk) = RayWalk::new(lattice, start, ray.direction) else { return false };
    // Places along the ray are rounded, not lengths: what a cell loses its neighbor gains.
    let per_meter = f64::from(LENGTH_UNITS) / lattice.resolution;
    let (length, mut before) = (far - near, 0u32);
    loop {
        let (cell, exit) = (walk.cell(), walk.exit());
        let place = (exit.min(length) * per_meter + 0.5) as u32;
        if place > before {
            touched.of_cell(cell).add_length(BlockKey::offset(cell), place - before);
            before = place;
        }
        if exit >= length {
            return true;
        }
        walk.advance();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::{distance, scale, sub};
    use crate::testing::point;
    use proptest::prelude::*;

    /// The length of a segment inside of a cell, by its entry and exit (cells).
    fn inside<const D: usize>(lattice: &Lattice<D>, cell: [i32; D], ray: &Ray<D>) -> f64 {
        let low = lattice.corner(cell);
        let high = low.map(|v| v + lattice.resolution);
        let part = clip(&Aabb::new(low, high), ray.origin, ray.direction, ray.length);
        part.map_or(0.0, |(a, b)| b - a) / lattice.resolution
    }

    fn holds_the_lengths<const D: usize>(ends: &[([f64; 3], bool)], origin: [f64; 3], boxed: bool) {
        let lattice = Lattice::<D>::new([-0.3; D], 0.1);
        let ray = |i: usize| {
            let (end, origin): ([f64; D], [f64; D]) = (point(ends[i].0), point(origin));
            let length = distance(end, origin);
            let direction = scale(sub(end, origin), 1.0 / length);
            Ray { origin, end, direction, length, hit: ends[i].1, passes: true }
        };
        let limits =
            if boxed { PlanLimits::inside(Aabb::new([-1.3; D], [1.7; D])) } else { PlanLimits::default() };
        let mut rays = RayLengths::<D>::new();
        for _ in 0..2 {
            rays.plan(&lattice, &limits, ends.len(), ray).unwrap();
        }
        assert!(rays.keys().is_sorted());
        let (mut total, mut hits) = (0.0, 0);
        for (i, key) in rays.keys().iter().enumerate() {
            let e = rays.evidence(i);
            for k in 0..e.hits().len() {
                let cell = key.cell(k);
                let length = f64::from(e.lengths()[k]) / f64::from(LENGTH_UNITS);
                let expected: f64 = (0..ends.len()).map(|i| inside(&lattice, cell, &ray(i))).sum();
                let slack = 1e-9 + ends.len() as f64 / f64::from(LENGTH_UNITS);
                if limits.bounds.is_none_or(|b| b.contains(lattice.center(cell))) {
                    assert!((length - expected).abs() <= slack, "{cell:?} {length} {expected}");
                }
                let ended =
                    (0..ends.len()).filter(|&i| ends[i].1 && lattice.cell_of(ray(i).end) == Some(cell));
                if !boxed {
                    assert_eq!(e.hits()[k] as usize, ended.count());
                }
                total += length;
                hits += e.hits()[k];
            }
        }
        let all: f64 = (0..ends.len()).map(|i| ray(i).length / lattice.resolution).sum();
        let slack = 0.01 * ends.len() as f64;
        assert!(boxed && total <= all + slack || (total - all).abs() <= slack, "{total} {all}");
        assert!(boxed || hits as usize == ends.iter().filter(|e| e.1).count());
    }

    proptest! {
        #[test]
        fn lengths_and_hits_are_those_of_the_segments_2d_and_3d(
            ends in prop::collection::vec((prop::array::uniform3(-3.0..3.0f64), any::<bool>()), 1..20),
            o in prop::array::uniform3(-1.0..1.0f64), boxed in any::<bool>(),
        ) {
            holds_the_lengths::<2>(&ends, o, boxed);
            holds_the_lengths::<3>(&ends, o, boxed);
        }
    }

    #[test]
    fn many_threads_count_as_one() {
        let lattice = Lattice::new([0.0; 3], 0.1);
        let ray = |i: usize| {
            let (a, b) = (i as f64 * 0.37, i as f64 * 0.011);
            let (direction, length) = ([a.cos() * b.cos(), a.sin() * b.cos(), b.sin()], 1.0 + (i % 7) as f64);
            let end = along([0.05; 3], direction, length);
            Ray { origin: [0.05; 3], end, direction, length, hit: i % 3 > 0, passes: true }
        };
        let made = |threads| {
            let mut rays = RayLengths::<3>::new();
            crate::testing::with_threads(threads, || {
                rays.plan(&lattice, &PlanLimits::default(), 20_000, ray).unwrap();
            });
            let all: Vec<_> =
                rays.keys().iter().enumerate().map(|(i, k)| (*k, rays.evidence(i).clone())).collect();
            let limit = PlanLimits { most_blocks: all.len() - 1, ..Default::default() };
            assert_eq!(rays.plan(&lattice, &limit, 20_000, ray), Err(PlanError::TooManyBlocks));
            all
        };
        assert!(made(1) == made(2));
    }

    #[test]
    fn what_cannot_be_walked_is_counted() {
        let lattice = Lattice::new([0.0; 2], 0.1);
        let to = |x: f64| Ray {
            origin: [0.05; 2],
            end: [x, 0.05],
            direction: [1.0, 0.0],
            length: x - 0.05,
            hit: true,
            passes: true,
        };
        let mut rays = RayLengths::<2>::new();
        let ends = [1.0, 1e6, f64::INFINITY, f64::NAN, 1e12];
        let tally = rays.plan(&lattice, &PlanLimits::default(), ends.len(), |i| to(ends[i])).unwrap();
        assert_eq!((tally.refused.too_far, tally.refused.not_finite, tally.refused_hits), (2, 2, 4));
        assert_eq!(rays.keys().len(), 2);
    }
}
