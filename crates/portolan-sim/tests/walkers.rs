//! People walk by while the robot maps: how much of the free space stands near an obstacle because of them.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "what cannot be set up ends the test; numbers are told"
)]

use portolan::field::{Esdf, ObstacleCells};
use portolan::geom::vector::distance;
use portolan::geom::{Aabb, Pose};
use portolan::scan::Scan;
use portolan::{Mapper, MapperSettings};
use portolan_sim::{Lidar, Random, SEED, Solid, SolidKind, World, apartment, lap_poses, scan_at};

const R: f64 = 0.05;
/// Free points count as near an obstacle up to here (meters).
const NEAR: f64 = 0.1;
const SCANS: usize = 200;

/// A person of 40 cm across: eight corners.
fn person(name: &str, at: [f64; 2]) -> Solid {
    let corner = |k: i32| {
        let angle = f64::from(k) * std::f64::consts::FRAC_PI_4;
        [at[0] + 0.2 * angle.cos(), at[1] + 0.2 * angle.sin()]
    };
    Solid { name: name.into(), kind: SolidKind::Movable, corners: (0..8).map(corner).collect() }
}

/// One lap. Two people walk the robot's way at three times its speed, one each way round, and meet it and each other over
/// and over; one who comes within 60 cm of the robot steps aside.
fn lap(walkers: bool) -> Vec<(Pose<2>, Scan<2>)> {
    let rooms = apartment().world;
    let way = lap_poses(3 * SCANS);
    let scan = |(i, pose): (usize, Pose<2>)| {
        let mut solids = rooms.solids().to_vec();
        let steps = [(9 * i + SCANS) % way.len(), (way.len() * 9 - 9 * i + 2 * SCANS) % way.len()];
        let places = steps.map(|step| way[step].translation);
        let there = places.iter().filter(|p| walkers && distance(**p, pose.translation) > 0.6);
        solids.extend(there.enumerate().map(|(k, p)| person(&format!("person {k}"), *p)));
        (pose, scan_at(&World::new(solids), &pose, &Lidar::default(), SEED, i as u64))
    };
    lap_poses(SCANS).into_iter().enumerate().map(scan).collect()
}

/// Free points within 10 cm of an obstacle, by the default, by the surface alone, by occupied cells: summed up over looks at
/// the map after every 25 scans.
fn near(log: &[(Pose<2>, Scan<2>)], points: &[[f64; 2]]) -> [usize; 3] {
    let mut mapper = Mapper::with(MapperSettings::<2>::new(R));
    let mut near = [0; 3];
    for (i, (pose, scan)) in log.iter().enumerate() {
        mapper.integrate(pose, scan).unwrap();
        if i % 25 < 24 {
            continue;
        }
        let settings = mapper.esdf_settings().unwrap();
        let all = mapper.esdf().unwrap().clone();
        let tsdf = mapper.tsdf().unwrap();
        let surface = Esdf::of(tsdf, &settings);
        let occupied = ObstacleCells::of_occupancy(mapper.occupancy().unwrap().store());
        let occupied = Esdf::of_obstacles(*tsdf.lattice(), &occupied, &settings, usize::MAX).unwrap();
        for (n, field) in near.iter_mut().zip([&all, &surface, &occupied]) {
            let is_near = |p: &&[f64; 2]| field.distance(**p).value().is_some_and(|d| d <= NEAR);
            *n += points.iter().filter(is_near).count();
        }
    }
    near
}

#[test]
fn people_who_walked_by_leave_no_more_than_they_did() {
    let world = apartment().world;
    let (mut random, box_of) = (Random::stream(7, 0), world.aabb());
    let mut point = || [0, 1].map(|k| box_of.min[k] + random.uniform() * box_of.extent()[k]);
    // In rooms, more than what is called near away from what stands there.
    let inside = Aabb::new([0.2, 0.2], [11.8, 8.8]);
    let points: Vec<[f64; 2]> = (0..16_000)
        .map(|_| point())
        .filter(|p| inside.contains(*p) && world.signed_distance(*p) > NEAR + 2.0 * R)
        .collect();
    assert!(points.len() > 5_000);
    let [empty, walked] = [false, true].map(lap);
    let hits_person =
        |a: &Scan<2>, b: &Scan<2>| a.beams().zip(b.beams()).filter(|(a, b)| a.range > b.range + 0.1).count();
    let on_people: usize = empty.iter().zip(&walked).map(|(a, b)| hits_person(&a.1, &b.1)).sum();
    let [without, with] = [&empty, &walked].map(|log| near(log, &points));
    let share = |n: usize| n as f64 / (points.len() * SCANS / 25) as f64;
    let ghosts: [f64; 3] = std::array::from_fn(|k| share(with[k]) - share(without[k]));
    println!("{} points, {on_people} beams on people", points.len());
    println!("near an obstacle, by the default, the surface alone, occupied cells:");
    println!("  nobody there  {:.5?}", without.map(share));
    println!("  two walk      {:.5?}", with.map(share));
    println!("  because of it {ghosts:.5?}");
    // Something is there to be measured: beams fell on people, and they are seen in the maps between whiles.
    assert!(on_people > 500 && ghosts[2] > 0.0 && without.iter().all(|n| *n == 0));
    // Obstacles are what either map says is there, and so no more than both together; a point in a thousand at most.
    assert!(ghosts[0] <= ghosts[1] + ghosts[2] && ghosts[0] < 1e-3, "{ghosts:?}");
}
