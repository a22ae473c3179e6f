//! What the README shows to planners, in 2-D and 3-D.

#![allow(clippy::unwrap_used)] // what cannot be set up ends the test

use portolan::field::{SparseEsdf, SparseEsdfSettings};
use portolan::map::{Tsdf, Tsdf2, Tsdf3, TsdfConfig};
use portolan::plan::{Demand, Waypoints, check_path};
use portolan::store::Bricks;

/// Distances to a wall at x = 3, as a map would have them.
fn wall_2d() -> Tsdf2 {
    let mut tsdf = Tsdf2::new(TsdfConfig { cells: [80, 60], ..Default::default() }).unwrap();
    (0..tsdf.grid().len()).for_each(|i| {
        let cell = tsdf.grid().cell(i);
        let d = 3.0 - tsdf.grid().lattice.center(cell)[0];
        tsdf.fuse(cell, d, 1.0);
    });
    tsdf
}

#[test]
fn in_2d() {
    let tsdf = wall_2d();
    let how = SparseEsdfSettings { unknown: true, ..Default::default() };
    let field = SparseEsdf::of_tsdf(&tsdf, &how);
    let path = Waypoints::new(vec![[0.5, 0.5], [2.5, 1.5], [2.5, 2.4]]).unwrap();
    assert!(check_path(&field, &path, &Demand::new(0.4)).is_certified());
    assert!(!check_path(&field, &path, &Demand::new(0.55)).is_certified());
}

#[test]
fn in_3d() {
    let how = SparseEsdfSettings { unknown: true, ..Default::default() };
    let path = Waypoints::new(vec![[0.5, 0.5, 0.5], [1.5, 1.0, 1.5], [1.5, 1.5, 1.0]]).unwrap();
    // Nothing was seen yet: nothing is certified.
    let unseen = Tsdf3::new(TsdfConfig::default()).unwrap();
    let field = SparseEsdf::of(unseen.store(), &how);
    assert!(!check_path(&field, &path, &Demand::new(0.3)).is_certified());
    // A wall at x = 2.
    let mut tsdf = Tsdf::<3>::new(TsdfConfig { cells: [48; 3], ..Default::default() }).unwrap();
    (0..tsdf.grid().len()).for_each(|i| {
        let cell = tsdf.grid().cell(i);
        let d = 2.0 - tsdf.grid().lattice.center(cell)[0];
        tsdf.fuse(cell, d, 1.0);
    });
    let field = SparseEsdf::of(&Bricks::from(tsdf.store()), &how);
    assert!(check_path(&field, &path, &Demand::new(0.45)).is_certified());
    assert!(!check_path(&field, &path, &Demand::new(0.55)).is_certified());
}
