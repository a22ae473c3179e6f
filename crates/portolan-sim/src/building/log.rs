//! A walk through the building with a sensor.

use super::camera::{DepthCamera, camera_frame};
use super::floor_plan::{Building, building_world};
use super::lidar::{SpinningLidar, lidar_frame};
use super::walk::{BODY_FROM_CAMERA, Walk, body_pose};
use super::world::World3;
use crate::SEED;
use portolan::geom::Pose;
use portolan::scan::Frame;

/// The sensor carried through the building.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BuildingSensor {
    /// Upright, at 1.15 m.
    Lidar(SpinningLidar),
    /// At 1.4 m, panning and pitched slightly down.
    Camera(DepthCamera),
}

impl BuildingSensor {
    /// Unit directions of a lidar's rays, which [`BuildingSensor::frame`] takes; none of a camera.
    pub fn directions(&self) -> Vec<[f64; 3]> {
        match self {
            Self::Lidar(lidar) => lidar.directions(),
            Self::Camera(_) => Vec::new(),
        }
    }

    /// The frame from a pose; its noise depends on the stream `(seed, index)` alone.
    pub fn frame(
        &self,
        world: &World3,
        world_from_sensor: &Pose<3>,
        directions: &[[f64; 3]],
        noise: (u64, u64),
    ) -> Frame {
        match self {
            Self::Lidar(lidar) => lidar_frame(world, world_from_sensor, lidar, directions, noise),
            Self::Camera(camera) => camera_frame(world, world_from_sensor, camera, noise),
        }
    }
}

/// The settings of a walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildingConfig {
    /// Number of scans, at equal distances along the closed path through all rooms.
    pub scans: usize,
    /// The sensor.
    pub sensor: BuildingSensor,
    /// Seed of the furniture and of the noise.
    pub seed: u64,
}

impl Default for BuildingConfig {
    /// 40 scans of the default lidar.
    fn default() -> Self {
        Self { scans: 40, sensor: BuildingSensor::Lidar(SpinningLidar::default()), seed: SEED }
    }
}

/// Scans with their true poses, and the world.
#[derive(Clone, Debug)]
pub struct BuildingLog {
    /// The world.
    pub world: World3,
    /// `world_from_sensor` and the frame of each scan.
    pub scans: Vec<(Pose<3>, Frame)>,
    /// Time of each scan (seconds), at 10 Hz.
    pub times: Vec<f64>,
}

/// One walk through the building: a 3-D log with ground truth.
///
/// ```
/// use portolan_sim::building::{BuildingConfig, SpinningLidar, BuildingSensor, building_log};
///
/// let sensor = BuildingSensor::Lidar(SpinningLidar { rings: 16, columns: 256, ..Default::default() });
/// let log = building_log(&BuildingConfig { scans: 3, sensor, ..Default::default() });
/// let (world_from_sensor, frame) = &log.scans[0];
/// assert!(log.world.signed_distance(world_from_sensor.translation) > 0.25);
/// assert!(frame.hits() > 3000);
/// ```
pub fn building_log(config: &BuildingConfig) -> BuildingLog {
    let building = building_world(config.seed);
    let poses = building_poses(&building, config);
    let directions = config.sensor.directions();
    let world = building.world;
    let scan = |(i, pose): (usize, Pose<3>)| {
        (pose, config.sensor.frame(&world, &pose, &directions, (config.seed, i as u64)))
    };
    let scans: Vec<_> = poses.into_iter().enumerate().map(scan).collect();
    let times = (0..scans.len()).map(|i| 0.1 * i as f64).collect();
    BuildingLog { world, scans, times }
}

/// True poses of a walk, `world_from_sensor`, with the small roll, pitch and vertical motion of a carried sensor.
pub fn building_poses(building: &Building, config: &BuildingConfig) -> Vec<Pose<3>> {
    let walk = Walk::new(&building.path);
    let pose = |i: usize| {
        let share = i as f64 / config.scans as f64;
        let ([x, y], heading) = walk.after(share);
        let swing = |times: f64, phase: f64| libm::sin(std::f64::consts::TAU * times * share + phase);
        match config.sensor {
            BuildingSensor::Lidar(_) => {
                let place = [x, y, 1.15 + 0.04 * swing(17.0, 0.0)];
                body_pose(place, heading, 0.0, 0.05 * swing(11.0, 1.0), 0.04 * swing(7.0, 2.0))
            }
            BuildingSensor::Camera(_) => {
                let place = [x, y, 1.4 + 0.05 * swing(5.0, 0.0)];
                let (turn, pitch) = (1.2 * swing(9.0, 0.0), 0.25 + 0.25 * swing(14.0, 1.0));
                body_pose(place, heading, turn, pitch, 0.04 * swing(6.0, 0.5)) * BODY_FROM_CAMERA
            }
        }
    };
    (0..config.scans).map(pose).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fingerprint(log: &BuildingLog) -> u64 {
        let mut hash = 0xCBF2_9CE4_8422_2325u64;
        let mut eat = |bits: u64| hash = (hash ^ bits).wrapping_mul(0x0000_0100_0000_01B3).rotate_left(29);
        for (pose, frame) in &log.scans {
            pose.translation.iter().chain(pose.rotation.iter().flatten()).for_each(|v| eat(v.to_bits()));
            match frame {
                Frame::Points(scan) => {
                    scan.points.iter().flatten().for_each(|v| eat(u64::from(v.to_bits())));
                }
                Frame::Image(image) => {
                    image.values.iter().for_each(|v| eat(u64::from(v.to_bits())));
                    image.colors.iter().flatten().for_each(|v| eat(u64::from(*v)));
                }
            }
        }
        hash
    }

    #[test]
    fn a_seed_gives_the_same_bytes_on_every_platform() {
        let lidar = SpinningLidar { rings: 16, columns: 128, ..Default::default() };
        let camera = DepthCamera::default().scaled(0.1);
        let of = |sensor, seed| fingerprint(&building_log(&BuildingConfig { scans: 10, sensor, seed }));
        let lidar_bytes = of(BuildingSensor::Lidar(lidar), SEED);
        assert_eq!(lidar_bytes, of(BuildingSensor::Lidar(lidar), SEED));
        assert_ne!(lidar_bytes, of(BuildingSensor::Lidar(lidar), SEED + 1));
        let camera_bytes = of(BuildingSensor::Camera(camera), SEED);
        println!("{lidar_bytes:#x} {camera_bytes:#x}");
        // The figures in the documentation are measured on this walk.
        assert_eq!((lidar_bytes, camera_bytes), (0xfd65_8d01_0a43_3e2d, 0xe114_bace_f211_ed3e));
    }

    #[test]
    fn poses_are_rigid_and_keep_clear() {
        for sensor in
            [BuildingSensor::Lidar(SpinningLidar::default()), BuildingSensor::Camera(DepthCamera::default())]
        {
            let config = BuildingConfig { scans: 300, sensor, ..Default::default() };
            let building = building_world(config.seed);
            for pose in building_poses(&building, &config) {
                assert!(pose.is_rigid());
                assert!(building.world.signed_distance(pose.translation) > 0.25);
            }
        }
    }

    #[test]
    fn twenty_scans_of_65_000_rays_take_a_moment() {
        let start = std::time::Instant::now();
        let log = building_log(&BuildingConfig { scans: 20, ..Default::default() });
        let took = start.elapsed().as_secs_f64();
        let hits: usize = log.scans.iter().map(|s| s.1.hits()).sum();
        println!("{hits} points, {} bodies: {took:.2} s", log.world.bodies().len());
        assert!(hits > 20 * 60_000);
    }
}
