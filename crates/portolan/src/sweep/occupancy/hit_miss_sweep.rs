//! Hits and misses of 3-D scans, brick by brick: exact rays, or exact ends and misses through a range image.

use super::exact::{ExactRays, Tally};
use super::masks::Bits;
use crate::cell::HitMiss;
use crate::geom::{BlockKey, Lattice, Pose};
use crate::parallel;
use crate::scan::{
    BeamCounts, LayoutFinder, PointScan, RangeImage, ScanStats, SphericalLayout, Way, WhyRays,
};
use crate::sweep::image::ProjectiveMisses;
use crate::sweep::scan_rays::{Ray, organised};
use crate::sweep::union::union;
use crate::sweep::{LONGEST_RAY_CELLS, PlanError, PlanLimits, Sweep, Swept};
use std::marker::PhantomData;

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

/// The sweep for hits and misses of 3-D scans: of points (`HitMissSweep<PointScan>`), of range images
/// (`HitMissSweep<RangeImage>`), or of points in the world's frame (`HitMissSweep<[[f64; 3]]>`).
///
/// The cell in which a ray ends on a surface is hit and no other; cells that rays pass are missed.
#[derive(Debug)]
pub struct HitMissSweep<S: ?Sized> {
    sweep: OccupancySweep,
    exact: ExactRays,
    misses: ProjectiveMisses,
    layout: LayoutFinder,
    keys: Vec<BlockKey<3>>,
    parts: Vec<Parts>,
    /// Where the readings of an image's pixels end (world).
    ends: Vec<[f64; 3]>,
    scan: PhantomData<fn(&S)>,
}

/// Without what it remembers of the last scan: a snapshot of a map does not pay for it.
impl<S: ?Sized> Clone for HitMissSweep<S> {
    fn clone(&self) -> Self {
        Self { layout: self.layout.clone(), ..Self::new(self.sweep) }
    }
}

/// A block's place among those that rays touch, and among those that the image sees.
#[derive(Clone, Copy, Debug)]
struct Parts {
    rays: Option<u32>,
    misses: Option<u32>,
}

/// The rays of a scan.
struct Rays<'a, F> {
    /// So many of the readings end on surfaces.
    hits: usize,
    readings: usize,
    /// Rays of that many numbers, some of which may be no readings.
    count: usize,
    ray: F,
    /// The range image that free space is read from.
    view: Option<View<'a>>,
}

/// An image and the pose of the frame in which its pixels look.
#[derive(Clone, Copy)]
struct View<'a> {
    world_from_image: &'a Pose<3>,
    image: &'a RangeImage,
}

impl<S: ?Sized> HitMissSweep<S> {
    /// A sweep that has seen nothing yet.
    pub fn new(sweep: OccupancySweep) -> Self {
        Self {
            sweep,
            exact: ExactRays::default(),
            misses: ProjectiveMisses::default(),
            layout: LayoutFinder::default(),
            keys: Vec::new(),
            parts: Vec::new(),
            ends: Vec::new(),
            scan: PhantomData,
        }
    }

    /// Looks for rows and columns anew.
    pub(crate) fn forget_layout(&mut self) {
        self.layout = LayoutFinder::default();
    }

    /// Rows and columns for points that come without them; otherwise they are looked for.
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.layout = LayoutFinder::of(layout);
    }

    /// Marks the rays, and finds what the image of a view sees; without one, rays that pass mark misses.
    fn plan_rays(
        &mut self,
        rays: &Rays<'_, impl Fn(usize) -> Ray<3> + Sync>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        self.keys.clear();
        self.parts.clear();
        self.misses.clear();
        let (bounds, most) = (limits.bounds.as_ref(), limits.most_blocks);
        let longest = LONGEST_RAY_CELLS * lattice.resolution;
        let further: Vec<Ray<3>> = rays.view.and_then(|view| free_reach(view, longest)).into_iter().collect();
        let (exact, misses) = (&mut self.exact, &mut self.misses);
        let (planned, ()) = parallel::join(
            || exact.plan(lattice, bounds, rays.count, &rays.ray, &further, most),
            || rays.view.into_iter().for_each(|view| misses.take(view.image, view.world_from_image, lattice)),
        );
        let mut tally = planned?;
        let is_searched = match (rays.view, exact.reach()) {
            (Some(_), Some((first, last))) => misses.find_blocks(first, last, most)?,
            _ => true,
        };
        if !is_searched {
            let passing = |i: usize| Ray { passes: true, ..(rays.ray)(i) };
            tally = exact.plan(lattice, bounds, rays.count, passing, &[], most)?;
        }
        self.unite();
        Ok(stats(rays.hits, rays.readings, tally))
    }

    /// Blocks of the rays and of the image together, ascending, as both are.
    fn unite(&mut self) {
        let parts = &mut self.parts;
        union(self.exact.keys(), self.misses.blocks(), |key, [rays, misses]| {
            self.keys.push(key);
            parts.push(Parts { rays, misses });
        });
    }
}

