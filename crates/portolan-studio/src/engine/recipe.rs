//! How a map is made so that the page shows what `map` makes of the same log, and how a setting is read.

use portolan::field::SparseEsdfSettings;
use portolan::map::SparseTsdf;
use portolan::surface::MeshSettings;

use super::Refusal;

/// What an observation of free space weighs in the map of a recorded log: thin things survive.
pub(super) const CARVE_WEIGHT: f64 = 0.3;
/// Rays are followed so far (cells): beyond a million cells a range is no measurement.
pub(super) const FARTHEST_CELLS: f64 = (1u32 << 20) as f64;

/// Half of what one ordinary ray weighs: what was seen once is a surface.
pub(super) fn mesh_settings(tsdf: &SparseTsdf) -> MeshSettings {
    MeshSettings { min_weight: 0.5 * tsdf.config().weights.typical_low(), ..MeshSettings::default() }
}

/// Half of what one ordinary observation of free space weighs: what was seen free once is known.
pub(super) fn esdf_settings(tsdf: &SparseTsdf) -> SparseEsdfSettings {
    let config = tsdf.config();
    let min_weight = 0.5 * config.weights.typical_low() * config.carve_weight;
    SparseEsdfSettings { min_weight, ..SparseEsdfSettings::default() }
}

/// A setting of the page, where it is in its range.
///
/// # Errors
/// Names the setting, its range and its value.
pub(super) fn within(name: &str, value: f64, low: f64, high: f64) -> Result<f64, Refusal> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(Refusal::new(format!("{name} must be from {low} to {high}, and is {value}")))
}
