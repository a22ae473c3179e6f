//! A robot drives through the Apartment.

use crate::lidar::{Lidar, scan_at};
use crate::{World, apartment};
use portolan::geom::Pose;
use portolan::geom::vector::{along, distance, sub, unit};
use portolan::scan::Scan;

/// The seed of the default log.
pub const SEED: u64 = 0x00C0_FFEE;

/// Scans with the poses at which they were taken.
pub type Lap = Vec<(Pose<2>, Scan<2>)>;

/// The settings of one lap of scans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LapConfig {
    /// Number of scans in the lap.
    pub scans: usize,
    /// The sensor.
    pub lidar: Lidar,
    /// Seed of the noise and of lost beams.
    pub seed: u64,
    /// Number of scans taken before, so that a second lap has noise of its own.
    pub first_index: u64,
}

impl Default for LapConfig {
    /// 200 scans, seed 0xC0FFEE.
    fn default() -> Self {
        Self { scans: 200, lidar: Lidar::default(), seed: SEED, first_index: 0 }
    }
}

/// True poses of one lap: `scans` poses at equal distances along the path, heading along it.
pub fn lap_poses(scans: usize) -> Vec<Pose<2>> {
    let path = apartment().path;
    let length: f64 = path.windows(2).map(|w| distance(w[0], w[1])).sum();
    let mut poses = Vec::with_capacity(scans);
    let (mut leg, mut done) = (0, 0.0);
    for i in 0..scans {
        let s = length * i as f64 / scans as f64;
        while leg + 2 < path.len() && s > done + distance(path[leg], path[leg + 1]) {
            done += distance(path[leg], path[leg + 1]);
            leg += 1;
        }
        let direction = unit(sub(path[leg + 1], path[leg])).unwrap_or([1.0, 0.0]);
        let [x, y] = along(path[leg], direction, s - done);
        poses.push(Pose::from_cos_sin(x, y, direction[0], direction[1]));
    }
    poses
}

/// One lap of scans with their true poses. The world is the Apartment, possibly with the chair moved.
pub fn lap(world: &World, config: &LapConfig) -> Lap {
    let scan = |(i, pose): (usize, Pose<2>)| {
        let index = config.first_index + i as u64;
        (pose, scan_at(world, &pose, &config.lidar, config.seed, index).at_time(index as f64))
    };
    lap_poses(config.scans).into_iter().enumerate().map(scan).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CHAIR_MOVE;
    use portolan::geom::vector::point_segment;

    #[test]
    fn the_robot_keeps_clear_of_everything() {
        let world = apartment().world;
        for world in [world.with_moved("chair", CHAIR_MOVE), world] {
            let worst = lap_poses(5000)
                .iter()
                .map(|p| (world.signed_distance(p.translation), p.translation))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            assert!(worst.unwrap().0 >= 0.25, "{worst:?}");
        }
    }

    #[test]
    fn nearly_every_inner_face_is_seen() {
        let world = apartment().world;
        let mut hits = Vec::new();
        for (pose, scan) in lap(&world, &LapConfig::default()) {
            hits.extend(scan.hits_world(&pose));
        }
        let (mut seen, mut total) = (0, 0);
        let inner = world.aabb().grown(-0.1);
        for s in world.boundary().iter().filter(|s| inner.contains(s.a) && inner.contains(s.b)) {
            let n = (distance(s.a, s.b) / 0.1).ceil() as i32;
            for k in 0..n {
                let p = along(s.a, sub(s.b, s.a), (f64::from(k) + 0.5) / f64::from(n));
                total += 1;
                seen += i32::from(hits.iter().any(|&h| point_segment(h, p, p).0 < 0.1));
            }
        }
        println!("{seen} of {total} decimetres of inner faces seen");
        assert!(f64::from(seen) > 0.9 * f64::from(total), "{seen} of {total}");
    }

    fn fingerprint(lap: &[(Pose<2>, Scan<2>)]) -> u64 {
        let mut hash = 0xCBF2_9CE4_8422_2325u64;
        let mut eat = |bits: u64| hash = (hash ^ bits).wrapping_mul(0x0000_0100_0000_01B3).rotate_left(29);
        for (pose, scan) in lap {
            pose.translation.iter().chain(pose.rotation.iter().flatten()).for_each(|v| eat(v.to_bits()));
            for b in scan.beams() {
                eat(b.kind as u64);
                b.direction.iter().chain([&b.range]).for_each(|v| eat(v.to_bits()));
            }
        }
        hash
    }

    #[test]
    fn a_seed_gives_the_same_bytes_on_any_number_of_threads() {
        let world = apartment().world;
        let whole = lap(&world, &LapConfig::default());
        for threads in [2usize, 8] {
            let part = 200 / threads;
            let lidar = Lidar::default();
            let poses = lap_poses(200);
            let parts: Vec<Vec<(Pose<2>, Scan<2>)>> = std::thread::scope(|s| {
                let (world, poses) = (&world, &poses);
                let handles: Vec<_> = (0..threads)
                    .map(|t| {
                        s.spawn(move || {
                            (t * part..(t + 1) * part)
                                .map(|i| (poses[i], scan_at(world, &poses[i], &lidar, SEED, i as u64)))
                                .collect()
                        })
                    })
                    .collect();
                handles.into_iter().map(|h| h.join().unwrap()).collect()
            });
            assert_eq!(fingerprint(&parts.concat()), fingerprint(&whole));
        }
        let other = lap(&world, &LapConfig { first_index: 200, ..Default::default() });
        assert_ne!(fingerprint(&other), fingerprint(&whole));
        // The default lap: every figure in the documentation is measured on these bytes.
        assert_eq!(fingerprint(&whole), 0xd73c_713a_6321_6ae4);
    }
}
