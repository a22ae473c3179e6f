//! A finite box of cells of a lattice, in memory order.

use super::{Aabb, BLOCK_EDGE, BlockKey, Lattice};

/// A box of cells starting at cell 0 of its lattice. Linear index: x fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid<const D: usize> {
    /// Origin and resolution.
    pub lattice: Lattice<D>,
    /// Number of cells along each axis.
    pub shape: [usize; D],
}

impl<const D: usize> Grid<D> {
    /// A grid of `shape` cells whose first cell has its lower corner at `origin` (meters).
    pub fn new(origin: [f64; D], resolution: f64, shape: [usize; D]) -> Self {
        Self { lattice: Lattice::new(origin, resolution), shape }
    }

    /// The smallest grid that covers `bounds`, with its origin at a multiple of the resolution, so that cells of maps with
    /// the same resolution coincide. `None` for a box that is empty or not finite, or that takes more than 2^30 cells along
    /// an axis.
    pub fn covering(bounds: Aabb<D>, resolution: f64) -> Option<Self> {
        let finite = bounds.min.iter().chain(&bounds.max).all(|v| v.is_finite());
        if bounds.is_empty() || !finite || !(resolution > 0.0 && resolution.is_finite()) {
            return None;
        }
        let first = bounds.min.map(|v| (v / resolution).floor());
        let cells: [f64; D] = std::array::from_fn(|k| (bounds.max[k] / resolution).floor() + 1.0 - first[k]);
        let held = cells.iter().all(|&n| n >= 1.0 && n <= f64::from(1u32 << 30));
        held.then(|| Self::new(first.map(|v| v * resolution), resolution, cells.map(|n| n as usize)))
    }

    /// Number of cells; `None` where it overflows.
    pub fn checked_len(&self) -> Option<usize> {
        self.shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s))
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether the grid has no cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bounding box of all cells (world).
    pub fn aabb(&self) -> Aabb<D> {
        self.lattice.aabb([0; D], self.shape.map(|s| s as i32))
    }

    /// Linear index of a cell; `None` outside.
    #[inline(always)]
    pub fn index(&self, cell: [i32; D]) -> Option<usize> {
        let mut i = 0;
        for k in (0..D).rev() {
            // As unsigned, a negative index is too large: one comparison.
            let c = cell[k] as u32 as usize;
            if c >= self.shape[k] {
                return None;
            }
            i = i * self.shape[k] + c;
        }
        Some(i)
    }

    /// The cell at a linear index: the inverse of [`Grid::index`].
    pub fn cell(&self, mut i: usize) -> [i32; D] {
        std::array::from_fn(|k| {
            let c = i % self.shape[k];
            i /= self.shape[k];
            c as i32
        })
    }

    /// Linear index of the cell that contains a world point; `None` outside.
    #[inline(always)]
    pub fn index_of(&self, p_world: [f64; D]) -> Option<usize> {
        self.index(self.lattice.cell_of(p_world)?)
    }

    /// Distance in memory between neighbors along each axis.
    pub fn strides(&self) -> [usize; D] {
        let mut stride = 1;
        std::array::from_fn(|k| {
            let s = stride;
            stride *= self.shape[k];
            s
        })
    }

    /// Number of blocks along each axis; the last one may be partly outside.
    pub fn blocks(&self) -> [usize; D] {
        self.shape.map(|s| s.div_ceil(BLOCK_EDGE))
    }

    /// Whether a block contains at least one cell of the grid.
    #[inline(always)]
    pub fn has_block(&self, key: BlockKey<D>) -> bool {
        (0..D).all(|k| key.0[k] >= 0 && ((key.0[k] as usize) << 3) < self.shape[k])
    }

    /// The `2^D` cells whose centers surround a world point, for multilinear interpolation: the lowest of the cells and the
    /// fraction in `[0, 1)` along each axis. `None` where one of the cells is outside.
    #[inline(always)]
    pub fn interpolation(&self, p_world: [f64; D]) -> Option<([i32; D], [f64; D])> {
        let c = self.lattice.to_cells(p_world);
        let mut base = [0i32; D];
        let mut fraction = [0.0; D];
        for k in 0..D {
            let shifted = c[k] - 0.5;
            // False for NaN; an axis of one cell has no neighbors to interpolate between.
            if !(shifted >= 0.0 && shifted < self.shape[k] as f64 - 1.0) {
                return None;
            }
            base[k] = shifted as i32;
            fraction[k] = shifted - f64::from(base[k]);
        }
        Some((base, fraction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn index_and_cell_are_inverse() {
        let g = Grid::new([0.0; 3], 1.0, [3, 4, 5]);
        for i in 0..g.len() {
            assert_eq!(g.index(g.cell(i)), Some(i));
        }
        assert_eq!(g.index([3, 0, 0]), None);
        assert_eq!(g.index([0, -1, 0]), None);
        assert_eq!(g.strides(), [1, 3, 12]);
        assert_eq!(g.blocks(), [1, 1, 1]);
    }

    #[test]
    fn covering_grids_share_their_lattice() {
        let a = Grid::covering(Aabb::new([-0.12, 3.0], [1.0, 4.0]), 0.05).unwrap();
        let b = Grid::covering(Aabb::new([7.77, -3.0], [8.0, 4.0]), 0.05).unwrap();
        for k in 0..2 {
            let shift = (a.lattice.origin[k] - b.lattice.origin[k]) / 0.05;
            assert!((shift - shift.round()).abs() < 1e-9);
        }
        assert!(a.index_of([-0.12, 3.0]).is_some() && a.index_of([1.0, 4.0]).is_some());
        assert_eq!(Grid::covering(Aabb::new([0.0; 2], [1e30, 1.0]), 0.05), None);
        assert_eq!(Grid::<2>::covering(Aabb::EMPTY, 0.05), None);
        assert_eq!(Grid::covering(Aabb::new([0.0; 2], [1.0; 2]), f64::NAN), None);
    }

    #[test]
    fn interpolation_lives_between_centres() {
        let g = Grid::new([0.0; 2], 1.0, [3, 3]);
        assert_eq!(g.interpolation([0.5, 1.75]), Some(([0, 1], [0.0, 0.25])));
        assert_eq!(g.interpolation([0.4, 1.0]), None);
        assert_eq!(g.interpolation([1.0, 2.5]), None);
        assert_eq!(g.interpolation([f64::NAN, 1.0]), None);
    }
}
