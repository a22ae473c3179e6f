//! What one thread counts of the rays of a scan.

use crate::cell::{HitLengths, LENGTH_UNITS};
use crate::geom::vector::along;
use crate::geom::{BLOCK_EDGE, BlockKey, Lattice, RayWalk};
use crate::sweep::touched::Touched;
use rustc_hash::FxHashMap;

/// A part of a ray that is walked: a start with a cell, a unit vector, a length (meters).
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk<const D: usize> {
    pub(super) start: [f64; D],
    pub(super) direction: [f64; D],
    pub(super) length: f64,
}

/// Hits and lengths of blocks whose cells are told apart, and the length in all cells of others.
#[derive(Clone, Debug)]
pub(super) struct Part<const D: usize> {
    pub(super) cells: Touched<HitLengths, D>,
    pub(super) totals: FxHashMap<BlockKey<D>, u64>,
}

/// Where a ray begins, in cells, and how it goes on, axis by axis: steps of the index and arc length from face to face.
struct Axes<const D: usize> {
    at: [f64; D],
    step: [i32; D],
    delta: [f64; D],
    /// Units of length per meter.
    per_meter: f64,
}

impl<const D: usize> Part<D> {
    pub(super) fn new() -> Self {
        Self { cells: Touched::new(), totals: FxHashMap::default() }
    }

    pub(super) fn clear(&mut self) {
        self.cells.clear();
        self.totals.clear();
    }

    pub(super) fn blocks(&self) -> usize {
        self.cells.keys().len() + self.totals.len()
    }

    /// Takes in what another part counted.
    pub(super) fn add(&mut self, other: &mut Self) {
        other.cells.sort();
        for (i, key) in other.cells.keys().iter().enumerate() {
            self.cells.of_cell(key.first_cell()).add(other.cells.evidence(i));
        }
        for (key, total) in &other.totals {
            *self.totals.entry(*key).or_default() += total;
        }
    }

    /// Adds the length of a ray, block by block, and cell by cell where `fine` says so.
    ///
    /// Places along the ray are rounded, not lengths: what a cell loses its neighbor gains.
    pub(super) fn walk(&mut self, lattice: &Lattice<D>, walk: &Walk<D>, fine: &impl Fn(BlockKey<D>) -> bool) {
        let blocks = Lattice::new(lattice.origin, BLOCK_EDGE as f64 * lattice.resolution);
        let Some(mut at) = RayWalk::new(&blocks, walk.start, walk.direction) else { return };
        let axes = Axes::new(lattice, walk);
        let (mut entry, mut before) = (0.0, 0u32);
        loop {
            let (key, exit) = (BlockKey(at.cell()), at.exit().min(walk.length));
            if fine(key) {
                let point = lattice.to_cells(along(walk.start, walk.direction, entry));
                let (_, lengths) = self.cells.of_cell(key.first_cell()).planes_mut();
                before = axes.add_cells(lengths, key, point, exit, before);
            } else {
                let place = axes.place(exit);
                if place > before {
                    *self.totals.entry(key).or_default() += u64::from(place - before);
                    before = place;
                }
            }
            if at.exit() >= walk.length {
                return;
            }
            entry = exit;
            at.advance();
        }
    }
}

impl<const D: usize> Axes<D> {
    fn new(lattice: &Lattice<D>, walk: &Walk<D>) -> Self {
        let (mut step, mut delta) = ([0; D], [f64::INFINITY; D]);
        for k in 0..D {
            // A component whose inverse overflows counts as zero, as in `RayWalk`.
            let inverse = lattice.resolution / walk.direction[k].abs();
            if inverse.is_finite() {
                step[k] = if walk.direction[k] > 0.0 { 1 } else { -1 };
                delta[k] = inverse;
            }
        }
        let per_meter = f64::from(LENGTH_UNITS) / lattice.resolution;
        Self { at: lattice.to_cells(walk.start), step, delta, per_meter }
    }

    /// A place along the ray in units of length.
    #[inline(always)]
    fn place(&self, arc: f64) -> u32 {
        (arc * self.per_meter + 0.5) as u32
    }

    /// Adds the lengths in a block's cells, from `point` (cells) where the ray enters it up to where it leaves it, `exit`.
    #[inline(always)]
    fn add_cells(
        &self,
        lengths: &mut [u32],
        key: BlockKey<D>,
        point: [f64; D],
        exit: f64,
        mut before: u32,
    ) -> u32 {
        let edge = BLOCK_EDGE as i32;
        let low = key.first_cell();
        let (mut cell, mut next, mut index) = ([0i32; D], [f64::INFINITY; D], 0i32);
        for k in (0..D).rev() {
            // Rounding may put the point beside the block: it is on its face then.
            let inside = (point[k] - f64::from(low[k])).clamp(0.0, f64::from(edge) - 0.5);
            cell[k] = inside as i32;
            index = index * edge + cell[k];
            if self.step[k] != 0 {
                let face = f64::from(low[k] + cell[k] + i32::from(self.step[k] > 0));
                next[k] = self.delta[k] * (face - self.at[k]) * f64::from(self.step[k]);
            }
        }
        loop {
            let mut axis = 0;
            for k in 1..D {
                axis = if next[k] < next[axis] { k } else { axis };
            }
            let arc = next[axis];
            let place = self.place(arc.min(exit));
            if place > before {
                if let Some(length) = lengths.get_mut(index as usize) {
                    *length = length.saturating_add(place - before);
                }
                before = place;
            }
            cell[axis] += self.step[axis];
            if arc >= exit || !(0..edge).contains(&cell[axis]) {
                return before;
            }
            index += self.step[axis] * edge.pow(axis as u32);
            next[axis] += self.delta[axis];
        }
    }
}
