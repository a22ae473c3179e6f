//! Why a map cannot be made.

use crate::cell::{OccupancyModelError, TsdfRuleError};
use crate::geom::{Grid, Lattice};
use crate::store::StoreFull;
use crate::sweep::PlanError;

/// What is wrong with a map's settings.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// The resolution is no length.
    #[error("resolution must be a positive, finite length in meters, got {0}")]
    Resolution(f64),
    /// The origin is no point.
    #[error("origin must be finite, got {0}")]
    Origin(f64),
    /// The origin is so far from zero that numbers do not tell cells apart.
    #[error(
        "the origin {origin} is more than 2^45 cells of {resolution} m from zero, where numbers do not tell cells apart: move \
         it nearer to zero, or make cells larger"
    )]
    FarOrigin {
        /// Of one axis (meters).
        origin: f64,
        /// Edge of a cell (meters).
        resolution: f64,
    },
    /// The box has no cell, or more than a dense map may have.
    #[error("a dense map of {cells} cells is not possible: between 1 and {limit} cells are")]
    Cells {
        /// Number of cells asked for (saturated).
        cells: usize,
        /// The largest number possible.
        limit: usize,
    },
    /// The tree's depth is out of range.
    #[error("tree depth {0} is not between 3 and 28")]
    Depth(u32),
    /// The weight of free space is not between 0 and 1.
    #[error("carve_weight must be above 0 and at most 1, got {0}")]
    CarveWeight(f32),
    /// The ranges that are used are none, or reach further than a scan is searched.
    #[error(
        "ranges from {min} to {max} m are not possible: need 0 <= min < max, and max below {most} m at this resolution"
    )]
    Ranges {
        /// Smallest range used (meters).
        min: f64,
        /// Largest range used (meters).
        max: f64,
        /// Limit at this resolution (meters).
        most: f64,
    },
    /// The largest Euclidean distance is no length.
    #[error("max_distance must be a positive, finite length in meters, got {0}")]
    MaxDistance(f64),
    /// A range image contradicts itself.
    #[error("a range image cannot be used: {0}")]
    Image(&'static str),
    /// Distances and colors lie on different lattices.
    #[error("the lattices of distances and colors differ")]
    Lattices,
    /// The map would need more memory than it may have.
    #[error(transparent)]
    Full(#[from] StoreFull),
    /// One scan reaches further than can be searched, whatever memory there is.
    #[error(
        "one scan reaches into more than {bricks} blocks of 8 cells an edge: limit the range that is used, or make cells larger"
    )]
    TooFar {
        /// Blocks that a scan may touch.
        bricks: usize,
    },
    /// The occupancy model is not valid.
    #[error(transparent)]
    Model(#[from] OccupancyModelError),
    /// The fusion filter's settings are not valid.
    #[error(transparent)]
    Rule(#[from] TsdfRuleError),
}

/// Blocks that one scan may touch at most.
const MOST_BLOCKS: usize = 1 << 26;

/// Blocks that one scan may touch where a store may hold `limit` bytes and a touched one costs `bytes`: many may turn out
/// to be unobserved, and the first few are free, but the search ends before it alone takes the memory.
pub(super) fn most_blocks(limit: usize, bytes: usize) -> usize {
    (limit / bytes).saturating_add(4096).min(MOST_BLOCKS)
}

/// The map's error for a scan that cannot be planned, in a store that holds `bytes` of `limit`.
pub(super) fn too_many(error: PlanError, most: usize, limit: usize, bytes: usize) -> MapError {
    match error {
        PlanError::BadImage(why) => MapError::Image(why),
        PlanError::TooManyBlocks if most == MOST_BLOCKS || limit == usize::MAX => {
            MapError::TooFar { bricks: most }
        }
        PlanError::TooManyBlocks => MapError::Full(StoreFull { limit, bytes }),
    }
}

/// Dense maps stop here: 2^31 cells are 16 GiB of distances and weights. Callers with less memory check the
/// size of a grid before they make a map of it.
const DENSE_LIMIT: usize = 1 << 31;

/// Checks that a dense map of this grid can be made.
pub(super) fn check_grid<const D: usize>(grid: &Grid<D>) -> Result<(), MapError> {
    check_lattice(&grid.lattice)?;
    match grid.checked_len() {
        Some(1..=DENSE_LIMIT) => Ok(()),
        cells => Err(MapError::Cells { cells: cells.unwrap_or(usize::MAX), limit: DENSE_LIMIT }),
    }
}

/// Checks that a lattice has cells.
pub(super) fn check_lattice<const D: usize>(lattice: &Lattice<D>) -> Result<(), MapError> {
    if !(lattice.resolution > 0.0 && lattice.resolution.is_finite()) {
        return Err(MapError::Resolution(lattice.resolution));
    }
    if let Some(&bad) = lattice.origin.iter().find(|v| !v.is_finite()) {
        return Err(MapError::Origin(bad));
    }
    match lattice.origin.iter().find(|v| v.abs() / lattice.resolution > FARTHEST_CELLS) {
        Some(&origin) => Err(MapError::FarOrigin { origin, resolution: lattice.resolution }),
        None => Ok(()),
    }
}

/// Cells between a lattice's origin and zero. From there on the places that an `f64` has are more than a 128th of a cell apart,
/// and maps that compute the same cell in different ways begin to differ.
const FARTHEST_CELLS: f64 = (1u64 << 45) as f64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_that_numbers_do_not_tell_apart_are_refused() {
        let check = |origin: f64| check_lattice(&Lattice::new([0.0, origin], 0.5));
        check(-FARTHEST_CELLS * 0.5).unwrap();
        check(4e6).unwrap();
        let said = check(FARTHEST_CELLS * 0.500001).unwrap_err().to_string();
        assert!(said.contains("cells of 0.5 m from zero"), "{said}");
        assert!(matches!(check(f64::INFINITY), Err(MapError::Origin(_))));
    }
}
