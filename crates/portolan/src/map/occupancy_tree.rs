//! What a tree answers beyond other occupancy maps: whole cubes of cells.

use super::{MapError, Occupancy};
use crate::answer::Answer;
use crate::cell::{LogOdds8, OccupancyModel};
use crate::geom::{Grid, Lattice};
use crate::store::{Store, Tree};

/// What a cube of many cells holds, as probabilities of being occupied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseOccupancy {
    /// P(occupied) of the cell that is least likely occupied.
    pub min: f64,
    /// P(occupied) of the cell that is most likely occupied.
    pub max: f64,
    /// P(occupied) at the mean log odds of the observed cells, each counting alike.
    pub mean: f64,
    /// Share of the cube that was observed, above 0, at most 1.
    pub observed: f64,
}

impl<const D: usize> Occupancy<D, LogOdds8, Tree<LogOdds8, D>> {
    /// An empty pruned tree (Hornung et al. 2013) on the lattice of a grid and at least as large.
    ///
    /// # Errors
    /// Where the lattice or the model is not possible.
    pub fn covering(grid: &Grid<D>, model: OccupancyModel) -> Result<Self, MapError> {
        super::error::check_lattice(&grid.lattice)?;
        Self::from_store(Tree::covering(grid).ok_or(MapError::Depth(29))?, model)
    }

    /// An empty tree whose root covers `2^depth` leaves along each axis from the lattice's origin upwards.
    ///
    /// # Errors
    /// Where the lattice, the depth or the model is not possible.
    pub fn with_depth(lattice: Lattice<D>, depth: u32, model: OccupancyModel) -> Result<Self, MapError> {
        super::error::check_lattice(&lattice)?;
        let tree = Tree::new(lattice.origin, lattice.resolution, depth).ok_or(MapError::Depth(depth))?;
        Self::from_store(tree, model)
    }

    /// The cells of a map in bricks in a tree: the same as if the scans had been fused into the tree.
    ///
    /// # Errors
    /// [`MapError::Depth`] where a brick is beyond 2^27 cells from the origin.
    pub fn from_bricks(map: &Occupancy<D>) -> Result<Self, MapError> {
        Self::from_store(Tree::from_bricks(map.store()).ok_or(MapError::Depth(29))?, *map.model())
    }

    /// P(occupied) inside the cube of edge `2^height` cells that holds a point, over what was observed of it; unknown where
    /// nothing was. O(depth + nodes below). [`Tree::max_at`] answers for the maximum alone in O(depth).
    pub fn coarse(&self, p_world: impl Into<[f64; D]>, height: u32) -> Answer<CoarseOccupancy> {
        let tree = self.store();
        let Some(cell) = tree.lattice().cell_of(p_world.into()).filter(|&c| tree.contains(c)) else {
            return Answer::Outside;
        };
        let Some(s) = tree.summary(cell, height) else { return Answer::Unknown };
        let of = |v: LogOdds8| self.lookup.of(v);
        let mean = 1.0 / (1.0 + (-s.mean * self.rule.quantum).exp());
        Answer::Known(CoarseOccupancy { min: of(s.min), max: of(s.max), mean, observed: s.observed })
    }

    /// Gives memory that no node uses back.
    pub fn compact(&mut self) {
        self.store.compact();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::LogOddsRule;

    #[test]
    fn coarse_cells_know_their_extremes_and_how_much_was_seen() {
        let model = OccupancyModel::default();
        let mut bricks = Occupancy::<3>::new(Lattice::new([0.0; 3], 1.0), model).unwrap();
        // Along x: three cells passed, the fourth hit.
        bricks.integrate_points(&[[3.5, 0.5, 0.5]], [0.5; 3]).unwrap();
        let map = Occupancy::<3, LogOdds8, Tree<LogOdds8, 3>>::from_bricks(&bricks).unwrap();
        for x in [0.5, 1.5, 2.5, 3.5, 4.5] {
            assert_eq!(map.probability([x, 0.5, 0.5]), bricks.probability([x, 0.5, 0.5]));
        }
        let Answer::Known(c) = map.coarse([1.0, 3.0, 2.0], 2) else { panic!("nothing known") };
        let rule = LogOddsRule::<i8>::new(&model).unwrap();
        let p = |units: f64| 1.0 / (1.0 + (-units * rule.quantum).exp());
        assert!((c.min - p(-15.0)).abs() < 1e-12 && (c.max - p(31.0)).abs() < 1e-12);
        assert!((c.mean - p((31.0 - 45.0) / 4.0)).abs() < 1e-12);
        assert_eq!(c.observed, 4.0 / 64.0);
        assert_eq!(map.coarse([5.0, 0.5, 0.5], 1), Answer::Unknown);
        assert_eq!(map.coarse([1e4, 0.5, 0.5], 1), Answer::Outside);
    }
}
