//! A box of a field in bricks as plain arrays, for files and for programs that want an array.

use super::Esdf;
use crate::answer::Status;
use crate::field::EsdfGrid;
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, Grid};

impl<const D: usize> Esdf<D> {
    /// The smallest box that holds all bricks; `None`: there is none.
    pub fn grid(&self) -> Option<Grid<D>> {
        let (first, end) = self.extent()?;
        Some(self.grid_of(first, end))
    }

    /// The part of [`Esdf::grid`] inside a box (world): the cells that it touches, not those that only begin where it
    /// ends. `None` where there is none.
    pub fn grid_within(&self, bounds: &Aabb<D>) -> Option<Grid<D>> {
        let (first, end) = self.extent()?;
        // Clamped before they become indices: a box may be as large as it likes.
        let whole = self.lattice.aabb(first, end);
        let apart = (0..D).any(|k| bounds.max[k] < whole.min[k] || bounds.min[k] >= whole.max[k]);
        if apart {
            return None;
        }
        let inside = |p: [f64; D]| std::array::from_fn(|k| p[k].clamp(whole.min[k], whole.max[k]));
        let low = self.lattice.cell_of(inside(bounds.min))?;
        let high = self.lattice.cell_of(inside(bounds.max))?;
        let first: [i32; D] = std::array::from_fn(|k| low[k].max(first[k]));
        let end: [i32; D] = std::array::from_fn(|k| {
            let begins_at_the_end = self.lattice.corner(high)[k] >= bounds.max[k] && high[k] > low[k];
            (high[k] + i32::from(!begins_at_the_end)).min(end[k])
        });
        (0..D).all(|k| first[k] < end[k]).then(|| self.grid_of(first, end))
    }

    /// A box of at most `cells` cells: as much as fits around the middle of what was observed, all of an axis where
    /// that is short. `None` where there is no brick or not one cell allowed.
    pub fn grid_of_at_most(&self, cells: usize) -> Option<Grid<D>> {
        let (first, end) = self.extent()?;
        let shape: [u64; D] = std::array::from_fn(|k| end[k].abs_diff(first[k]).into());
        let fits = |edge: u64| {
            let count = shape.iter().try_fold(1u64, |n, &s| n.checked_mul(s.min(edge)));
            count.is_some_and(|n| n <= cells as u64)
        };
        let (mut edge, mut above) = (0, shape.iter().copied().max()? + 1);
        while above - edge > 1 {
            let middle = edge + (above - edge) / 2;
            if fits(middle) { edge = middle } else { above = middle }
        }
        // The median: what was seen once far away does not draw the box there.
        let middle = |k: usize| {
            let mut along: Vec<i32> = self.keys.iter().map(|key| key.first_cell()[k] + 4).collect();
            let half = along.len() / 2;
            i64::from(*along.select_nth_unstable(half).1)
        };
        let low: [i32; D] = std::array::from_fn(|k| {
            let most = i64::from(end[k]) - shape[k].min(edge) as i64;
            (middle(k) - (edge / 2) as i64).clamp(first[k].into(), most) as i32
        });
        let high: [i32; D] = std::array::from_fn(|k| low[k] + shape[k].min(edge) as i32);
        (edge > 0).then(|| self.grid_of(low, high))
    }

    /// The cells of a grid of the same lattice, wherever it lies: nothing is known outside. O(cells), five bytes each.
    pub fn dense(&self, grid: &Grid<D>) -> EsdfGrid<D> {
        let mut distances = vec![f32::NAN; grid.len()];
        if let Some(first) = self.lattice.cell_of(grid.lattice.center([0; D])) {
            for (row, values) in distances.chunks_exact_mut(grid.shape[0].max(1)).enumerate() {
                let in_grid = grid.cell(row * grid.shape[0]);
                let mut cell: [i32; D] = std::array::from_fn(|k| first[k].saturating_add(in_grid[k]));
                let mut rest = values;
                while !rest.is_empty() {
                    let run = rest.len().min(BLOCK_EDGE - (cell[0] & 7) as usize);
                    let (here, behind) = std::mem::take(&mut rest).split_at_mut(run);
                    if let Some(brick) = self.brick(BlockKey::of_cell(cell)) {
                        here.copy_from_slice(&brick[BlockKey::offset(cell)..][..run]);
                    }
                    cell[0] = cell[0].saturating_add(run as i32);
                    rest = behind;
                }
            }
        }
        let status: Vec<Status> = distances
            .iter_mut()
            .map(|v| {
                let status = match *v {
                    v if v.is_nan() => Status::Unknown,
                    v if v.is_infinite() => Status::Saturated,
                    _ => Status::Known,
                };
                *v = self.clamped(*v);
                status
            })
            .collect();
        let saturated = status.contains(&Status::Saturated);
        EsdfGrid::of_cells(*grid, distances, saturated.then_some(status))
    }

