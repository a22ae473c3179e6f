//! What a field holds of one brick.

use std::sync::Arc;

/// Planes of a brick's cells, x fastest, shared with snapshots until they are made anew.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EsdfBrick {
    /// Signed distance (metres); infinite, with the side's sign, beyond the largest distance; NaN: unknown.
    pub(crate) distance: Arc<[f32]>,
    /// Of the accurate method.
    pub(crate) nearest: Option<Arc<Nearest>>,
    /// Squared distance (cells) to the nearest unknown cell as a box, where it is kept; infinite beyond the largest
    /// distance, 0 for unknown cells.
    pub(crate) unknown: Option<Arc<[f32]>>,
}

/// What the accurate transform found, for all cells of a brick, observed or not.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Nearest {
    /// `min over crossings w of |q - w|^2 + h_w`, squared cells; infinite beyond the largest distance.
    pub(crate) power: Box<[f32]>,
    /// The edge of that crossing, as a [`super::feature::Feature`]; [`super::feature::Feature::NONE`] beyond it.
    pub(crate) feature: Box<[u32]>,
}

impl EsdfBrick {
    /// Bytes held, shared or not.
    pub(super) fn bytes(&self) -> usize {
        let plane = size_of_val(&*self.distance);
        let nearest = self.nearest.iter().map(|n| size_of_val(&*n.power) + size_of_val(&*n.feature));
        let unknown = self.unknown.iter().map(|u| size_of_val(&**u));
        size_of::<Self>() + plane + nearest.chain(unknown).sum::<usize>()
    }
}
