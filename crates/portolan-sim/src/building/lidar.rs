//! A spinning 3-D lidar.

use super::world::World3;
use crate::Random;
use portolan::geom::Pose;
use portolan::geom::vector::scale;
use portolan::scan::{Frame, PointScan, RangeImage, Spherical};

/// A lidar that turns about its z axis: rings of one elevation, columns of one azimuth.
///
/// The noise of the range is independent, normal and without bias. Directions and poses are exact: no mixed pixels at edges,
/// no dependence on the angle of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinningLidar {
    /// Number of rings, at equal angles from the highest to the lowest elevation.
    pub rings: usize,
    /// Number of readings in a turn, counter-clockwise from x.
    pub columns: usize,
    /// Lowest and highest elevation (radians).
    pub elevation: [f64; 2],
    /// Maximum range (meters); rays without a hit within it are empty.
    pub max_range: f64,
    /// Standard deviation of the range (meters).
    pub noise: f64,
    /// Share of rays that are lost, at random.
    pub dropped_rate: f64,
    /// Whether rays without a hit are distinguished from lost ones, so that they are free up to the maximum range.
    pub misses_known: bool,
    /// Whether the frame has a range image, with rows and columns, beside its points.
    pub organized: bool,
}

impl Default for SpinningLidar {
    /// 64 rings over ±22.5 degrees, 1024 columns, 30 m, noise 1 cm, one ray in 200 lost; misses known, organized.
    fn default() -> Self {
        let edge = std::f64::consts::PI / 8.0;
        Self {
            rings: 64,
            columns: 1024,
            elevation: [-edge, edge],
            max_range: 30.0,
            noise: 0.01,
            dropped_rate: 0.005,
            misses_known: true,
            organized: true,
        }
    }
}

impl SpinningLidar {
    /// The projection of rows and columns.
    pub fn projection(&self) -> Spherical {
        let [low, high] = self.elevation;
        let last = self.rings.saturating_sub(1).max(1) as f64;
        Spherical {
            elevations: (0..self.rings).map(|r| (high - (high - low) * r as f64 / last) as f32).collect(),
            first_azimuth: 0.0,
            azimuth_step: std::f64::consts::TAU / self.columns as f64,
        }
    }

    /// Unit directions in the sensor's frame, row by row. The same bytes on every platform.
    pub fn directions(&self) -> Vec<[f64; 3]> {
        let projection = self.projection();
        let turn: Vec<_> = (0..self.columns)
            .map(|c| projection.azimuth_step * c as f64)
            .map(|a| [libm::cos(a), libm::sin(a)])
            .collect();
        let ring = |e: &f32| {
            let (cos, sin) = (libm::cos(f64::from(*e)), libm::sin(f64::from(*e)));
            turn.iter().map(move |[x, y]| [cos * x, cos * y, sin])
        };
        projection.elevations.iter().flat_map(ring).collect()
    }
}

/// The frame of the lidar at rest at a pose, with `directions` from [`SpinningLidar::directions`]. The noise depends on the stream
/// `(seed, index)` alone.
pub fn lidar_frame(
    world: &World3,
    world_from_sensor: &Pose<3>,
    lidar: &SpinningLidar,
    directions: &[[f64; 3]],
    (seed, index): (u64, u64),
) -> Frame {
    Frame::Points(turn(world, |_| *world_from_sensor, lidar, directions, (seed, index)).0)
}

/// The frame of a lidar that moves while it turns once in `duration` seconds: `world_from_sensor` is its pose so many seconds after
/// the start of the turn. Points, free ends and the image are in the frame of the moment, as a driver delivers them, with their
/// times since the start. Without motion it is the frame of [`lidar_frame`], with times.
pub fn moving_lidar_frame(
    world: &World3,
    world_from_sensor: impl Fn(f64) -> Pose<3>,
    lidar: &SpinningLidar,
    directions: &[[f64; 3]],
    duration: f64,
    (seed, index): (u64, u64),
) -> Frame {
    let time = |column: &usize| (duration * *column as f64 / lidar.columns as f64) as f32;
    let poses: Vec<Pose<3>> =
        (0..lidar.columns).map(|column| world_from_sensor(f64::from(time(&column)))).collect();
    let (mut scan, columns) = turn(world, |column| poses[column], lidar, directions, (seed, index));
    scan.times = columns.iter().flatten().map(time).collect();
    Frame::Points(scan)
}

