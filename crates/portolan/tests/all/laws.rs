//! Laws that hold for every map.

use crate::common::{apartment, grid, points, tsdf};
use portolan::Answer;
use portolan::cell::OccupancyModel;
use portolan::field::{esdf_from_tsdf, squared_distance_transform};
use portolan::geom::{Grid, Pose};
use portolan::map::{BeamSweep, DenseTsdf, OccupancyGrid, Quadtree, Tsdf2, TsdfConfig};
use portolan::scan::{Beam, Scan, ScanStats};
use portolan::store::Store;
use portolan::surface::{ContourSettings, marching_squares};

type Log = [(Pose<2>, Scan<2>)];

fn occupancy(grid: Grid<2>, log: &Log) -> OccupancyGrid<2> {
    let mut map = OccupancyGrid::covering(&grid, OccupancyModel::default()).unwrap();
    log.iter().for_each(|(pose, scan)| drop_stats(map.integrate(pose, scan).unwrap()));
    map
}

fn drop_stats(stats: ScanStats) {
    assert_eq!((stats.scans, stats.refused_poses), (1, 0));
}

#[test]
fn quadtree_and_grid_agree_at_every_cell_of_the_apartment() {
    let log = &apartment().log;
    let dense = occupancy(grid(), log);
    let mut tree = Quadtree::covering(&grid(), OccupancyModel::default()).unwrap();
    log.iter().for_each(|(pose, scan)| drop_stats(tree.integrate(pose, scan).unwrap()));
    tree.store().check_invariants();
    let mut compact = tree.clone();
    compact.compact();
    for i in 0..grid().len() {
        let cell = grid().cell(i);
        assert_eq!(tree.store().cell(cell), dense.store().cell(cell));
        assert_eq!(compact.store().cell(cell), dense.store().cell(cell));
    }
    for p in points(2000) {
        assert_eq!(tree.probability(p), dense.probability(p));
    }
}

/// The same log at UTM coordinates gives the same map.
#[test]
fn far_from_zero_nothing_changes() {
    let offset = [500_000.0, 4_000_000.0];
    let near_log = &apartment().log[..60];
    let far_log: Vec<_> = near_log
        .iter()
        .map(|(pose, scan)| {
            let translation = [pose.translation[0] + offset[0], pose.translation[1] + offset[1]];
            (Pose { translation, ..*pose }, scan.clone())
        })
        .collect();
    let far_grid = Grid::new(offset, 0.05, [240, 180]);
    let (near, far) = (occupancy(grid(), near_log), occupancy(far_grid, &far_log));
    // A coordinate of 4e6 is rounded to 5e-10 m: a beam through the corner of a cell may take the other side.
    let differing = (0..grid().len()).filter(|&i| near.store().at(i) != far.store().at(i)).count();
    // Seen: 23 of some 20,000 observed cells.
    assert!(differing <= 60, "{differing} cells differ");

    let near = tsdf(BeamSweep::CellCentre, true, near_log);
    let mut far = Tsdf2::covering(&far_grid, TsdfConfig::textbook()).unwrap();
    far_log.iter().for_each(|(pose, scan)| drop_stats(far.integrate(pose, scan).unwrap()));
    let values = |t: &Tsdf2, i| t.store().at(i).map(|c| (c.distance, c.weight));
    let mut worst: f32 = 0.0;
    let mut differing = 0;
    for i in 0..grid().len() {
        match (values(&near, i), values(&far, i)) {
            (Some(a), Some(b)) if a.1 == b.1 => worst = worst.max((a.0 - b.0).abs()),
            (a, b) => differing += usize::from(a != b),
        }
    }
    assert!(worst < 1e-4 && differing <= 40, "{worst} m, {differing} cells");
}

/// Turning scans and map together by a quarter turn turns the answers.
#[test]
fn a_quarter_turn_of_everything_turns_the_contour() {
    let log = &apartment().log[..60];
    let turn = Pose::<2>::from_cos_sin(9.0, 0.0, 0.0, 1.0);
    let turned_log: Vec<_> = log.iter().map(|(pose, scan)| (turn * *pose, scan.clone())).collect();
    let turned_grid = Grid::new([0.0; 2], 0.05, [180, 240]);
    let straight = tsdf(BeamSweep::CellCentre, true, log);
    let mut turned = Tsdf2::covering(&turned_grid, TsdfConfig::textbook()).unwrap();
    turned_log.iter().for_each(|(pose, scan)| drop_stats(turned.integrate(pose, scan).unwrap()));
    let a = esdf_from_tsdf(&straight, 0.5, 1.5);
    let b = esdf_from_tsdf(&turned, 0.5, 1.5);
    let (mut asked, mut differing) = (0, 0);
    for p in points(4000) {
        asked += 1;
        differing += i32::from(match (a.distance(p), b.distance(turn.transform_point(p))) {
            (Answer::Known(x), Answer::Known(y)) => (x - y).abs() > 1e-3,
            (x, y) => x.status() != y.status(),
        });
    }
    assert!(differing * 200 <= asked, "{differing} of {asked} answers differ");
}

