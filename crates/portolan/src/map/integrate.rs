//! The one way a scan enters any map: sweep, cell and store meet here.

use super::MapError;
use super::error::{most_blocks, too_many};
use crate::cell::Cell;
use crate::geom::{Aabb, Pose};
use crate::scan::ScanStats;
use crate::store::Store;
use crate::sweep::{PlanLimits, Sweep};

/// Fuses one scan, taken at a known pose, into a store of cells.
///
/// The sweep finds the blocks of cells that the scan observes and gives the evidence about each; the store fuses it by the
/// cell's rule. The named maps do nothing else, and any other sweep, cell and store can be joined in the same way. A pose
/// that is not rigid, or has no cell, refuses the scan, which is counted.
///
/// # Errors
/// [`MapError::Full`] where the store's limit of memory leaves no room: what was fused before stays. [`MapError::TooFar`]
/// where the scan touches more blocks than `limits` allow, [`MapError::Image`] where it contradicts itself: nothing is
/// fused then.
pub fn integrate<C, S, W, const D: usize>(
    store: &mut S,
    sweep: &mut W,
    rule: &C::Rule,
    limits: &PlanLimits<D>,
    world_from_sensor: &Pose<D>,
    scan: &W::Scan,
) -> Result<ScanStats, MapError>
where
    C: Cell,
    S: Store<C, D>,
    W: Sweep<D, Evidence = C::Evidence>,
{
    match plan::<C, S, W, D>(store, sweep, limits, world_from_sensor, scan)? {
        Some(stats) => Ok(ScanStats { cells: store.fuse(sweep, rule)?, ..stats }),
        None => Ok(ScanStats::refused_pose()),
    }
}

/// The first half of [`integrate`]: `None` where the pose is refused.
pub(super) fn plan<C, S, W, const D: usize>(
    store: &S,
    sweep: &mut W,
    limits: &PlanLimits<D>,
    world_from_sensor: &Pose<D>,
    scan: &W::Scan,
) -> Result<Option<ScanStats>, MapError>
where
    C: Cell,
    S: Store<C, D>,
    W: Sweep<D, Evidence = C::Evidence>,
{
    if !world_from_sensor.is_rigid() || store.lattice().cell_of(world_from_sensor.translation).is_none() {
        return Ok(None);
    }
    let planned = sweep.plan(scan, world_from_sensor, store.lattice(), limits);
    planned
        .map(Some)
        .map_err(|error| too_many(error, limits.most_blocks, store.limit(), store.memory_bytes()))
}

/// Limits for a store whose touched blocks cost the sweep `bytes` each, inside of `bounds` if there are any.
pub(super) fn limits<C: Cell, S: Store<C, D>, const D: usize>(
    store: &S,
    bounds: Option<Aabb<D>>,
    bytes: usize,
) -> PlanLimits<D> {
    let bounds = match (bounds, store.bounds()) {
        (Some(a), Some(b)) => Some(a.intersection(b)),
        (a, b) => a.or(b),
    };
    PlanLimits { bounds, most_blocks: most_blocks(store.limit(), bytes) }
}
