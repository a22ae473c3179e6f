//! Exact rays of a scan: hits, and the length in every cell.

use super::blocks::{HitBlocks, is_fine, shared_out};
use super::part::{Part, Walk};
use crate::cell::HitLengths;
use crate::geom::vector::{along, distance, scale, sub};
use crate::geom::{Aabb, BlockKey, Lattice, block_cells};
use crate::parallel;
use crate::sweep::occupancy::Tally;
use crate::sweep::scan_rays::Ray;
use crate::sweep::{LONGEST_RAY_CELLS, PlanError, PlanLimits, clip};

/// Hits and lengths by block. First come the hits, which say what blocks are told apart cell by cell; then rays are walked,
/// shared out to threads with counts of their own, which are then added: whole numbers, so that the order does not matter.
#[derive(Clone, Debug)]
pub(super) struct RayLengths<const D: usize> {
    /// The blocks in which a beam ever ended.
    pub(super) hit: HitBlocks<D>,
    parts: Vec<Part<D>>,
    walks: Vec<Walk<D>>,
    keys: Vec<BlockKey<D>>,
    said: Vec<Said>,
}

/// What rays say of a block.
#[derive(Clone, Copy, Debug)]
enum Said {
    /// Of each cell, in so many-th place.
    Cells(u32),
    /// The length in all cells together.
    Total(u64),
}

/// Rays that are worth a thread.
const RAYS_A_PART: usize = 4096;

impl<const D: usize> RayLengths<D> {
    pub(super) fn new() -> Self {
        Self {
            hit: HitBlocks::default(),
            parts: vec![Part::new()],
            walks: Vec::new(),
            keys: Vec::new(),
            said: Vec::new(),
        }
    }

    /// Takes rays in. Stops where more than the limit's blocks are touched, and forgets them.
    pub(super) fn plan(
        &mut self,
        lattice: &Lattice<D>,
        limits: &PlanLimits<D>,
        rays: impl Iterator<Item = Ray<D>>,
    ) -> Result<Tally, PlanError> {
        self.keys.clear();
        self.said.clear();
        self.walks.clear();
        self.parts.iter_mut().for_each(Part::clear);
        let mut tally = Tally::default();
        let mut last = None;
        for ray in rays {
            let end = match self.prepare(lattice, limits.bounds.as_ref(), &ray) {
                Ok(end) => end,
                Err(finite) => {
                    *(if finite { &mut tally.refused.too_far } else { &mut tally.refused.not_finite }) += 1;
                    tally.refused_hits += u64::from(ray.hit);
                    continue;
                }
            };
            match limits.bounds {
                Some(b) if ray.hit && !b.contains(ray.end) => tally.hits_outside += 1,
                _ if ray.hit => {
                    let key = BlockKey::of_cell(end);
                    if last.replace(key) != Some(key) {
                        self.hit.insert(key);
                    }
                    self.parts[0].cells.of_cell(end).add_hit(BlockKey::offset(end));
                }
                _ => {}
            }
        }
        if !self.walk(lattice, limits) {
            // Together with the memory.
            *self = Self { hit: std::mem::take(&mut self.hit), ..Self::new() };
            return Err(PlanError::TooManyBlocks);
        }
        Ok(tally)
    }

    /// The cell of a ray's end, and a walk for it where it passes something. Whether it is finite, where it is refused.
    fn prepare(
        &mut self,
        lattice: &Lattice<D>,
        bounds: Option<&Aabb<D>>,
        ray: &Ray<D>,
    ) -> Result<[i32; D], bool> {
        let length = distance(ray.end, ray.origin);
        let finite = length.is_finite();
        let longest = LONGEST_RAY_CELLS * lattice.resolution;
        let end = lattice.cell_of(ray.end).filter(|_| finite).ok_or(finite)?;
        if bounds.is_none() && length > longest {
            return Err(true);
        }
        if ray.passes && length > 0.0 {
            let direction = scale(sub(ray.end, ray.origin), 1.0 / length);
            let part = match bounds {
                Some(b) => clip(b, ray.origin, direction, length),
                None => Some((0.0, length)),
            };
            let Some((near, far)) = part else { return Ok(end) };
            let start = if near > 0.0 { along(ray.origin, direction, near) } else { ray.origin };
            if far - near > longest || lattice.cell_of(start).is_none() {
                return Err(true);
            }
            self.walks.push(Walk { start, direction, length: far - near });
        }
        Ok(end)
    }

