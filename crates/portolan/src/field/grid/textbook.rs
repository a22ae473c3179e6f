//! The textbook's distance field of a dense map.

use super::{EsdfGrid, squared_distance_transform};
use crate::map::DenseTsdf;

/// The textbook's transform: seeds every observed cell within `band_cells` of the surface with its own
/// estimate, `f = (D / r)^2`, runs the exact squared distance transform over `f`, and takes the sign from `D`.
///
/// Cells of weight below `min_weight` neither seed nor are answered for, so that a map without a surface is
/// unknown everywhere. O(cells).
///
/// [`Esdf`](crate::field::Esdf) is the field to plan with: this one is what the text derives, kept for comparison.
///
/// How far to trust it: `sqrt(dist^2 + D^2)` treats a cell's offset to the surface as if it were at right
/// angles to the way there. On an exact field that makes distances too small by up to one and a half cells,
/// and never too large; on a fused field, whose values are projective, it can be too large by as much as the
/// cells' values are.
pub fn esdf_from_tsdf<const D: usize>(tsdf: &DenseTsdf<D>, min_weight: f32, band_cells: f64) -> EsdfGrid<D> {
    let grid = *tsdf.grid();
    let planes = tsdf.store().planes();
    let (distance, weight) = (planes.distances(), planes.weights());
    let inverse = 1.0 / grid.lattice.resolution;
    let observed = |w: f32| w > 0.0 && w >= min_weight;
    let mut f: Vec<f64> = distance
        .iter()
        .zip(weight)
        .map(|(&d, &w)| {
            let offset = f64::from(d) * inverse;
            if observed(w) && offset.abs() <= band_cells { offset * offset } else { f64::INFINITY }
        })
        .collect();
    squared_distance_transform(&mut f, grid.shape);
    let signed = f.iter().zip(distance.iter().zip(weight)).map(|(&sq, (&d, &w))| {
        let known = observed(w) && sq < f64::INFINITY;
        let length = (sq.sqrt() * grid.lattice.resolution) as f32;
        if !known {
            f32::NAN
        } else if d < 0.0 {
            -length
        } else {
            length
        }
    });
    EsdfGrid::of_cells(grid, signed.collect(), None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Answer;
    use crate::geom::Grid;
    use crate::geom::vector;
    use crate::map::TsdfConfig;
    use crate::testing;

    fn sphere<const D: usize>(n: usize, r: f64, radius: f64) -> DenseTsdf<D> {
        let centre = [0.5 * n as f64 * r; D];
        testing::tsdf(Grid::new([0.0; D], r, [n; D]), 3.0 * r, |p| vector::distance(p, centre) - radius)
    }

    /// The seeding's half of the finding that can be proved: on an exact field the distance is never too large,
    /// and too small by at most one and a half cells.
    fn exact_fields_are_never_over_estimated<const D: usize>() {
        let (n, r) = (40, 0.05);
        let tsdf = sphere::<D>(n, r, 0.5);
        let esdf = esdf_from_tsdf(&tsdf, 0.5, 1.5);
        let centre = [0.5 * n as f64 * r; D];
        let mut worst_under: f64 = 0.0;
        for (i, &d) in esdf.samples().iter().enumerate() {
            let truth =
                (vector::distance(esdf.grid().lattice.center(esdf.grid().cell(i)), centre) - 0.5).abs();
            let error = f64::from(d).abs() - truth;
            // Sub-cell offsets of a curved surface: its chord lies inside by r^2 / 8R.
            assert!(error <= r * r / (8.0 * 0.5) + 1e-6, "over by {error}");
            worst_under = worst_under.max(-error);
        }
        assert!(worst_under > 0.2 * r && worst_under <= 1.5 * r, "under by {worst_under}");
    }

    #[test]
    fn exact_fields_are_never_over_estimated_2d_and_3d() {
        exact_fields_are_never_over_estimated::<2>();
        exact_fields_are_never_over_estimated::<3>();
    }

    #[test]
    fn a_map_without_a_surface_is_unknown_and_not_far() {
        let tsdf = testing::tsdf(Grid::new([0.0; 2], 0.05, [10; 2]), 0.15, |_| 0.15);
        let esdf = esdf_from_tsdf(&tsdf, 0.5, 1.5);
        assert_eq!(esdf.distance([0.25, 0.25]), Answer::Unknown);
        assert_eq!(esdf.gradient([0.25, 0.25]), Answer::Unknown);
        assert_eq!(esdf.distance([0.26, 0.6]), Answer::Outside);
    }

    #[test]
    fn unobserved_cells_make_their_neighbourhood_unknown() {
        let mut tsdf =
            DenseTsdf::covering(&Grid::new([0.0; 2], 0.1, [20; 2]), TsdfConfig::textbook()).unwrap();
        for i in 0..400 {
            let cell = tsdf.grid().cell(i);
            if cell != [10, 10] {
                tsdf.fuse(cell, 0.1 * (f64::from(cell[0]) - 3.7), 1.0);
            }
        }
        let esdf = esdf_from_tsdf(&tsdf, 0.5, 1.5);
        assert_eq!(esdf.distance([1.02, 1.02]), Answer::Unknown);
        let d = esdf.distance([1.3, 1.3]).known().unwrap();
        assert!((0.7..0.9).contains(&d), "{d}");
        let (value, gradient) = esdf.distance_and_gradient([1.5, 0.5]).known().unwrap();
        assert!(value > 0.0 && (gradient[0] - 1.0).abs() < 0.01 && gradient[1].abs() < 1e-6);
        assert!(esdf.distance([0.15, 0.5]).known().unwrap() < 0.0);
    }
}
