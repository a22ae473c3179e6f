//! The box of cells that a map may change.

use super::{Aabb, BlockKey, Lattice, block_cells};

/// Cells from `first` to `last`, both included, along each axis; empty where `last` lies below `first`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellBox<const D: usize> {
    first: [i32; D],
    last: [i32; D],
}

/// Cell indices beyond these are brought to them.
const LIMIT: f64 = (1u32 << 29) as f64;

impl<const D: usize> CellBox<D> {
    /// The cells that hold the two corners of a world box and all between them. Empty where the box is empty or not a
    /// number.
    pub fn covering(bounds: &Aabb<D>, lattice: &Lattice<D>) -> Self {
        Self::of(bounds, lattice, f64::floor, f64::floor)
    }

    /// The cells whose center lies in a world box, its faces included.
    pub fn of_centers(bounds: &Aabb<D>, lattice: &Lattice<D>) -> Self {
        Self::of(bounds, lattice, |v| (v - 0.5).ceil(), |v| (v - 0.5).floor())
    }

    fn of(
        bounds: &Aabb<D>,
        lattice: &Lattice<D>,
        first: impl Fn(f64) -> f64,
        last: impl Fn(f64) -> f64,
    ) -> Self {
        if bounds.is_empty() {
            return Self { first: [0; D], last: [-1; D] };
        }
        let cell =
            |p, snap: &dyn Fn(f64) -> f64| lattice.to_cells(p).map(|v| snap(v).clamp(-LIMIT, LIMIT) as i32);
        Self { first: cell(bounds.min, &first), last: cell(bounds.max, &last) }
    }

    /// World box of the cells.
    pub fn aabb(&self, lattice: &Lattice<D>) -> Aabb<D> {
        lattice.aabb(self.first, self.last.map(|v| v + 1))
    }

    /// Whether a cell lies in the box.
    #[inline]
    pub fn contains(&self, cell: [i32; D]) -> bool {
        (0..D).all(|k| self.first[k] <= cell[k] && cell[k] <= self.last[k])
    }

    /// Whether all cells of a block do.
    pub fn contains_block(&self, key: BlockKey<D>) -> bool {
        self.contains(key.first_cell()) && self.contains(key.cell(block_cells::<D>() - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes_of_cells<const D: usize>() {
        let lattice = Lattice::new([0.0; D], 0.5);
        let world = Aabb::new([-1.2; D], [2.0; D]);
        let (covering, centers) =
            (CellBox::covering(&world, &lattice), CellBox::of_centers(&world, &lattice));
        for n in 0..12i32.pow(D as u32) {
            let cell: [i32; D] = std::array::from_fn(|k| n / 12i32.pow(k as u32) % 12 - 6);
            let corner = lattice.aabb(cell, cell.map(|v| v + 1));
            let touches = (0..D).all(|k| corner.max[k] > world.min[k] && corner.min[k] <= world.max[k]);
            assert_eq!(covering.contains(cell), touches, "{cell:?}");
            assert_eq!(centers.contains(cell), world.contains(lattice.center(cell)), "{cell:?}");
        }
        assert!(!CellBox::covering(&Aabb::EMPTY, &lattice).contains([0; D]));
        let all = CellBox::covering(&Aabb::new([f64::NEG_INFINITY; D], [f64::INFINITY; D]), &lattice);
        assert!(all.contains_block(BlockKey([9; D])));
        assert!(!covering.contains_block(BlockKey([0; D])) && !covering.contains_block(BlockKey([-1; D])));
    }

    #[test]
    fn boxes_of_cells_2d_and_3d() {
        boxes_of_cells::<2>();
        boxes_of_cells::<3>();
    }
}
