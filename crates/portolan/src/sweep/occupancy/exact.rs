//! Exact rays of a whole scan.

use super::masks::{Bits, BrickMasks};
use super::trace::{trace, walk};
use crate::geom::vector::{along, distance, dot, scale, sub};
use crate::geom::{Aabb, BlockKey, Lattice, RayWalk};
use crate::parallel;
use crate::scan::RefusedBeams;
use crate::sweep::scan_rays::Ray;
use crate::sweep::{LONGEST_RAY_CELLS, PlanError, clip};

/// What became of the rays of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// Hits whose end lies outside of the bounds.
    pub(crate) hits_outside: u64,
    /// Rays that were not used: an end is not finite; or has no cell index, or the ray is too long.
    pub(crate) refused: RefusedBeams,
    /// Those among them with a surface.
    pub(crate) refused_hits: u64,
}

impl Tally {
    /// Of the rays of both.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            hits_outside: self.hits_outside + other.hits_outside,
            refused: self.refused + other.refused,
            refused_hits: self.refused_hits + other.refused_hits,
        }
    }
}

/// Walks every beam through the cells (Amanatides & Woo 1987): each cell that beams pass gets one miss a scan, each in
/// which one ends one hit, and a hit overrules misses (Hornung et al. 2013, as in OctoMap's `computeUpdate`). The cell in
/// which a beam without a surface ends gets nothing. Rays are shared out to threads with bits of their own, which are
/// then merged: the order does not matter.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExactRays {
    parts: Vec<BrickMasks>,
    keys: Vec<BlockKey<3>>,
    slots: Vec<u32>,
    reach: Option<(BlockKey<3>, BlockKey<3>)>,
}

/// Rays that are worth a thread.
const RAYS_A_PART: usize = 2048;

impl ExactRays {
    /// Marks `count` rays; `further` only count for [`ExactRays::reach`]. Cells outside of `bounds` may be marked, too.
    ///
    /// Stops where more than `most` bricks are touched, whatever the number of threads, and forgets them. Each thread holds
    /// up to `most` bricks of its own until then.
    pub(crate) fn plan(
        &mut self,
        lattice: &Lattice<3>,
        bounds: Option<&Aabb<3>>,
        count: usize,
        ray: impl Fn(usize) -> Ray<3> + Sync,
        further: &[Ray<3>],
        most: usize,
    ) -> Result<Tally, PlanError> {
        let parts = parallel::threads().min(count / RAYS_A_PART).max(1);
        self.parts.resize_with(parts.max(self.parts.len()), BrickMasks::default);
        let range = |part: usize| part * count / parts..(part + 1) * count / parts;
        let mut boxes = vec![Aabb::EMPTY; parts];
        parallel::each(boxes.iter_mut().enumerate(), |(i, b)| {
            let short = |r: &Ray<3>| bounds.is_some() || !is_long(lattice, r);
            *b = extent(lattice, range(i).map(&ray).filter(short))
        });
        let all = boxes.into_iter().fold(extent(lattice, further.iter().copied()), Aabb::union);
        let (first, last) = reach(lattice, bounds, all);
        self.reach = Some((first, last));
        let mut tallies = vec![Tally::default(); parts];
        let jobs =
            self.parts[..parts].iter_mut().zip(&mut tallies).enumerate().map(|(i, (m, t))| (range(i), m, t));
        parallel::each(jobs, |(range, masks, tally)| {
            masks.begin(first, last);
            for i in range {
                mark(masks, lattice, bounds, ray(i), tally);
                if masks.len() > most {
                    break;
                }
            }
        });
        let (whole, others) = self.parts[..parts].split_at_mut(1);
        let mut fits = whole[0].len() <= most;
        for part in others {
            fits = fits && part.len() <= most;
            if fits {
                whole[0].merge(part);
                fits = whole[0].len() <= most;
            }
        }
        if !fits {
            // Together with the memory.
            *self = Self::default();
            return Err(PlanError::TooManyBlocks);
        }
        (self.keys, self.slots) = whole[0].sorted().into_iter().unzip();
        Ok(tallies.into_iter().fold(Tally::default(), Tally::and))
    }

