//! Hits and misses of 3-D scans, brick by brick: exact rays, or exact ends and misses through a range image.

use super::exact::{ExactRays, LONGEST_RAY, Ray, Tally, TooManyBricks};
use super::{Bits, Projective};
use crate::cell::HitMiss;
use crate::geom::{Aabb, BlockKey, Lattice, Pose};
use crate::parallel;
use crate::scan::{
    BeamCounts, LayoutFinder, Origin, PointScan, Projection, RangeImage, ScanStats, SphericalLayout,
};
use crate::sweep::{PlanError, PlanLimits, Sweep, Swept};
use std::borrow::Cow;
use std::marker::PhantomData;

/// Boxes of more bricks than this are not searched for free space: single readings from far away are cheaper as rays.
const PROJECTIVE_BRICKS: u64 = 1 << 27;

/// How a 3-D scan becomes evidence of hits and misses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OccupancySweep {
    /// Where a scan has rows and columns or gets them, misses through its range image and exact hits: faster, frees the
    /// space between beams, and carves grazing surfaces less. Exact otherwise.
    #[default]
    Auto,
    /// Every cell that a beam passes, exactly: the map that OctoMap makes.
    Exact,
}

/// The sweep for hits and misses of 3-D scans: of points (`HitsAndMisses<PointScan>`), of range images
/// (`HitsAndMisses<RangeImage>`), or of points in the world's frame (`HitsAndMisses<[[f64; 3]]>`).
///
/// The cell in which a ray ends on a surface is hit and no other; cells that rays pass are missed.
#[derive(Debug)]
pub struct HitsAndMisses<S: ?Sized> {
    sweep: OccupancySweep,
    exact: ExactRays,
    view: Option<Projective>,
    layout: LayoutFinder,
    keys: Vec<BlockKey<3>>,
    parts: Vec<Parts>,
    scan: PhantomData<fn(&S)>,
}

/// Without what it remembers of the last scan: a snapshot of a map does not pay for it.
impl<S: ?Sized> Clone for HitsAndMisses<S> {
    fn clone(&self) -> Self {
        Self { layout: self.layout.clone(), ..Self::new(self.sweep) }
    }
}

/// Where the evidence about a brick comes from.
#[derive(Clone, Copy, Debug)]
struct Parts {
    /// Its place among the bricks that rays marked.
    marked: Option<u32>,
    /// Whether all of it is free, if the range image sees it.
    free: Option<bool>,
}

/// The rays of a scan.
struct Rays<'a, F> {
    /// The first so many end on surfaces.
    hits: usize,
    count: usize,
    ray: F,
    /// The range image that free space is read from, and where it was taken.
    view: Option<(&'a Pose<3>, &'a RangeImage)>,
}

impl<S: ?Sized> HitsAndMisses<S> {
    /// A sweep that has seen nothing yet.
    pub fn new(sweep: OccupancySweep) -> Self {
        Self {
            sweep,
            exact: ExactRays::default(),
            view: None,
            layout: LayoutFinder::default(),
            keys: Vec::new(),
            parts: Vec::new(),
            scan: PhantomData,
        }
    }

