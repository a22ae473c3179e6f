//! A sweep turns a scan into evidence: at most one observation per cell, block by block.
//!
//! | sweep | evidence | where it looks |
//! |---|---|---|
//! | [`Rays`] | hits and misses | every cell that a beam passes through, exactly |
//! | [`March`] | distances | samples along every beam, as the textbook does it |
//! | [`CellCentre`] | distances | the centre of every cell, against the range interpolated between beams |
//! | [`Projective`] | distances | the center of every 3-D cell, against a range image |
//! | [`PointRays`] | distances | every 3-D cell that a ray to a point passes through; the nearest ray counts |
//! | [`HitMissSweep`] | hits and misses | 3-D cells that beams pass through, exactly or through a range image |

mod cell_centre;
mod fan;
mod fan_plan;
mod image;
mod march;
mod nearest_ray;
mod occupancy;
mod plan;
mod point_rays;
mod rays;
mod touched;
mod weight;

pub use cell_centre::CellCentre;
pub use image::{Projective, ProjectiveSettings};
pub use march::March;
#[cfg(test)]
pub(crate) use occupancy::CellBox;
pub use occupancy::{HitMissSweep, OccupancySweep};
pub use plan::{LONGEST_RAY_CELLS, PlanError, PlanLimits, PlannedScan};
pub use point_rays::PointRays;
pub use rays::Rays;
pub use weight::WeightModel;

use crate::cell::Evidence;
use crate::geom::{Aabb, BlockKey, Lattice, Pose};
use crate::scan::Scan;

/// Turns scans into evidence about blocks of cells. Keeps its scratch memory from scan to scan.
pub trait Sweep<const D: usize> {
    /// What it says about a block.
    type Evidence: Evidence;

    /// Looks at a scan and finds the blocks that it says something about. Beams are followed only inside
    /// `bounds` (world). The pose must be rigid.
    fn plan(&mut self, scan: &Scan<D>, world_from_sensor: &Pose<D>, lattice: &Lattice<D>, bounds: &Aabb<D>);

    /// The planned blocks, ascending.
    fn blocks(&self) -> &[BlockKey<D>];

    /// The evidence about the `i`-th planned block: from the plan, or computed into `scratch`.
    fn evidence<'a>(&'a self, i: usize, scratch: &'a mut Self::Evidence) -> &'a Self::Evidence;
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
