//! The Euclidean signed distance field of a map in bricks.

use super::TOGETHER;
use super::bricks::EsdfBrick;
use super::cell_mask::CellMask;
use super::measure::NodeDistances;
use super::obstacles::ObstacleCells;
use super::settings::{EsdfMethod, EsdfSettings, EsdfUpdate};
use super::surface::SurfaceElements;
use crate::cell::SignedDistance;
use crate::geom::{BlockKey, Lattice};
use crate::map::DistanceMap;
use crate::parallel;
use crate::store::{Bricks, Store};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Signed Euclidean distances (meters) at the centers of the cells of a map in bricks, positive in free space, up to a
/// largest distance.
///
/// Every cell that the map observed is known or saturated, and so is every obstacle; all others are unknown. Outside begins where no brick is
/// near: a brick away from every brick of the map.
///
/// A clone is a snapshot that shares all bricks which neither side has solved again since: readers keep one while
/// [`Esdf::update`] follows the map.
#[derive(Clone, Debug)]
pub struct Esdf<const D: usize> {
    pub(super) lattice: Lattice<D>,
    /// With a weight.
    settings: EsdfSettings,
    pub(super) max_distance: f32,
    /// Of the map, when it was looked at last.
    pub(super) epoch: u64,
    pub(super) slots: Arc<FxHashMap<BlockKey<D>, u32>>,
    /// In the order of slots, as are the bricks.
    pub(super) keys: Arc<Vec<BlockKey<D>>>,
    pub(super) bricks: Vec<EsdfBrick>,
    /// Of the accurate method.
    pub(super) surface: SurfaceElements<D>,
    /// Cells of which a map says that something stops beams there, in bricks. Of the accurate method.
    pub(super) candidates: Arc<FxHashMap<BlockKey<D>, CellMask>>,
    pub(super) has_points: bool,
}

impl<const D: usize> Esdf<D> {
    /// The field over the observed bricks of a map, by [`EsdfSettings::method`].
    ///
    /// `map` is a [`Tsdf`](crate::map::Tsdf), a [`Tsdf3`](crate::map::Tsdf3), or the cells of one in bricks; a dense map
    /// is copied into bricks first, a small part of what the transform takes.
    ///
    /// Accurate: the exact distance to the crossings of the surface that [`crate::surface`] extracts, and from there to its
    /// segments or triangles ([`Esdf::measure`] says when); up to 509 cells, whatever `max_distance` says. Seeded: what
    /// [`crate::field::esdf_from_tsdf`] makes of a dense map, up to `max_distance`. The sign is that of the cell's own
    /// estimate.
    ///
    /// O(cells of the observed bricks x cells of `max_distance`) at worst, where nothing is near. In parallel with the
    /// feature `parallel`; the result is the same bytes.
    ///
    /// # Panics
    /// Where `max_distance` is not positive.
    pub fn of(map: &impl DistanceMap<D>, settings: &EsdfSettings) -> Self {
        Self::made(map, None, settings)
    }

    /// [`Esdf::of`], with what stops beams as obstacles beside the surface: cells of `cells` that no element of the surface
    /// explains (none within 1.4 cells of their center in 2-D, 0.8 in 3-D) are obstacles at their center, also where the map
    /// of distances calls them free or never observed them. By the accurate method alone; the others measure to their own cells.
    ///
    /// # Panics
    /// Where `max_distance` is not positive, or the cells are of another lattice.
    pub fn with_obstacles(
        map: &impl DistanceMap<D>,
        cells: &ObstacleCells<D>,
        settings: &EsdfSettings,
    ) -> Self {
        Self::made(map, Some(cells), settings)
    }

    fn made(map: &impl DistanceMap<D>, cells: Option<&ObstacleCells<D>>, settings: &EsdfSettings) -> Self {
        assert!(settings.max_distance > 0.0, "distances are maintained up to a positive length");
        let store = map.bricks();
        let lattice = *store.lattice();
        let reach = settings.reach_cells(lattice.resolution);
        let min_weight = settings.min_weight.unwrap_or(map.min_weight());
        let mut field = Self {
            lattice,
            settings: EsdfSettings { min_weight: Some(min_weight), ..*settings },
            max_distance: (reach * lattice.resolution) as f32,
            epoch: 0,
            slots: Arc::default(),
            keys: Arc::default(),
            bricks: Vec::new(),
            surface: SurfaceElements::new(min_weight),
            candidates: Arc::default(),
            has_points: false,
        };
        field.renew(&store, cells);
        field
    }

