//! What the three maps of a ledger have in common.

use super::LedgerError;
use crate::cell::{DistanceSum, HitLengthSum, HitMissSum, LogOdds8, Sign};
use crate::geom::{Aabb, Pose};
use crate::map::{Attenuation, MapError, Occupancy, ScanKind, Tsdf};
use crate::scan::ScanStats;
use crate::store::{Store, SumStore, Unfit};

pub(super) type SumOccupancy<const D: usize> = Occupancy<D, LogOdds8, SumStore<HitMissSum, D>>;
pub(super) type SumTsdf<const D: usize> = Tsdf<D, SumStore<DistanceSum, D>>;
pub(super) type SumAttenuation<const D: usize> = Attenuation<D, SumStore<HitLengthSum, D>>;

/// A map of sums.
pub(super) trait SumMap<const D: usize>: Clone + Send {
    /// Adds a scan, or takes it away, read by itself; wholly or not at all.
    fn fuse(&mut self, pose: &Pose<D>, scan: &impl ScanKind<D>, sign: Sign)
    -> Result<ScanStats, LedgerError>;

    /// Adds another map's sums, or takes them away; all or none.
    fn add(&mut self, other: &Self, sign: Sign) -> Result<(), LedgerError>;

    /// Bytes held.
    fn bytes(&self) -> usize;

    /// Allows no more than `bytes`.
    fn limit(&mut self, bytes: usize);

    /// Keeps to a box.
    fn keep_within(&mut self, bounds: Option<Aabb<D>>);
}

macro_rules! sum_map {
    ($($map:ident),*) => {$(
        impl<const D: usize> SumMap<D> for $map<D> {
            fn fuse(
                &mut self,
                pose: &Pose<D>,
                scan: &impl ScanKind<D>,
                sign: Sign,
            ) -> Result<ScanStats, LedgerError> {
                let mut once = |sign| {
                    self.forget_scans();
                    self.store_mut().begin(sign);
                    (self.integrate(pose, scan), self.store_mut().verdict())
                };
                let (stats, verdict) = once(sign);
                if let (Ok(stats), Ok(())) = (&stats, &verdict) {
                    return Ok(*stats);
                }
                // The same sweeps once more: what they did is undone, up to where they ended.
                let _ = once(sign.opposite());
                self.store_mut().forget_empty();
                match (stats?, verdict) {
                    (stats, Ok(())) => Ok(stats),
                    (_, Err(Unfit::Full(full))) => Err(MapError::from(full).into()),
                    (_, Err(Unfit::NotThere(block))) => Err(LedgerError::Sums { block: block.0.to_vec() }),
                }
            }

            fn add(&mut self, other: &Self, sign: Sign) -> Result<(), LedgerError> {
                let failed = |block: crate::geom::BlockKey<D>| LedgerError::Sums { block: block.0.to_vec() };
                self.store_mut().add(other.store(), sign).map_err(failed)
            }

            fn bytes(&self) -> usize {
                self.store().memory_bytes()
            }

            fn limit(&mut self, bytes: usize) {
                self.set_limit(bytes);
            }

            fn keep_within(&mut self, bounds: Option<Aabb<D>>) {
                self.set_bounds(bounds);
            }
        }
    )*};
}
sum_map!(SumOccupancy, SumTsdf, SumAttenuation);
