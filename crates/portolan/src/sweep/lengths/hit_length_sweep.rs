//! Hits and lengths of 3-D scans: exact rays, or exact ends and lengths in closed form through a range image.

use super::rays::{Ray, RayLengths};
use crate::cell::{Evidence, HitLengths};
use crate::geom::vector::{norm, scale, sub};
use crate::geom::{BlockKey, Lattice, Pose, block_cells};
use crate::scan::{LayoutFinder, Origin, PointScan, RangeImage, ScanStats, SphericalLayout};
use crate::sweep::image::ProjectiveLengths;
use crate::sweep::occupancy::stats;
use crate::sweep::{OccupancySweep, PlanError, PlanLimits, Sweep, Swept};
use std::borrow::Cow;
use std::marker::PhantomData;

/// The sweep for hits and lengths of 3-D scans: of points (`HitLengthSweep<PointScan>`) or of range images
/// (`HitLengthSweep<RangeImage>`).
///
/// Hits are always exact, one for each beam. Where a scan has rows and columns or gets them, lengths are those that its
/// beams have on average: so many beams per steradian, times a cell's volume over the squared range, times the share of the
/// cell's window that looks past it. That costs cells instead of beams times cells, and agrees with exact rays to a few
/// per cent over any patch of cells that beams pass densely; where beams are further apart than cells, the length lies
/// between them, too.
#[derive(Debug)]
pub struct HitLengthSweep<S: ?Sized> {
    sweep: OccupancySweep,
    rays: RayLengths<3>,
    lengths: ProjectiveLengths,
    layout: LayoutFinder,
    keys: Vec<BlockKey<3>>,
    parts: Vec<[Option<u32>; 2]>,
    scan: PhantomData<fn(&S)>,
}

/// Without what it remembers of the last scan: a snapshot of a map does not pay for it.
impl<S: ?Sized> Clone for HitLengthSweep<S> {
    fn clone(&self) -> Self {
        Self { layout: self.layout.clone(), ..Self::new(self.sweep) }
    }
}

impl<S: ?Sized> HitLengthSweep<S> {
    /// A sweep that has seen nothing yet.
    pub fn new(sweep: OccupancySweep) -> Self {
        Self {
            sweep,
            rays: RayLengths::new(),
            lengths: ProjectiveLengths::default(),
            layout: LayoutFinder::default(),
            keys: Vec::new(),
            parts: Vec::new(),
            scan: PhantomData,
        }
    }

    /// Takes rays in, and the lengths that an image gives.
    fn plan_rays(
        &mut self,
        hits: usize,
        count: usize,
        ray: impl Fn(usize) -> Ray<3> + Sync,
        view: Option<(&RangeImage, &Pose<3>)>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        self.keys.clear();
        self.parts.clear();
        self.lengths.clear();
        let tally = self.rays.plan(lattice, limits, count, ray)?;
        if let Some((image, world_from_image)) = view {
            self.lengths.plan(image, world_from_image, lattice, limits)?;
        }
        self.unite();
        Ok(stats(hits, count, tally))
    }

    /// Blocks of the rays and of the image together, ascending, as both are.
    fn unite(&mut self) {
        let (marked, seen) = (self.rays.keys(), self.lengths.blocks());
        let (mut i, mut j) = (0, 0);
        while i < marked.len() || j < seen.len() {
            let key = match (marked.get(i), seen.get(j)) {
                (Some(a), Some(b)) => *a.min(b),
                (Some(key), None) | (None, Some(key)) => *key,
                (None, None) => break,
            };
            let (is_marked, is_seen) = (marked.get(i) == Some(&key), seen.get(j) == Some(&key));
            self.keys.push(key);
            self.parts.push([is_marked.then_some(i as u32), is_seen.then_some(j as u32)]);
            i += usize::from(is_marked);
            j += usize::from(is_seen);
        }
    }
}

/// A ray between two points of the world.
fn between(origin: [f64; 3], end: [f64; 3], hit: bool, passes: bool) -> Ray<3> {
    let offset = sub(end, origin);
    let length = norm(offset);
    let direction = scale(offset, if length > 0.0 { 1.0 / length } else { 0.0 });
    Ray { origin, end, direction, length, hit, passes: passes && length > 0.0 }
}

impl Sweep<3> for HitLengthSweep<RangeImage> {
    type Scan = RangeImage;

    fn plan(
        &mut self,
        image: &RangeImage,
        world_from_sensor: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        image.check().map_err(PlanError::BadImage)?;
        let exact = self.sweep == OccupancySweep::Exact;
        let all: Vec<_> = image.readings().collect();
        let ray = |i: usize| {
            let (origin, end, hit) = all[i];
            let to_world = |p| world_from_sensor.transform_point(p);
            between(to_world(origin), to_world(end), hit, exact)
        };
        let hits = all.iter().filter(|r| r.2).count();
        let view = (!exact).then_some((image, world_from_sensor));
        let stats = self.plan_rays(hits, all.len(), ray, view, lattice, limits)?;
        Ok(ScanStats { refused: stats.refused + image.refused, ..stats })
    }
}

impl Sweep<3> for HitLengthSweep<PointScan> {
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
        let exact = image.is_none();
        let ray = |i: usize| match i.checked_sub(hits) {
            Some(free) => between(common, to_world(scan.free_ends[free]), false, true),
            None => {
                let origin = match &scan.origin {
                    Origin::Common(_) => common,
                    Origin::PerPoint(all) => all.get(i).map_or([f64::NAN; 3], |o| to_world(*o)),
                };
                between(origin, to_world(scan.points[i]), true, exact)
            }
        };
        let view = image.as_deref().map(|image| (image, &world_from_image));
        let stats = self.plan_rays(hits, hits + scan.free_ends.len(), ray, view, lattice, limits)?;
        Ok(ScanStats { refused: stats.refused + scan.refused, ..stats })
    }
}

impl HitLengthSweep<PointScan> {
    /// Rows and columns for points that come without them; otherwise they are looked for.
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.layout = LayoutFinder::of(layout);
    }

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

impl<S: ?Sized> Swept<3> for HitLengthSweep<S> {
    type Evidence = HitLengths;
    type Scratch = HitLengths;

    fn scratch(&self) -> HitLengths {
        HitLengths::silent(block_cells::<3>())
    }

    fn blocks(&self) -> &[BlockKey<3>] {
        &self.keys
    }

    fn evidence<'a>(&'a self, i: usize, scratch: &'a mut HitLengths) -> &'a HitLengths {
        let [rays, seen] = self.parts[i];
        match (rays, seen) {
            (Some(slot), None) => return self.rays.evidence(slot as usize),
            (slot, Some(at)) => {
                match slot {
                    Some(slot) => scratch.clone_from(self.rays.evidence(slot as usize)),
                    None => scratch.clear(),
                }
                self.lengths.add_to(at as usize, scratch.lengths_mut());
            }
            (None, None) => scratch.clear(),
        }
        scratch
    }
}
