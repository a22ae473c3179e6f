//! Which cells are obstacles without being surface.

use crate::cell::SignedDistance;
use crate::field::Esdf;
use crate::field::esdf::TOGETHER;
use crate::field::esdf::bricks::Sides;
use crate::field::esdf::cell_mask::CellMask;
use crate::field::esdf::surface::simplex_distance_sq;
use crate::geom::BlockKey;
use crate::parallel;
use crate::store::Bricks;
use std::sync::Arc;

/// An element within so many cells of a cell's center explains what was hit there. With less, cells beside walls thicken them,
/// with more, what stands before a wall is lost: chosen on Freiburg 079 and, in 3-D, on the red kitchen
/// (`docs/WHAT-MAPS-DO-NOT-KNOW.md`). In 3-D a hit may be farther from the center of its cell.
const fn explained<const D: usize>() -> f64 {
    if D == 2 { 1.4 } else { 0.8 }
}

/// A cell inside of the surface is within its own estimate of it, and this many cells: half a diagonal of a 3-D cell, and
/// as much for what a mean of distances along rays is short of the distance to what was extracted.
const BEYOND_ESTIMATE: f32 = 1.75;

/// Why the center of a cell is an obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointKind {
    /// Something stops beams there, and no surface is within 1.4 cells (2-D) or 0.8 cells (3-D).
    Thin,
    /// It is inside of the surface by its own estimate, and there is no surface that it is behind of.
    Loose,
}

impl PointKind {
    /// In one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Thin => "thin",
            Self::Loose => "loose",
        }
    }
}

