//! The 2-D field of a height range of a 3-D field.

use super::HandoverError;
use super::fill::check_length;
use crate::field::UnknownSpace;
use crate::geom::Grid;

/// The least distance of every column between two heights (meters): a 2-D array that is negative where there is an
/// obstacle at any of these heights. Cells with their center in `[low, high]` count. Where a cell's center is on an obstacle
/// that is a point, and 0 from it, the column's value is half a cell below zero, so that it has a surface in 2-D.
///
/// The values are also distances to surfaces below and above, such as the floor; only their sign is meaningful in 2-D.
/// For 2-D distances compute a distance field of it.
///
/// NaN where unknown: with [`UnknownSpace::Optimistic`] where all cells of the column are unknown, with
/// [`UnknownSpace::Pessimistic`] where one is unknown and none lies in an obstacle.
///
/// # Errors
/// Where the number of samples is not that of the grid, or no cell center lies between the heights.
pub fn lowest_between(
    grid: &Grid<3>,
    distances: &[f32],
    heights: [f64; 2],
    unknown: UnknownSpace,
) -> Result<(Grid<2>, Vec<f32>), HandoverError> {
    check_length(grid, distances.len())?;
    let [nx, ny, nz] = grid.shape;
    let between = |z: usize| {
        let height = grid.lattice.center([0, 0, z as i32])[2];
        height >= heights[0] && height <= heights[1]
    };
    let layers: Vec<&[f32]> =
        distances.chunks_exact(nx * ny).enumerate().filter(|(z, _)| between(*z)).map(|(_, l)| l).collect();
    if layers.is_empty() {
        let (low, high) =
            (grid.lattice.origin[2], grid.lattice.origin[2] + nz as f64 * grid.lattice.resolution);
        let value = if heights[0] > high || !(heights[0] >= low) { heights[0] } else { heights[1] };
        let advice = "no cell center lies between the heights; choose heights within the map";
        return Err(HandoverError::Setting { name: "the height range", value, advice });
    }
    let column = |i: usize| {
        let known = layers.iter().map(|layer| layer[i]).filter(|d| !d.is_nan());
        let (count, lowest) = known.fold((0, f32::INFINITY), |(n, low), d| (n + 1, low.min(d)));
        let complete = count == layers.len() || unknown == UnknownSpace::Optimistic;
        let on_point = lowest == 0.0;
        let lowest = if on_point { -0.5 * grid.lattice.resolution as f32 } else { lowest };
        if count > 0 && (complete || lowest <= 0.0) { lowest } else { f32::NAN }
    };
    let [x, y, _] = grid.lattice.origin;
    Ok((Grid::new([x, y], grid.lattice.resolution, [nx, ny]), (0..nx * ny).map(column).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_its_lowest_cell() {
        let grid = Grid::new([1.0, 2.0, 0.0], 0.5, [2, 1, 4]);
        let n = f32::NAN;
        // Centers at 0.25, 0.75, 1.25, 1.75.
        let d = [-1.0, -1.0, 0.5, n, 0.3, 0.2, -0.5, n];
        let of = |heights, unknown| lowest_between(&grid, &d, heights, unknown);
        let (flat, low) = of([0.5, 1.5], UnknownSpace::Optimistic).unwrap();
        assert_eq!((flat, low), (Grid::new([1.0, 2.0], 0.5, [2, 1]), vec![0.3, 0.2]));
        let (_, low) = of([0.5, 1.5], UnknownSpace::Pessimistic).unwrap();
        assert!(low[0] == 0.3 && low[1].is_nan());
        let (_, low) = of([0.0, 1.5], UnknownSpace::Pessimistic).unwrap();
        assert_eq!(low, [-1.0, -1.0]);
        let (_, low) = of([1.7, 9.0], UnknownSpace::Optimistic).unwrap();
        assert!(low[0] == -0.5 && low[1].is_nan());
        let on_a_point = [0.5, 0.5, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5];
        let (_, low) = lowest_between(&grid, &on_a_point, [0.5, 1.5], UnknownSpace::Pessimistic).unwrap();
        assert_eq!(low, [-0.25, -0.25]);
        for bad in [[3.0, 4.0], [-2.0, -1.0], [0.8, 1.2], [f64::NAN, 1.0], [1.0, 0.5]] {
            assert!(of(bad, UnknownSpace::Optimistic).is_err(), "{bad:?}");
        }
        assert!(lowest_between(&grid, &d[1..], [0.0, 1.0], UnknownSpace::Optimistic).is_err());
    }
}