    /// Walks the rays and brings the blocks into order; `false` where they are too many.
    fn walk(&mut self, lattice: &Lattice<D>, limits: &PlanLimits<D>) -> bool {
        let (walks, hit) = (&self.walks, &self.hit);
        let parts = parallel::threads().min(walks.len() / RAYS_A_PART).max(1);
        self.parts.resize_with(parts.max(self.parts.len()), Part::new);
        let fine = |key| is_fine(hit, limits.bounds.as_ref(), lattice, key);
        parallel::each(self.parts[..parts].iter_mut().enumerate(), |(i, part)| {
            for walk in &walks[i * walks.len() / parts..(i + 1) * walks.len() / parts] {
                part.walk(lattice, walk, &fine);
                if part.blocks() > limits.most_blocks {
                    break;
                }
            }
        });
        let (whole, others) = self.parts[..parts].split_at_mut(1);
        let mut fits = whole[0].blocks() <= limits.most_blocks;
        for part in others {
            fits = fits && part.blocks() <= limits.most_blocks;
            if fits {
                whole[0].add(part);
                fits = whole[0].blocks() <= limits.most_blocks;
            }
        }
        if fits {
            let part = &mut self.parts[0];
            part.cells.sort();
            let cells = part.cells.keys().iter().enumerate().map(|(i, key)| (*key, Said::Cells(i as u32)));
            let totals = part.totals.iter().map(|(key, total)| (*key, Said::Total(*total)));
            let mut all: Vec<_> = cells.chain(totals).collect();
            all.sort_unstable_by_key(|(key, _)| *key);
            (self.keys, self.said) = all.into_iter().unzip();
        }
        fits
    }

    /// The blocks that were touched, ascending.
    pub(super) fn keys(&self) -> &[BlockKey<D>] {
        &self.keys
    }

    /// What is said of the `i`-th of them, in `scratch` where it is the same of all cells.
    pub(super) fn evidence<'a>(&'a self, i: usize, scratch: &'a mut HitLengths) -> &'a HitLengths {
        match self.said[i] {
            Said::Cells(at) => self.parts[0].cells.evidence(at as usize),
            Said::Total(_) => {
                scratch.set_even(shared_out(self.mean(i)));
                scratch
            }
        }
    }

