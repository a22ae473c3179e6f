//! What the wheels say: relative motions with noise, and where they lead.

use crate::Random;
use portolan::geom::Pose;
use portolan::geom::vector::norm;
use serde::Serialize;

/// How far the wheels are off. Random errors grow with the square root of the way, as sums of independent ones do;
/// a bias grows with the way itself: it is what makes a lap not close.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OdometryNoise {
    /// Standard deviation of the position after one meter (meters).
    pub position_per_metre: f64,
    /// Standard deviation of the heading after one meter (radians).
    pub heading_per_metre: f64,
    /// Standard deviation of the heading after a turn of one radian (radians).
    pub heading_per_radian: f64,
    /// Distances are measured too long by this part of them (a wheel's radius).
    pub scale_bias: f64,
    /// The heading drifts by so much on every meter (radians; wheels of different radii).
    pub heading_bias_per_metre: f64,
}

impl Default for OdometryNoise {
    /// A small differential drive: after a lap of the Apartment it is about a meter and some degrees off.
    fn default() -> Self {
        Self {
            position_per_metre: 0.01,
            heading_per_metre: 0.004,
            heading_per_radian: 0.006,
            scale_bias: 0.01,
            heading_bias_per_metre: 0.001,
        }
    }
}

impl OdometryNoise {
    /// Standard deviations `[position (meters), heading (radians)]` of a measured motion, bias included; never
    /// quite zero, so that they can be inverted.
    pub fn sigmas(&self, motion: &Pose<2>) -> [f64; 2] {
        let (way, turn) = (norm(motion.translation), heading(motion).abs());
        let square = |v: f64| v * v;
        let position = square(self.position_per_metre) * way + square(self.scale_bias * way);
        let heading = square(self.heading_per_metre) * way
            + square(self.heading_per_radian) * turn
            + square(self.heading_bias_per_metre * way);
        [position.sqrt().max(1e-3), heading.sqrt().max(1e-3)]
    }
}

/// The relative motions `previous_from_next` between consecutive true poses, as the wheels measured them: one
/// fewer than poses. The noise of motion `k` is that of the stream `(seed, k)` alone.
pub fn measure_motions(world_from_robot: &[Pose<2>], noise: &OdometryNoise, seed: u64) -> Vec<Pose<2>> {
    let motion = |(k, pair): (usize, &[Pose<2>])| {
        let truth = pair[0].inverse() * pair[1];
        // A stream of its own: the lidar draws from those of the scans' indices.
        let mut random = Random::stream(seed ^ 0x0D0_0E7E5, k as u64);
        let (way, turn) = (norm(truth.translation), heading(&truth));
        let mut position = || noise.position_per_metre * way.sqrt() * random.normal();
        let [dx, dy] = [position(), position()];
        let dtheta = noise.heading_per_metre * way.sqrt() * random.normal()
            + noise.heading_per_radian * turn.abs().sqrt() * random.normal()
            + noise.heading_bias_per_metre * way;
        let stretch = 1.0 + noise.scale_bias;
        let [x, y] = truth.translation;
        planar(stretch * x + dx, stretch * y + dy, turn + dtheta)
    };
    world_from_robot.windows(2).enumerate().map(motion).collect()
}

/// The poses that the motions lead to from a first pose: one more than motions.
pub fn dead_reckon(start: Pose<2>, motions: &[Pose<2>]) -> Vec<Pose<2>> {
    let mut poses = vec![start];
    let mut pose = start;
    for motion in motions {
        pose = pose * *motion;
        // Thousands of products would let the rotation grow.
        pose = planar(pose.translation[0], pose.translation[1], heading(&pose));
        poses.push(pose);
    }
    poses
}

/// Heading of a pose in `(-pi, pi]` (radians), the same bytes on every platform.
pub fn heading(pose: &Pose<2>) -> f64 {
    libm::atan2(pose.rotation[1][0], pose.rotation[0][0])
}

/// A pose of a position (meters) and a heading (radians), the same bytes on every platform.
pub fn planar(x: f64, y: f64, theta: f64) -> Pose<2> {
    Pose::from_cos_sin(x, y, libm::cos(theta), libm::sin(theta))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{SEED, lap_poses};

    #[test]
    fn without_noise_it_is_the_truth() {
        let truth = lap_poses(200);
        let silent = OdometryNoise {
            position_per_metre: 0.0,
            heading_per_metre: 0.0,
            heading_per_radian: 0.0,
            scale_bias: 0.0,
            heading_bias_per_metre: 0.0,
        };
        let poses = dead_reckon(truth[0], &measure_motions(&truth, &silent, 1));
        for (a, b) in poses.iter().zip(&truth) {
            assert!(a.translation_to(b) < 1e-9);
        }
    }

    #[test]
    fn a_lap_drifts_by_about_a_metre_and_some_degrees() {
        let truth = lap_poses(200);
        let way: f64 = truth.windows(2).map(|w| w[0].translation_to(&w[1])).sum();
        for seed in (0..8).map(|k| SEED + k) {
            let poses = dead_reckon(truth[0], &measure_motions(&truth, &OdometryNoise::default(), seed));
            let error = truth[199].inverse() * poses[199];
            let (metres, degrees) = (norm(error.translation), heading(&error).to_degrees());
            println!("seed {seed:#x}: {way:.1} m lap, off by {metres:.2} m, {degrees:.1} degrees");
            assert!((0.1..3.0).contains(&metres) && degrees.abs() < 25.0);
        }
    }
}
