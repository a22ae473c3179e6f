//! What a field holds of one brick.

use super::cell_mask::CellMask;
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
    /// Squared distance (cells) to the nearest obstacle that is a point; `None`: all beyond the largest distance.
    pub(crate) points: Option<Arc<[f32]>>,
}

/// What the accurate transform found, for all cells of a brick, observed or not.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Nearest {
    /// `min over crossings w of |q - w|^2 + h_w`, squared cells; infinite beyond the largest distance.
    pub(crate) power: Box<[f32]>,
    /// The edge of that crossing, as a feature, [`Feature::NONE`](super::transform::Feature::NONE) beyond it.
    pub(crate) feature: Box<[u32]>,
}

/// Which cells of a brick were observed, which of them are inside of the surface, and which are obstacles as points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sides {
    observed: CellMask,
    inside: CellMask,
    pub(super) points: CellMask,
    /// Cells of which a map says that something stops beams there.
    pub(super) said: CellMask,
}

impl Sides {
    /// Of a brick of the map; no cell is a point.
    pub(super) fn of(brick: &DistanceBrick, min_weight: f32) -> Self {
        let mut sides = Self::default();
        let cells = brick.distances().chunks(64).zip(brick.weights().chunks(64));
        for (word, (distances, weights)) in cells.enumerate() {
            for (bit, (&d, &w)) in distances.iter().zip(weights).enumerate() {
                let observed = (w > 0.0) & (w >= min_weight);
                sides.observed.0[word] |= u64::from(observed) << bit;
                sides.inside.0[word] |= u64::from(observed & (d < 0.0)) << bit;
            }
        }
        sides
    }

    /// The same, with the points of another state.
    pub(super) fn with_points_of(self, other: &Self) -> Self {
        Self { points: other.points, said: other.said, ..self }
    }

    /// Whether something is known of a cell: it was observed, or something stops beams there.
    #[inline(always)]
    pub(crate) fn known(&self, i: usize) -> bool {
        self.observed.has(i) | self.points.has(i) | self.said.has(i)
    }

    /// Whether a cell was observed inside of the surface.
    #[inline(always)]
    pub(crate) fn inside(&self, i: usize) -> bool {
        self.inside.has(i)
    }

    /// Cells that were observed inside of the surface.
    pub(super) fn inside_cells(&self) -> CellMask {
        self.inside
    }

    /// Whether a cell was observed.
    #[inline(always)]
    pub(super) fn observed(&self, i: usize) -> bool {
        self.observed.has(i)
    }

    /// Whether a cell was observed in free space.
    #[inline(always)]
    pub(super) fn free(&self, i: usize) -> bool {
        self.observed.has(i) & !self.inside.has(i)
    }

    /// Cells that were not observed.
    pub(super) fn unobserved<const D: usize>(&self) -> CellMask {
        self.observed.others::<D>()
    }

    /// Whether some cell was observed.
    pub(super) fn any(&self) -> bool {
        self.observed.any()
    }

    /// Whether the same cells were observed.
    pub(super) fn same_cells(&self, other: &Self) -> bool {
        self.observed == other.observed
    }
}

impl EsdfBrick {
    /// A brick of which nothing is solved yet.
    pub(super) fn new(sides: Sides) -> Self {
        Self { distance: Arc::default(), sides: Arc::new(sides), nearest: None, unknown: None, points: None }
    }

    /// Bytes held, shared or not.
    pub(super) fn bytes(&self) -> usize {
        let plane = self.distance.get().map_or(0, |d| size_of_val(&**d));
        let nearest = self.nearest.iter().map(|n| size_of_val(&*n.power) + size_of_val(&*n.feature));
        let planes = self.unknown.iter().chain(&self.points).map(|plane| size_of_val(&**plane));
        size_of::<Self>() + size_of::<Sides>() + plane + nearest.chain(planes).sum::<usize>()
    }
}
