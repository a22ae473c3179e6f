//! Certified paths and motions through the Apartment and the Building, against the exact distance to what was extracted.

use crate::common::{apartment, points, tsdf};
use crate::scenes::{Random, Segments};
use portolan::field::{Esdf, EsdfSettings};
use portolan::geom::{Pose, vector};
use portolan::map::{BeamSweep, Tsdf2, Tsdf3, TsdfConfig};
use portolan::plan::{
    Body, Cause, Curve, Demand, Motion, MotionCheck, NearestFree, PathCheck, PathClearance, Spline,
    Waypoints, check_motion, check_path, check_pose, nearest_free,
};
use portolan::store::Store;
use portolan::surface::{ContourSettings, MeshSettings, NearestSurface, marching_cubes, marching_squares};
use portolan_sim::building::{BuildingConfig, BuildingSensor, SpinningLidar, building_log};
use std::sync::LazyLock;

/// The Apartment at 5 cm, its field up to one meter, and the contour it is about.
static APARTMENT: LazyLock<(Tsdf2, Esdf<2>, Segments)> = LazyLock::new(|| {
    let tsdf = tsdf(BeamSweep::CellCentre, true, &apartment().log);
    let settings = EsdfSettings { unknown: true, ..Default::default() };
    let esdf = Esdf::of(&tsdf, &settings);
    let contour = ContourSettings { min_weight: settings.min_weight, ..Default::default() };
    let segments = Segments::of(&marching_squares(&tsdf, &contour), 0.1);
    (tsdf, esdf, segments)
});

/// Whether a cell within `reach` of a point was not observed: as boxes, cell by cell.
fn near_unknown(tsdf: &Tsdf2, p: [f64; 2], reach: f64) -> bool {
    let lattice = tsdf.grid().lattice;
    let [low, high] = [-reach, reach].map(|d| lattice.cell_of(p.map(|v| v + d)).unwrap());
    (low[0]..=high[0]).flat_map(|x| (low[1]..=high[1]).map(move |y| [x, y])).any(|cell| {
        let box_ = lattice.aabb(cell, cell.map(|v| v + 1));
        let off: [f64; 2] = std::array::from_fn(|k| (box_.min[k] - p[k]).max(p[k] - box_.max[k]).max(0.0));
        tsdf.store().cell(cell).is_none_or(|c| c.weight < 0.5) && vector::norm(off) < reach
    })
}

/// Every 5 mm of a part of a path keeps `least`, exactly.
fn keeps(path: &impl Curve<2>, to: f64, least: f64, demand: &Demand) {
    let (tsdf, _, segments) = &*APARTMENT;
    let mut t = 0.0;
    loop {
        let p = path.point(t);
        let exact = segments.distance(p).unwrap();
        assert!(exact >= least, "{exact} of {least} at {p:?}");
        if *demand == Demand::new(demand.clearance) {
            assert!(!near_unknown(tsdf, p, least - 1e-9), "{p:?} is near the unknown");
        }
        if t >= to {
            return;
        }
        t = path.advance(t, 5e-3).min(to);
    }
}

/// What was found of a path is true, as far as it was certified; whether all of it was.
fn is_true(path: &impl Curve<2>, demand: &Demand) -> Result<PathClearance, Cause> {
    let (_, esdf, segments) = &*APARTMENT;
    match check_path(esdf, path, demand) {
        PathCheck::Certified(least) => {
            keeps(path, path.end(), least.lower, demand);
            let at = segments.distance(path.point(least.at)).unwrap();
            assert!(*demand == Demand::new(demand.clearance) || at <= least.upper);
            Ok(least)
        }
        PathCheck::Violated(found) => {
            if found.from > 0.0 {
                keeps(path, found.from, demand.clearance, demand);
            }
            Err(found.cause)
        }
    }
}

