//! Fields of distances over both stores.

use super::*;
use crate::geom::{Aabb, Grid, Pose};
use crate::scan::{Frame, Pinhole, PointScan, RangeImage, RangeLimits, Scan};
use crate::store::Store;

fn fan(k: u32) -> (Pose<2>, Scan<2>) {
    let bearings: Vec<f64> = (0..90).map(|i| f64::from(i) * 0.07 - 3.1).collect();
    let ranges: Vec<f64> = (0..90).map(|i| 0.8 + 0.1 * f64::from((i * k) % 5)).collect();
    let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
    (Pose::<2>::new(0.02 * f64::from(k), 0.0, 0.3 * f64::from(k)), scan)
}

const GRID: [usize; 2] = [60, 60];

fn config(beams: BeamSweep) -> TsdfConfig<2> {
    TsdfConfig { origin: [-1.5, -1.5], w_max: 3.0, beams, ..TsdfConfig::textbook() }
}

fn grid() -> Grid<2> {
    Grid::new([-1.5, -1.5], 0.05, GRID)
}

fn events_are_what_happened<S: Store<SignedDistance, 2> + Clone>(mut tsdf: Tsdf<2, S>) {
    let mut unwatched = tsdf.clone();
    let all = || (0..60).flat_map(|x| (0..60).map(move |y| [x, y]));
    let cells = all().filter(|c| (c[0] * 7 + c[1]) % 3 == 0);
    tsdf.watch(cells.clone().chain([[3, 3], [3, 3]]));
    let mut seen = 0;
    for k in 0..6 {
        let (pose, scan) = fan(k);
        let before = tsdf.clone();
        tsdf.integrate(&pose, &scan).unwrap();
        unwatched.integrate(&pose, &scan).unwrap();
        assert!(all().all(|c| tsdf.store().cell(c) == unwatched.store().cell(c)));
        assert!(unwatched.events().is_empty());
        let observed: std::collections::HashMap<_, _> = tsdf.events().iter().copied().collect();
        assert_eq!(observed.len(), tsdf.events().len());
        seen += observed.len();
        for cell in cells.clone() {
            let (old, new) = (before.store().cell(cell), tsdf.store().cell(cell));
            match observed.get(&cell) {
                None => assert_eq!(old, new),
                Some(e) => {
                    let new = new.unwrap();
                    assert_eq!((e.after as f32, e.weight_after as f32), (new.distance, new.weight));
                    assert_eq!(e.weight_before, old.map_or(0.0, |c| c.weight.into()));
                    assert!(e.gain > 0.0 && e.gain <= 1.0);
                }
            }
        }
    }
    assert!(seen > 1000);
}

#[test]
fn events_of_watched_cells_are_what_happened() {
    for beams in [BeamSweep::CellCentre, BeamSweep::March] {
        let mut dense = Tsdf2::covering(&grid(), config(beams)).unwrap();
        dense.watch([[-1, 4], [60, 2]]);
        events_are_what_happened(dense);
        events_are_what_happened(Tsdf::<2>::new(config(beams)).unwrap());
    }
}

#[test]
fn bricks_within_bounds_hold_what_an_array_holds() {
    for beams in [BeamSweep::CellCentre, BeamSweep::March] {
        let mut dense = Tsdf2::covering(&grid(), config(beams)).unwrap();
        let mut bricks = Tsdf::<2>::new(config(beams)).unwrap();
        bricks.set_bounds(Some(grid().aabb()));
        let mut observed = 0;
        for k in 0..6 {
            let (pose, scan) = fan(k);
            let (a, b) = (dense.integrate(&pose, &scan).unwrap(), bricks.integrate(&pose, &scan).unwrap());
            assert_eq!((a.beams, a.refused, a.hits_outside), (b.beams, b.refused, b.hits_outside));
            observed += b.cells;
        }
        assert!(observed > 3_000);
        for x in -20..80 {
            for y in -20..80 {
                assert_eq!(dense.store().cell([x, y]), bricks.store().cell([x, y]), "{x} {y}");
            }
        }
    }
}

#[test]
fn a_scan_that_reaches_too_far_is_refused_with_a_clear_error() {
    let bearings: Vec<f64> = (0..90).map(|i| f64::from(i) * 0.07 - 3.1).collect();
    let limits = RangeLimits { max: 1e9, ..Default::default() };
    let far = Scan::from_laser(&bearings, &[1e8; 90], &limits);
    let mut map = Tsdf::<2>::new(TsdfConfig::textbook()).unwrap();
    let error = map.integrate(&Pose::<2>::IDENTITY, &far).unwrap_err();
    assert!(matches!(error, MapError::TooFar { .. }), "{error}");
    let mut grid =
        Occupancy::<2>::new(crate::geom::Lattice::new([0.0; 2], 0.05), Default::default()).unwrap();
    let stats = grid.integrate(&Pose::<2>::IDENTITY, &far).unwrap();
    assert_eq!((stats.refused.too_far, stats.beams.dropped, stats.cells), (90, 90, 0));
    // Inside of bounds they are walked as far as these go.
    grid.set_bounds(Some(Aabb::new([-2.0; 2], [2.0; 2])));
    assert!(grid.integrate(&Pose::<2>::IDENTITY, &far).unwrap().cells > 1000);

    // Pixels that look almost aside: what they see is a meter deep and a hundred thousand kilometers wide.
    let camera = Pinhole { fx: 1e-8, fy: 1e-8, cx: 0.5, cy: 0.5 };
    let image = RangeImage::from_depth(camera, 2, 2, [1.0; 4]);
    let mut map = Tsdf3::new(TsdfConfig::textbook()).unwrap();
    let error = map.integrate(&Pose::IDENTITY, &Frame::Image(image)).unwrap_err();
    assert!(matches!(error, MapError::TooFar { .. }), "{error}");
    assert!(map.store().is_empty());
}

#[test]
fn rays_take_no_more_memory_than_the_limit_allows_for() {
    let config = TsdfConfig { max_range: 2000.0, points: PointSweep::Rays, ..TsdfConfig::textbook() };
    let points = (0..20).map(|i| {
        let a = 0.7 * i as f32;
        [1900.0 * a.cos(), 1900.0 * a.sin(), 0.0]
    });
    let scan = PointScan::new(points, [0.0; 3]);
    let mut map = Tsdf3::new(config).unwrap();
    map.set_limit(1 << 20);
    let error = map.integrate(&Pose::IDENTITY, &scan).unwrap_err();
    assert!(matches!(error, MapError::Full(_)), "{error}");
}
