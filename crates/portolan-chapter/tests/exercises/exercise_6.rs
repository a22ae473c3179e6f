//! Exercise 6: the k-d tree over end points, `Cloud`, against the distance field.

use crate::page::{check, mm};
use portolan::field::esdf_from_tsdf;
use portolan::geom::Grid;
use portolan::map::{Cloud, Tsdf2, TsdfConfig};
use portolan_chapter::MapRepr;
use portolan_chapter::gallery::{GallerySettings, Row, run};
use portolan_draw::shown_bytes;
use portolan_sim::{CHAIR_MOVE, LapConfig, Truth, apartment, lap};

/// A point is held twice, once with its index (bytes).
const POINT_BYTES: usize = 2 * 16 + 4;

/// Scans of the lap after which the cloud holds more bytes than a distance field of the Apartment, and those bytes.
fn scans_until_larger() -> (usize, usize) {
    let world = apartment().world;
    let grid = Grid::new([0.0; 2], 0.05, [240, 180]);
    let tsdf = Tsdf2::covering(&grid, TsdfConfig::textbook()).unwrap();
    let field = esdf_from_tsdf(&tsdf, 0.5, 1.5).memory_bytes();
    let mut points = Vec::new();
    let scans = lap(&world, &LapConfig::default());
    let larger = scans.iter().position(|(pose, scan)| {
        points.extend(scan.hits_world(pose));
        // Made at once, a cloud has little room to spare.
        Cloud::from_points(points.iter().copied()).memory_bytes() > field
    });
    (larger.unwrap() + 1, field)
}

/// The cloud grows with the time, the map with the building: after a second lap the one is twice as large, the other as
/// large as before.
#[test]
fn exercise_6_bytes_cross_over_after_a_few_scans() {
    let (scans, _) = scans_until_larger();
    assert!((scans as f64 - 12.0).abs() <= 1.0, "{scans}");
    let points: Vec<_> = lap(&apartment().world, &LapConfig::default())
        .iter()
        .flat_map(|(pose, scan)| scan.hits_world(pose).collect::<Vec<_>>())
        .collect();
    let bytes = POINT_BYTES * points.len();
    assert!(Cloud::from_points(points.iter().copied()).memory_bytes() >= bytes);
    let twice = Cloud::from_points(points.iter().chain(&points).copied());
    assert!(twice.memory_bytes() >= 2 * bytes && twice.points().len() == 2 * points.len());
}

/// What cloud and filter make of a chair that was moved between two laps: distance of the cloud and true distance at the
/// place where it stood (meters), and the filter's occupancy there.
fn after_the_move() -> (f64, f64, Option<f64>) {
    let world = apartment().world;
    let moved = world.with_moved("chair", CHAIR_MOVE);
    let grid = Grid::covering(world.aabb(), 0.05).unwrap();
    let mut tsdf = Tsdf2::covering(&grid, TsdfConfig { w_max: 4.0, ..TsdfConfig::textbook() }).unwrap();
    let mut cloud = Cloud::new();
    for (k, world) in [&world, &moved].into_iter().enumerate() {
        for (pose, scan) in lap(world, &LapConfig { first_index: 200 * k as u64, ..Default::default() }) {
            tsdf.integrate(&pose, &scan).unwrap();
            cloud.integrate(&pose, &scan);
        }
    }
    cloud.rebuild();
    // The middle of the side that the robot saw.
    let ghost = [1.87, 2.825];
    // A cloud has no inside and no free space.
    assert_eq!(MapRepr::<2>::occupancy(&cloud, ghost), None);
    (
        cloud.nearest_distance(ghost).unwrap(),
        moved.signed_distance(ghost),
        MapRepr::<2>::occupancy(&tsdf, ghost),
    )
}

/// The real question: a cloud is the log, not the map. It keeps every end point, so that the chair is still there after
/// it was moved; the filter forgets.
#[test]
fn exercise_6_a_cloud_cannot_forget() {
    let (cloud, truth, filter) = after_the_move();
    assert!(truth > 0.5 && cloud < 0.03);
    assert_eq!(filter, Some(0.0));
}

#[test]
fn exercise_6_on_the_page() {
    let world = apartment().world;
    let log = lap(&world, &LapConfig::default());
    let grid = Grid::new([0.0; 2], 0.05, [240, 180]);
    let settings = GallerySettings::new(grid, 100_000, None);
    let gallery = run(&log, &settings, Some(&world as &dyn Truth<2>), &mut || 0.0).unwrap();
    let row = |name: &str| gallery.rows.iter().find(|r| r.name.starts_with(name)).unwrap();
    let error = |row: &Row| mm(row.distance_error.unwrap().median);
    let (scans, field) = scans_until_larger();
    let cloud = Cloud::from_points(gallery.cloud.points().iter().copied()).memory_bytes();
    let (ghost, truth, filter) = after_the_move();
    assert_eq!(filter, Some(0.0));
    let rows = [
        ("points after the lap", gallery.cloud.points().len().to_string()),
        ("bytes of the points and their tree after the lap", shown_bytes(cloud as f64)),
        ("bytes of the distance field", shown_bytes(field as f64)),
        ("scans of 200 after which the cloud is the larger one", scans.to_string()),
        ("error of the cloud's distances in free space, median", error(row("point cloud"))),
        ("error of the distance field's", error(row("ESDF"))),
        ("the chair has moved: distance of the cloud where it stood", mm(ghost)),
        ("true distance there", mm(truth)),
    ];
    check(6, &rows);
}
