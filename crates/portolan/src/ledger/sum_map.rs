//! What the three maps of a ledger have in common.

use super::LedgerError;
use crate::cell::{ColorSum, DistanceSum, HitLengthSum, HitMissSum, LogOdds8, Sign};
use crate::geom::{Aabb, BlockKey, Pose};
use crate::map::{Attenuation, MapError, Occupancy, ScanKind, Tsdf};
use crate::scan::ScanStats;
use crate::store::{SumStore, Unfit};

pub(super) type SumOccupancy<const D: usize> = Occupancy<D, LogOdds8, SumStore<HitMissSum, D>>;
pub(super) type SumTsdf<const D: usize> = Tsdf<D, SumStore<DistanceSum, D>, SumStore<ColorSum, D>>;
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

/// A map's stores of sums, all told the same.
pub(super) trait SumStores<const D: usize> {
    /// What comes belongs to one scan ([`SumStore::begin`]).
    fn begin(&mut self, sign: Sign);

    /// Whether that scan can stay ([`SumStore::verdict`]).
    fn verdict(&mut self) -> Result<(), Unfit<D>>;

    /// Forgets bricks that hold nothing.
    fn forget_empty(&mut self);

    /// Adds another map's sums, or takes them away. An error leaves half of them.
    fn add_sums(&mut self, other: &Self, sign: Sign) -> Result<(), BlockKey<D>>;
}

macro_rules! one_store {
    ($($map:ident),*) => {$(
        impl<const D: usize> SumStores<D> for $map<D> {
            fn begin(&mut self, sign: Sign) {
                self.store_mut().begin(sign);
            }

            fn verdict(&mut self) -> Result<(), Unfit<D>> {
                self.store_mut().verdict()
            }

            fn forget_empty(&mut self) {
                self.store_mut().forget_empty();
            }

            fn add_sums(&mut self, other: &Self, sign: Sign) -> Result<(), BlockKey<D>> {
                self.store_mut().add(other.store(), sign)
            }
        }
    )*};
}
one_store!(SumOccupancy, SumAttenuation);

/// Distances, and colors where they are kept.
impl<const D: usize> SumStores<D> for SumTsdf<D> {
    fn begin(&mut self, sign: Sign) {
        let (distances, colors) = self.stores_mut();
        distances.begin(sign);
        colors.into_iter().for_each(|colors| colors.begin(sign));
    }

    fn verdict(&mut self) -> Result<(), Unfit<D>> {
        let (distances, colors) = self.stores_mut();
        // Both end the scan, whatever the first one says.
        let verdicts = [distances.verdict(), colors.map_or(Ok(()), SumStore::verdict)];
        verdicts.into_iter().collect()
    }

    fn forget_empty(&mut self) {
        let (distances, colors) = self.stores_mut();
        distances.forget_empty();
        colors.into_iter().for_each(SumStore::forget_empty);
    }

    fn add_sums(&mut self, other: &Self, sign: Sign) -> Result<(), BlockKey<D>> {
        let (distances, colors) = self.stores_mut();
        distances.add(other.store(), sign)?;
        match (colors, other.colors()) {
            (Some(ours), Some(theirs)) => ours.add(theirs, sign),
            _ => Ok(()),
        }
    }
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
                    self.begin(sign);
                    (self.integrate(pose, scan), self.verdict())
                };
                let (stats, verdict) = once(sign);
                if let (Ok(stats), Ok(())) = (&stats, &verdict) {
                    return Ok(*stats);
                }
                // The same sweeps once more: what they did is undone, up to where they ended.
                let _ = once(sign.opposite());
                SumStores::forget_empty(self);
                match (stats?, verdict) {
                    (stats, Ok(())) => Ok(stats),
                    (_, Err(Unfit::Full(full))) => Err(MapError::from(full).into()),
                    (_, Err(Unfit::NotThere(block))) => Err(LedgerError::Sums { block: block.0.to_vec() }),
                }
            }

            fn add(&mut self, other: &Self, sign: Sign) -> Result<(), LedgerError> {
                let failed = |block: BlockKey<D>| LedgerError::Sums { block: block.0.to_vec() };
                self.add_sums(other, sign).map_err(failed)
            }

            fn bytes(&self) -> usize {
                self.memory_bytes()
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
