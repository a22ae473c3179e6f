//! People walk through the building while it is mapped, and a chair is moved.

use super::floor_plan::building_world;
use super::lidar::{SpinningLidar, lidar_frame};
use super::log::{BuildingConfig, BuildingSensor, building_poses};
use super::shape::Shape;
use super::world::{Body, World3};
use crate::Random;
use portolan::geom::Pose;
use portolan::geom::vector::distance;
use portolan::scan::Frame;

/// Places on the sensor's path that the walkers step between.
const PLACES: usize = 400;
const WALKERS: usize = 5;
/// Nobody stands nearer to the sensor than this (meters).
const KEPT_CLEAR: f64 = 0.7;
/// Farther from what moves than this (meters) a return is of something else: six standard deviations of a range.
const NEAR: f64 = 0.06;

/// The settings of a walk among people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WalkersConfig {
    /// Number of scans. The walkers' paths are as long for any number of them.
    pub scans: usize,
    /// The sensor.
    pub lidar: SpinningLidar,
    /// Standard deviation of the error of a pose along each axis (meters).
    pub pose_sigma: f64,
    /// Seed of the furniture and of the ranges' noise.
    pub seed: u64,
}

/// A scan among people.
#[derive(Clone, Debug)]
pub struct WalkersScan {
    /// `world_from_sensor`, with its error.
    pub pose: Pose<3>,
    /// What the lidar saw.
    pub frame: Frame,
    /// Of each point whether it is of what moves.
    pub moves: Vec<bool>,
}

fn bodies(name: &str, shapes: impl IntoIterator<Item = Shape>) -> Vec<Body> {
    let body = |shape| Body { name: name.to_owned(), shape, color: [200, 60, 60] };
    shapes.into_iter().map(body).collect()
}

fn person([x, y]: [f64; 2]) -> Vec<Body> {
    let legs = Shape::Cylinder { centre: [x, y, 0.45], radius: 0.13, half_height: 0.45 };
    let trunk = Shape::Cylinder { centre: [x, y, 1.15], radius: 0.22, half_height: 0.35 };
    bodies("person", [legs, trunk, Shape::Sphere { centre: [x, y, 1.62], radius: 0.12 }])
}

fn chair([x, y]: [f64; 2]) -> Vec<Body> {
    let part = |low: [f64; 3], high: [f64; 3]| {
        Shape::between([x + low[0], y + low[1], low[2]], [x + high[0], y + high[1], high[2]])
    };
    let leg = |a: f64, b: f64| part([a - 0.02, b - 0.02, 0.0], [a + 0.02, b + 0.02, 0.43]);
    let legs = [leg(-0.2, -0.2), leg(-0.2, 0.2), leg(0.2, -0.2), leg(0.2, 0.2)];
    let seat = part([-0.22, -0.22, 0.42], [0.22, 0.22, 0.46]);
    bodies("chair", legs.into_iter().chain([seat, part([-0.22, 0.18, 0.44], [0.22, 0.22, 0.9])]))
}

/// A walk through the building among five people, and a chair that stands elsewhere in its second half: what moves is known point by
/// point.
///
/// ```
/// use portolan_sim::building::{SpinningLidar, WalkersConfig, walkers_log};
///
/// let lidar = SpinningLidar { rings: 16, columns: 256, ..Default::default() };
/// let log = walkers_log(&WalkersConfig { scans: 3, lidar, pose_sigma: 0.02, seed: 7 });
/// assert!(log.iter().all(|scan| scan.moves.len() == scan.frame.hits()));
/// ```
pub fn walkers_log(config: &WalkersConfig) -> Vec<WalkersScan> {
    let WalkersConfig { scans, lidar, pose_sigma, seed } = *config;
    let building = building_world(seed);
    let sensor = BuildingSensor::Lidar(lidar);
    let along = |scans| building_poses(&building, &BuildingConfig { scans, sensor, seed });
    let (way, directions) = (along(PLACES), lidar.directions());
    let on_way = |step: usize| [0, 1].map(|k| way[step % PLACES].translation[k]);
    let mut random = Random::stream(3, 1);
    let see = |(i, pose): (usize, Pose<3>)| {
        let mut moving = Vec::new();
        for walker in 0..WALKERS {
            let step = (walker * 83 + 37 + i * (3 + walker) * PLACES / scans / 2) % PLACES;
            let at = on_way(if walker % 2 == 0 { step } else { PLACES - 1 - step });
            if distance(at, [pose.translation[0], pose.translation[1]]) > KEPT_CLEAR {
                moving.extend(person(at));
            }
        }
        let [x, y] = on_way(if 2 * i < scans { 200 } else { 60 });
        moving.extend(chair([x, y + if 2 * i < scans { -0.8 } else { 0.8 }]));
        let world = World3::new(building.world.bodies().iter().chain(&moving).cloned().collect());
        let frame = lidar_frame(&world, &pose, &lidar, &directions, (seed, i as u64));
        let moving = World3::new(moving);
        let is_moving = |p: &[f32; 3]| {
            let p = pose.transform_point(p.map(f64::from));
            let to_moving = moving.signed_distance(p).abs();
            to_moving < NEAR && to_moving < building.world.signed_distance(p).abs()
        };
        let moves = match &frame {
            Frame::Points(scan) => scan.points.iter().map(is_moving).collect(),
            Frame::Image(_) => Vec::new(),
        };
        let translation = pose.translation.map(|v| v + pose_sigma * random.normal());
        WalkersScan { pose: Pose { translation, ..pose }, frame, moves }
    };
    along(scans).into_iter().enumerate().map(see).collect()
}
