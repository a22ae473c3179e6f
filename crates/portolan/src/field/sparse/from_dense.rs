//! A dense map in bricks.

use super::settings::SparseEsdfSettings;
use super::sparse_esdf::SparseEsdf;
use crate::map::DenseTsdf;

impl<const D: usize> SparseEsdf<D> {
    /// The field of a dense map, which is copied into bricks first: O(cells), a small part of what the transform takes.
    ///
    /// # Panics
    /// Where `max_distance` is not positive.
    pub fn of_tsdf(tsdf: &DenseTsdf<D>, settings: &SparseEsdfSettings) -> Self {
        Self::of(&tsdf.store().into(), settings)
    }
}
