//! A 2-D lidar.

use crate::{Random, World};
use portolan::geom::Pose;
use portolan::scan::{Beam, BeamKind, Scan};

/// A 2-D lidar with a full turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lidar {
    /// Number of beams over the full turn.
    pub beams: usize,
    /// Standard deviation of the range (meters).
    pub noise: f64,
    /// Maximum range (meters); beams without a hit within it become [`BeamKind::MaxRange`].
    pub max_range: f64,
    /// Share of beams without an echo, at random; they give no evidence of free space.
    pub no_return_rate: f64,
    /// Share of beams that are lost, at random.
    pub dropped_rate: f64,
}

impl Default for Lidar {
    /// 360 beams, noise 1 cm, range 8 m, one beam in 200 without echo and one in 200 lost.
    fn default() -> Self {
        Self { beams: 360, noise: 0.01, max_range: 8.0, no_return_rate: 0.005, dropped_rate: 0.005 }
    }
}

/// The scan of the lidar from a pose. The noise depends on the stream `(seed, index)` alone.
pub fn scan_at(world: &World, world_from_sensor: &Pose<2>, lidar: &Lidar, seed: u64, index: u64) -> Scan<2> {
    scan_while_moving(world, |_| *world_from_sensor, lidar, seed, index)
}

/// The scan of a lidar that moves: `world_from_sensor` is its pose when it measured beam `i`. Beams are in the frame of their moment,
/// as a driver delivers them. Without motion it is the scan of [`scan_at`].
pub fn scan_while_moving(
    world: &World,
    world_from_sensor: impl Fn(usize) -> Pose<2>,
    lidar: &Lidar,
    seed: u64,
    index: u64,
) -> Scan<2> {
    let mut random = Random::stream(seed, index);
    let bearings: Vec<f64> =
        (0..lidar.beams).map(|i| (i as f64 / lidar.beams as f64 - 0.5) * std::f64::consts::TAU).collect();
    let beams = bearings.iter().enumerate().map(|(i, &bearing)| {
        let pose = world_from_sensor(i);
        let direction = [libm::cos(bearing), libm::sin(bearing)];
        // Drawn for every beam, so that the result of one beam does not change the noise of the next.
        let (fate, noise) = (random.uniform(), random.normal());
        let hit = world.cast_ray(pose.translation, pose.rotate(direction));
        let (kind, range) = if fate < lidar.dropped_rate {
            (BeamKind::Dropped, 0.0)
        } else if fate < lidar.dropped_rate + lidar.no_return_rate {
            (BeamKind::NoReturn, 0.0)
        } else {
            match hit.map(|h| (h.range, h.range + lidar.noise * noise)) {
                Some((truth, range)) if truth.max(range) <= lidar.max_range => {
                    (BeamKind::Hit, range.max(0.0))
                }
                _ => (BeamKind::MaxRange, lidar.max_range),
            }
        };
        Beam { direction, range, kind }
    });
    let beams = beams.collect();
    Scan::from_fan(&bearings, beams)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_kinds_are_as_stated() {
        let world = crate::apartment().world;
        let lidar = Lidar::default();
        let (mut errors, mut counts) = (Vec::new(), portolan::scan::BeamCounts::default());
        for (i, pose) in crate::lap_poses(200).iter().enumerate() {
            let scan = scan_at(&world, pose, &lidar, 1, i as u64);
            counts += scan.counts();
            for beam in scan.beams().filter(Beam::is_hit) {
                let truth = world.cast_ray(pose.translation, pose.rotate(beam.direction)).unwrap().range;
                errors.push(beam.range - truth);
            }
        }
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / n;
        let sigma = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
        assert!(mean.abs() < 2e-4 && (sigma - 0.01).abs() < 2e-4, "{mean} {sigma}");
        let share = |c: u64| c as f64 / counts.total() as f64;
        assert!((0.003..0.007).contains(&share(counts.no_return)), "{counts:?}");
        assert!((0.003..0.007).contains(&share(counts.dropped)), "{counts:?}");
        assert!(share(counts.hit) > 0.95, "{counts:?}");
    }
}