    /// The cells of all bricks: the first, and behind the last.
    fn extent(&self) -> Option<([i32; D], [i32; D])> {
        let (mut first, mut end) = (self.keys.first()?.first_cell(), self.keys.first()?.first_cell());
        for key in self.keys.iter() {
            let low = key.first_cell();
            first = std::array::from_fn(|k| first[k].min(low[k]));
            end = std::array::from_fn(|k| end[k].max(low[k] + BLOCK_EDGE as i32));
        }
        Some((first, end))
    }

    fn grid_of(&self, first: [i32; D], end: [i32; D]) -> Grid<D> {
        let shape = std::array::from_fn(|k| end[k].abs_diff(first[k]) as usize);
        Grid::new(self.lattice.corner(first), self.lattice.resolution, shape)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Answer;
    use crate::cell::SignedDistance;
    use crate::field::EsdfSettings;
    use crate::geom::Lattice;
    use crate::store::Bricks;

    /// A wall at x = 1.23 through bricks at these keys; every seventh cell was not observed.
    fn wall<const D: usize>(keys: &[[i32; 3]]) -> Esdf<D> {
        let lattice = Lattice::new([500_000.0; D], 0.1);
        let mut store = Bricks::<SignedDistance, D>::new(lattice);
        for key in keys {
            let key = BlockKey(std::array::from_fn(|k| key[k]));
            let distance = |i| (1.23 - (lattice.center(key.cell(i))[0] - 500_000.0)).clamp(-0.3, 0.3) as f32;
            let brick = crate::testing::brick::<D>(|i| (i % 7 != 0).then(|| (distance(i), 1.0)));
            store.insert(key, brick).unwrap();
        }
        Esdf::of(&store, &EsdfSettings { max_distance: 0.5, ..Default::default() })
    }

    fn says_what_the_field_says<const D: usize>() {
        let esdf = wall::<D>(&[[0, 0, 0], [1, 0, 0], [1, -1, 0], [-1, 0, 1]]);
        let bounds = Aabb::new([499_998.99; D], [500_001.35; D]);
        for grid in [esdf.grid().unwrap(), esdf.grid_within(&bounds).unwrap()] {
            let dense = esdf.dense(&grid);
            assert_eq!(dense.samples().len(), grid.len());
            for (i, &d) in dense.samples().iter().enumerate() {
                let cell = esdf.lattice.cell_of(grid.lattice.center(grid.cell(i))).unwrap();
                let answer = esdf.cell(cell);
                assert!(answer.value().map_or(d.is_nan(), |v| v == d));
                let status = if answer == Answer::Outside { Status::Unknown } else { answer.status() };
                assert_eq!(dense.status(i), status);
            }
            for status in 0..3 {
                assert!(dense.status_bytes().contains(&status));
            }
        }
        let all = esdf.grid().unwrap();
        assert_eq!(all.shape[..2], [24, 16]);
        assert_eq!(esdf.grid_within(&Aabb::new([-1e9; D], [1e9; D])).unwrap(), all);
        assert_eq!(esdf.grid_within(&Aabb::new([0.0; D], [1.0; D])), None);
        assert_eq!(esdf.grid_within(&bounds).unwrap().shape[..2], [22, 16]);
    }

    #[test]
    fn says_what_the_field_says_2d_and_3d() {
        says_what_the_field_says::<2>();
        says_what_the_field_says::<3>();
    }

    #[test]
    fn the_box_that_fits_is_around_the_middle() {
        // A lonely brick far away does not draw it there.
        let near: Vec<_> = (0..64).map(|i| [i % 8, i / 8, 0]).chain([[1_000_000, 0, 0]]).collect();
        let esdf = wall::<3>(&near);
        assert!(esdf.grid().unwrap().len() > 1 << 26);
        let grid = esdf.grid_of_at_most(100_000).unwrap();
        assert!(grid.len() <= 100_000 && grid.shape[1..] == [64, 8], "{:?}", grid.shape);
        let all = wall::<3>(&near[..64]);
        assert_eq!(all.grid_of_at_most(64 * 64 * 8), all.grid());
        let some = all.grid_of_at_most(5000).unwrap();
        assert_eq!(some.shape, [25, 25, 8]);
        let middle = (some.aabb().min[0] + some.aabb().max[0]) / 2.0;
        assert!((middle - 500_003.2).abs() < 0.51, "{middle}");
        assert_eq!(all.grid_of_at_most(0), None);
    }
}