    /// Rows and columns for points that come without them; otherwise they are looked for.
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.layout = LayoutFinder::of(layout);
    }

    fn plan_rays(
        &mut self,
        rays: &Rays<'_, impl Fn(usize) -> Ray + Sync>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        self.keys.clear();
        self.parts.clear();
        let (inside, most, ray) = (limits.bounds.as_ref(), limits.most_blocks, &rays.ray);
        let tally =
            self.mark(rays, lattice, inside, most).map_err(|TooManyBricks| PlanError::TooManyBlocks)?;
        self.view = self.view.take().filter(|_| self.exact.reach_bricks() <= PROJECTIVE_BRICKS);
        let tally = if self.view.is_none() && rays.view.is_some() {
            let passing = |i| Ray { passes: true, ..ray(i) };
            let planned = self.exact.plan(lattice, inside, rays.count, passing, &[], most);
            planned.map_err(|TooManyBricks| PlanError::TooManyBlocks)?
        } else {
            tally
        };
        let seen = match (&self.view, self.exact.reach()) {
            (Some(view), Some((first, last))) => view.bricks(first, last),
            _ => Vec::new(),
        };
        union(self.exact.keys(), &seen, &mut self.keys, &mut self.parts);
        Ok(stats(rays.hits, rays.count, tally))
    }

    /// Marks the rays and, at the same time, makes the range image ready.
    fn mark(
        &mut self,
        rays: &Rays<'_, impl Fn(usize) -> Ray + Sync>,
        lattice: &Lattice<3>,
        bounds: Option<&Aabb<3>>,
        most: usize,
    ) -> Result<Tally, TooManyBricks> {
        let longest = LONGEST_RAY * lattice.resolution;
        let further = rays.view.map(|(pose, image)| free_reach(pose, image, longest)).unwrap_or_default();
        let guard = self.view.take().map(Projective::into_guard).unwrap_or_default();
        let exact = &mut self.exact;
        let (planned, view) = parallel::join(
            || exact.plan(lattice, bounds, rays.count, &rays.ray, &further, most),
            || rays.view.map(|(pose, image)| Projective::new(image, pose, lattice, guard)),
        );
        self.view = view;
        planned
    }
}

impl Sweep<3> for HitsAndMisses<RangeImage> {
    type Scan = RangeImage;

    fn plan(
        &mut self,
        image: &RangeImage,
        world_from_sensor: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        image.check().map_err(PlanError::BadImage)?;
        let passes = self.sweep == OccupancySweep::Exact;
        let all: Vec<Ray> = image
            .readings()
            .map(|(origin, end, hit)| Ray {
                origin: world_from_sensor.transform_point(origin),
                end: world_from_sensor.transform_point(end),
                hit,
                passes,
            })
            .collect();
        let hits = all.iter().filter(|r| r.hit).count();
        let view = (!passes).then_some((world_from_sensor, image));
        let rays = Rays { hits, count: all.len(), ray: |i| all[i], view };
        let stats = self.plan_rays(&rays, lattice, limits)?;
        Ok(ScanStats { refused: stats.refused + image.refused, ..stats })
    }
}

impl Sweep<3> for HitsAndMisses<PointScan> {
    type Scan = PointScan;

    fn plan(
        &mut self,
        scan: &PointScan,
        world_from_sensor: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        let to_world = |p: [f32; 3]| world_from_sensor.transform_point(p.map(f64::from));
        let hits = scan.points.len();
        let (common, image) = match &scan.origin {
            Origin::Common(o) => (world_from_sensor.transform_point(*o), self.organised(scan, *o)?),
            Origin::PerPoint(_) => (world_from_sensor.translation, None),
        };
        let world_from_image = Pose { translation: common, ..*world_from_sensor };
        let view = image.as_deref().map(|image| (&world_from_image, image));
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
        let rays = Rays { hits, count: hits + scan.free_ends.len(), ray, view };
        let stats = self.plan_rays(&rays, lattice, limits)?;
        Ok(ScanStats { refused: stats.refused + scan.refused, ..stats })
    }
}

/// Points in the world's frame, seen from the pose's translation: exact rays, whatever the sweep.
impl Sweep<3> for HitsAndMisses<[[f64; 3]]> {
    type Scan = [[f64; 3]];

    fn plan(
        &mut self,
        points_world: &[[f64; 3]],
        world_from_sensor: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        let origin = world_from_sensor.translation;
        let ray = |i: usize| Ray { origin, end: points_world[i], hit: true, passes: true };
        let count = points_world.len();
        self.plan_rays(&Rays { hits: count, count, ray, view: None }, lattice, limits)
    }
}

