//! A ray from cell to cell, and how it ends.

use super::GainSettings;
use super::cells::Known;
use crate::geom::{Lattice, RayWalk};
use crate::sweep::clip;

/// Longest ray (cells).
const FARTHEST: f64 = 1e5;

/// Stretches that are shorter (cells) are rounding.
const LEAST: f64 = 1e-9;

/// How a ray ends.
pub(super) enum End {
    Hit,
    Unknown,
    Outside,
    Free,
}

/// The part of a ray in a cell.
pub(super) struct Stretch {
    /// All of it (meters).
    pub(super) length: f64,
    /// What lies within the bounds (meters).
    pub(super) inside: f64,
    /// Whether the cell counts as crossed within the bounds.
    pub(super) counts: bool,
}

/// Visits the cells that a ray (world, unit direction) crosses up to the largest range or to where it leaves the bounds. The
/// visitor says what is in a cell, or that the ray ends there. A cell that is only touched, at a corner or beyond the bounds
/// by rounding, is not visited.
pub(super) fn follow<const D: usize>(
    lattice: &Lattice<D>,
    origin: [f64; D],
    direction: [f64; D],
    settings: &GainSettings<D>,
    mut visit: impl FnMut([i32; D], Stretch) -> Result<Known, End>,
) -> End {
    // Where one of the two is NaN, `min` returns the other.
    let range = settings.max_range.min(FARTHEST * lattice.resolution);
    let part = match &settings.bounds {
        Some(bounds) => clip(bounds, origin, direction, f64::INFINITY),
        None => Some((0.0, f64::INFINITY)),
    };
    let (Some((enter, leave)), Some(mut walk)) = (part, RayWalk::new(lattice, origin, direction)) else {
        return End::Outside;
    };
    let (end, least) = (range.min(leave), LEAST * lattice.resolution);
    let mut at = 0.0;
    loop {
        let exit = walk.exit().min(end);
        let (length, inside) = (exit - at, exit - f64::max(at, enter));
        let found = if length > least {
            match visit(walk.cell(), Stretch { length, inside, counts: inside > least }) {
                Ok(found) => found,
                Err(end) => return end,
            }
        } else {
            Known::Free
        };
        // False only for what is not a number.
        if !(exit < end) {
            return match found {
                _ if leave < range => End::Outside,
                Known::Unknown => End::Unknown,
                _ => End::Free,
            };
        }
        at = exit;
        walk.advance();
    }
}
