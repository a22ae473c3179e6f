//! What the plan of a scan may use, and why there may be none.

use crate::geom::Aabb;

/// Rays and reaches of more cells than this are refused: one reading of 10^8 m must not cost what a million others do.
/// At cells of 5 cm these are 52 km.
pub const LONGEST_RAY_CELLS: f64 = (1u32 << 20) as f64;

/// How far a sweep follows beams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanLimits<const D: usize> {
    /// Beams are followed only inside this box (world, meters); `None`: everywhere.
    pub bounds: Option<Aabb<D>>,
    /// No scan may touch more blocks than this.
    pub most_blocks: usize,
}

impl<const D: usize> Default for PlanLimits<D> {
    fn default() -> Self {
        Self { bounds: None, most_blocks: usize::MAX }
    }
}

impl<const D: usize> PlanLimits<D> {
    /// Limits that follow beams only inside a box (world, meters).
    pub fn inside(bounds: Aabb<D>) -> Self {
        Self { bounds: Some(bounds), ..Self::default() }
    }

    /// The bounds as a box; without bounds an infinite one.
    pub fn bounds_or_everywhere(&self) -> Aabb<D> {
        self.bounds.unwrap_or(Aabb::new([f64::NEG_INFINITY; D], [f64::INFINITY; D]))
    }
}

/// Why a scan cannot be swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A range image contradicts itself: see [`crate::scan::RangeImage::check`].
    #[error("a range image cannot be used: {0}")]
    BadImage(&'static str),
    /// The scan reaches into more blocks than [`PlanLimits::most_blocks`], or than can be searched.
    #[error("the scan reaches into too many blocks of cells")]
    TooManyBlocks,
}
