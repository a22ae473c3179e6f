//! Checks that maps in bricks share.

use super::MapError;
use crate::geom::Lattice;

/// Checks that bricks can lie on this lattice.
pub(super) fn check_lattice(lattice: &Lattice<3>) -> Result<(), MapError> {
    if !(lattice.resolution > 0.0 && lattice.resolution.is_finite()) {
        return Err(MapError::Resolution(lattice.resolution));
    }
    match lattice.origin.iter().find(|v| !v.is_finite()) {
        Some(&bad) => Err(MapError::Origin(bad)),
        None => Ok(()),
    }
}

/// Blocks that one scan may see, of which many may turn out to be silent: the search for them ends before their list alone
/// takes the memory.
pub(super) fn most_blocks(limit: usize) -> usize {
    (limit / 1024).saturating_add(4096).min(1 << 26)
}
