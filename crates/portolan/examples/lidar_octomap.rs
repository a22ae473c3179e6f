//! A lidar: point clouds with known poses into an occupancy map, written for OctoMap.
//!
//! `cargo run --release -p portolan --example lidar_octomap -- building.bt`
#![allow(clippy::print_stdout, reason = "an example")]

use portolan::geom::Lattice;
use portolan::map::{Occupancy, Octree};
use portolan_io::write_octomap_bt;
use portolan_sim::building::{BuildingConfig, BuildingSensor, SpinningLidar, building_log};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Five scans of a simulated building. Of your own: `PointScan::new(points, origin)` in the sensor's frame, or
    // `map.integrate_points(&points_world, sensor_world)`.
    let sensor = BuildingSensor::Lidar(SpinningLidar::default());
    let log = building_log(&BuildingConfig { scans: 5, sensor, ..Default::default() });

    let mut map = Occupancy::<3>::new(Lattice::new([0.0; 3], 0.1), Default::default())?; // cells of 10 cm
    for (pose, scan) in &log.scans {
        let stats = map.integrate(pose, scan)?;
        println!("{} points, {} cells observed", stats.beams.hit, stats.cells);
    }
    println!("{} bytes for {} cells", map.memory_bytes(), map.observed_cells());

    let tree = Octree::from_bricks(&map)?;
    let around = tree.coarse(log.scans[0].0.translation, 4); // a cube of 1.6 m
    println!("around the first sensor: {around:?}");
    if let Some(path) = std::env::args().nth(1) {
        write_octomap_bt(&path, tree.store())?;
        println!("{path}");
    }
    Ok(())
}
