//! The array layouts of several consumers.

use super::Filled;
use super::half::f16_from_f32;
use crate::geom::Grid;

/// The samples with the last axis fastest (C order of an array indexed `[x, y]` or `[x, y, z]`); `values` are x
/// fastest, which is Fortran order of the same array.
///
/// # Panics
/// Where the number of values is not the product of `shape`.
pub fn c_order<T: Copy, const D: usize>(values: &[T], shape: [usize; D]) -> Vec<T> {
    assert_eq!(values.len(), shape.iter().product::<usize>(), "one sample per cell");
    let mut strides = [1; D];
    for k in 1..D {
        strides[k] = strides[k - 1] * shape[k - 1];
    }
    let mut index = [0; D];
    let mut from = 0;
    (0..values.len())
        .map(|_| {
            let value = values[from];
            for k in (0..D).rev() {
                index[k] += 1;
                from += strides[k];
                if index[k] < shape[k] {
                    break;
                }
                index[k] = 0;
                from -= strides[k] * shape[k];
            }
            value
        })
        .collect()
}

/// The arguments of GPMP2's `PlanarSDF(origin, cell_size, data)` and `SignedDistanceField(origin, cell_size, data)`
/// *(gpmp2/obstacle/SignedDistanceField.h)*: one matrix per z, a row for every y and a column for every x, positive outside
/// obstacles. GPMP2 interpolates between nodes at `origin + index * cell_size`, so the origin is the center of cell 0, half
/// a cell from the corner of the grid. A query beyond the outermost nodes throws, which its obstacle factors treat as no
/// cost: the box must be larger than the reach of the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Gpmp2Field<const D: usize> {
    /// Center of cell 0 (meters).
    pub origin: [f64; D],
    /// Edge of a cell (meters).
    pub cell_size: f64,
    /// Number of samples along y.
    pub rows: usize,
    /// Number of samples along x.
    pub columns: usize,
    /// Number of samples along z; 1 in 2-D.
    pub layers: usize,
    /// Layer by layer, row by row (C order of an array indexed `[z, y, x]`).
    pub values: Vec<f64>,
}

impl<const D: usize> Gpmp2Field<D> {
    /// The samples in their order: row by row is x fastest.
    pub fn of(field: &Filled<D>) -> Self {
        let shape = &field.grid.shape;
        Self {
            origin: field.grid.lattice.center([0; D]),
            cell_size: field.grid.lattice.resolution,
            rows: shape[1],
            columns: shape[0],
            layers: shape.get(2).copied().unwrap_or(1),
            values: field.values.iter().map(|&d| f64::from(d)).collect(),
        }
    }

    /// `data[layer](row, column)`.
    ///
    /// # Panics
    /// Where an index is out of range.
    pub fn at(&self, row: usize, column: usize, layer: usize) -> f64 {
        assert!(row < self.rows && column < self.columns && layer < self.layers, "an index in the field");
        self.values[(layer * self.rows + row) * self.columns + column]
    }
}

/// The arguments of CasADi's `interpolant(name, 'bspline', knots, values)`, which acados uses: strictly increasing vectors
/// of knots, and the values with the first axis fastest (`ravel(order='F')` of an array indexed `[x, y, z]`). The knots are
/// the cell centers. Beyond the outermost knots CasADi extrapolates the outermost piece.
#[derive(Clone, Debug, PartialEq)]
pub struct KnotGrid<const D: usize> {
    /// Positions of the knots along each axis (meters).
    pub knots: [Vec<f64>; D],
    /// Values at the knots (meters, positive in free space), the first axis fastest.
    pub values: Vec<f64>,
}

impl<const D: usize> KnotGrid<D> {
    /// The samples in their order.
    pub fn of(field: &Filled<D>) -> Self {
        let knots = std::array::from_fn(|k| {
            let position = |i: usize| field.grid.lattice.center([i as i32; D])[k];
            (0..field.grid.shape[k]).map(position).collect()
        });
        Self { knots, values: field.values.iter().map(|&d| f64::from(d)).collect() }
    }
}

/// The version of cuRobo: sign and grid differ between them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CuroboVersion {
    /// Up to 0.7 *(sphere_obb_kernel.cu, `compute_voxel_index`)*: positive **inside** obstacles, free space is filled with
    /// `-max_esdf_distance`; the grid has `floor(dims / voxel_size) + 1` samples along an axis, the first at `-dims / 2`
    /// from its pose; a query rounds down to a sample.
    UpTo07,
    /// From 0.8 on *(geom/data/data_voxel.py)*: negative inside obstacles; `dims / voxel_size` samples at the centers of
    /// voxels; interpolated.
    #[default]
    From08,
}

