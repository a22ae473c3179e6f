//! How a field of distances is made.

use super::transform::Feature;
use crate::map::DistanceMap;

/// What distances are measured to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum EsdfMethod {
    /// The extracted surface: the nearest of its crossings of the lattice's edges, found by an exact transform with
    /// real-valued roots, and from there the surface's segments or triangles. What clearance can be certified with.
    #[default]
    Accurate,
    /// The textbook's: every observed cell within so many cells of the surface is a seed with its own estimate,
    /// `f = (D / r)^2`, which is too small almost everywhere (see [`crate::field::esdf_from_tsdf`]).
    Seeded {
        /// Cells whose estimate is within this many cells of zero seed the transform; 1.5 in the textbook.
        band_cells: f32,
    },
    /// The center of the nearest observed cell of the other sign, less half a cell: what a map that only knows occupied
    /// and free can give (see [`crate::field::EsdfGrid::from_mask`]).
    Mask,
}

impl EsdfMethod {
    /// The textbook's: seeds within 1.5 cells of the surface.
    pub const TEXTBOOK: Self = Self::Seeded { band_cells: 1.5 };
}

/// Settings of an [`Esdf`](super::Esdf).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EsdfSettings {
    /// Cells of smaller weight count as never observed. `None`: what fits the map
    /// ([`DistanceMap::min_weight`](crate::map::DistanceMap::min_weight)), and any weight above 0 where cells alone are given.
    pub min_weight: Option<f32>,
    /// Distances are maintained up to here (meters); beyond it answers are saturated. Positive.
    pub max_distance: f64,
    /// What distances are measured to.
    pub method: EsdfMethod,
    /// Whether the distance to the nearest unknown cell is kept too.
    pub unknown: bool,
}

impl Default for EsdfSettings {
    /// The weight that fits the map; one meter; the accurate method.
    fn default() -> Self {
        Self { min_weight: None, max_distance: 1.0, method: EsdfMethod::Accurate, unknown: false }
    }
}

impl EsdfSettings {
    /// The default, with the weight that fits a map written out: for fields of its cells alone.
    pub fn of<const D: usize>(map: &impl DistanceMap<D>) -> Self {
        Self { min_weight: Some(map.min_weight()), ..Self::default() }
    }

    /// Distances are maintained up to so many cells.
    pub(super) fn reach_cells(&self, resolution: f64) -> f64 {
        let most = match self.method {
            EsdfMethod::Accurate => f64::from(Feature::REACH - 1),
            EsdfMethod::Seeded { .. } | EsdfMethod::Mask => LARGEST,
        };
        (self.max_distance / resolution).min(most)
    }
}

/// Squares of whole numbers up to this are exact in `f32`.
const LARGEST: f64 = 4096.0;

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EsdfUpdate {
    /// Bricks of the map that had changed.
    pub changed: usize,
    /// Bricks whose surface is not what it was.
    pub touched: usize,
    /// Bricks that were solved again.
    pub solved: usize,
    /// Bricks whose distances to the surface are measured again when they are read.
    pub stale: usize,
}
