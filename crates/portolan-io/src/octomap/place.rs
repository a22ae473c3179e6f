//! Where OctoMap has its cells: about the world's zero, 65,536 along each axis.

use std::borrow::Cow;
use std::path::Path;

use portolan::cell::LogOddsValue;
use portolan::store::{Store, Tree};

use super::{DEPTH, HALF};
use crate::{IoError, Result};

/// How far an origin may be from a multiple of the resolution (cells).
const OFF: f64 = 1e-6;

/// The tree in OctoMap's place and depth.
pub(super) fn placed<'a, V: LogOddsValue>(tree: &'a Tree<V, 3>, path: &Path) -> Result<Cow<'a, Tree<V, 3>>> {
    let (origin, resolution) = (tree.lattice().origin, tree.lattice().resolution);
    if !(1e-9..=1e9).contains(&resolution) {
        let value = format!("{resolution} m");
        return Err(IoError::unwritable(path, "the resolution", value, "give metres, above zero"));
    }
    let shift = origin.map(|v| v / resolution);
    let nearest = shift.map(f64::round);
    if !(0..3).all(|k| (shift[k] - nearest[k]).abs() <= OFF) {
        let value = format!("{origin:?} m");
        let advice = format!(
            "OctoMap's cells start at the world's origin: give an origin that is a multiple of the resolution ({resolution} m)"
        );
        return Err(IoError::unwritable(path, "the origin of the map", value, advice));
    }
    let (low, high) = tree.extent().unwrap_or(([0; 3], [0; 3]));
    let world = |cell: [i32; 3]| -> [f64; 3] { std::array::from_fn(|k| f64::from(cell[k]) + nearest[k]) };
    let half = f64::from(HALF);
    let (low_world, high_world) = (world(low), world(high));
    if !(0..3).all(|k| low_world[k] >= -half && high_world[k] <= half) {
        let value = format!("from {low_world:?} to {high_world:?} cells");
        let advice = format!(
            "OctoMap holds cells from -{HALF} to {HALF}: choose a coarser resolution or move the map to the world's origin"
        );
        return Err(IoError::unwritable(path, "the observed box", value, advice));
    }
    let first = nearest.map(|v| (-half - v) as i32);
    if first == [0; 3] && tree.depth() == DEPTH {
        return Ok(Cow::Borrowed(tree));
    }
    // Cannot fail: the box was checked. A tree without leaves fits anywhere.
    let moved = tree.moved_to(first, DEPTH);
    moved.map(Cow::Owned).ok_or_else(|| {
        IoError::unwritable(path, "the depth of the map", tree.depth(), "give one from 3 to 28")
    })
}
