//! The clamped maps of a ledger.

use super::{Ledger, LedgerError};
use crate::answer::Answer;
use crate::map::{Attenuation, Occupancy, Tsdf};
use crate::mapper::{Mapper, MapperMaps, MapperSettings};

impl<const D: usize> Ledger<D> {
    /// The estimate of the cell that holds a point, as [`Tsdf::signed_distance`] of [`Ledger::mapper`] would answer now; `None`: there
    /// are no distances. O(1).
    pub fn signed_distance(&self, p_world: impl Into<[f64; D]>) -> Option<Answer<f64>> {
        self.tsdf.as_ref().map(|map| map.signed_distance(p_world))
    }

    /// P(occupied) at a point, as [`Occupancy::probability`] of [`Ledger::mapper`] would answer now; `None`: there is no occupancy. O(1).
    pub fn probability(&self, p_world: impl Into<[f64; D]>) -> Option<Answer<f64>> {
        self.occupancy.as_ref().map(|map| map.probability(p_world))
    }

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
            let colors = map.colors().map(|colors| colors.estimates(left)).transpose();
            let colors = colors.map_err(crate::map::MapError::from)?;
            left = left.saturating_sub(colors.as_ref().map_or(0, crate::store::Store::memory_bytes));
            maps.tsdf = Some(Tsdf::from_stores(store, colors, *map.config())?);
        }
        if let Some(map) = &self.attenuation {
            let store = map.store().estimates(left).map_err(crate::map::MapError::from)?;
            maps.attenuation = Some(Attenuation::from_store(store, *map.rule())?);
        }
        Ok(Mapper::of_maps(settings, maps)?)
    }
}
