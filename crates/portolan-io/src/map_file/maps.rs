//! Where maps of the engine meet what a file holds of them: cells and settings.

use portolan::cell::{LogOdds8, SignedDistance};
use portolan::map::{BeamSweep, DenseTsdf, MapError, OccupancyGrid, OccupancyTree, TsdfConfig};
use portolan::store::{Dense, Tree};
use portolan::sweep::WeightModel;
use serde_json::Map;

use super::settings::{OccupancySettings, TsdfSettings, sweep_word, weights_word};

/// The name of the setting that only dense TSDFs have.
pub(super) const SWEEP: &str = "sweep";

pub(super) fn grid_of<const D: usize>(
    store: Dense<LogOdds8, D>,
    settings: &OccupancySettings,
) -> Result<OccupancyGrid<D>, MapError> {
    OccupancyGrid::from_store(store, settings.model)
}

pub(super) fn of_grid<const D: usize>(map: &OccupancyGrid<D>) -> (&Dense<LogOdds8, D>, OccupancySettings) {
    (map.store(), OccupancySettings { model: *map.model(), more: Map::new() })
}

pub(super) fn tree_of<const D: usize>(
    store: Tree<LogOdds8, D>,
    settings: &OccupancySettings,
) -> Result<OccupancyTree<D>, MapError> {
    OccupancyTree::from_store(store, settings.model)
}

pub(super) fn of_tree<const D: usize>(map: &OccupancyTree<D>) -> (&Tree<LogOdds8, D>, OccupancySettings) {
    (map.store(), OccupancySettings { model: *map.model(), more: Map::new() })
}

pub(super) fn tsdf_of<const D: usize>(
    store: Dense<SignedDistance, D>,
    settings: &TsdfSettings,
    weights: WeightModel,
    beams: BeamSweep,
) -> Result<DenseTsdf<D>, MapError> {
    let (truncation, carve_weight) = (settings.truncation, settings.carve_weight);
    let w_max = settings.w_max.unwrap_or(f32::INFINITY);
    let config = TsdfConfig { truncation, w_max, carve_weight, beams, weights, ..TsdfConfig::default() };
    DenseTsdf::from_stores(store, None, config)
}

pub(super) fn of_tsdf<const D: usize>(map: &DenseTsdf<D>) -> (&Dense<SignedDistance, D>, TsdfSettings) {
    let config = map.config();
    let settings = TsdfSettings {
        truncation: config.truncation,
        w_max: Some(config.w_max).filter(|w| w.is_finite()),
        carve_weight: config.carve_weight,
        weights: weights_word(config.weights).into(),
        more: [(SWEEP.to_owned(), sweep_word(config.beams).into())].into_iter().collect(),
    };
    (map.store(), settings)
}
