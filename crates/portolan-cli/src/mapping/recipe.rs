//! The settings of `map` as the library's recipe, and what a recipe alone does not say.

use portolan::cell::{AttenuationRule, OccupancyModel, TsdfRule};
use portolan::geom::Aabb;
use portolan::mapper::MapperSettings;

use super::choices::SweepArg;
use super::{MapKind, Settings};

/// Cells around everything that was seen, besides the truncation, in a dense map.
pub(super) const MARGIN_CELLS: f64 = 4.0;

/// The maps that are asked for, on a lattice with this origin (`None`: what fits the first scan), in at most `memory` bytes.
pub(super) fn mapper_settings<const D: usize>(
    settings: &Settings,
    origin: Option<[f64; D]>,
    bounds: Option<Aabb<D>>,
    memory: usize,
) -> MapperSettings<D> {
    let occupancy = settings.wants(MapKind::Grid) || settings.wants(MapKind::Tree);
    MapperSettings {
        origin,
        truncation: Some(settings.truncation()),
        w_max: settings.w_max(),
        carve: settings.shape.carve,
        carve_weight: settings.shape.carve_weight,
        weights: settings.weights(),
        beams: settings.sweep().beams(),
        exact: settings.sweep() == SweepArg::Exact,
        occupancy: occupancy.then(OccupancyModel::default),
        attenuation: settings.wants(MapKind::Attenuation).then(|| attenuation_rule(settings)),
        distances: settings.wants(MapKind::Tsdf),
        color: settings.shape.color,
        bounds,
        memory,
        max_distance: settings.max_distance,
        thin: settings.thin,
        ..MapperSettings::new(settings.resolution())
    }
}

/// Counts forget as the filter of distances does: the same half-life, for beams of weight 1.
pub(super) fn attenuation_rule(settings: &Settings) -> AttenuationRule {
    let filter = TsdfRule { truncation: settings.truncation() as f32, w_max: settings.w_max() };
    AttenuationRule::of_half_life(filter.half_life(1.0))
}
