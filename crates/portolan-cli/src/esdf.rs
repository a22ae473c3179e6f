//! How distance fields are made of maps.

use portolan::field::{Esdf, EsdfGrid, EsdfMethod, EsdfSettings};
use portolan::geom::vector;
use portolan::map::Tsdf;
use serde::{Deserialize, Serialize};

/// What distances are measured to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum EsdfArg {
    /// Distances to the extracted surface
    #[default]
    Accurate,
    /// The textbook's: from cells near the surface, which keep their own estimates
    Seeded,
    /// Distances to the nearest cell of the other sign
    Mask,
}

impl EsdfArg {
    /// As the library has it.
    pub(crate) fn method(self) -> EsdfMethod {
        match self {
            Self::Accurate => EsdfMethod::Accurate,
            Self::Seeded => EsdfMethod::TEXTBOOK,
            Self::Mask => EsdfMethod::Mask,
        }
    }
}

/// The field of a 2-D map, as far as the method reaches (509 cells where it is accurate), with distances to
/// unknown cells where they are wanted.
pub(crate) fn esdf_2d(tsdf: &Tsdf2, method: EsdfArg, unknown: bool) -> SparseEsdf<2> {
    let grid = tsdf.grid();
    let max_distance = vector::norm(grid.aabb().extent()).max(grid.lattice.resolution);
    let how = EsdfSettings { max_distance, method: method.method(), unknown, ..EsdfSettings::default() };
    Esdf::of(tsdf, &how)
}

/// The cells of the field of a 2-D map.
pub(crate) fn dense_esdf_2d(tsdf: &Tsdf2, method: EsdfArg) -> DenseEsdf<2> {
    esdf_2d(tsdf, method, false).dense(tsdf.grid())
}

/// The status plane of a file, where it holds more than NaN does.
pub(crate) fn status_plane<const D: usize>(dense: &DenseEsdf<D>) -> Option<&[u8]> {
    dense.status.contains(&2).then_some(&dense.status[..])
}

/// A field of samples that are known where they are numbers.
pub(crate) fn known_where_finite<const D: usize>(grid: Grid<D>, distances: Vec<f32>) -> DenseEsdf<D> {
    let status = distances.iter().map(|d| u8::from(!d.is_nan())).collect();
    DenseEsdf { grid, distances, status }
}
