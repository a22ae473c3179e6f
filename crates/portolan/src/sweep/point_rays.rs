//! The sweep for 3-D scans without rows and columns: exact rays, the nearest of which counts.

use super::image::keep_inside;
use super::nearest_ray::{NearestRay, Ray};
use super::{PlanError, PlanLimits, PlannedScan, ProjectiveSettings};
use crate::cell::{ColorObservation, Colors, Distances, Evidence};
use crate::geom::vector::{norm, scale, sub};
use crate::geom::{Aabb, BlockKey, Lattice, Pose};
use crate::scan::PointScan;

/// Walks the ray of every point through the cells exactly. A cell takes the ray that passes nearest to its center, and
/// gets that ray's distance at the center; ties go to the earlier ray.
///
/// The cost is that of rays times their length in cells: where the scan has rows and columns, [`super::Projective`] is
/// faster, and better between rays. Weights by incidence need neighbors; here every ray counts as head-on.
#[derive(Clone, Debug)]
pub struct PointRays {
    settings: ProjectiveSettings,
    rays: NearestRay<3>,
    bounds: Option<(Lattice<3>, Aabb<3>)>,
    colors: Vec<[u8; 3]>,
}

impl PointRays {
    /// Bytes that a touched block takes.
    pub(crate) const BLOCK_BYTES: usize = super::nearest_ray::CELL_BYTES * crate::geom::block_cells::<3>();

    /// A sweep with these settings.
    pub fn new(settings: ProjectiveSettings) -> Self {
        Self { settings, rays: NearestRay::new(), bounds: None, colors: Vec::new() }
    }

    /// Takes a scan in, taken at a rigid pose, and gathers its observations of cells. Only cells whose center lies in the bounds
    /// get anything. O(rays times their length in cells).
    ///
    /// # Errors
    /// Where rays touch more blocks than they may.
    pub fn plan(
        &mut self,
        scan: &PointScan,
        world_from_scan: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<PlannedScan, PlanError> {
        let how = &self.settings;
        let mut planned = PlannedScan { refused: scan.refused, ..PlannedScan::default() };
        let PlannedScan { beams, refused, .. } = &mut planned;
        // One pass over the points alone: rays are counted whether they reach into the bounds or not.
        let ray = |i: usize| {
            let (end, hit) = match scan.points.get(i) {
                Some(p) => (p, true),
                None => (&scan.free_ends[i - scan.points.len()], false),
            };
            let origin = scan.origin_of(i);
            let offset = sub(end.map(f64::from), origin.unwrap_or([f64::NAN; 3]));
            let length = norm(offset);
            if !length.is_finite() {
                return Err(Refusal::NotFinite);
            }
            if length == 0.0 || (hit && length <= how.min_range) {
                return Err(Refusal::TooNear);
            }
            let weight = if how.weights.parts().0 { (1.0 / length.max(1.0).powi(2)) as f32 } else { 1.0 };
            Ok(Ray {
                origin: world_from_scan.transform_point(origin.unwrap_or([0.0; 3])),
                direction: world_from_scan.rotate(scale(offset, 1.0 / length)),
                range: length.min(how.max_range),
                hit: hit && length <= how.max_range,
                weight,
            })
        };
        let count = scan.points.len() + scan.free_ends.len();
        for i in 0..count {
            match ray(i) {
                Ok(Ray { hit: true, .. }) => beams.hit += 1,
                Ok(_) => beams.max_range += 1,
                Err(why) => {
                    beams.dropped += 1;
                    match why {
                        Refusal::NotFinite => refused.not_finite += 1,
                        Refusal::TooNear => refused.too_near += 1,
                    }
                }
            }
        }
        let unused =
            Ray { origin: [0.0; 3], direction: [1.0, 0.0, 0.0], range: 0.0, hit: false, weight: 0.0 };
        let everywhere = Aabb::new([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);
        let within = limits.bounds.as_ref().unwrap_or(&everywhere);
        let fits = self.rays.plan_rays(
            (0..count).map(|i| ray(i).unwrap_or(unused)),
            (lattice, within),
            (how.truncation, how.carve_weight),
            limits.most_blocks,
        );
        self.bounds = limits.bounds.map(|b| (*lattice, b));
        self.colors.clear();
        if limits.colors && scan.colors.len() == scan.points.len() {
            self.colors.extend_from_slice(&scan.colors);
        }
        if let Some(bounds) = &limits.bounds {
            let outside = |p: &[f32; 3]| !bounds.contains(world_from_scan.transform_point(p.map(f64::from)));
            planned.hits_outside = scan.points.iter().filter(|p| outside(p)).count() as u64;
        }
        if fits { Ok(planned) } else { Err(PlanError::TooManyBlocks) }
    }

    /// The touched blocks, ascending.
    pub fn blocks(&self) -> &[BlockKey<3>] {
        self.rays.blocks()
    }

    /// The evidence about the `i`-th block, into `evidence`; returns for how many cells there is some.
    pub fn evidence(&self, i: usize, evidence: &mut Distances) -> usize {
        evidence.clone_from(self.rays.evidence(i));
        if let Some((lattice, bounds)) = &self.bounds {
            keep_inside(lattice, bounds, self.blocks()[i], evidence.planes_mut().1);
        }
        evidence.observed()
    }

    /// The colors of the `i`-th block: of the rays that the distances come from, for cells within `band` metres of the
    /// surface, with the weight of their distances. `distances` is the block's evidence. Returns for how many cells there is
    /// one.
    pub fn colors(&self, i: usize, distances: &Distances, band: f32, colors: &mut Colors) -> usize {
        colors.clear();
        let rays = &self.rays.nearest(i).ray;
        let mut found = 0;
        for (cell, &ray) in rays.iter().enumerate() {
            let one = distances.one(cell).filter(|d| d.distance.abs() <= band);
            if let (Some(seen), Some(&rgb)) = (one, self.colors.get(ray as usize)) {
                colors.set(cell, ColorObservation { rgb, weight: seen.weight });
                found += 1;
            }
        }
        found
    }
}

/// Why a point makes no ray.
enum Refusal {
    NotFinite,
    TooNear,
}