impl<const D: usize> Esdf<D> {
    /// The cells whose centers are obstacles beside the surface, ascending by bricks. None but by the accurate method.
    pub fn point_obstacles(&self) -> impl Iterator<Item = ([i32; D], PointKind)> + '_ {
        self.keys().into_iter().flat_map(|key| {
            let sides = self.slot(key).map(|slot| *self.bricks[slot].sides).unwrap_or_default();
            let kind = move |i| if sides.said.has(i) { PointKind::Thin } else { PointKind::Loose };
            sides.points.cells().map(move |i| (key.cell(i), kind(i)))
        })
    }

    /// Finds the points of bricks (ascending) again; returns the bricks whose points are not what they were.
    pub(in crate::field::esdf) fn find_points(
        &mut self,
        store: &Bricks<SignedDistance, D>,
        keys: &[BlockKey<D>],
    ) -> Vec<BlockKey<D>> {
        let found = parallel::map(keys, TOGETHER, |&key| self.points_of(store, key));
        let mut changed = Vec::new();
        for (&key, found) in keys.iter().zip(found) {
            let Some((slot, sides)) = self.slot(key).zip(found) else { continue };
            if *self.bricks[slot].sides != sides {
                self.bricks[slot].sides = Arc::new(sides);
                changed.push(key);
            }
        }
        changed
    }

    /// What is known of a brick's cells, with points found again.
    fn points_of(&self, store: &Bricks<SignedDistance, D>, key: BlockKey<D>) -> Option<Sides> {
        let slot = self.slot(key)?;
        let mut sides = *self.bricks[slot].sides;
        let (inside, said) = (sides.inside_cells(), self.candidates.get(&key).copied().unwrap_or_default());
        (sides.points, sides.said) = (CellMask::default(), said);
        said.cells().filter(|&i| !self.is_explained(key.cell(i))).for_each(|i| sides.points.set(i));
        let distances = store.brick(key).map_or(&[][..], |brick| brick.distances());
        for i in inside.cells() {
            let is_lost = || distances.get(i).is_some_and(|&d| self.is_lost(slot, i, d));
            if self.is_torn_off(key, i) || is_lost() && !self.is_part_of_solid(key, i) {
                sides.points.set(i);
            }
        }
        Some(sides)
    }

    /// Whether an element of the surface is so near to the center of a cell that it is what was hit there.
    fn is_explained(&self, cell: [i32; D]) -> bool {
        // The cells between nodes that reach within that far.
        let around = explained::<D>().ceil() as i32;
        let edge = 2 * around as usize;
        (0..edge.pow(D as u32)).any(|n| {
            let lower: [i32; D] =
                std::array::from_fn(|k| cell[k] - around + (n / edge.pow(k as u32) % edge) as i32);
            let p = std::array::from_fn(|k| f64::from(cell[k] - lower[k]));
            self.surface.cell(lower).iter().any(|s| simplex_distance_sq(p, s) <= explained::<D>().powi(2))
        })
    }

    /// Whether a cell inside of the surface has a free cell beside it and no surface in between, because a corner of every
    /// cell around that edge was not observed.
    fn is_torn_off(&self, key: BlockKey<D>, i: usize) -> bool {
        let cell = key.cell(i);
        self.beside(key, i).any(|(axis, beside, sides)| {
            let free = sides.is_some_and(|sides| sides.free(BlockKey::offset(beside)));
            free && !self.is_crossed(if beside[axis] > cell[axis] { cell } else { beside }, axis)
        })
    }

    /// Whether a lost cell is of a solid that was observed up to its surface: a cell beside it is inside, too, and nearer to
    /// the surface. Where no surface is within reach, whether all cells beside it are inside.
    fn is_part_of_solid(&self, key: BlockKey<D>, i: usize) -> bool {
        let power = |cell: [i32; D]| {
            let slot = self.slot(BlockKey::of_cell(cell))?;
            Some(self.bricks[slot].nearest.as_ref()?.power[BlockKey::offset(cell)])
        };
        let own = power(key.cell(i)).unwrap_or(f32::INFINITY);
        let mut beside = self.beside(key, i).map(|(_, cell, sides)| {
            (cell, sides.is_some_and(|sides| sides.inside_cells().has(BlockKey::offset(cell))))
        });
        if own == f32::INFINITY {
            return beside.all(|(_, inside)| inside);
        }
        beside.any(|(cell, inside)| inside && power(cell).is_some_and(|p| p < own))
    }

    /// The `2 D` cells beside one, with the axis and what is known of their brick.
    fn beside(&self, key: BlockKey<D>, i: usize) -> impl Iterator<Item = (usize, [i32; D], Option<&Sides>)> {
        let cell = key.cell(i);
        (0..D).flat_map(|axis| [(axis, -1), (axis, 1)]).map(move |(axis, step)| {
            let mut beside = cell;
            beside[axis] += step;
            let slot = self.slot(BlockKey::of_cell(beside));
            (axis, beside, slot.map(|slot| &*self.bricks[slot].sides))
        })
    }

    /// Whether the surface crosses the edge from a cell to the next one along an axis.
    fn is_crossed(&self, start: [i32; D], axis: usize) -> bool {
        let crossings = self.surface.brick(BlockKey::of_cell(start));
        crossings.is_some_and(|c| c.height[axis][BlockKey::offset(start)] < f32::INFINITY)
    }

    /// Whether a cell inside of the surface, which is `-distance` away by its own estimate (meters), is farther than that
    /// from any. So is the middle of a solid that was observed all through, where estimates are truncated.
    fn is_lost(&self, slot: usize, i: usize, distance: f32) -> bool {
        let Some(nearest) = &self.bricks[slot].nearest else { return true };
        let estimate = (distance / self.lattice.resolution as f32).abs() + BEYOND_ESTIMATE;
        // Beyond what is maintained nothing was looked for.
        estimate * estimate < self.limit() && nearest.power[i] > estimate * estimate
    }
}

/// The bricks of `keys` and all that touch them, ascending.
pub(in crate::field::esdf) fn with_neighbors<const D: usize>(keys: &[BlockKey<D>]) -> Vec<BlockKey<D>> {
    let around = |key: &BlockKey<D>, n: usize| {
        BlockKey(std::array::from_fn(|k| key.0[k] + (n / 3usize.pow(k as u32) % 3) as i32 - 1))
    };
    let mut all: Vec<_> =
        keys.iter().flat_map(|key| (0..3usize.pow(D as u32)).map(move |n| around(key, n))).collect();
    all.sort_unstable();
    all.dedup();
    all
}
