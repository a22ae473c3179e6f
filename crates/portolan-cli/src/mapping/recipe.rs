//! The recipe: the numbers that make maps fit each other, where the settings leave them open.

use portolan::field::SparseEsdfSettings;
use portolan::map::{PointSweep, SparseTsdfConfig, TsdfConfig};
use portolan::surface::MeshSettings;
use portolan::sweep::WeightModel;

use super::Settings;
use super::choices::SweepArg;

/// Free space weighs less than a surface: on real logs, full of table legs, surfaces that weigh as much as the beams
/// that pass beside them are carved away (Intel at 5 cm: 85.0 % of held-out ranges within two cells, 82.1 with 1).
pub(crate) const CARVE_WEIGHT: f32 = 0.3;
/// Largest weight of a cell.
pub(crate) const W_MAX: f32 = 64.0;
/// Distances of a 3-D esdf are kept up to here (meters).
pub(crate) const MAX_DISTANCE: f64 = 1.0;
/// Cells around everything that was seen, besides the truncation, in a dense map.
pub(super) const MARGIN_CELLS: f64 = 4.0;
/// Rays are followed up to this length (cells): beyond a million cells a range is not a measurement.
const FARTHEST_CELLS: f64 = (1u32 << 20) as f64;

/// Three times the resolution, without the rounding error that would show in every file (0.15000000000000002).
pub(super) fn three_cells(resolution: f64) -> f64 {
    let exact = 3.0 * resolution;
    format!("{exact:.9e}").parse().unwrap_or(exact)
}

/// The 2-D signed distances.
pub(super) fn tsdf_2d(settings: &Settings) -> TsdfConfig<2> {
    TsdfConfig {
        truncation: settings.truncation(),
        w_max: settings.w_max(),
        sweep: settings.sweep().in_2d(),
        weights: settings.weights(),
        carve_weight: settings.shape.carve_weight,
        ..TsdfConfig::default()
    }
}

/// The 3-D signed distances, on a lattice with this origin.
pub(super) fn tsdf_3d(settings: &Settings, origin: [f64; 3]) -> SparseTsdfConfig {
    let (resolution, truncation) = (settings.resolution(), settings.truncation());
    SparseTsdfConfig {
        resolution,
        origin,
        truncation,
        w_max: settings.w_max(),
        weights: settings.weights(),
        carve: settings.shape.carve,
        carve_weight: settings.shape.carve_weight,
        color: settings.shape.color,
        sweep: if settings.sweep() == SweepArg::Exact { PointSweep::Rays } else { PointSweep::Projective },
        // What is beyond the caller's limit is cut before; the map's own is as far as it reaches.
        max_range: FARTHEST_CELLS * resolution - truncation,
        ..SparseTsdfConfig::default()
    }
}

/// The origin of a 3-D lattice: zero, unless the log is so far from it that indices would run out or files of other
/// programs could not hold them anyway; then the multiple of the resolution next to the first pose.
pub(super) fn origin(first: [f64; 3], resolution: f64) -> [f64; 3] {
    const FAR: f64 = 1e6;
    first.map(|v| if (v / resolution).abs() < FAR { 0.0 } else { (v / resolution).round() * resolution })
}

/// A `W_min` of half of what one ordinary ray weighs: what was seen once is a surface.
pub(crate) fn mesh_settings(weights: WeightModel) -> MeshSettings {
    MeshSettings { min_weight: 0.5 * weights.typical_low(), ..MeshSettings::default() }
}

/// A `W_min` of half of what one ordinary observation of free space weighs: what was seen free once is known.
pub(crate) fn free_weight(weights: WeightModel, carve_weight: f32) -> f32 {
    0.5 * weights.typical_low() * carve_weight
}

/// The 3-D distance field of signed distances with these weights.
pub(crate) fn esdf_settings(
    weights: WeightModel,
    carve_weight: f32,
    max_distance: f64,
) -> SparseEsdfSettings {
    let min_weight = free_weight(weights, carve_weight);
    SparseEsdfSettings { min_weight, max_distance, ..SparseEsdfSettings::default() }
}