impl HitsAndMisses<PointScan> {
    /// Rows and columns of a scan about one origin, if the sweep wants them and the scan has or gets them.
    fn organised<'a>(
        &mut self,
        scan: &'a PointScan,
        origin: [f64; 3],
    ) -> Result<Option<Cow<'a, RangeImage>>, PlanError> {
        if self.sweep == OccupancySweep::Exact {
            return Ok(None);
        }
        if let Some(image) = &scan.image {
            image.check().map_err(PlanError::BadImage)?;
            return Ok(Some(Cow::Borrowed(image)));
        }
        Ok(self.layout.image(&scan.points, origin).map(Cow::Owned))
    }
}

impl<S: ?Sized> Swept<3> for HitsAndMisses<S> {
    type Evidence = HitMiss;
    type Scratch = HitMiss;

    fn scratch(&self) -> HitMiss {
        HitMiss::from_words([0; 8], [0; 8])
    }

    fn blocks(&self) -> &[BlockKey<3>] {
        &self.keys
    }

    fn evidence<'a>(&'a self, i: usize, scratch: &'a mut HitMiss) -> &'a HitMiss {
        let Parts { marked, free } = self.parts[i];
        let mut bits = marked.map_or_else(Bits::default, |slot| *self.exact.bits(slot as usize));
        let free = match (free, &self.view) {
            (Some(true), _) => [u64::MAX; 8],
            (Some(false), Some(view)) => view.free_cells(self.keys[i]),
            _ => [0; 8],
        };
        (0..8).for_each(|w| bits.miss[w] |= free[w]);
        *scratch = HitMiss::from_words(bits.hit, bits.miss);
        scratch
    }
}

/// Marked and seen bricks together, ascending, as both are.
fn union(
    marked: &[BlockKey<3>],
    seen: &[(BlockKey<3>, bool)],
    keys: &mut Vec<BlockKey<3>>,
    parts: &mut Vec<Parts>,
) {
    let (mut i, mut j) = (0, 0);
    while i < marked.len() || j < seen.len() {
        let key = match (marked.get(i), seen.get(j)) {
            (Some(a), Some(b)) => *a.min(&b.0),
            (Some(a), None) => *a,
            (None, Some(b)) => b.0,
            (None, None) => break,
        };
        let is_marked = marked.get(i) == Some(&key);
        let free = seen.get(j).filter(|b| b.0 == key).map(|b| b.1);
        keys.push(key);
        parts.push(Parts { marked: is_marked.then_some(i as u32), free });
        i += usize::from(is_marked);
        j += usize::from(free.is_some());
    }
}

/// The box around a sensor in which pixels without a surface mean that space is free, as its diagonal. Not those of more
/// than `longest` metres, which are refused.
fn free_reach(world_from_image: &Pose<3>, image: &RangeImage, longest: f64) -> Vec<Ray> {
    let used = |v: &f32| f64::from(-v) <= longest;
    let farthest = image.values.iter().copied().filter(used).fold(0.0f32, f32::min);
    if farthest == 0.0 || matches!(image.projection, Projection::Orthographic { .. }) {
        return Vec::new();
    }
    // Depths of a camera are shorter than its rays, by less than this for any that sees forwards.
    let r = 2.0 * f64::from(-farthest);
    let o = world_from_image.translation;
    vec![Ray { origin: o.map(|v| v - r), end: o.map(|v| v + r), hit: false, passes: false }]
}

fn stats(hits: usize, count: usize, tally: Tally) -> ScanStats {
    let dropped = tally.refused.total();
    let hit = (hits as u64).saturating_sub(tally.refused_hits);
    let max_range = (count as u64).saturating_sub(hit + dropped);
    ScanStats {
        scans: 1,
        beams: BeamCounts { hit, max_range, dropped, ..Default::default() },
        refused: tally.refused,
        hits_outside: tally.hits_outside,
        ..Default::default()
    }
}
