//! How much a cell must weigh to count as observed, by what observations weigh in its map.

use super::{DenseTsdf, Tsdf};
use crate::cell::{Color, SignedDistance};
use crate::store::{Bricks, Dense, Store};
use crate::sweep::WeightModel;
use std::borrow::Cow;

/// The least weight of cells that count, in a map whose beams weigh as this model has it, and `carve_weight` times that
/// beyond the truncation: half of what one ordinary observation of free space weighs, so that what was seen once is known.
/// 0.5 where everything weighs 1.
///
/// There is one such weight, for surfaces, distances, rays and frontiers alike: what is certified of a surface holds for
/// the surface that is written.
pub fn least_weight(weights: WeightModel, carve_weight: f32) -> f32 {
    // More weight on free space than on surfaces must not hide surfaces.
    0.5 * weights.typical_low() * carve_weight.min(1.0)
}

/// Signed distances that fields, surfaces and rays are derived from: a map, or its cells alone.
pub trait DistanceMap<const D: usize> {
    /// How much its cells must weigh to count. Of cells alone 0, any weight: how they were weighed is not known. Everything
    /// that is derived of a map takes it where its settings say `min_weight: None`.
    fn min_weight(&self) -> f32;

    /// Its cells in bricks; of a dense map a copy, O(cells).
    fn bricks(&self) -> Cow<'_, Bricks<SignedDistance, D>>;

    /// Its cells in a dense array, if that is what holds them.
    fn dense(&self) -> Option<&Dense<SignedDistance, D>> {
        None
    }
}

impl<const D: usize> DistanceMap<D> for Bricks<SignedDistance, D> {
    fn min_weight(&self) -> f32 {
        0.0
    }

    fn bricks(&self) -> Cow<'_, Self> {
        Cow::Borrowed(self)
    }
}

impl<const D: usize> DistanceMap<D> for Tsdf<D> {
    fn min_weight(&self) -> f32 {
        self.min_weight()
    }

    fn bricks(&self) -> Cow<'_, Bricks<SignedDistance, D>> {
        Cow::Borrowed(self.store())
    }
}

impl<const D: usize> DistanceMap<D> for DenseTsdf<D> {
    fn min_weight(&self) -> f32 {
        self.min_weight()
    }

    fn bricks(&self) -> Cow<'_, Bricks<SignedDistance, D>> {
        Cow::Owned(self.store().into())
    }

    fn dense(&self) -> Option<&Dense<SignedDistance, D>> {
        Some(self.store())
    }
}

impl<const D: usize, S: Store<SignedDistance, D>, C: Store<Color, D>> Tsdf<D, S, C> {
    /// How much cells must weigh to count, by what beams weigh in this map.
    pub fn min_weight(&self) -> f32 {
        least_weight(self.config().weights, self.config().carve_weight)
    }
}