    /// The bricks that were touched, ascending.
    pub(crate) fn keys(&self) -> &[BlockKey<3>] {
        &self.keys
    }

    /// The first and the last brick of the box in which all rays run, with a margin.
    pub(crate) fn reach(&self) -> Option<(BlockKey<3>, BlockKey<3>)> {
        self.reach
    }

    /// The bits of the `i`-th brick.
    pub(crate) fn bits(&self, i: usize) -> &Bits {
        self.parts[0].bits(self.slots[i])
    }
}

/// Whether a ray is longer than any that is walked, or not finite.
#[inline(always)]
fn is_long(lattice: &Lattice<3>, ray: &Ray<3>) -> bool {
    let offset = sub(ray.end, ray.origin);
    let longest = LONGEST_RAY_CELLS * lattice.resolution;
    !(dot(offset, offset) <= longest * longest)
}

/// Marks one ray.
#[inline]
fn mark(
    masks: &mut BrickMasks,
    lattice: &Lattice<3>,
    bounds: Option<&Aabb<3>>,
    ray: Ray<3>,
    tally: &mut Tally,
) {
    let end = match bounds {
        None if is_long(lattice, &ray) => None,
        None if ray.passes => trace(masks, lattice, ray.origin, ray.end),
        Some(bounds) if ray.passes => trace_inside(masks, lattice, bounds, ray),
        _ => lattice.cell_of(ray.end),
    };
    match end {
        Some(cell) if ray.hit => match bounds {
            Some(b) if !b.contains(ray.end) => tally.hits_outside += 1,
            _ => masks.mark_hit(cell),
        },
        Some(_) => {}
        None => {
            let finite = ray.origin.iter().chain(&ray.end).all(|v| v.is_finite());
            *(if finite { &mut tally.refused.too_far } else { &mut tally.refused.not_finite }) += 1;
            tally.refused_hits += u64::from(ray.hit);
        }
    }
}

/// As [`trace`], but only the part of a ray inside of the bounds: a far sensor costs nothing. `None` also where that part
/// is too long.
fn trace_inside(
    masks: &mut BrickMasks,
    lattice: &Lattice<3>,
    bounds: &Aabb<3>,
    ray: Ray<3>,
) -> Option<[i32; 3]> {
    let end = lattice.cell_of(ray.end)?;
    let length = distance(ray.end, ray.origin);
    if length == 0.0 {
        return Some(end);
    }
    if !length.is_finite() {
        return None;
    }
    let direction = scale(sub(ray.end, ray.origin), 1.0 / length);
    if let Some((near, far)) = clip(bounds, ray.origin, direction, length) {
        if far - near > LONGEST_RAY_CELLS * lattice.resolution {
            return None;
        }
        let start = if near > 0.0 { along(ray.origin, direction, near) } else { ray.origin };
        walk(masks, RayWalk::new(lattice, start, direction)?, end, far - near);
    }
    Some(end)
}

/// The box of all origins and ends that have a cell.
fn extent(lattice: &Lattice<3>, rays: impl Iterator<Item = Ray<3>> + Clone) -> Aabb<3> {
    // Where the corners of the box of all have cells, all have.
    let (mut all, mut is_number) = (Aabb::EMPTY, true);
    for ray in rays.clone() {
        for p in [ray.origin, ray.end] {
            is_number &= !(p[0].is_nan() | p[1].is_nan() | p[2].is_nan());
            all.include(p);
        }
    }
    if is_number && lattice.cell_of(all.min).is_some() && lattice.cell_of(all.max).is_some() {
        return all;
    }
    let mut all = Aabb::EMPTY;
    for p in rays.flat_map(|ray| [ray.origin, ray.end]) {
        if lattice.cell_of(p).is_some() {
            all.include(p);
        }
    }
    all
}

