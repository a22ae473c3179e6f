//! Where maps of the engine meet what a file holds of them: cells and settings.

use portolan::cell::{LogOdds8, OccupancyModel, SignedDistance};
use portolan::map::{BeamSweep, DenseTsdf, MapError, OccupancyGrid, OccupancyTree, TsdfConfig};
use portolan::store::{Bricks, Dense, Tree};
use portolan::sweep::WeightModel;
use serde_json::{Map, Value};

use super::settings::{OccupancySettings, TsdfSettings};
use super::{OccupancyBricks, TsdfBricks, sweep_word, weights_word};

/// The name of the setting that only dense TSDFs have.
pub(super) const SWEEP: &str = "sweep";

/// What a file holds of a map.
pub(super) struct Saved<'a, S, T> {
    pub(super) store: &'a S,
    pub(super) settings: T,
}

pub(super) fn saved_grid<const D: usize>(
    map: &OccupancyGrid<D>,
) -> Saved<'_, Dense<LogOdds8, D>, OccupancySettings> {
    Saved { store: map.store(), settings: OccupancySettings { model: *map.model(), more: Map::new() } }
}

pub(super) fn saved_tree<const D: usize>(
    map: &OccupancyTree<D>,
) -> Saved<'_, Tree<LogOdds8, D>, OccupancySettings> {
    Saved { store: map.store(), settings: OccupancySettings { model: *map.model(), more: Map::new() } }
}

pub(super) fn saved_tsdf<const D: usize>(
    map: &DenseTsdf<D>,
) -> Saved<'_, Dense<SignedDistance, D>, TsdfSettings> {
    let config = map.config();
    let settings = TsdfSettings {
        truncation: config.truncation,
        w_max: Some(config.w_max).filter(|w| w.is_finite()),
        carve_weight: config.carve_weight,
        weights: weights_word(config.weights).into(),
        more: [(SWEEP.to_owned(), Value::from(sweep_word(config.beams)))].into_iter().collect(),
    };
    Saved { store: map.store(), settings }
}

pub(super) fn saved_occupancy_bricks<const D: usize>(
    map: &OccupancyBricks<D>,
) -> Saved<'_, Bricks<LogOdds8, D>, OccupancySettings> {
    Saved { store: &map.store, settings: OccupancySettings { model: map.model, more: map.more.clone() } }
}

pub(super) fn saved_tsdf_bricks<const D: usize>(
    map: &TsdfBricks<D>,
) -> Saved<'_, Bricks<SignedDistance, D>, TsdfSettings> {
    let settings = TsdfSettings {
        truncation: map.truncation,
        w_max: Some(map.w_max).filter(|w| w.is_finite()),
        carve_weight: map.carve_weight,
        weights: weights_word(map.weights).into(),
        more: map.more.clone(),
    };
    Saved { store: &map.store, settings }
}

pub(super) fn grid_of<const D: usize>(
    store: Dense<LogOdds8, D>,
    model: OccupancyModel,
) -> Result<OccupancyGrid<D>, MapError> {
    OccupancyGrid::from_store(store, model)
}

pub(super) fn tree_of<const D: usize>(
    store: Tree<LogOdds8, D>,
    model: OccupancyModel,
) -> Result<OccupancyTree<D>, MapError> {
    OccupancyTree::from_store(store, model)
}

pub(super) fn tsdf_of<const D: usize>(
    store: Dense<SignedDistance, D>,
    settings: &TsdfSettings,
    weights: WeightModel,
    beams: BeamSweep,
) -> Result<DenseTsdf<D>, MapError> {
    let config = TsdfConfig {
        truncation: settings.truncation,
        w_max: settings.w_max(),
        carve_weight: settings.carve_weight,
        beams,
        weights,
        ..TsdfConfig::default()
    };
    DenseTsdf::from_stores(store, None, config)
}
