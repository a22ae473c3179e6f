//! The sweep for 3-D scans without rows and columns: exact rays, the nearest of which counts.

use super::nearest_ray::{NearestRay, Ray};
use super::{LONGEST_RAY_CELLS, PlanError, PlanLimits, ProjectiveSettings, Sweep, Swept, SweptColors};
use crate::cell::{ColorObservation, Colors, Distances, Evidence};
use crate::geom::vector::{norm, scale, sub};
use crate::geom::{Aabb, BlockKey, Lattice, Pose, block_cells};
use crate::scan::{BeamCounts, PointScan, RefusedBeams, ScanStats};

/// Walks the ray of every point through the cells exactly. A cell listens to the ray that passes nearest to its center, and
/// gets that ray's distance at the center; ties go to the earlier ray.
///
/// The cost is that of rays times their length in cells: where the scan has rows and columns, [`super::Projective`] says
/// the same sooner, and better between rays. Weights by incidence need neighbours; here every ray counts as head-on.
#[derive(Clone, Debug)]
pub struct PointRays {
    settings: ProjectiveSettings,
    rays: NearestRay<3>,
    colors: Vec<[u8; 3]>,
}

impl PointRays {
    /// Bytes that a touched block takes.
    pub(crate) const BLOCK_BYTES: usize = super::nearest_ray::CELL_BYTES * block_cells::<3>();

    /// A sweep with these settings, which has seen nothing yet.
    pub fn new(settings: ProjectiveSettings) -> Self {
        Self { settings, rays: NearestRay::new(), colors: Vec::new() }
    }
}

impl Sweep<3> for PointRays {
    type Scan = PointScan;

    fn plan(
        &mut self,
        scan: &PointScan,
        world_from_scan: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        let how = &self.settings;
        let (mut beams, mut refused) = (BeamCounts::default(), RefusedBeams::default());
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
            if length > LONGEST_RAY_CELLS * lattice.resolution && limits.bounds.is_none() {
                return Err(Refusal::TooFar);
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
                        Refusal::TooFar => refused.too_far += 1,
                    }
                }
            }
        }
        let silent =
            Ray { origin: [0.0; 3], direction: [1.0, 0.0, 0.0], range: 0.0, hit: false, weight: 0.0 };
        let bounds = limits.bounds_or_everywhere();
        let fits = self.rays.plan(
            (0..count).map(|i| ray(i).unwrap_or(silent)),
            (lattice, &bounds),
            (how.truncation, how.carve_weight),
            limits.most_blocks,
        );
        if !fits {
            return Err(PlanError::TooManyBlocks);
        }
        self.colors.clear();
        if how.color && scan.colors.len() == scan.points.len() {
            self.colors.extend_from_slice(&scan.colors);
        }
        let outside = |bounds: Aabb<3>| {
            let is_outside =
                |p: &[f32; 3]| !bounds.contains(world_from_scan.transform_point(p.map(f64::from)));
            scan.points.iter().filter(|p| is_outside(p)).count() as u64
        };
        Ok(ScanStats {
            scans: 1,
            beams,
            refused: scan.refused + refused,
            hits_outside: limits.bounds.map_or(0, outside),
            ..Default::default()
        })
    }
}

impl Swept<3> for PointRays {
    type Evidence = Distances;
    type Scratch = ();

    fn scratch(&self) {}

    fn blocks(&self) -> &[BlockKey<3>] {
        self.rays.keys()
    }

    fn evidence<'a>(&'a self, i: usize, (): &'a mut ()) -> &'a Distances {
        &self.rays.evidence(i).distances
    }
}

impl SweptColors<3> for PointRays {
    /// Those of the rays that the distances come from.
    fn colors(&self, i: usize, distances: &Distances, band: f32, colors: &mut Colors) {
        colors.clear();
        let rays = &self.rays.evidence(i).ray;
        for (cell, &ray) in rays.iter().enumerate() {
            let one = distances.one(cell).filter(|d| d.distance.abs() <= band);
            if let (Some(seen), Some(&rgb)) = (one, self.colors.get(ray as usize)) {
                colors.set(cell, ColorObservation { rgb, weight: seen.weight });
            }
        }
    }
}

/// Why a point is no ray.
enum Refusal {
    NotFinite,
    TooNear,
    /// Longer than any ray that is walked.
    TooFar,
}
