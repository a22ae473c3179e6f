//! A sweep turns a scan into evidence: at most one observation per cell, block by block.
//!
//! | sweep | evidence | where it looks |
//! |---|---|---|
//! | [`Rays`] | hits and misses | every cell that a beam passes through, exactly |
//! | [`March`] | distances | samples along every beam, as the textbook does it |
//! | [`CellCentre`] | distances | the center of every cell, against the range interpolated between beams |
//! | [`Projective`] | distances | the center of every 3-D cell, against a range image |
//! | [`PointRays`] | distances | every 3-D cell that a ray to a point passes through; the nearest ray counts |
//! | [`HitMissSweep`] | hits and misses | 3-D cells that rays pass through, exactly or through a range image |
//! | [`BeamLengths`] | hits and lengths | every cell that a beam passes through, exactly |
//! | [`HitLengthSweep`] | hits and lengths | 3-D cells that rays pass through, exactly or in closed form through a range image |

mod cell_centre;
mod fan;
mod fan_plan;
mod image;
mod inside;
mod lengths;
mod march;
mod nearest_ray;
mod occupancy;
mod plan;
mod point_rays;
mod rays;
mod scan_rays;
mod touched;
mod union;
mod weight;

pub use cell_centre::CellCentre;
pub use image::{Projective, ProjectiveSettings};
pub(crate) use inside::Inside;
pub use lengths::{BeamLengths, HitLengthSweep};
pub(crate) use lengths::{HitBlocks, KnowsHits};
pub use march::March;
pub use occupancy::{HitMissSweep, OccupancySweep};
pub use plan::{LONGEST_RAY_CELLS, PlanError, PlanLimits};
pub use point_rays::PointRays;
pub use rays::Rays;
pub use weight::WeightModel;

use crate::cell::{Colors, Distances, Evidence};
use crate::geom::{Aabb, BlockKey, Lattice, Pose};
use crate::scan::{Scan, ScanStats};

/// A scan that was swept: the blocks of cells that it observes, and the evidence about each.
///
/// Stores fuse it block by block, on several threads: what one thread needs of its own is its scratch.
pub trait Swept<const D: usize>: Sync {
    /// What a scan yields about the cells of a block.
    type Evidence: Evidence;
    /// Memory in which one thread computes evidence.
    type Scratch: Send;

    /// Memory for one thread.
    fn scratch(&self) -> Self::Scratch;

    /// The planned blocks, ascending, each once.
    fn blocks(&self) -> &[BlockKey<D>];

    /// The evidence about the `i`-th planned block: from the plan, or computed into `scratch`.
    fn evidence<'a>(&'a self, i: usize, scratch: &'a mut Self::Scratch) -> &'a Self::Evidence;
}

/// Turns scans into evidence about blocks of cells. Keeps its memory from scan to scan.
pub trait Sweep<const D: usize>: Swept<D> {
    /// The kind of scan that it reads.
    type Scan: ?Sized;

    /// Finds the blocks that a scan observes, within the limits. The pose must be rigid, and its translation must have a
    /// cell. Returns what became of the beams; `cells` is still 0.
    ///
    /// # Errors
    /// [`PlanError`] where the scan contradicts itself or observes too many blocks; nothing is planned then.
    fn plan(
        &mut self,
        scan: &Self::Scan,
        world_from_sensor: &Pose<D>,
        lattice: &Lattice<D>,
        limits: &PlanLimits<D>,
    ) -> Result<ScanStats, PlanError>;
}

/// A swept scan of distances that may have colors, too.
pub trait SweptColors<const D: usize>: Swept<D, Evidence = Distances> {
    /// The colors of the `i`-th planned block, for cells within `band` meters of the surface, with the weight of their
    /// distances; `distances` is the block's evidence. Without colors `colors` is cleared.
    fn colors(&self, _i: usize, _distances: &Distances, _band: f32, colors: &mut Colors) {
        colors.clear();
    }

    /// Whether the `i`-th planned block is known to hold no surface.
    fn is_free(&self, _i: usize) -> bool {
        false
    }
}

/// What became of the beams of a scan that maps read beam by beam.
fn beam_stats<const D: usize>(
    scan: &Scan<D>,
    world_from_sensor: &Pose<D>,
    limits: &PlanLimits<D>,
) -> ScanStats {
    let outside =
        |bounds: Aabb<D>| scan.hits_world(world_from_sensor).filter(|&p| !bounds.contains(p)).count() as u64;
    ScanStats {
        scans: 1,
        beams: scan.counts(),
        refused: scan.refused(),
        hits_outside: limits.bounds.map_or(0, outside),
        ..Default::default()
    }
}

/// The part of `origin + s * direction`, `0 <= s <= length`, inside a box: `None` where it misses.
pub(crate) fn clip<const D: usize>(
    bounds: &Aabb<D>,
    origin: [f64; D],
    direction: [f64; D],
    length: f64,
) -> Option<(f64, f64)> {
    let (mut near, mut far) = (0.0f64, length);
    for k in 0..D {
        if direction[k] == 0.0 {
            if origin[k] < bounds.min[k] || origin[k] > bounds.max[k] {
                return None;
            }
        } else {
            let a = (bounds.min[k] - origin[k]) / direction[k];
            let b = (bounds.max[k] - origin[k]) / direction[k];
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
    }
    (near <= far).then_some((near, far))
}
