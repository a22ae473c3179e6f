//! A dense array of cells.

use super::dense_bricks::cells_between;
use super::{Store, StoreFull};
use crate::cell::{Cell, Planes};
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, Grid, Lattice};

/// Every cell of a box, in structure-of-arrays planes, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Dense<C: Cell, const D: usize> {
    grid: Grid<D>,
    planes: C::Planes,
}

impl<C: Cell, const D: usize> Dense<C, D> {
    /// A box in which nothing was observed.
    pub fn new(grid: Grid<D>) -> Self {
        Self { planes: C::Planes::unobserved(grid.len()), grid }
    }

    /// A box from its planes. `None` where their length is not that of the grid.
    pub fn from_planes(grid: Grid<D>, planes: C::Planes) -> Option<Self> {
        (grid.checked_len() == Some(planes.len())).then_some(Self { grid, planes })
    }

    /// Shape and place.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// The cells in memory order.
    pub fn planes(&self) -> &C::Planes {
        &self.planes
    }

    /// The cells in memory order, for writing.
    pub fn planes_mut(&mut self) -> &mut C::Planes {
        &mut self.planes
    }

    /// Cell at a linear index; `None`: never observed.
    #[inline(always)]
    pub fn at(&self, i: usize) -> Option<C> {
        self.planes.get(i)
    }

    /// The same cells in another box of the same lattice, for maps that grow. `None` where the lattices do
    /// not coincide or an observed cell would be lost.
    pub fn regridded(&self, grid: Grid<D>) -> Option<Self> {
        let shift = cells_between(&self.grid.lattice, &grid.lattice)?;
        let mut moved = Self::new(grid);
        for i in 0..self.grid.len() {
            if let Some(cell) = self.planes.get(i) {
                let from = self.grid.cell(i);
                let to = grid.index(std::array::from_fn(|k| from[k] + shift[k]))?;
                moved.planes.set(to, Some(cell));
            }
        }
        Some(moved)
    }
}

impl<C: Cell, const D: usize> Store<C, D> for Dense<C, D> {
    fn lattice(&self) -> &Lattice<D> {
        &self.grid.lattice
    }

    #[inline(always)]
    fn cell(&self, cell: [i32; D]) -> Option<C> {
        self.planes.get(self.grid.index(cell)?)
    }

    fn bounds(&self) -> Option<Aabb<D>> {
        Some(self.grid.aabb())
    }

    #[inline(always)]
    fn contains(&self, cell: [i32; D]) -> bool {
        self.grid.index(cell).is_some()
    }

    fn apply(&mut self, key: BlockKey<D>, evidence: &C::Evidence, rule: &C::Rule) -> Result<(), StoreFull> {
        if !self.grid.has_block(key) {
            return Ok(());
        }
        let first = key.first_cell();
        let run = BLOCK_EDGE.min(self.grid.shape[0] - first[0] as usize);
        let rows = BLOCK_EDGE.pow(D as u32 - 1);
        for row in 0..rows {
            let from = row * BLOCK_EDGE;
            if let Some(start) = self.grid.index(key.cell(from)) {
                C::fuse_run(&mut self.planes, start, evidence, from, run, rule);
            }
        }
        Ok(())
    }

    fn memory_bytes(&self) -> usize {
        self.planes.bytes() + size_of::<Self>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Evidence, HitMiss, LogOdds8, LogOddsRule, OccupancyModel};
    use crate::geom::block_cells;

    fn applies_only_inside<const D: usize>() {
        let rule = LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap();
        let mut store = Dense::<LogOdds8, D>::new(Grid::new([0.0; D], 1.0, [11; D]));
        let mut everywhere = HitMiss::silent(block_cells::<D>());
        (0..block_cells::<D>()).for_each(|i| everywhere.mark_hit(i));
        for key in [[1; D], [-1; D], [2; D]] {
            store.apply(BlockKey(key), &everywhere, &rule).unwrap();
        }
        let observed = (0..store.grid().len()).filter(|&i| store.at(i).is_some()).count();
        assert_eq!(observed, 3usize.pow(D as u32));
        assert_eq!(store.cell([8; D]), Some(LogOdds8(31)));
        assert_eq!(store.cell([7; D]), None);
        assert_eq!(store.cell([11; D]), None);

        let bigger = Grid::new([-2.0; D], 1.0, [20; D]);
        let moved = store.regridded(bigger).unwrap();
        assert_eq!(moved.cell([10; D]), Some(LogOdds8(31)));
        assert_eq!(moved.regridded(*store.grid()), Some(store.clone()));
        assert_eq!(store.regridded(Grid::new([0.0; D], 1.0, [9; D])), None);
        assert_eq!(store.regridded(Grid::new([0.5; D], 1.0, [20; D])), None);
    }

    #[test]
    fn applies_only_inside_2d_and_3d() {
        applies_only_inside::<2>();
        applies_only_inside::<3>();
    }
}
