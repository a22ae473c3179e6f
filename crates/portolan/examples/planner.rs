//! A planner's questions: certified clearance, a path, the nearest free place.
//!
//! `cargo run --release -p portolan --example planner`
#![allow(clippy::print_stdout, reason = "an example")]

use portolan::field::{ClearanceField, Esdf, EsdfSettings, UnknownSpace};
use portolan::plan::{Demand, PathCheck, Waypoints, check_path, path_violations};
use portolan::{Mapper, MapperSettings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A lap through a simulated flat of 12 m x 9 m.
    let log = portolan_sim::lap(&portolan_sim::apartment().world, &Default::default());
    let mut mapper = Mapper::with(MapperSettings::<2>::new(0.05));
    for (pose, scan) in &log {
        mapper.integrate(pose, scan)?;
    }
    let tsdf = mapper.tsdf().ok_or("no distances")?;
    // Up to 3 m from surfaces, and from space that was never observed.
    let esdf = Esdf::of(tsdf, &EsdfSettings { max_distance: 3.0, unknown: true, ..Default::default() });

    let start = log[0].0.translation;
    let unknown = UnknownSpace::default();
    println!("unknown space is: {}", unknown.word());
    println!("clearance at the start: {:?}", esdf.clearance(start, unknown));

    let way: Vec<[f64; 2]> = log.iter().step_by(10).map(|(pose, _)| pose.translation).collect();
    for clearance in [0.1, 0.2, 2.0] {
        // Every point of the path, also between those that were looked at, is at least so far from obstacles.
        let path = Waypoints::new(way.clone())?;
        match check_path(&esdf, &path, &Demand::new(clearance)) {
            PathCheck::Certified(least) => {
                println!("{clearance} m: certified, {:.3} m at least", least.lower)
            }
            PathCheck::Violated(first) => {
                println!("{clearance} m: refused from {:.2} m on: {:?}", first.from, first.cause);
                let all = path_violations(&esdf, &path, &Demand::new(clearance));
                let length: f64 = all.iter().map(|part| part.to - part.from).sum();
                println!("    {} parts of it, {length:.2} m in all", all.len());
            }
        }
    }
    Ok(())
}