/// The arguments of cuRobo's `VoxelGrid(name, pose, dims, voxel_size, feature_tensor)`: the last axis fastest, x slowest.
#[derive(Clone, Debug, PartialEq)]
pub struct CuroboGrid {
    /// Number of samples along x, y, z.
    pub shape: [usize; 3],
    /// Lengths along x, y, z (meters) from which cuRobo computes this shape.
    pub dims: [f64; 3],
    /// x, y, z (meters) of the center of the grid, and the identity quaternion w, x, y, z.
    pub pose: [f64; 7],
    /// Edge of a voxel (meters).
    pub voxel_size: f64,
    /// The samples (meters) with the sign of the version, x slowest.
    pub values: Vec<f32>,
}

impl CuroboGrid {
    /// The samples in the order and with the sign of a version.
    pub fn of(field: &Filled<3>, version: CuroboVersion) -> Self {
        let Grid { lattice, shape } = field.grid;
        let mut values = c_order(&field.values, shape);
        if version == CuroboVersion::UpTo07 {
            values.iter_mut().for_each(|d| *d = -*d);
        }
        let dims = shape.map(|n| match version {
            // From the first sample to the last.
            CuroboVersion::UpTo07 => (n as f64 - 1.0) * lattice.resolution,
            CuroboVersion::From08 => n as f64 * lattice.resolution,
        });
        let middle: [f64; 3] =
            std::array::from_fn(|k| lattice.origin[k] + 0.5 * shape[k] as f64 * lattice.resolution);
        let pose = [middle[0], middle[1], middle[2], 1.0, 0.0, 0.0, 0.0];
        Self { shape, dims, pose, voxel_size: lattice.resolution, values }
    }