/// A 3-D map seen by a planar scan is the 2-D map.
#[test]
fn a_slice_of_space_is_the_plane() {
    let log = &apartment().log[..40];
    let plane = occupancy(grid(), log);
    let space_grid = Grid::new([0.0, 0.0, -0.1], 0.05, [240, 180, 4]);
    let mut space = OccupancyGrid::<3>::covering(&space_grid, OccupancyModel::default()).unwrap();
    let mut space_tsdf =
        DenseTsdf::covering(&space_grid, TsdfConfig { beams: BeamSweep::March, ..TsdfConfig::textbook() })
            .unwrap();
    for (pose, scan) in log {
        let [[c, s], _] = [[pose.rotation[0][0], pose.rotation[1][0]], [0.0; 2]];
        let rotation = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
        let pose = Pose { rotation, translation: [pose.translation[0], pose.translation[1], 0.025] };
        let scan = Scan::<3>::from_beams(scan.beams().map(|b| Beam {
            direction: [b.direction[0], b.direction[1], 0.0],
            range: b.range,
            kind: b.kind,
        }));
        drop_stats(space.integrate(&pose, &scan).unwrap());
        drop_stats(space_tsdf.integrate(&pose, &scan).unwrap());
    }
    let plane_tsdf = tsdf(BeamSweep::March, true, log);
    let (mut differing, mut off) = (0, 0.0f32);
    for i in 0..grid().len() {
        let [x, y] = grid().cell(i);
        differing += usize::from(plane.store().at(i) != space.store().cell([x, y, 2]));
        if let (Some(a), Some(b)) = (plane_tsdf.store().at(i), space_tsdf.store().cell([x, y, 2])) {
            off = off.max((a.distance - b.distance).abs());
        }
        assert_eq!(space.store().cell([x, y, 1]), None);
    }
    // Normalising a 3-D direction may change its last bit, and with it a cell at a corner.
    assert!(differing <= 20, "{differing} cells differ");
    assert!(off < 1e-3, "{off}");
}

#[test]
fn carving_costs_five_times_as_much_and_does_not_move_the_contour() {
    let log = &apartment().log;
    let count = |carve| {
        let mut map = Tsdf2::covering(&grid(), TsdfConfig { carve, ..TsdfConfig::textbook() }).unwrap();
        let mut stats = ScanStats::default();
        log.iter().for_each(|(pose, scan)| stats += map.integrate(pose, scan).unwrap());
        (stats.cells, marching_squares(&map, &ContourSettings::default()).segments.len())
    };
    let ((carved, with), (banded, without)) = (count(true), count(false));
    println!("{carved} observations with carving, {banded} without; {with} and {without} segments");
    let ratio = carved as f64 / banded as f64;
    assert!((3.0..8.0).contains(&ratio), "{ratio}");
    let changed = (with as f64 - without as f64).abs() / with as f64;
    assert!(changed <= 0.005, "{changed}");
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let shape = [1100, 900];
    let transform = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut f: Vec<f64> = (0..shape[0] * shape[1])
            .map(|i| if i % 1013 == 0 { (i % 7) as f64 * 0.37 } else { f64::INFINITY })
            .collect();
        pool.install(|| squared_distance_transform(&mut f, shape));
        f.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    let one = transform(1);
    assert!(one == transform(2) && one == transform(8));
}

/// Unknown is never a number: beyond what was seen every map says so.
#[test]
fn what_was_never_seen_is_unknown_everywhere() {
    let log = &apartment().log[..1];
    let map = tsdf(BeamSweep::CellCentre, true, log);
    let esdf = esdf_from_tsdf(&map, 0.5, 1.5);
    let grid_map = occupancy(grid(), log);
    let unseen = [11.0, 8.0];
    assert_eq!(map.signed_distance(unseen), Answer::Unknown);
    assert_eq!(esdf.distance(unseen), Answer::Unknown);
    assert_eq!(grid_map.probability(unseen), Answer::Unknown);
    assert_eq!(map.signed_distance([13.0, 8.0]), Answer::Outside);
    assert_eq!(esdf.distance([13.0, 8.0]), Answer::Outside);
    assert_eq!(grid_map.probability([13.0, 8.0]), Answer::Outside);
}
