//! How much a cell must weigh to count as observed, by what observations weigh in its map.

use super::{DenseTsdf, Tsdf};
use crate::cell::SignedDistance;
use crate::store::{Bricks, Dense, Store};
use crate::sweep::WeightModel;
use std::borrow::Cow;

/// The least weights of cells that count. Everything that is derived of a map takes them where its settings say
/// `min_weight: None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// For surfaces: half of what one ordinary beam weighs, so that what was seen once is a surface.
    pub surface: f32,
    /// For distances, rays and frontiers: half of what one ordinary observation of free space weighs, so that what was
    /// seen free once is known.
    pub observed: f32,
}

impl Thresholds {
    /// Any weight above 0: for cells whose weights have no known scale.
    pub const ANY: Self = Self { surface: 0.0, observed: 0.0 };

    /// Of a map whose beams weigh as this model has it, and `carve_weight` times that beyond the truncation. 0.5 for
    /// both where everything weighs 1.
    pub fn of(weights: WeightModel, carve_weight: f32) -> Self {
        let surface = 0.5 * weights.typical_low();
        Self { surface, observed: surface * carve_weight }
    }
}

/// Signed distances that fields, surfaces and rays are derived from: a map, or its cells alone.
pub trait DistanceMap<const D: usize> {
    /// How much its cells must weigh to count. Of cells alone, [`Thresholds::ANY`]: how they were weighed is not known.
    fn thresholds(&self) -> Thresholds;

    /// Its cells in bricks; of a dense map a copy, O(cells).
    fn bricks(&self) -> Cow<'_, Bricks<SignedDistance, D>>;

    /// Its cells in a dense array, if that is what holds them.
    fn dense(&self) -> Option<&Dense<SignedDistance, D>> {
        None
    }
}

impl<const D: usize> DistanceMap<D> for Bricks<SignedDistance, D> {
    fn thresholds(&self) -> Thresholds {
        Thresholds::ANY
    }

    fn bricks(&self) -> Cow<'_, Self> {
        Cow::Borrowed(self)
    }
}

impl<const D: usize> DistanceMap<D> for Tsdf<D> {
    fn thresholds(&self) -> Thresholds {
        self.thresholds()
    }

    fn bricks(&self) -> Cow<'_, Bricks<SignedDistance, D>> {
        Cow::Borrowed(self.store())
    }
}

impl<const D: usize> DistanceMap<D> for DenseTsdf<D> {
    fn thresholds(&self) -> Thresholds {
        self.thresholds()
    }

    fn bricks(&self) -> Cow<'_, Bricks<SignedDistance, D>> {
        Cow::Owned(self.store().into())
    }

    fn dense(&self) -> Option<&Dense<SignedDistance, D>> {
        Some(self.store())
    }
}

impl<const D: usize, S: Store<SignedDistance, D>> Tsdf<D, S> {
    /// How much cells must weigh to count, by what beams weigh in this map.
    pub fn thresholds(&self) -> Thresholds {
        Thresholds::of(self.config().weights, self.config().carve_weight)
    }
}
