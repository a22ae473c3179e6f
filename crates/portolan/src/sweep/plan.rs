//! What a plan of a scan is given, and what it returns.

use crate::geom::Aabb;
use crate::scan::{BeamCounts, RefusedBeams};

/// Rays and reaches of more cells than this are refused: one reading of 10^8 m must not cost what a million others do.
/// At cells of 5 cm these are 52 km.
pub const LONGEST_RAY_CELLS: f64 = (1u32 << 20) as f64;

/// What a plan may use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanLimits<const D: usize> {
    /// Box in which cells may change (world, metres); `None`: everywhere.
    pub bounds: Option<Aabb<D>>,
    /// Most blocks that the plan may hold.
    pub most_blocks: usize,
    /// Whether colors are looked up too, where the scan has them.
    pub colors: bool,
}

impl<const D: usize> Default for PlanLimits<D> {
    /// Everywhere, any number of blocks, no colors.
    fn default() -> Self {
        Self { bounds: None, most_blocks: usize::MAX, colors: false }
    }
}

/// What became of a planned scan's readings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlannedScan {
    /// Readings by what they do to the map.
    pub beams: BeamCounts,
    /// Readings that are not used, by cause; those that were refused when the scan was built are among them.
    pub refused: RefusedBeams,
    /// Surfaces outside of the bounds.
    pub hits_outside: u64,
}

/// Why a scan cannot be swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A range image contradicts itself: see [`crate::scan::RangeImage::check`].
    #[error("a range image cannot be used: {0}")]
    BadImage(&'static str),
    /// The scan reaches into more blocks than [`PlanLimits::most_blocks`], or than can be searched.
    #[error("the scan reaches into too many blocks")]
    TooManyBlocks,
}
