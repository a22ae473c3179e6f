//! Hits and lengths of 3-D scans: exact rays, or exact ends and lengths in closed form through a range image.

use super::blocks::{HitBlocks, KnowsHits, is_fine, shared_out};
use super::rays::RayLengths;
use crate::cell::{Evidence, HitLengths};
use crate::geom::{Aabb, BlockKey, Lattice, Pose, block_cells};
use crate::scan::{LayoutFinder, PointScan, RangeImage, ScanStats, SphericalLayout, Way};
use crate::sweep::image::ProjectiveLengths;
use crate::sweep::occupancy::stats;
use crate::sweep::scan_rays::{Ray, organised};
use crate::sweep::union::union;
use crate::sweep::{OccupancySweep, PlanError, PlanLimits, Sweep, Swept};
use std::marker::PhantomData;

/// The sweep for hits and lengths of 3-D scans: of points (`HitLengthSweep<PointScan>`) or of range images
/// (`HitLengthSweep<RangeImage>`).
///
/// Hits are always exact, one for each beam. Where a scan has rows and columns or gets them, lengths are those that its
/// beams have on average: so many beams per steradian, times a cell's volume over the squared range, times the share of the
/// cell's window that looks past it. That costs cells instead of beams times cells, and agrees with exact rays to a few
/// per cent over any patch of cells that beams pass densely; where beams are further apart than cells, the length lies
/// between them, too. Only the cells of blocks in which a beam ever ended are told apart; of the others the sweep says the
/// mean length.
#[derive(Debug)]
pub struct HitLengthSweep<S: ?Sized> {
    sweep: OccupancySweep,
    rays: RayLengths<3>,
    lengths: ProjectiveLengths,
    layout: LayoutFinder,
    keys: Vec<BlockKey<3>>,
    parts: Vec<Seen>,
    scan: PhantomData<fn(&S)>,
}

/// A block's place among those that rays touch, and among those that the image sees, and whether its cells are told apart.
#[derive(Clone, Copy, Debug)]
struct Seen {
    rays: Option<u32>,
    image: Option<u32>,
    fine: bool,
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
        (hits, count): (usize, usize),
        rays: impl Iterator<Item = Ray<3>>,
        view: Option<(&RangeImage, &Pose<3>)>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        self.keys.clear();
        self.parts.clear();
        self.lengths.clear();
        let tally = self.rays.plan(lattice, limits, rays)?;
        if let Some((image, world_from_image)) = view {
            self.lengths.plan(image, world_from_image, lattice, limits)?;
        }
        self.unite(lattice, limits.bounds.as_ref());
        Ok(stats(hits, count, tally))
    }

    /// Blocks of the rays and of the image together, ascending, as both are.
    fn unite(&mut self, lattice: &Lattice<3>, bounds: Option<&Aabb<3>>) {
        let (hit, parts) = (&self.rays.hit, &mut self.parts);
        union(self.rays.keys(), self.lengths.blocks(), |key, [rays, image]| {
            self.keys.push(key);
            parts.push(Seen { rays, image, fine: is_fine(hit, bounds, lattice, key) });
        });
    }
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
        let to_world = |p| world_from_sensor.transform_point(p);
        let rays = image.readings().map(|(origin, end, hit)| {
            // Of a ray that is not followed only the end counts.
            let origin = if exact { to_world(origin) } else { world_from_sensor.translation };
            Ray { origin, end: to_world(end), hit, passes: exact }
        });
        let count = image.values.iter().filter(|v| **v != 0.0).count();
        let view = (!exact).then_some((image, world_from_sensor));
        let stats = self.plan_rays((image.hits(), count), rays, view, lattice, limits)?;
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
        let hits = scan.points.len();
        let (common, way, image) =
            organised(scan, world_from_sensor, self.sweep, &mut self.layout, lattice.resolution)?;
        let world_from_image = Pose { translation: common, ..*world_from_sensor };
        let exact = image.is_none();
        let ray = |i: usize| match Ray::of_points(scan, i, common, world_from_sensor, exact) {
            // A hit without a length says nothing of hits per meter.
            ray if way == Way::Points => Ray { origin: [f64::NAN; 3], ..ray },
            ray => ray,
        };
        let view = image.as_deref().map(|image| (image, &world_from_image));
        let count = hits + scan.free_ends.len();
        let stats = self.plan_rays((hits, count), (0..count).map(ray), view, lattice, limits)?;
        Ok(ScanStats { refused: stats.refused + scan.refused, ..stats })
    }
}

impl HitLengthSweep<PointScan> {
    /// Looks for rows and columns anew.
    pub(crate) fn forget_layout(&mut self) {
        self.layout = LayoutFinder::default();
    }

    /// Rows and columns for points that come without them; otherwise they are looked for.
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.layout = LayoutFinder::of(layout);
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
        let Seen { rays, image, fine } = self.parts[i];
        if !fine {
            let of_rays = rays.map_or(0.0, |at| self.rays.mean(at as usize));
            let of_image = image.map_or(0.0, |at| self.lengths.mean(at as usize));
            scratch.set_even(shared_out(of_rays + of_image));
            return scratch;
        }
        let Some(at) = image else {
            return match rays {
                Some(at) => self.rays.evidence(at as usize, scratch),
                None => scratch,
            };
        };
        // Cells that are told apart are so by rays and image alike.
        let mut none = HitLengths::silent(0);
        match rays {
            Some(at) => scratch.copy(self.rays.evidence(at as usize, &mut none)),
            None => scratch.clear(),
        }
        self.lengths.add_to(at as usize, scratch.planes_mut().1);
        scratch
    }
}

impl<S: ?Sized> KnowsHits<3> for HitLengthSweep<S> {
    fn hit_blocks(&mut self) -> &mut HitBlocks<3> {
        &mut self.rays.hit
    }
}
