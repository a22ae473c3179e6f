//! Arrays in bricks and back.

use super::{Bricks, Dense, Store};
use crate::cell::{Cell, DistanceBrick, Planes, SignedDistance};
use crate::geom::{BLOCK_EDGE, BlockKey, Grid, Lattice, block_cells};
use rustc_hash::FxHashMap;

/// The cells of an array in bricks, for what is derived from bricks; those without an observed cell are left out.
/// O(cells).
impl<const D: usize> From<&Dense<SignedDistance, D>> for Bricks<SignedDistance, D> {
    fn from(dense: &Dense<SignedDistance, D>) -> Self {
        let shape = dense.grid().shape;
        let mut bricks = Bricks::new(*dense.lattice());
        if dense.grid().is_empty() {
            return bricks;
        }
        let counts: [usize; D] = std::array::from_fn(|k| shape[k].div_ceil(BLOCK_EDGE));
        let planes = dense.planes();
        let (mut distance, mut weight) = (vec![0.0; block_cells::<D>()], vec![0.0; block_cells::<D>()]);
        for n in 0..counts.iter().product() {
            let mut rest = n;
            let key = BlockKey(std::array::from_fn(|k| {
                let at = rest % counts[k];
                rest /= counts[k];
                at as i32
            }));
            let first = key.first_cell();
            weight.fill(0.0);
            let width = (shape[0] - first[0] as usize).min(BLOCK_EDGE);
            for row in 0..block_cells::<D>() / BLOCK_EDGE {
                let cell = key.cell(row * BLOCK_EDGE);
                if let Some(from) = dense.grid().index(cell) {
                    let to = row * BLOCK_EDGE..row * BLOCK_EDGE + width;
                    distance[to.clone()].copy_from_slice(&planes.distances()[from..from + width]);
                    weight[to].copy_from_slice(&planes.weights()[from..from + width]);
                }
            }
            if weight.iter().any(|w| *w > 0.0)
                && let Some(brick) = DistanceBrick::from_parts(&distance, &weight)
            {
                // There is no limit.
                let _ = bricks.insert(key, brick);
            }
        }
        bricks
    }
}

impl<C: Cell, const D: usize> Dense<C, D> {
    /// The cells of bricks that lie in a box of the same lattice. `None` where the lattices do not coincide. O(cells).
    pub fn of_bricks(bricks: &Bricks<C, D>, grid: Grid<D>) -> Option<Self> {
        let shift = cells_between(bricks.lattice(), &grid.lattice)?;
        let mut dense = Self::new(grid);
        for (key, brick) in bricks.bricks_by_age() {
            for i in 0..block_cells::<D>() {
                let Some(cell) = brick.get(i) else { continue };
                let from = key.cell(i);
                if let Some(to) = grid.index(std::array::from_fn(|k| from[k] + shift[k])) {
                    dense.planes_mut().set(to, Some(cell));
                }
            }
        }
        Some(dense)
    }
}

impl<C: Cell, const D: usize> Bricks<C, D> {
    /// The observed cells of an array as bricks of a lattice. `None` where the lattices do not coincide. O(cells).
    pub fn of_dense(dense: &Dense<C, D>, lattice: Lattice<D>) -> Option<Self> {
        let shift = cells_between(dense.lattice(), &lattice)?;
        let grid = dense.grid();
        let mut bricks: FxHashMap<BlockKey<D>, C::Brick> = FxHashMap::default();
        for i in 0..grid.len() {
            let Some(value) = dense.at(i) else { continue };
            let from = grid.cell(i);
            let cell = std::array::from_fn(|k| from[k] + shift[k]);
            let brick = bricks.entry(BlockKey::of_cell(cell));
            brick
                .or_insert_with(|| Planes::unobserved(block_cells::<D>()))
                .set(BlockKey::offset(cell), Some(value));
        }
        let mut keys: Vec<_> = bricks.keys().copied().collect();
        keys.sort_unstable();
        let mut store = Self::new(lattice);
        for key in keys {
            if let Some(brick) = bricks.remove(&key) {
                // There is no limit.
                let _ = store.insert(key, brick);
            }
        }
        Some(store)
    }
}

/// What to add to a cell of one lattice to get the same cell of another; `None` where their cells do not coincide.
pub(super) fn cells_between<const D: usize>(from: &Lattice<D>, to: &Lattice<D>) -> Option<[i32; D]> {
    let mut shift = [0; D];
    for k in 0..D {
        let cells = (from.origin[k] - to.origin[k]) / from.resolution;
        if from.resolution != to.resolution || (cells - cells.round()).abs() > 1e-6 || cells.abs() > 1e9 {
            return None;
        }
        shift[k] = cells.round() as i32;
    }
    Some(shift)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{LogOdds8, SignedDistance};

    fn there_and_back<C: Cell, const D: usize>(value: impl Fn(usize) -> Option<C>) {
        let grid = Grid::new([-0.5; D], 0.25, [13; D]);
        let mut dense = Dense::<C, D>::new(grid);
        (0..grid.len()).for_each(|i| dense.planes_mut().set(i, value(i)));
        for origin in [[-0.5; D], [0.0; D], [-7.25; D]] {
            let bricks = Bricks::of_dense(&dense, Lattice::new(origin, 0.25)).unwrap();
            for i in 0..grid.len() {
                let p = grid.lattice.center(grid.cell(i));
                assert_eq!(bricks.cell(bricks.lattice().cell_of(p).unwrap()), dense.at(i));
            }
            let back = Dense::of_bricks(&bricks, grid).unwrap();
            assert!((0..grid.len()).all(|i| back.at(i) == dense.at(i)));
            // A box that holds a part, and one that holds more.
            for (at, n) in [(0.25, 5), (-2.0, 30)] {
                let other = Grid::new([at; D], 0.25, [n; D]);
                let part = Dense::of_bricks(&bricks, other).unwrap();
                for i in 0..other.len() {
                    let cell = grid.lattice.cell_of(other.lattice.center(other.cell(i))).unwrap();
                    assert_eq!(part.at(i), dense.cell(cell));
                }
            }
        }
        assert!(Bricks::of_dense(&dense, Lattice::new([0.1; D], 0.25)).is_none());
        assert!(Bricks::of_dense(&dense, Lattice::new([0.0; D], 0.5)).is_none());
    }

    #[test]
    fn cells_go_there_and_back_2d_and_3d() {
        let odds = |i: usize| (!i.is_multiple_of(3)).then_some(LogOdds8((i % 90) as i8 - 40));
        let distances =
            |i: usize| (i % 5 < 3).then_some(SignedDistance { distance: i as f32 * 0.01, weight: 1.0 });
        there_and_back::<_, 2>(odds);
        there_and_back::<_, 3>(odds);
        there_and_back::<_, 2>(distances);
        there_and_back::<_, 3>(distances);
    }
}
