//! The one way a scan enters a map.

use crate::cell::{Cell, Evidence};
use crate::geom::{Aabb, BlockKey, Pose};
use crate::scan::{Scan, ScanStats};
use crate::store::Store;
use crate::sweep::Sweep;

/// Sweeps a scan and fuses its evidence block by block. `bounds` is the world box of the store.
pub(super) fn integrate<C, S, W, const D: usize>(
    store: &mut S,
    sweep: &mut W,
    scratch: &mut C::Evidence,
    rule: &C::Rule,
    bounds: &Aabb<D>,
    at: (&Pose<D>, &Scan<D>),
) -> ScanStats
where
    C: Cell,
    S: Store<C, D>,
    W: Sweep<D, Evidence = C::Evidence>,
{
    integrate_watched::<C, S, W, D>(store, sweep, scratch, rule, bounds, at, |_, _, _| ())
}

/// The same with an onlooker, who sees every block's evidence before it is fused: once a block, so that the loop over
/// cells does not know of it.
pub(super) fn integrate_watched<C, S, W, const D: usize>(
    store: &mut S,
    sweep: &mut W,
    scratch: &mut C::Evidence,
    rule: &C::Rule,
    bounds: &Aabb<D>,
    (world_from_sensor, scan): (&Pose<D>, &Scan<D>),
    mut onlooker: impl FnMut(BlockKey<D>, &S, &C::Evidence),
) -> ScanStats
where
    C: Cell,
    S: Store<C, D>,
    W: Sweep<D, Evidence = C::Evidence>,
{
    if !world_from_sensor.is_rigid() || store.lattice().cell_of(world_from_sensor.translation).is_none() {
        return ScanStats { refused_poses: 1, ..Default::default() };
    }
    sweep.plan(scan, world_from_sensor, store.lattice(), bounds);
    let mut cells = 0;
    for i in 0..sweep.blocks().len() {
        let evidence = sweep.evidence(i, scratch);
        let observed = evidence.observed();
        if observed == 0 {
            continue;
        }
        cells += observed as u64;
        onlooker(sweep.blocks()[i], store, evidence);
        store.apply(sweep.blocks()[i], evidence, rule);
    }
    ScanStats {
        scans: 1,
        refused_poses: 0,
        beams: scan.counts(),
        refused: scan.refused(),
        cells,
        hits_outside: scan.hits_world(world_from_sensor).filter(|&p| !bounds.contains(p)).count() as u64,
    }
}
