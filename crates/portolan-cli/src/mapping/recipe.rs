//! The settings of `map` as the library's recipe, and what a recipe alone does not say.

use portolan::cell::{AttenuationRule, OccupancyModel, TsdfRule};
use portolan::geom::Aabb;
use portolan::map::BeamSweep;
use portolan::mapper::MapperSettings;

use super::choices::{SweepArg, WeightsArg};
use super::settings::Shape;
use super::{MapKind, Settings};
use crate::arguments::ForgettingArgs;
use crate::dimension::Dimension;

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

impl Settings {
    /// The inverse: what a file says of maps that were made by this recipe. What a recipe does not say, as the limits of range,
    /// stays as it was.
    pub(crate) fn of_mapper<const D: usize>(
        how: &MapperSettings<D>,
        dimension: Dimension,
        before: Self,
    ) -> Self {
        let sweep = match dimension {
            Dimension::Two if how.beams == BeamSweep::March => SweepArg::March,
            Dimension::Two => SweepArg::CellCentre,
            Dimension::Three if how.exact => SweepArg::Exact,
            Dimension::Three => SweepArg::Auto,
        };
        let mut settings = Self {
            shape: Shape {
                resolution: how.resolution,
                truncation: Some(how.truncation()),
                forgetting: ForgettingArgs::of(how.w_max),
                weights: WeightsArg::of(how.weights),
                sweep: Some(sweep),
                carve: how.carve,
                carve_weight: how.carve_weight,
                color: how.color,
                ledger: false,
                ..before.shape
            },
            max_distance: how.max_distance,
            thin: how.thin,
            maps: Vec::new(),
            ..before
        }
        .resolved(dimension);
        settings.keep(&[
            (MapKind::Grid, how.occupancy.is_some()),
            (MapKind::Tree, how.occupancy.is_some()),
            (MapKind::Tsdf, how.distances),
            (MapKind::Attenuation, how.attenuation.is_some()),
        ]);
        settings
    }

    /// Drops the maps that there are not, and what is derived from them.
    pub(crate) fn keep(&mut self, held: &[(MapKind, bool)]) {
        let is_held = |kind: MapKind| held.iter().any(|(k, held)| *k == kind && *held);
        let tsdf = is_held(MapKind::Tsdf);
        self.maps.retain(|&kind| match kind {
            MapKind::Esdf | MapKind::Contour | MapKind::Mesh => tsdf,
            _ => is_held(kind),
        });
    }
}

/// Counts forget as the filter of distances does: the same half-life, for beams of weight 1.
pub(super) fn attenuation_rule(settings: &Settings) -> AttenuationRule {
    let filter = TsdfRule { truncation: settings.truncation() as f32, w_max: settings.w_max() };
    AttenuationRule::of_half_life(filter.half_life(1.0))
}
