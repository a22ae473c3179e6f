//! What a field holds of one brick.

use crate::cell::DistanceBrick;
use std::sync::{Arc, OnceLock};

/// Planes of a brick's cells, x fastest, shared with snapshots until they are made anew.
#[derive(Clone, Debug)]
pub(crate) struct EsdfBrick {
    /// Signed distance (meters); infinite, with the side's sign, beyond the largest distance; NaN: unknown. By the
    /// accurate method it is measured when it is read for the first time, by whichever snapshot:
    /// [`super::Esdf::brick`] is the way to it.
    pub(super) distance: Arc<OnceLock<Box<[f32]>>>,
    pub(crate) sides: Arc<Sides>,
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
    /// The edge of that crossing, as a feature, [`Feature::NONE`](super::transform::Feature::NONE) beyond it.
    pub(crate) feature: Box<[u32]>,
}

/// Which cells of a brick were observed, and which of them are inside of the surface: a bit each, 64 a word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sides {
    observed: [u64; 8],
    inside: [u64; 8],
}

impl Sides {
    /// Of a brick of the map.
    pub(super) fn of(brick: &DistanceBrick, min_weight: f32) -> Self {
        let mut sides = Self::default();
        let cells = brick.distances().chunks(64).zip(brick.weights().chunks(64));
        for (word, (distances, weights)) in cells.enumerate() {
            for (bit, (&d, &w)) in distances.iter().zip(weights).enumerate() {
                let observed = (w > 0.0) & (w >= min_weight);
                sides.observed[word] |= u64::from(observed) << bit;
                sides.inside[word] |= u64::from(observed & (d < 0.0)) << bit;
            }
        }
        sides
    }

    /// Whether a cell was observed.
    #[inline(always)]
    pub(crate) fn observed(&self, i: usize) -> bool {
        self.observed[i >> 6] >> (i & 63) & 1 == 1
    }

    /// Whether a cell was observed inside of the surface.
    #[inline(always)]
    pub(crate) fn inside(&self, i: usize) -> bool {
        self.inside[i >> 6] >> (i & 63) & 1 == 1
    }

    /// Whether some cell was observed.
    pub(super) fn any(&self) -> bool {
        self.observed != [0; 8]
    }

    /// Whether the same cells were observed.
    pub(super) fn same_cells(&self, other: &Self) -> bool {
        self.observed == other.observed
    }
}

impl EsdfBrick {
    /// A brick of which nothing is solved yet.
    pub(super) fn new(sides: Sides) -> Self {
        Self { distance: Arc::default(), sides: Arc::new(sides), nearest: None, unknown: None }
    }

    /// Bytes held, shared or not.
    pub(super) fn bytes(&self) -> usize {
        let plane = self.distance.get().map_or(0, |d| size_of_val(&**d));
        let nearest = self.nearest.iter().map(|n| size_of_val(&*n.power) + size_of_val(&*n.feature));
        let unknown = self.unknown.iter().map(|u| size_of_val(&**u));
        size_of::<Self>() + size_of::<Sides>() + plane + nearest.chain(unknown).sum::<usize>()
    }
}