#[test]
fn certified_paths_through_the_apartment_keep_their_clearance() {
    let drives: Vec<_> = portolan_sim::apartment().path.windows(2).map(|w| w.to_vec()).collect();
    let (mut free, mut refused) = (0, 0);
    // The legs of the lap, which were driven and seen; a robot of 20 cm keeps 5 cm besides.
    for leg in &drives {
        let path = Waypoints::new(leg.clone()).unwrap();
        for demand in [Demand::new(0.25), Demand::new(0.25).optimistic()] {
            match is_true(&path, &demand) {
                Ok(_) => free += 1,
                Err(cause) => {
                    println!("{leg:?}: {cause:?}");
                    refused += 1;
                }
            }
        }
    }
    println!("legs of the lap: {free} certified, {refused} refused");
    assert!(free > 9 * refused, "{free} {refused}");
    // Anything at all, straight and bent.
    let places: Vec<_> = points(600).collect();
    let mut counts = std::collections::BTreeMap::new();
    for (i, p) in places.chunks_exact(3).enumerate() {
        let demand = Demand::new([0.0, 0.05, 0.2][i % 3]);
        let demand = if i % 2 == 0 { demand } else { demand.optimistic() };
        // Shorter than between far rooms, so that some are free.
        let near = |q: [f64; 2]| vector::along(p[0], vector::sub(q, p[0]), 0.15);
        let corners = vec![p[0], near(p[1]), near(p[2])];
        let straight = is_true(&Waypoints::new(corners.clone()).unwrap(), &demand);
        let bent = is_true(&Spline::catmull_rom(&corners).unwrap(), &demand);
        for found in [straight, bent] {
            let word = match found {
                Ok(_) => "certified".to_owned(),
                Err(cause) => format!("{cause:?}"),
            };
            *counts.entry(word).or_insert(0) += 1;
        }
    }
    println!("random paths: {counts:?}");
    assert!(counts["certified"] > 40 && counts["TooNear"] + counts["Unknown"] > 100, "{counts:?}");
    // Bounds are so close that few are left undecided.
    assert!(counts.get("Undecided").copied().unwrap_or(0) < 20, "{counts:?}");
}

#[test]
fn from_a_wall_the_nearest_free_place_is_before_it() {
    let (_, esdf, segments) = &*APARTMENT;
    let demand = Demand::new(0.25);
    let (mut found, mut none) = (0, 0);
    for p in points(150) {
        match nearest_free(esdf, p, &demand, &Default::default()) {
            NearestFree::Here => assert!(segments.distance(p).unwrap() >= 0.25),
            NearestFree::At { point, distance } => {
                assert!(segments.distance(point).unwrap() >= 0.25 && distance <= 2.0 + 1e-9);
                found += 1;
            }
            NearestFree::NoneWithin(_) => none += 1,
        }
    }
    println!("{found} of 150 places have a free one near, {none} none");
    assert!(found > 30 && none < 20);
}

#[test]
fn certified_motions_through_the_building_keep_their_clearance() {
    let sensor = BuildingSensor::Lidar(SpinningLidar { rings: 32, columns: 512, ..Default::default() });
    let log = building_log(&BuildingConfig { scans: 24, sensor, ..Default::default() });
    let mut map =
        Tsdf3::new(TsdfConfig { resolution: 0.1, truncation: 0.3, ..TsdfConfig::textbook() }).unwrap();
    for (pose, frame) in &log.scans {
        map.integrate(pose, frame).unwrap();
    }
    let settings = EsdfSettings { unknown: true, ..Default::default() };
    let esdf = Esdf::of(map.store(), &settings);
    let mesh = MeshSettings { min_weight: settings.min_weight, ..Default::default() };
    let surface = NearestSurface::of_mesh(&marching_cubes(map.store(), None, &mesh));
    // A drone: a ball in the middle, four around it.
    let arm = 0.18;
    let body = Body::of(&[
        ([0.0; 3], 0.1),
        ([arm, arm, 0.0], 0.06),
        ([-arm, arm, 0.0], 0.06),
        ([arm, -arm, 0.0], 0.06),
        ([-arm, -arm, 0.0], 0.06),
    ])
    .unwrap();
    let mut random = Random(7);
    let mut free = 0;
    let mut refused = 0;
    for i in 0..300 {
        let (from, _) = &log.scans[i % log.scans.len()];
        let mut unit = || 2.0 * random.unit() - 1.0;
        let q = [unit(), unit(), unit(), unit()];
        let step: [f64; 3] = std::array::from_fn(|_| 1.2 * unit());
        let to = Pose::<3>::from_quaternion(vector::add(from.translation, step), q).unwrap();
        let motion = Motion::new(*from, to);
        let demand = Demand::new(0.05);
        let demand = if i % 2 == 0 { demand } else { demand.optimistic() };
        let (end, least) = match check_motion(&esdf, &body, &motion, &demand) {
            MotionCheck::Free(found) => {
                free += 1;
                assert!(check_pose(&esdf, &body, &to, &demand).is_free());
                (1.0, found.lower)
            }
            MotionCheck::Refused { from_to, .. } => {
                refused += 1;
                (from_to[0], 0.05)
            }
        };
        for u in (0..=60).filter(|_| end > 0.0) {
            let pose = motion.pose(end * f64::from(u) / 60.0);
            for s in body.spheres() {
                let exact = surface.distance(pose.transform_point(s.center)).unwrap() - s.radius;
                // The sensor's own axis: rotations of a motion are rigid to 1e-12.
                assert!(exact >= least - 1e-9, "{exact} of {least}");
            }
        }
    }
    println!("{free} motions certified, {refused} refused");
    assert!(free > 60 && refused > 60);
}