/// A turn of the lidar, whose pose is that of the column; and the columns of its points and of its free ends.
fn turn(
    world: &World3,
    world_from_sensor: impl Fn(usize) -> Pose<3>,
    lidar: &SpinningLidar,
    directions: &[[f64; 3]],
    (seed, index): (u64, u64),
) -> (PointScan, [Vec<usize>; 2]) {
    let mut random = Random::stream(seed ^ 0x11DA_2000, index);
    let mut scan = PointScan::new([], [0.0; 3]);
    let mut values = Vec::with_capacity(directions.len());
    let [mut hit_columns, mut free_columns] = [Vec::new(), Vec::new()];
    for (i, &direction) in directions.iter().enumerate() {
        // Drawn for every ray, so that the result of one ray does not change the noise of the next.
        let (fate, noise) = (random.uniform(), lidar.noise * random.normal());
        let column = i % lidar.columns;
        let pose = world_from_sensor(column);
        let hit = world.cast_ray(pose.translation, pose.rotate(direction));
        let end = |range: f64| scale(direction, range).map(|v| v as f32);
        let value = match hit.map(|h| (h.range, h.range + noise)) {
            _ if fate < lidar.dropped_rate => 0.0,
            Some((truth, range)) if truth.max(range) <= lidar.max_range && range > 0.0 => {
                scan.points.push(end(range));
                hit_columns.push(column);
                range
            }
            // A reading below zero because of its noise.
            Some((truth, _)) if truth <= lidar.max_range => 0.0,
            _ if lidar.misses_known => {
                scan.free_ends.push(end(lidar.max_range));
                free_columns.push(column);
                -lidar.max_range
            }
            _ => 0.0,
        };
        values.push(value as f32);
    }
    if lidar.organized {
        scan.image = Some(RangeImage::from_ranges(lidar.projection(), lidar.columns, values));
    }
    (scan, [hit_columns, free_columns])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::building_world;
    use portolan::geom::vector::{norm, unit};

    #[test]
    fn noise_and_losses_are_as_stated() {
        let building = building_world(1);
        let lidar = SpinningLidar::default();
        let directions = lidar.directions();
        let (mut errors, mut lost, mut rays) = (Vec::new(), 0, 0);
        for (i, &[x, y]) in building.path.iter().enumerate().step_by(3) {
            let pose = Pose { translation: [x, y, 1.2], ..Pose::IDENTITY };
            let frame = lidar_frame(&building.world, &pose, &lidar, &directions, (1, i as u64));
            let Frame::Points(scan) = frame else { panic!("a lidar delivers points") };
            let image = scan.image.as_ref().unwrap();
            assert_eq!(image.hits(), scan.points.len());
            assert_eq!(image.values.iter().filter(|v| **v < 0.0).count(), scan.free_ends.len());
            rays += directions.len();
            lost += image.values.iter().filter(|v| **v == 0.0).count();
            for ((k, p), q) in image.points().zip(&scan.points) {
                let q = q.map(f64::from);
                assert!(norm([0, 1, 2].map(|k| p[k] - q[k])) < 1e-5);
                let truth = building.world.cast_ray(pose.translation, directions[k]).unwrap().range;
                errors.push(norm(q) - truth);
                let off = norm([0, 1, 2].map(|j| unit(q).unwrap()[j] - directions[k][j]));
                assert!(off < 1e-6);
            }
            for end in &scan.free_ends {
                let direction = unit(end.map(f64::from)).unwrap();
                assert!(building.world.cast_ray(pose.translation, direction).is_none_or(|h| h.range > 29.9));
            }
        }
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / n;
        let sigma = (errors.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>() / n).sqrt();
        assert!(mean.abs() < 1e-4 && (sigma - 0.01).abs() < 1e-4, "{mean} {sigma}");
        let share = lost as f64 / rays as f64;
        assert!((0.004..0.006).contains(&share), "{share}");
    }

    #[test]
    fn misses_are_absent_where_they_are_not_known() {
        let world = building_world(1).world;
        let lidar = SpinningLidar { misses_known: false, organized: false, ..Default::default() };
        let pose = Pose { translation: [2.0, 2.9, 1.5], ..Pose::IDENTITY };
        let Frame::Points(scan) = lidar_frame(&world, &pose, &lidar, &lidar.directions(), (1, 0)) else {
            panic!("a lidar delivers points")
        };
        assert!(scan.free_ends.is_empty() && scan.image.is_none());
        assert!(scan.points.len() > 50_000 && scan.points.len() < 65_000);
    }
}
