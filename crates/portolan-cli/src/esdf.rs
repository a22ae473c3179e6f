//! Distance fields of 2-D maps, and the methods of both dimensions.

use anyhow::Context;
use portolan::cell::DistancePlanes;
use portolan::field::{Esdf, EsdfGrid, EsdfMethod, EsdfSettings};
use portolan::geom::{Grid, vector};
use portolan::map::{Tsdf2, TsdfConfig};
use portolan::store::Dense;
use portolan_io::MapCell;
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
pub(crate) fn esdf_2d(tsdf: &Tsdf2, method: EsdfArg, unknown: bool) -> Esdf<2> {
    let grid = tsdf.grid();
    let max_distance = vector::norm(grid.aabb().extent()).max(grid.lattice.resolution);
    let how = EsdfSettings { max_distance, method: method.method(), unknown, ..EsdfSettings::default() };
    Esdf::of(tsdf, &how)
}

/// The cells of the field of a 2-D map.
pub(crate) fn dense_esdf_2d(tsdf: &Tsdf2, method: EsdfArg) -> EsdfGrid<2> {
    esdf_2d(tsdf, method, false).dense(tsdf.grid())
}

/// The status plane of a file, where it holds more than NaN does.
pub(crate) fn status_plane<const D: usize>(dense: &EsdfGrid<D>) -> Option<Vec<u8>> {
    dense.is_saturated().then(|| dense.status_bytes())
}

/// A 2-D field of distances to occupied and free cells.
pub(crate) fn esdf_of_cells(grid: Grid<2>, cells: &[MapCell]) -> EsdfGrid<2> {
    EsdfGrid::from_mask(grid, |i| match cells[i] {
        MapCell::Occupied => Some(true),
        MapCell::Free => Some(false),
        MapCell::Unknown => None,
    })
}

/// Samples of a 2-D field as signed distances of weight 1, or 0 where they are NaN.
pub(crate) fn tsdf_of_samples(grid: Grid<2>, samples: &[f32]) -> anyhow::Result<Tsdf2> {
    let known = |d: &f32| if d.is_nan() { (0.0, 0.0) } else { (*d, 1.0) };
    let (distances, weights) = samples.iter().map(known).unzip();
    let planes = DistancePlanes::from_parts(distances, weights);
    let store = planes.and_then(|planes| Dense::from_planes(grid, planes));
    let store = store.context("the distance field has values that are not finite")?;
    Ok(Tsdf2::from_stores(store, None, TsdfConfig::default())?)
}
