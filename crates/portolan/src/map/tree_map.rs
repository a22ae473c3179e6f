//! The log-odds quadtree and octree.

use super::error::check_grid;
use super::integrate::integrate;
use super::{MapError, SparseOccupancy};
use crate::answer::Answer;
use crate::cell::{Evidence, HitMiss, LogOdds8, LogOddsRule, OccupancyModel, ProbabilityTable};
use crate::geom::{Aabb, Grid, Pose, block_cells};
use crate::scan::{Scan, ScanStats};
use crate::store::{Store, Tree};
use crate::sweep::Rays;

/// The same filter as the occupancy grid in a pruned tree (Hornung et al. 2013).
#[derive(Clone, Debug)]
pub struct TreeMap<const D: usize> {
    tree: Tree<LogOdds8, D>,
    rule: LogOddsRule<i8>,
    probabilities: ProbabilityTable,
    model: OccupancyModel,
    bounds: Aabb<D>,
    sweep: Rays<D>,
    scratch: HitMiss,
}

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

/// A log-odds tree of the plane.
pub type Quadtree = TreeMap<2>;
/// A log-odds tree of space.
pub type Octree = TreeMap<3>;

impl<const D: usize> TreeMap<D> {
    /// An empty tree on the lattice of a grid and at least as large.
    ///
    /// # Errors
    /// Where the lattice or the model is not possible.
    pub fn covering(grid: &Grid<D>, model: OccupancyModel) -> Result<Self, MapError> {
        let tree = Tree::covering(grid).ok_or(MapError::Depth(29))?;
        Self::from_tree(tree, model)
    }

    /// An empty tree whose root covers `2^depth` leaves along each axis from `origin` upwards.
    ///
    /// # Errors
    /// Where the lattice, the depth or the model is not possible.
    pub fn new(
        origin: [f64; D],
        resolution: f64,
        depth: u32,
        model: OccupancyModel,
    ) -> Result<Self, MapError> {
        Self::from_tree(Tree::new(origin, resolution, depth).ok_or(MapError::Depth(depth))?, model)
    }

    /// A map of a stored tree.
    ///
    /// # Errors
    /// Where the lattice or the model is not possible.
    pub fn from_tree(tree: Tree<LogOdds8, D>, model: OccupancyModel) -> Result<Self, MapError> {
        check_grid(&Grid { shape: [1; D], ..tree.grid() })?;
        let rule = LogOddsRule::<i8>::new(&model)?;
        let bounds = tree.grid().aabb();
        let sweep = Rays::new(model.wall_depth.unwrap_or(tree.grid().lattice.resolution));
        let probabilities = ProbabilityTable::new(&rule);
        let scratch = HitMiss::silent(block_cells::<D>());
        Ok(Self { tree, rule, probabilities, model, bounds, sweep, scratch })
    }

    /// Fuses a scan taken at a known pose; prunes on the way.
    pub fn integrate(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> ScanStats {
        let at = (world_from_sensor, scan);
        integrate::<LogOdds8, _, _, D>(
            &mut self.tree,
            &mut self.sweep,
            &mut self.scratch,
            &self.rule,
            &self.bounds,
            at,
        )
    }

    /// P(occupied) at a point. O(depth).
    #[inline]
    pub fn probability(&self, p_world: impl Into<[f64; D]>) -> Answer<f64> {
        let p = p_world.into();
        let Some(cell) = self.tree.lattice().cell_of(p).filter(|_| self.bounds.contains(p)) else {
            return Answer::Outside;
        };
        self.tree.cell(cell).map_or(Answer::Unknown, |v| Answer::Known(self.probabilities.of(v)))
    }

    /// P(occupied) inside the cube of edge `2^height` cells that holds a point, over what was observed of it; unknown
    /// where nothing was. O(depth + nodes below). [`Tree::max_at`] answers for the maximum alone in O(depth).
    pub fn coarse(&self, p_world: impl Into<[f64; D]>, height: u32) -> Answer<CoarseOccupancy> {
        let p = p_world.into();
        let Some(cell) = self.tree.lattice().cell_of(p).filter(|_| self.bounds.contains(p)) else {
            return Answer::Outside;
        };
        let Some(s) = self.tree.summary(cell, height) else { return Answer::Unknown };
        let of = |v: LogOdds8| self.probabilities.of(v);
        let mean = 1.0 / (1.0 + (-s.mean * self.rule.quantum).exp());
        Answer::Known(CoarseOccupancy { min: of(s.min), max: of(s.max), mean, observed: s.observed })
    }

    /// The tree.
    pub fn tree(&self) -> &Tree<LogOdds8, D> {
        &self.tree
    }

    /// Gives memory that no node uses back.
    pub fn compact(&mut self) {
        self.tree.compact();
    }

    /// Bytes of the nodes, measured.
    pub fn memory_bytes(&self) -> usize {
        self.tree.memory_bytes()
    }

    /// The model that the filter's numbers come from.
    pub fn model(&self) -> &OccupancyModel {
        &self.model
    }
}

impl TreeMap<3> {
    /// The cells of bricks in a tree: the same as if the scans had been fused into the tree.
    ///
    /// # Errors
    /// [`MapError::Depth`] where a brick is beyond 2^27 cells from the origin.
    pub fn from_sparse(map: &SparseOccupancy<LogOdds8>) -> Result<Self, MapError> {
        Self::from_tree(Tree::from_bricks(map.store()).ok_or(MapError::Depth(29))?, *map.model())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_cells_know_their_extremes_and_how_much_was_seen() {
        use crate::geom::Lattice;
        use crate::map::OccupancySweep;
        let model = OccupancyModel::default();
        let mut bricks =
            SparseOccupancy::new(Lattice::new([0.0; 3], 1.0), model, OccupancySweep::Exact).unwrap();
        // Along x: three cells passed, the fourth hit.
        bricks.integrate_points(&[[3.5, 0.5, 0.5]], [0.5; 3]).unwrap();
        let map = Octree::from_sparse(&bricks).unwrap();
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
