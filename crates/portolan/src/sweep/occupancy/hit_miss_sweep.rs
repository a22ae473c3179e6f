//! Hits and misses of a whole scan.

use super::cell_box::CellBox;
use super::exact::{ExactRays, Ray, Tally};
use super::masks::Bits;
use crate::cell::{Evidence, HitMiss};
use crate::geom::{BlockKey, Lattice, Pose};
use crate::parallel;
use crate::scan::{
    BeamCounts, Frame, LayoutFinder, Origin, PointScan, RangeImage, RefusedBeams, Scan, SphericalLayout,
};
use crate::sweep::image::ProjectiveMisses;
use crate::sweep::{LONGEST_RAY_CELLS, PlanError, PlanLimits, PlannedScan};
use std::borrow::Cow;

/// How a scan becomes evidence of hits and misses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OccupancySweep {
    /// Projective where a scan has rows and columns or gets them, exact otherwise.
    #[default]
    Auto,
    /// Every cell that a beam passes, exactly: the map that OctoMap makes.
    Exact,
    /// Misses through a range image, hits exact: faster, frees the space between beams, and carves grazing surfaces less.
    /// As `Auto`, said by name.
    Projective,
}

/// The cell in which a beam ends is hit, cells that beams pass are missed, and a hit overrules misses: one observation per
/// cell and scan (Hornung et al. 2013). Hits are exact; misses come from exact rays or through the scan's range image.
///
/// Keeps its memory from scan to scan, and the rows and columns that it found.
#[derive(Clone, Debug, Default)]
pub struct HitMissSweep {
    kind: OccupancySweep,
    layout: LayoutFinder,
    rays: ExactRays,
    misses: ProjectiveMisses,
    bounds: Option<CellBox>,
    keys: Vec<BlockKey<3>>,
    parts: Vec<Parts>,
}

/// A block's place among those that rays touch, and among those that the image sees.
#[derive(Clone, Copy, Debug)]
struct Parts {
    rays: Option<u32>,
    misses: Option<u32>,
}

/// The rays of a scan: those up to `hits` end on surfaces.
struct Rays<F> {
    hits: usize,
    count: usize,
    ray: F,
}

/// An image and the pose of the frame in which its pixels look.
#[derive(Clone, Copy)]
struct View<'a> {
    world_from_image: &'a Pose<3>,
    image: &'a RangeImage,
}

impl HitMissSweep {
    /// A sweep of this kind.
    pub fn new(kind: OccupancySweep) -> Self {
        Self { kind, ..Self::default() }
    }