    /// Mean length of the `i`-th block's cells, where cells are not told apart; else 0.
    pub(super) fn mean(&self, i: usize) -> f64 {
        match self.said[i] {
            Said::Cells(_) => 0.0,
            Said::Total(total) => total as f64 / block_cells::<D>() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Evidence, LENGTH_UNITS};
    use crate::testing::point;
    use proptest::prelude::*;

    /// The length of a segment inside of a box (cells).
    fn inside<const D: usize>(lattice: &Lattice<D>, first: [i32; D], edge: i32, ray: &Ray<D>) -> f64 {
        let (low, high) = (lattice.corner(first), lattice.corner(first.map(|v| v + edge)));
        let length = distance(ray.end, ray.origin);
        let direction = scale(sub(ray.end, ray.origin), 1.0 / length);
        let part = clip(&Aabb::new(low, high), ray.origin, direction, length);
        part.map_or(0.0, |(a, b)| b - a) / lattice.resolution
    }

    fn holds_the_lengths<const D: usize>(ends: &[([f64; 3], bool)], origin: [f64; 3], boxed: bool) {
        let lattice = Lattice::<D>::new([-0.3; D], 0.1);
        let ray =
            |i: usize| Ray { origin: point(origin), end: point(ends[i].0), hit: ends[i].1, passes: true };
        let bounds = Aabb::new([-1.3; D], [1.7; D]);
        let limits = if boxed { PlanLimits::inside(bounds) } else { PlanLimits::default() };
        let mut rays = RayLengths::<D>::new();
        for _ in 0..2 {
            rays.plan(&lattice, &limits, (0..ends.len()).map(ray)).unwrap();
        }
        assert!(rays.keys().is_sorted());
        let (mut total, mut hits, mut scratch) = (0.0, 0, HitLengths::silent(block_cells::<D>()));
        let slack = 1e-9 + ends.len() as f64 / f64::from(LENGTH_UNITS);
        for (i, key) in rays.keys().iter().enumerate() {
            let e = rays.evidence(i, &mut scratch);
            if e.even().is_some() {
                // Rounded for all cells at once; what is rounded is the mean.
                let length = rays.mean(i) * block_cells::<D>() as f64 / f64::from(LENGTH_UNITS);
                let first = key.first_cell();
                let expected: f64 = (0..ends.len()).map(|i| inside(&lattice, first, 8, &ray(i))).sum();
                assert!(D == 3 && (length - expected).abs() <= slack, "{key:?} {length} {expected}");
                total += length;
                continue;
            }
            for k in 0..block_cells::<D>() {
                let (cell, o) = (key.cell(k), e.one(k).unwrap_or_default());
                let length = f64::from(o.length) / f64::from(LENGTH_UNITS);
                let expected: f64 = (0..ends.len()).map(|i| inside(&lattice, cell, 1, &ray(i))).sum();
                if limits.bounds.is_none_or(|b| b.contains(lattice.center(cell))) {
                    assert!((length - expected).abs() <= slack, "{cell:?} {length} {expected}");
                }
                let ended =
                    (0..ends.len()).filter(|&i| ends[i].1 && lattice.cell_of(ray(i).end) == Some(cell));
                if !boxed {
                    assert_eq!(o.hits as usize, ended.count());
                }
                total += length;
                hits += o.hits;
            }
        }
        let all: f64 =
            (0..ends.len()).map(|i| distance(ray(i).end, ray(i).origin) / lattice.resolution).sum();
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
            let (a, b, r) = (i as f64 * 0.37, i as f64 * 0.011, 1.0 + (i % 7) as f64);
            let end = [r * a.cos() * b.cos(), r * a.sin() * b.cos(), r * b.sin()];
            Ray { origin: [0.05; 3], end, hit: !i.is_multiple_of(3) && i % 7 < 3, passes: true }
        };
        let made = |threads| {
            let mut rays = RayLengths::<3>::new();
            crate::testing::with_threads(threads, || {
                rays.plan(&lattice, &PlanLimits::default(), (0..20_000).map(ray)).unwrap();
            });
            let mut scratch = HitLengths::silent(512);
            let all: Vec<_> = rays.keys().iter().copied().enumerate().collect();
            let all: Vec<_> =
                all.into_iter().map(|(i, k)| (k, rays.evidence(i, &mut scratch).clone())).collect();
            assert!(all.iter().any(|e| e.1.even().is_some()) && all.iter().any(|e| e.1.even().is_none()));
            let limit = PlanLimits { most_blocks: all.len() - 1, ..Default::default() };
            let refused = rays.plan(&lattice, &limit, (0..20_000).map(ray));
            assert_eq!(refused, Err(PlanError::TooManyBlocks));
            all
        };
        assert!(made(1) == made(2));
    }

    #[test]
    fn what_cannot_be_walked_is_counted() {
        let lattice = Lattice::new([0.0; 2], 0.1);
        let to = |x: f64| Ray { origin: [0.05; 2], end: [x, 0.05], hit: true, passes: true };
        let mut rays = RayLengths::<2>::new();
        let ends = [1.0, 1e6, f64::INFINITY, f64::NAN, 1e12];
        let tally = rays.plan(&lattice, &PlanLimits::default(), ends.into_iter().map(to)).unwrap();
        assert_eq!((tally.refused.too_far, tally.refused.not_finite, tally.refused_hits), (2, 2, 4));
        assert_eq!(rays.keys().len(), 2);
    }
}
