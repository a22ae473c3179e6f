//! Writes a drive along a simulated street, for maps that are larger than memory: `street OUT [SCANS [METERS]]` (2000 scans, 1000 m).
//! Ten buildings along a bend, lamps, trees and parked cars on open ground; a lidar of 32 rings, 512 columns and 40 m, in KITTI's layout.

use portolan::geom::Pose;
use portolan_io::{LogLayout, LogWriter};
use portolan_sim::building::{Body, Shape, SpinningLidar, World3, lidar_frame};
use portolan_sim::{Random, SEED};
use std::path::Path;

const BUILDINGS: u32 = 10;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out, rest @ ..] = arguments.as_slice() else {
        return Err("call it as: street OUT [SCANS [METERS]]".into());
    };
    let scans: u32 = rest.first().map_or(Ok(2000), |scans| scans.parse())?;
    let meters: f64 = rest.get(1).map_or(Ok(1000.0), |meters| meters.parse())?;
    let world = street(meters);
    let lidar = SpinningLidar { rings: 32, columns: 512, max_range: 40.0, ..SpinningLidar::default() };
    let directions = lidar.directions();
    let layout = LogLayout::Kitti { camera_from_lidar: Pose::IDENTITY };
    let mut writer = LogWriter::create(Path::new(out), layout)?;
    for i in 0..scans {
        let s = meters * f64::from(i) / f64::from(scans);
        let pose = at(s, meters, 0.0, 1.8);
        let frame = lidar_frame(&world, &pose, &lidar, &directions, (SEED, i.into()));
        writer.push(&pose, 0.1 * f64::from(i), &frame)?;
    }
    writer.finish()?;
    Ok(())
}

/// A pose on the street: so far along it and to the left of it, at this height (meters).
fn at(s: f64, meters: f64, left: f64, height: f64) -> Pose<3> {
    // An arc of a sixth of a turn.
    let turn = std::f64::consts::FRAC_PI_3 * s / meters;
    let radius = meters / std::f64::consts::FRAC_PI_3;
    let (sin, cos) = (libm::sin(turn), libm::cos(turn));
    let (x, y) = ((radius - left) * sin, radius - (radius - left) * cos);
    Pose { rotation: [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], translation: [x, y, height] }
}

fn street(meters: f64) -> World3 {
    let mut random = Random::stream(SEED, 0x0005_73EE);
    let mut between = move |low: f64, high: f64| low + (high - low) * random.uniform();
    let mut bodies = Vec::new();
    let mut add = |name: &str, shape, color| bodies.push(Body { name: name.into(), shape, color });
    let ground = Shape::between([-100.0, -100.0, -0.5], [meters + 100.0, meters + 100.0, 0.013]);
    add("ground", ground, [120, 120, 110]);
    let spacing = meters / f64::from(BUILDINGS);
    for k in 0..BUILDINGS {
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let [length, depth, height] = [between(0.25, 0.4) * spacing, between(10.0, 16.0), between(6.0, 14.0)];
        let world_from_box =
            at(spacing * (f64::from(k) + 0.5), meters, side * (9.0 + 0.5 * depth), 0.5 * height - 0.2);
        let half = [0.5 * length, 0.5 * depth, 0.5 * height];
        add("building", Shape::Box { world_from_box, half }, [190, 150, 120]);
        for i in 0..8 {
            let s = spacing * (f64::from(k) + f64::from(i) / 8.0);
            let lamp = at(s, meters, -5.5, 2.5).translation;
            add("lamp", Shape::Cylinder { centre: lamp, radius: 0.08, half_height: 2.6 }, [80, 80, 80]);
            let car = at(s + between(1.0, 7.0), meters, 4.2, 0.75);
            add("car", Shape::Box { world_from_box: car, half: [2.1, 0.85, 0.72] }, [60, 80, 160]);
            let centre =
                at(s + between(0.0, 5.0), meters, -side * between(8.0, 14.0), between(3.5, 5.0)).translation;
            add("crown", Shape::Sphere { centre, radius: between(1.2, 2.2) }, [60, 130, 60]);
            let trunk = [centre[0], centre[1], 0.5 * centre[2]];
            add(
                "trunk",
                Shape::Cylinder { centre: trunk, radius: 0.2, half_height: 0.5 * centre[2] },
                [90, 70, 50],
            );
        }
    }
    World3::new(bodies)
}
