//! How distance fields are made of maps.

use portolan::field::{Esdf, EsdfGrid, EsdfMethod, EsdfSettings};
use portolan::geom::vector;
use portolan::map::Tsdf;
use serde_json::{Map, Value};

/// What distances are measured to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum EsdfArg {
    /// The extracted surface
    #[default]
    Accurate,
    /// The chapter's seeds: cells near the surface with their own estimates
    Seeded,
    /// The nearest cell of the other sign
    Mask,
}

impl EsdfArg {
    /// The library's word.
    pub(crate) fn method(self) -> EsdfMethod {
        match self {
            Self::Accurate => EsdfMethod::Accurate,
            Self::Seeded => EsdfMethod::TEXTBOOK,
            Self::Mask => EsdfMethod::Mask,
        }
    }

    /// The word in files and on the command line.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Accurate => "accurate",
            Self::Seeded => "seeded",
            Self::Mask => "mask",
        }
    }

    /// What a map was made with.
    pub(crate) fn of_settings(settings: &Map<String, Value>) -> Option<Self> {
        let word = settings.get("esdf").and_then(Value::as_str)?;
        [Self::Accurate, Self::Seeded, Self::Mask].into_iter().find(|method| method.word() == word)
    }
}

/// The field of a map of the plane, as far as the method reaches (509 cells where it is accurate), with distances to
/// unknown cells where they are wanted.
pub(crate) fn plane_esdf(tsdf: &Tsdf2, method: EsdfArg, unknown: bool) -> Esdf<2> {
    let grid = tsdf.grid();
    let max_distance = vector::norm(grid.aabb().extent()).max(grid.lattice.resolution);
    let how = EsdfSettings { max_distance, method: method.method(), unknown, ..EsdfSettings::default() };
    Esdf::of(tsdf, &how)
}

/// The cells of a map of the plane.
pub(crate) fn dense_plane_esdf(tsdf: &Tsdf2, method: EsdfArg) -> EsdfGrid<2> {
    plane_esdf(tsdf, method, false).dense(tsdf.grid())
}

/// The status plane of a file, where there is something to say that NaN does not.
pub(crate) fn status_plane<const D: usize>(dense: &EsdfGrid<D>) -> Option<Vec<u8>> {
    dense.is_saturated().then(|| dense.status_bytes())
}