impl Sweep<3> for HitMissSweep<RangeImage> {
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
        let to_world = |p| world_from_sensor.transform_point(p);
        let at = world_from_sensor.translation;
        // Says nothing of any cell.
        let nothing = Ray { origin: at, end: at, hit: false, passes: false };
        let view = (!passes).then_some(View { world_from_image: world_from_sensor, image });
        let readings = image.values.iter().filter(|v| **v != 0.0).count();
        let (hits, count) = (image.hits(), image.values.len());
        let stats = if passes || image.has_parallel_rays() {
            let ray = |pixel: usize| match image.reading(pixel) {
                Some((origin, end, hit)) => Ray { origin: to_world(origin), end: to_world(end), hit, passes },
                None => nothing,
            };
            self.plan_rays(&Rays { hits, readings, count, ray, view }, lattice, limits)?
        } else {
            let mut ends = std::mem::take(&mut self.ends);
            fill_ends(&mut ends, image, world_from_sensor);
            let ray = |pixel: usize| match image.values[pixel] {
                0.0 => nothing,
                v => Ray { end: ends[pixel], hit: v > 0.0, ..nothing },
            };
            let planned = self.plan_rays(&Rays { hits, readings, count, ray, view }, lattice, limits);
            self.ends = ends;
            planned?
        };
        let way = if passes { Way::Rays(WhyRays::Asked) } else { Way::Stated };
        Ok(ScanStats { refused: stats.refused + image.refused, ..stats }.by(way))
    }
}

impl Sweep<3> for HitMissSweep<PointScan> {
    type Scan = PointScan;

    fn plan(
        &mut self,
        scan: &PointScan,
        world_from_sensor: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        let hits = scan.points.len();
        let (common, way, image) =
            organised(scan, world_from_sensor, self.sweep, &mut self.layout, lattice.resolution)?;
        let world_from_image = Pose { translation: common, ..*world_from_sensor };
        let view = image.as_deref().map(|image| View { world_from_image: &world_from_image, image });
        let passes = view.is_none() && way != Way::Points;
        let ray = |i: usize| Ray::of_points(scan, i, common, world_from_sensor, passes);
        let count = hits + scan.free_ends.len();
        let rays = Rays { hits, readings: count, count, ray, view };
        let stats = self.plan_rays(&rays, lattice, limits)?;
        Ok(ScanStats { refused: stats.refused + scan.refused, ..stats }.by(way))
    }
}

/// Points in the world's frame, seen from the pose's translation: exact rays, whatever the sweep.
impl Sweep<3> for HitMissSweep<[[f64; 3]]> {
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
        self.plan_rays(&Rays { hits: count, readings: count, count, ray, view: None }, lattice, limits)
    }
}

impl<S: ?Sized> Swept<3> for HitMissSweep<S> {
    type Evidence = HitMiss;
    type Scratch = HitMiss;

    fn scratch(&self) -> HitMiss {
        HitMiss::from_words([0; 8], [0; 8])
    }

    fn blocks(&self) -> &[BlockKey<3>] {
        &self.keys
    }

    fn evidence<'a>(&'a self, i: usize, scratch: &'a mut HitMiss) -> &'a HitMiss {
        let Parts { rays, misses } = self.parts[i];
        let mut bits = rays.map_or_else(Bits::default, |slot| *self.exact.bits(slot as usize));
        if let Some(at) = misses {
            let free = self.misses.free_cells(at as usize);
            (0..8).for_each(|w| bits.miss[w] |= free[w]);
        }
        *scratch = HitMiss::from_words(bits.hit, bits.miss);
        scratch
    }
}

/// Where the readings of pixels end (world), row by row, on all threads; anything for those without one.
fn fill_ends(ends: &mut Vec<[f64; 3]>, image: &RangeImage, world_from_image: &Pose<3>) {
    const ROWS: usize = 16;
    ends.resize(image.values.len(), [0.0; 3]);
    let columns = image.columns.max(1);
    let bands = ends.chunks_mut(ROWS * columns).zip(image.values.chunks(ROWS * columns)).enumerate();
    parallel::each(bands, |(band, (ends, values))| {
        let rows = ends.chunks_exact_mut(columns).zip(values.chunks_exact(columns));
        for (row, (ends, values)) in rows.enumerate() {
            for (column, (end, &v)) in ends.iter_mut().zip(values).enumerate() {
                let point = image.point(column, ROWS * band + row, f64::from(v.abs()));
                *end = world_from_image.transform_point(point);
            }
        }
    });
}

/// The box around a sensor in which pixels without a surface mean that space is free, as its diagonal. Not those of more
/// than `longest` meters, which are refused.
fn free_reach(View { world_from_image, image }: View<'_>, longest: f64) -> Option<Ray<3>> {
    // Without a branch: as many pixels at once as the machine can compare.
    let longest = -(longest as f32);
    let farthest = image.values.iter().fold(0.0f32, |far, &v| far.min(if v >= longest { v } else { 0.0 }));
    if farthest == 0.0 || image.has_parallel_rays() {
        return None;
    }
    // Depths of a camera are shorter than its rays, by less than this for any that sees forwards.
    let r = 2.0 * f64::from(-farthest);
    let o = world_from_image.translation;
    Some(Ray { origin: o.map(|v| v - r), end: o.map(|v| v + r), hit: false, passes: false })
}

/// What became of `count` rays, of which the first so many were to hit.
pub(in crate::sweep) fn stats(hits: usize, count: usize, tally: Tally) -> ScanStats {
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
