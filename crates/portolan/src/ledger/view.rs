//! The clamped maps of a ledger.

use super::{Ledger, LedgerError};
use crate::map::{Attenuation, Occupancy, Tsdf};
use crate::mapper::{Mapper, MapperMaps, MapperSettings};

impl<const D: usize> Ledger<D> {
    /// The maps that follow from the sums: log odds clamped once, weighted means, hits per meter. They answer what a mapper's
    /// answer, and are the same bytes for equal ledgers. O(cells), memory beside the ledger's. Scans that are added to them
    /// are not added here.
    ///
    /// # Errors
    /// [`MapError::Full`](crate::map::MapError::Full) where they would take more than the settings' memory.
    pub fn mapper(&self) -> Result<Mapper<D>, LedgerError> {
        let settings =
            MapperSettings { origin: Some(self.settings.origin.unwrap_or([0.0; D])), ..self.settings };
        let mut left = settings.memory;
        let mut maps = MapperMaps::default();
        if let Some(map) = &self.occupancy {
            let store = map.store().estimates(left).map_err(crate::map::MapError::from)?;
            left = left.saturating_sub(crate::store::Store::memory_bytes(&store));
            maps.occupancy = Some(Occupancy::from_store(store, *map.model())?);
        }
        if let Some(map) = &self.tsdf {
            let store = map.store().estimates(left).map_err(crate::map::MapError::from)?;
            left = left.saturating_sub(crate::store::Store::memory_bytes(&store));
            maps.tsdf = Some(Tsdf::from_stores(store, None, *map.config())?);
        }
        if let Some(map) = &self.attenuation {
            let store = map.store().estimates(left).map_err(crate::map::MapError::from)?;
            maps.attenuation = Some(Attenuation::from_store(store, *map.rule())?);
        }
        Ok(Mapper::of_maps(settings, maps)?)
    }
}