/// The bricks of a box, as far as it is inside of the bounds, with a margin for rounding.
fn reach(lattice: &Lattice<3>, bounds: Option<&Aabb<3>>, mut all: Aabb<3>) -> (BlockKey<3>, BlockKey<3>) {
    if let Some(b) = bounds {
        all = all.intersection(*b);
    }
    if all.is_empty() {
        return (BlockKey([0; 3]), BlockKey([-1; 3]));
    }
    let cell = |p| lattice.to_cells(p).map(|v: f64| v.floor().clamp(-1e9, 1e9) as i32);
    let (low, high) = (BlockKey::of_cell(cell(all.min)), BlockKey::of_cell(cell(all.max)));
    (BlockKey(low.0.map(|v| v - 1)), BlockKey(high.0.map(|v| v + 1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    /// The definition, with sets of cells.
    fn oracle(lattice: &Lattice<3>, rays: &[Ray<3>]) -> (HashSet<[i32; 3]>, HashSet<[i32; 3]>) {
        let (mut hits, mut misses) = (HashSet::new(), HashSet::new());
        for ray in rays {
            let end = lattice.cell_of(ray.end).unwrap();
            if ray.hit {
                hits.insert(end);
            }
            let length = distance(ray.end, ray.origin);
            if length == 0.0 {
                continue;
            }
            let direction = scale(sub(ray.end, ray.origin), 1.0 / length);
            let mut walk = RayWalk::new(lattice, ray.origin, direction).unwrap();
            while walk.cell() != end {
                misses.insert(walk.cell());
                if walk.exit() >= length {
                    break;
                }
                walk.advance();
            }
        }
        misses.retain(|c| !hits.contains(c));
        (hits, misses)
    }

    fn equals_the_oracle(lattice: &Lattice<3>, rays: &[Ray<3>]) {
        let mut sweep = ExactRays::default();
        for _ in 0..2 {
            assert_eq!(
                sweep.plan(lattice, None, rays.len(), |i| rays[i], &[], usize::MAX),
                Ok(Tally::default())
            );
        }
        assert!(sweep.keys().is_sorted());
        let (mut hits, mut misses) = (HashSet::new(), HashSet::new());
        for (i, key) in sweep.keys().iter().enumerate() {
            let bits = sweep.bits(i);
            for k in 0..512 {
                if bits.hit[k >> 6] >> (k & 63) & 1 != 0 {
                    hits.insert(key.cell(k));
                } else if bits.miss[k >> 6] >> (k & 63) & 1 != 0 {
                    misses.insert(key.cell(k));
                }
            }
        }
        assert!((hits, misses) == oracle(lattice, rays));
    }

    const UTM: [f64; 3] = [500_000.0, 4_000_000.0, 300.0];

    proptest! {
        #[test]
        fn equals_sets_of_cells(
            ends in prop::collection::vec((prop::array::uniform3(-3.0..3.0f64), any::<bool>()), 1..60),
            o in prop::array::uniform3(-1.0..1.0f64), utm in any::<bool>(),
        ) {
            let zero = if utm { UTM } else { [0.0; 3] };
            let shift = |p: [f64; 3]| std::array::from_fn(|k| p[k] + zero[k]);
            let rays: Vec<_> = ends.iter().map(|&(e, hit)| Ray { origin: shift(o), end: shift(e), hit, passes: true }).collect();
            equals_the_oracle(&Lattice::new(shift([-0.3; 3]), 0.1), &rays);
        }

        /// Everything on a raster of half a cell: along axes, through edges and corners, on faces, from origins of their own.
        #[test]
        fn equals_sets_of_cells_on_faces_and_corners(
            ends in prop::collection::vec((prop::array::uniform3(-24..24i32), prop::array::uniform3(-9..9i32), any::<bool>()), 1..60),
        ) {
            let at = |p: [i32; 3]| p.map(|v| f64::from(v) * 0.125);
            let rays: Vec<_> = ends.iter().map(|&(e, o, hit)| Ray { origin: at(o), end: at(e), hit, passes: true }).collect();
            equals_the_oracle(&Lattice::new([0.0; 3], 0.25), &rays);
        }
    }

    #[test]
    fn along_axes_and_without_length() {
        let ray = |end, hit| Ray { origin: [0.05, 0.05, 0.05], end, hit, passes: true };
        let rays = [
            ray([0.05, 0.05, 4.0], true),
            ray([0.05, 0.05, -4.0], true),
            ray([-4.0, 0.05, 0.05], false),
            ray([0.05, 4.0, 0.05], true),
            ray([0.05, 0.05, 0.05], true),
            ray([0.06, 0.05, 0.05], false),
        ];
        equals_the_oracle(&Lattice::new([0.0; 3], 0.1), &rays);
    }

    #[test]
    fn far_rays_do_without_a_window() {
        let ray = |x: f64| Ray { origin: [0.0; 3], end: [x, 0.7 * x, 0.3], hit: true, passes: true };
        let rays = [ray(900.0), ray(-900.0), ray(3.0)];
        equals_the_oracle(&Lattice::new([0.0; 3], 0.05), &rays);
    }

    #[test]
    fn what_has_no_cell_is_counted() {
        let lattice = Lattice::new([0.0; 3], 0.1);
        let rays = [[f64::NAN, 0.0, 0.0], [1e12, 0.0, 0.0], [1.0, 0.0, 0.0]].map(|end| Ray {
            origin: [0.0; 3],
            end,
            hit: true,
            passes: true,
        });
        let mut sweep = ExactRays::default();
        let refused = RefusedBeams { not_finite: 1, too_far: 1, ..Default::default() };
        let want = Tally { hits_outside: 0, refused, refused_hits: 2 };
        assert_eq!(sweep.plan(&lattice, None, 3, |i| rays[i], &[], usize::MAX), Ok(want));
        assert_eq!(sweep.keys().len(), 2);
    }

    #[test]
    fn only_the_inside_of_bounds_is_walked() {
        let lattice = Lattice::new([0.0; 3], 0.1);
        let bounds = Aabb::new([0.0; 3], [4.0; 3]);
        let ray = Ray { origin: [-1e6, 0.55, 0.55], end: [1e6, 0.55, 0.55], hit: true, passes: true };
        let mut sweep = ExactRays::default();
        let tally = sweep.plan(&lattice, Some(&bounds), 1, |_| ray, &[], usize::MAX);
        assert_eq!(tally, Ok(Tally { hits_outside: 1, ..Default::default() }));
        assert!((5..=7).contains(&sweep.keys().len()), "{:?}", sweep.keys());
    }
    #[test]
    fn a_ray_that_is_too_long_costs_nothing() {
        let lattice = Lattice::new([0.0; 3], 0.1);
        let to = |x: f64, passes| Ray { origin: [0.05; 3], end: [x, 0.05, 0.05], hit: true, passes };
        let mut sweep = ExactRays::default();
        let wide = Aabb::new([-1e7; 3], [1e7; 3]);
        for (passes, bounds) in [(true, None), (false, None), (true, Some(&wide))] {
            let rays = [to(1.0, passes), to(1e6, passes)];
            let tally = sweep.plan(&lattice, bounds, 2, |i| rays[i], &[], usize::MAX).unwrap();
            let refused = RefusedBeams { too_far: 1, ..Default::default() };
            assert_eq!((tally.refused, tally.refused_hits), (refused, 1));
            assert!(sweep.keys().len() <= 2, "{passes} {}", sweep.keys().len());
        }
        assert_eq!(sweep.plan(&lattice, None, 1, |_| to(1e5, true), &[], usize::MAX), Ok(Tally::default()));
    }

    #[test]
    fn no_more_bricks_are_touched_than_may_be() {
        let lattice = Lattice::new([0.0; 3], 0.1);
        let ray = |i: usize| {
            let a = i as f64;
            Ray { origin: [0.0; 3], end: [50.0 * a.cos(), 50.0 * a.sin(), 1.0], hit: true, passes: true }
        };
        let mut sweep = ExactRays::default();
        // As many rays as are shared out to threads.
        sweep.plan(&lattice, None, 5000, ray, &[], usize::MAX).unwrap();
        let touched = sweep.keys().len();
        assert_eq!(sweep.plan(&lattice, None, 5000, ray, &[], touched - 1), Err(PlanError::TooManyBlocks));
        assert!(sweep.keys().is_empty());
        assert!(sweep.plan(&lattice, None, 5000, ray, &[], touched).is_ok());
        assert_eq!(sweep.keys().len(), touched);
    }
}
