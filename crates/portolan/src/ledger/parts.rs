//! What a ledger is made of, for files.

use super::{Ledger, LedgerError, LedgerScans};
use crate::cell::{ColorSum, DistanceSum, HitLengthSum, HitMissSum, SumCell, SumPlanes};
use crate::geom::BlockKey;
use crate::mapper::MapperSettings;
use crate::store::{Bricks, Store, SumStore};

/// The sums of a ledger; `None`: no such map.
#[derive(Clone, Debug, Default)]
pub struct LedgerSums<const D: usize> {
    /// Of hits and misses.
    pub occupancy: Option<Bricks<HitMissSum, D>>,
    /// Of distances.
    pub distances: Option<Bricks<DistanceSum, D>>,
    /// Of colors.
    pub colors: Option<Bricks<ColorSum, D>>,
    /// Of hits and lengths.
    pub attenuation: Option<Bricks<HitLengthSum, D>>,
}

impl<const D: usize> Ledger<D> {
    /// The sums of hits and misses; `None` where there is no such map.
    pub fn occupancy_sums(&self) -> Option<&Bricks<HitMissSum, D>> {
        self.occupancy.as_ref().map(|map| map.store().sums())
    }

    /// The sums of distances; `None` where there is no such map.
    pub fn distance_sums(&self) -> Option<&Bricks<DistanceSum, D>> {
        self.tsdf.as_ref().map(|map| map.store().sums())
    }

    /// The sums of colors; `None` where none are kept.
    pub fn color_sums(&self) -> Option<&Bricks<ColorSum, D>> {
        self.tsdf.as_ref()?.colors().map(SumStore::sums)
    }

    /// The sums of hits and lengths; `None` where there is no such map.
    pub fn attenuation_sums(&self) -> Option<&Bricks<HitLengthSum, D>> {
        self.attenuation.as_ref().map(|map| map.store().sums())
    }

    /// A ledger of these scans and sums; maps whose sums are missing are empty.
    ///
    /// # Errors
    /// Where a setting is not possible, a lattice is another one than the settings', or sums are such as no observations have.
    pub fn from_parts(
        settings: MapperSettings<D>,
        scans: LedgerScans<D>,
        sums: LedgerSums<D>,
    ) -> Result<Self, LedgerError> {
        let mut ledger = Self::new(settings)?;
        ledger.scans = scans;
        if let (Some(map), Some(sums)) = (&mut ledger.occupancy, sums.occupancy) {
            put(map.store_mut(), sums)?;
        }
        if let Some(map) = &mut ledger.tsdf {
            let (distances, colors) = map.stores_mut();
            if let Some(sums) = sums.distances {
                put(distances, sums)?;
            }
            if let (Some(colors), Some(sums)) = (colors, sums.colors) {
                put(colors, sums)?;
            }
        }
        if let (Some(map), Some(sums)) = (&mut ledger.attenuation, sums.attenuation) {
            put(map.store_mut(), sums)?;
        }
        Ok(ledger)
    }
}

fn put<C: SumCell, const D: usize>(
    store: &mut SumStore<C, D>,
    sums: Bricks<C, D>,
) -> Result<(), LedgerError> {
    if sums.lattice() != store.lattice() {
        let [ours, theirs] = [store.lattice(), sums.lattice()].map(|lattice| format!("{lattice:?}"));
        return Err(LedgerError::Different { what: "lattice", ours, theirs });
    }
    let wrong = |(key, brick): (BlockKey<D>, &C::Brick)| (!brick.is_possible()).then_some(key);
    if let Some(key) = sums.bricks_by_age().find_map(wrong) {
        return Err(LedgerError::Sums { block: key.0.to_vec() });
    }
    store.replace(sums);
    Ok(())
}
