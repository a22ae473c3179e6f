//! What the README shows to planners, in 2-D and 3-D.

use portolan::field::{Esdf, EsdfSettings};
use portolan::geom::Grid;
use portolan::map::{DenseTsdf, Tsdf3, TsdfConfig};
use portolan::plan::{Demand, Waypoints, check_path};

/// Distances to a wall at this x, as a map would have them.
fn wall<const D: usize>(shape: [usize; D], x: f64) -> DenseTsdf<D> {
    let grid = Grid::new([0.0; D], 0.05, shape);
    let mut tsdf = DenseTsdf::covering(&grid, TsdfConfig::textbook()).unwrap();
    (0..grid.len()).for_each(|i| {
        let cell = grid.cell(i);
        tsdf.fuse(cell, x - grid.lattice.center(cell)[0], 1.0);
    });
    tsdf
}

#[test]
fn in_2d() {
    let tsdf = wall([80, 60], 3.0);
    let how = EsdfSettings { unknown: true, ..Default::default() };
    let field = Esdf::of(&tsdf, &how);
    let path = Waypoints::new(vec![[0.5, 0.5], [2.5, 1.5], [2.5, 2.4]]).unwrap();
    assert!(check_path(&field, &path, &Demand::new(0.4)).is_certified());
    assert!(!check_path(&field, &path, &Demand::new(0.55)).is_certified());
}

#[test]
fn in_3d() {
    let how = EsdfSettings { unknown: true, ..Default::default() };
    let path = Waypoints::new(vec![[0.5, 0.5, 0.5], [1.5, 1.0, 1.5], [1.5, 1.5, 1.0]]).unwrap();
    // Nothing was seen yet: nothing is certified.
    let unseen = Tsdf3::new(TsdfConfig::textbook()).unwrap();
    let field = Esdf::of(&unseen, &how);
    assert!(!check_path(&field, &path, &Demand::new(0.3)).is_certified());
    let field = Esdf::of(&wall([48; 3], 2.0), &how);
    assert!(check_path(&field, &path, &Demand::new(0.45)).is_certified());
    assert!(!check_path(&field, &path, &Demand::new(0.55)).is_certified());
}