    /// Follows the map that the field was made of: afterwards it is what [`Esdf::of`] makes of it, bit for bit, or
    /// [`Esdf::with_obstacles`] of it and the cells that were given last.
    /// Only what changed since and what lies within the largest distance of it is solved again, and only where the surface
    /// is not what it was; by the other methods than [`EsdfMethod::Accurate`], everything.
    ///
    /// O(bricks + cells within reach of a change).
    ///
    /// # Panics
    /// Where the map has another lattice.
    pub fn update(&mut self, store: &Bricks<SignedDistance, D>) -> EsdfUpdate {
        self.renew(store, None)
    }

    /// [`Esdf::update`], with what stops beams now: afterwards it is what [`Esdf::with_obstacles`] makes of both.
    ///
    /// # Panics
    /// Where the map has another lattice.
    pub fn update_with(&mut self, store: &Bricks<SignedDistance, D>, cells: &ObstacleCells<D>) -> EsdfUpdate {
        self.renew(store, Some(cells))
    }

    fn renew(&mut self, store: &Bricks<SignedDistance, D>, cells: Option<&ObstacleCells<D>>) -> EsdfUpdate {
        assert_eq!(self.lattice, *store.lattice(), "the map that the field was made of");
        let others = cells.and_then(ObstacleCells::lattice).unwrap_or(&self.lattice);
        assert_eq!(self.lattice, *others, "cells on the map's lattice");
        if self.settings.method == EsdfMethod::Accurate {
            return self.follow(store, cells);
        }
        let changed = store.changed_since(self.epoch).len();
        if changed > 0 {
            self.solve_cells(store);
        }
        let solved = if changed > 0 { self.keys.len() } else { 0 };
        EsdfUpdate { changed, touched: changed, solved, stale: 0 }
    }

    /// Measures the distances of all bricks that were not read yet, in parallel with the feature `parallel`. Otherwise the
    /// accurate method measures a brick when it is read for the first time, which makes that one query slow (a tenth of a
    /// millisecond) and leaves alone what nobody asks for.
    pub fn measure(&self) {
        let slots: Vec<usize> =
            (0..self.bricks.len()).filter(|&s| self.bricks[s].distance.get().is_none()).collect();
        parallel::map_with(&slots, TOGETHER, NodeDistances::new, |&slot, scratch| {
            // A reader may be first.
            let _ = self.bricks[slot].distance.set(self.measured(slot, scratch));
        });
    }

    /// How the field is made, with the weight that it was made with.
    pub fn settings(&self) -> &EsdfSettings {
        &self.settings
    }

    /// Index to meters.
    pub fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    /// Distances are maintained up to here (meters).
    pub fn max_distance(&self) -> f32 {
        self.max_distance
    }

    /// The keys of the bricks that hold a cell of which something is known, ascending. O(n log n).
    pub fn keys(&self) -> Vec<BlockKey<D>> {
        let mut keys = self.keys.to_vec();
        keys.sort_unstable();
        keys
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let bucket = size_of::<(BlockKey<D>, u32)>() + 1;
        self.bricks.iter().map(EsdfBrick::bytes).sum::<usize>()
            + self.keys.capacity() * size_of::<BlockKey<D>>()
            + self.slots.capacity() * 8 / 7 * bucket
            + self.surface.memory_bytes()
            + self.candidates.capacity() * 8 / 7 * (size_of::<(BlockKey<D>, CellMask)>() + 1)
            + size_of::<Self>()
    }

    /// Distances are maintained up to so many cells.
    pub(super) fn reach_cells(&self) -> f64 {
        self.settings.reach_cells(self.lattice.resolution)
    }

    /// Cells of smaller weight count as never observed.
    pub(super) fn min_weight(&self) -> f32 {
        self.settings.min_weight.unwrap_or(0.0)
    }

    #[inline]
    pub(super) fn slot(&self, key: BlockKey<D>) -> Option<usize> {
        self.slots.get(&key).map(|&slot| slot as usize)
    }

    pub(super) fn add(&mut self, key: BlockKey<D>, brick: EsdfBrick) {
        Arc::make_mut(&mut self.slots).insert(key, self.bricks.len() as u32);
        Arc::make_mut(&mut self.keys).push(key);
        self.bricks.push(brick);
    }

    /// The last brick takes its place.
    pub(super) fn remove(&mut self, key: BlockKey<D>, slot: usize) {
        let (slots, keys) = (Arc::make_mut(&mut self.slots), Arc::make_mut(&mut self.keys));
        slots.remove(&key);
        keys.swap_remove(slot);
        self.bricks.swap_remove(slot);
        if let Some(moved) = keys.get(slot) {
            slots.insert(*moved, slot as u32);
        }
    }

    pub(super) fn clear(&mut self) {
        (self.slots, self.keys) = Default::default();
        self.bricks.clear();
    }
}

#[cfg(test)]
#[path = "field_tests.rs"]
mod tests;