    /// The samples as `f16` bits, the precision of cuRobo: errors up to 0.5 mm at 2 m, 0.06 mm at 0.25 m.
    pub fn half(&self) -> Vec<u16> {
        self.values.iter().map(|&d| f16_from_f32(d)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{EsdfGrid, UnknownSpace};
    use crate::geom::vector;
    use crate::handover::f32_from_f16;

    const R: f64 = 0.25;

    /// A ball off the middle of a box of three different lengths, far from the origin.
    fn scene<const D: usize>(shape: [usize; D]) -> Filled<D> {
        let grid = Grid::new(std::array::from_fn(|k| 100.0 - 30.0 * k as f64), R, shape);
        let ball: [f64; D] = std::array::from_fn(|k| grid.lattice.origin[k] + R * (3.3 - k as f64));
        let distance = |i| (vector::distance(grid.lattice.center(grid.cell(i)), ball) - 0.4) as f32;
        let distances: Vec<f32> = (0..grid.len()).map(distance).collect();
        Filled::new(&grid, &distances, UnknownSpace::Pessimistic, 50.0).unwrap()
    }

    /// Points between the outermost centers, and our own answers there.
    fn probes<const D: usize>(field: &Filled<D>) -> Vec<([f64; D], f64)> {
        let esdf = EsdfGrid::from_samples(field.grid, field.values.clone()).unwrap();
        let point = |i: usize| {
            std::array::from_fn(|k| {
                let span = (field.grid.shape[k] - 1) as f64 * R * 0.999;
                let part = (i as f64 * [0.618_034, 0.414_214, 0.302_776][k]).fract();
                field.grid.lattice.origin[k] + 0.5 * R + part * span
            })
        };
        (0..200).map(point).map(|p: [f64; D]| (p, esdf.distance(p).known().unwrap())).collect()
    }

    #[test]
    fn orders_are_numpys() {
        assert_eq!(c_order(&[0, 1, 2, 3, 4, 5], [2, 3]), [0, 2, 4, 1, 3, 5]);
        let shape = [4, 3, 2];
        let values: Vec<usize> = (0..24).collect();
        let c = c_order(&values, shape);
        for (x, y, z) in (0..24).map(|i| (i % 4, i / 4 % 3, i / 12)) {
            assert_eq!(c[(x * 3 + y) * 2 + z], x + 4 * (y + 3 * z));
        }
        assert!(c_order::<u8, 2>(&[], [0, 3]).is_empty());
    }

    /// Interpolates as `SignedDistanceField::getSignedDistance` does: rows by y, columns by x, from the origin.
    #[test]
    fn gpmp2_finds_the_same_distances() {
        let field = scene([9, 7, 5]);
        let given = Gpmp2Field::of(&field);
        assert_eq!((given.rows, given.columns, given.layers), (7, 9, 5));
        for (p, ours) in probes(&field) {
            let [column, row, layer]: [f64; 3] =
                std::array::from_fn(|k| (p[k] - given.origin[k]) / given.cell_size);
            let (r, c, z) = (row.floor(), column.floor(), layer.floor());
            let mut theirs = 0.0;
            for corner in 0..8 {
                let [dr, dc, dz] = [corner & 1, corner >> 1 & 1, corner >> 2].map(f64::from);
                let weight = (1.0 - (row - r - dr).abs())
                    * (1.0 - (column - c - dc).abs())
                    * (1.0 - (layer - z - dz).abs());
                theirs += weight * given.at((r + dr) as usize, (c + dc) as usize, (z + dz) as usize);
            }
            assert!((theirs - ours).abs() < 1e-5, "{p:?}: {theirs} {ours}");
        }
        let flat = scene([9, 7]);
        let given = Gpmp2Field::of(&flat);
        let inside = flat.grid.cell(flat.values.iter().position(|d| *d < 0.0).unwrap());
        assert!(given.at(inside[1] as usize, inside[0] as usize, 0) < 0.0);
        assert_eq!((given.rows, given.columns, given.layers), (7, 9, 1));
    }

    /// `values[i + nx (j + ny k)]` at `(knots[0][i], knots[1][j], knots[2][k])`, as CasADi has it.
    #[test]
    fn casadi_finds_the_same_distances() {
        let field = scene([9, 7, 5]);
        let KnotGrid { knots, values } = KnotGrid::of(&field);
        assert_eq!(knots.each_ref().map(Vec::len), [9, 7, 5]);
        assert!(knots.iter().flat_map(|k| k.windows(2)).all(|w| w[0] < w[1]));
        for (p, ours) in probes(&field) {
            let at: [usize; 3] =
                std::array::from_fn(|k| knots[k].partition_point(|v| *v <= p[k]).min(knots[k].len() - 1) - 1);
            let mut theirs = 0.0;
            for corner in 0..8usize {
                let node: [usize; 3] = std::array::from_fn(|k| at[k] + (corner >> k & 1));
                let part = |k: usize| 1.0 - (p[k] - knots[k][node[k]]).abs() / R;
                theirs +=
                    part(0) * part(1) * part(2) * values[node[0] + knots[0].len() * (node[1] + 7 * node[2])];
            }
            assert!((theirs - ours).abs() < 1e-5, "{p:?}: {theirs} {ours}");
        }
    }

    /// As `sample_voxel_sdf_with_grad` finds voxels: from the pose in the middle, centers at half voxels.
    #[test]
    fn curobo_08_finds_the_same_distances() {
        let field = scene([9, 7, 5]);
        let grid = CuroboGrid::of(&field, CuroboVersion::From08);
        let n = grid.dims.map(|d| (d / grid.voxel_size).round() as usize);
        assert_eq!((n, grid.shape), ([9, 7, 5], [9, 7, 5]));
        let half = grid.half();
        for (p, ours) in probes(&field) {
            let v: [f64; 3] =
                std::array::from_fn(|k| (p[k] - grid.pose[k]) / grid.voxel_size + 0.5 * n[k] as f64 - 0.5);
            let (mut theirs, mut in_half) = (0.0, 0.0);
            for corner in 0..8usize {
                let node: [usize; 3] = std::array::from_fn(|k| v[k].floor() as usize + (corner >> k & 1));
                let weight: f64 = (0..3).map(|k| 1.0 - (v[k] - node[k] as f64).abs()).product();
                let at = node[0] * n[1] * n[2] + node[1] * n[2] + node[2];
                theirs += weight * f64::from(grid.values[at]);
                in_half += weight * f64::from(f32_from_f16(half[at]));
            }
            assert!((theirs - ours).abs() < 1e-5, "{p:?}: {theirs} {ours}");
            assert!((in_half - ours).abs() < 0.5e-3 * ours.abs().max(1.0), "{p:?}: {in_half} {ours}");
        }
    }

    /// As `compute_voxel_index` finds the sample below a point, and its penetration: sample + radius.
    #[test]
    fn curobo_07_finds_the_same_samples() {
        let field = scene([9, 7, 5]);
        let grid = CuroboGrid::of(&field, CuroboVersion::UpTo07);
        let n = grid.dims.map(|d| (d / grid.voxel_size + 1e-3).floor() as usize + 1);
        assert_eq!(n, [9, 7, 5]);
        for i in 0..field.grid.len() {
            let center = field.grid.lattice.center(field.grid.cell(i));
            // A hair above the sample, which the truncation takes down to it.
            let x: [usize; 3] = std::array::from_fn(|k| {
                ((center[k] + 1e-6 - grid.pose[k] + 0.5 * grid.dims[k]) / grid.voxel_size) as usize
            });
            let theirs = grid.values[x[0] * n[1] * n[2] + x[1] * n[2] + x[2]];
            assert_eq!(theirs, -field.values[i]);
        }
        assert!(grid.values.iter().any(|d| *d > 0.0), "positive inside");
    }
}