    /// Rows and columns for scans of points that come without them; otherwise they are found: see [`LayoutFinder`].
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.layout = LayoutFinder::of(layout);
    }

    /// Takes in what a sensor delivered at a rigid pose. Rays that are not finite, or longer than [`LONGEST_RAY_CELLS`]
    /// (within the bounds, if there are any), are refused and counted. O(cells passed), in parallel.
    ///
    /// # Errors
    /// Where an image that is used contradicts itself, or rays touch more blocks than they may. The plan is then empty.
    pub fn plan(
        &mut self,
        frame: &Frame,
        world_from_sensor: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<PlannedScan, PlanError> {
        let mut planned = match frame {
            Frame::Points(scan) => self.plan_scan(scan, world_from_sensor, lattice, limits)?,
            Frame::Image(image) => self.plan_image(image, world_from_sensor, lattice, limits)?,
        };
        planned.refused += frame.refused();
        Ok(planned)
    }

    /// Takes in surfaces seen from `origin_world` (both world, metres), with exact rays.
    ///
    /// # Errors
    /// As [`HitMissSweep::plan`].
    pub fn plan_points(
        &mut self,
        points_world: &[impl Into<[f64; 3]> + Copy + Sync],
        origin_world: [f64; 3],
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<PlannedScan, PlanError> {
        let ray =
            |i: usize| Ray { origin: origin_world, end: points_world[i].into(), hit: true, passes: true };
        let count = points_world.len();
        self.plan_rays(&Rays { hits: count, count, ray }, None, lattice, limits)
    }

    /// Takes in beams, with exact rays: they have no rows and columns.
    ///
    /// # Errors
    /// As [`HitMissSweep::plan`].
    pub fn plan_beams(
        &mut self,
        scan: &Scan<3>,
        world_from_sensor: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<PlannedScan, PlanError> {
        let origin = world_from_sensor.translation;
        let used = scan.beams().filter(|b| b.free_range() > 0.0);
        let ray = |b: crate::scan::Beam<3>| {
            let end = world_from_sensor.transform_point(b.direction.map(|d| d * b.range));
            Ray { origin, end, hit: b.is_hit(), passes: true }
        };
        let rays: Vec<Ray> = used.map(ray).collect();
        let hits = rays.iter().filter(|r| r.hit).count();
        let rays = Rays { hits, count: rays.len(), ray: |i: usize| rays[i] };
        let mut planned = self.plan_rays(&rays, None, lattice, limits)?;
        let refused_hits = (hits as u64).saturating_sub(planned.beams.hit);
        planned.beams = scan.counts();
        planned.beams.hit -= refused_hits.min(planned.beams.hit);
        planned.beams.dropped += refused_hits;
        planned.refused += scan.refused();
        Ok(planned)
    }

    fn plan_scan(
        &mut self,
        scan: &PointScan,
        world_from_sensor: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<PlannedScan, PlanError> {
        let to_world = |p: [f32; 3]| world_from_sensor.transform_point(p.map(f64::from));
        let hits = scan.points.len();
        let (common, image) = match &scan.origin {
            Origin::Common(o) => (world_from_sensor.transform_point(*o), self.organised(scan, *o)?),
            Origin::PerPoint(_) => (world_from_sensor.translation, None),
        };
        let world_from_image = Pose { translation: common, ..*world_from_sensor };
        let view = image.as_deref().map(|image| View { world_from_image: &world_from_image, image });
        let passes = view.is_none();
        let ray = |i: usize| match i.checked_sub(hits) {
            Some(free) => {
                Ray { origin: common, end: to_world(scan.free_ends[free]), hit: false, passes: true }
            }
            None => {
                let origin = match &scan.origin {
                    Origin::Common(_) => common,
                    Origin::PerPoint(all) => all.get(i).map_or([f64::NAN; 3], |o| to_world(*o)),
                };
                Ray { origin, end: to_world(scan.points[i]), hit: true, passes }
            }
        };
        self.plan_rays(&Rays { hits, count: hits + scan.free_ends.len(), ray }, view, lattice, limits)
    }

    /// Rows and columns of a scan about one origin, if the sweep wants them and the scan has or gets them.
    fn organised<'a>(
        &mut self,
        scan: &'a PointScan,
        origin: [f64; 3],
    ) -> Result<Option<Cow<'a, RangeImage>>, PlanError> {
        if self.kind == OccupancySweep::Exact {
            return Ok(None);
        }
        if let Some(image) = &scan.image {
            image.check().map_err(PlanError::BadImage)?;
            return Ok(Some(Cow::Borrowed(image)));
        }
        Ok(self.layout.image(&scan.points, origin).map(Cow::Owned))
    }

    fn plan_image(
        &mut self,
        image: &RangeImage,
        world_from_sensor: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<PlannedScan, PlanError> {
        image.check().map_err(PlanError::BadImage)?;
        let passes = self.kind == OccupancySweep::Exact;
        let ray = |(origin, end, hit)| Ray {
            origin: world_from_sensor.transform_point(origin),
            end: world_from_sensor.transform_point(end),
            hit,
            passes,
        };
        let rays: Vec<Ray> = image.readings().map(ray).collect();
        let hits = rays.iter().filter(|r| r.hit).count();
        let rays = Rays { hits, count: rays.len(), ray: |i: usize| rays[i] };
        self.plan_rays(
            &rays,
            (!passes).then_some(View { world_from_image: world_from_sensor, image }),
            lattice,
            limits,
        )
    }

    /// Marks the rays, and finds the blocks of which a view sees free cells; without one, rays that pass mark misses.
    fn plan_rays<F: Fn(usize) -> Ray + Sync>(
        &mut self,
        rays: &Rays<F>,
        view: Option<View<'_>>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<PlannedScan, PlanError> {
        self.keys.clear();
        self.parts.clear();
        self.misses.clear();
        self.bounds = limits.bounds.map(|b| CellBox::of(&b, lattice));
        let bounds = self.bounds.map(|b| b.aabb(lattice));
        let (bounds, most) = (bounds.as_ref(), limits.most_blocks);
        let longest = LONGEST_RAY_CELLS * lattice.resolution;
        let further: Vec<Ray> = view.and_then(|view| free_reach(view, longest)).into_iter().collect();
        let (exact, misses) = (&mut self.rays, &mut self.misses);
        let (planned, ()) = parallel::join(
            || exact.plan(lattice, bounds, rays.count, &rays.ray, &further, most),
            || view.into_iter().for_each(|view| misses.take(view.image, view.world_from_image, lattice)),
        );
        let mut tally = planned.map_err(|_| PlanError::TooManyBlocks)?;
        let is_searched = match (view, exact.reach()) {
            (Some(_), Some((first, last))) => misses.find_blocks(first, last),
            _ => true,
        };
        if !is_searched {
            let passing = |i: usize| Ray { passes: true, ..(rays.ray)(i) };
            let planned = exact.plan(lattice, bounds, rays.count, passing, &[], most);
            tally = planned.map_err(|_| PlanError::TooManyBlocks)?;
        }
        self.unite();
        Ok(planned_scan(rays.hits, rays.count, tally))
    }

    /// Blocks of the rays and of the image together, ascending, as both are.
    fn unite(&mut self) {
        let (marked, seen) = (self.rays.keys(), self.misses.blocks());
        let (mut i, mut j) = (0, 0);
        while i < marked.len() || j < seen.len() {
            let key = match (marked.get(i), seen.get(j)) {
                (Some(a), Some(b)) => *a.min(b),
                (Some(key), None) | (None, Some(key)) => *key,
                (None, None) => break,
            };
            let (is_marked, is_seen) = (marked.get(i) == Some(&key), seen.get(j) == Some(&key));
            self.keys.push(key);
            self.parts
                .push(Parts { rays: is_marked.then_some(i as u32), misses: is_seen.then_some(j as u32) });
            i += usize::from(is_marked);
            j += usize::from(is_seen);
        }
    }

    /// The planned blocks, ascending.
    pub fn blocks(&self) -> &[BlockKey<3>] {
        &self.keys
    }

    /// The evidence about the `i`-th planned block, into `evidence`; returns for how many cells there is some.
    pub fn evidence(&self, i: usize, evidence: &mut HitMiss) -> usize {
        let parts = self.parts[i];
        let Bits { mut miss, mut hit } =
            parts.rays.map_or_else(Bits::default, |at| *self.rays.bits(at as usize));
        if let Some(at) = parts.misses {
            let free = self.misses.free_cells(at as usize);
            (0..8).for_each(|w| miss[w] |= free[w]);
        }
        if let Some(mask) = self.bounds.and_then(|b| b.mask(self.keys[i])) {
            for w in 0..8 {
                hit[w] &= mask[w];
                miss[w] &= mask[w];
            }
        }
        *evidence = HitMiss::from_words(hit, miss);
        evidence.observed()
    }
}

/// The box around a sensor in which pixels without a surface make cells free, as its diagonal. Not those of more than
/// `longest` metres, which are refused.
fn free_reach(View { world_from_image, image }: View<'_>, longest: f64) -> Option<Ray> {
    let used = |v: &f32| f64::from(-v) <= longest;
    let farthest = image.values.iter().copied().filter(used).fold(0.0f32, f32::min);
    if farthest == 0.0 || image.has_parallel_rays() {
        return None;
    }
    // Depths of a camera are shorter than its rays, by less than this for any that sees forwards.
    let r = 2.0 * f64::from(-farthest);
    let o = world_from_image.translation;
    Some(Ray { origin: o.map(|v| v - r), end: o.map(|v| v + r), hit: false, passes: false })
}

fn planned_scan(hits: usize, count: usize, tally: Tally) -> PlannedScan {
    let dropped = tally.refused.total();
    let hit = (hits as u64).saturating_sub(tally.refused_hits);
    let max_range = (count as u64).saturating_sub(hit + dropped);
    let beams = BeamCounts { hit, max_range, dropped, ..Default::default() };
    let refused: RefusedBeams = tally.refused;
    PlannedScan { beams, refused, hits_outside: tally.hits_outside }
}
