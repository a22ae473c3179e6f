//! The motion of a sensor while it scans, taken out.

use std::borrow::Cow;

use super::laser::fan_order;
use super::{BeamOrder, Delivered, Origin, PointScan, Scan};
use crate::geom::vector::{along, cross, dot, norm, unit};
use crate::geom::{Motion, NoPose, Pose, Trajectory};

/// The poses within a scan that are kept for its strips.
const KNOTS: usize = 64;

impl PointScan {
    /// Moves every point, and every free end that has a time, to where it is in the frame of the sensor at `world_from_sensor`,
    /// and gives it its own origin: where the sensor was when it was seen. `motion` holds the poses of the sensor, and
    /// [`PointScan::times`] count from `taken_at` on its clock (seconds).
    ///
    /// Rows and columns hold for a sensor that stands still, so the image beside the points is left out. Maps of occupancy and of
    /// hits per meter follow such scans ray by ray. Signed distances find the rings of a turning lidar in what was delivered
    /// ([`PointScan::delivered`], if rays had a common origin), and see it in strips of columns that are taken at one moment each;
    /// else they follow rays, too. Points keep colors and times. A scan without times stays as it is. O(n), with a search in
    /// the trajectory for each time that differs from the one before.
    ///
    /// # Errors
    /// [`NoPose`] for the first point at whose time there is no pose; the scan is as it was then.
    pub fn deskew(
        &mut self,
        world_from_sensor: &Pose<3>,
        motion: &mut Motion<3>,
        taken_at: f64,
    ) -> Result<(), NoPose> {
        if self.times.is_empty() {
            return Ok(());
        }
        let sensor_from_world = world_from_sensor.inverse();
        let count = self.points.len() + self.free_ends.len();
        let mut origins = Vec::with_capacity(count);
        let mut ends = Vec::with_capacity(count);
        // Consecutive points often have one time: the lasers of a column fire together.
        let mut last: Option<(f32, Pose<3>)> = None;
        for (i, end) in self.points.iter().chain(&self.free_ends).enumerate() {
            let moved = match (self.times.get(i), last) {
                (None, _) => Pose::IDENTITY,
                (Some(t), Some((of, pose))) if of == *t => pose,
                (Some(t), _) => {
                    let pose = sensor_from_world * motion.at(taken_at + f64::from(*t))?;
                    last = Some((*t, pose));
                    pose
                }
            };
            let to_scan = |p: [f64; 3]| moved.transform_point(p).map(|v| v as f32);
            // Without an origin a point stays without one.
            let origin = self.origin_of(i).unwrap_or([f64::NAN; 3]);
            origins.push(to_scan(origin));
            ends.push(to_scan(end.map(f64::from)));
        }
        let free_ends = ends.split_off(self.points.len());
        let mut delivered = None;
        if let Origin::Common(origin) = self.origin {
            let (first, last) = self
                .times
                .iter()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
            let mut knots = Vec::with_capacity(KNOTS + 1);
            for k in 0..=KNOTS {
                let share = k as f64 / KNOTS as f64;
                let time = f64::from(first) + share * (f64::from(last) - f64::from(first));
                knots.push((time, sensor_from_world * motion.at(taken_at + time)?));
            }
            delivered = Trajectory::new(knots).ok().map(|path| Delivered {
                points: self.points.clone(),
                free_ends: self.free_ends.clone(),
                origin,
                scan_from_sensor: path.with_longest_gap(f64::INFINITY),
            });
        }
        (self.points, self.free_ends) = (ends, free_ends);
        self.origin = Origin::PerPoint(origins);
        self.delivered = delivered.map(Box::new);
        self.image = None;
        Ok(())
    }
}

impl<const D: usize> Scan<D> {
    /// Turns every beam to where it pointed in the frame of the sensor at `world_from_sensor`, and lets it begin where the
    /// sensor was then ([`Scan::origin`]). `motion` holds the poses of the sensor; beam `i` was measured `times[i]` seconds
    /// after `taken_at` on its clock. Beams beyond the end of `times` stay as they are.
    ///
    /// What follows beams one by one (occupancy, hits per meter, the march) follows them from there. The sweep between beams
    /// ([`crate::sweep::CellCentre`]) needs one place to look from: it sees their ends from the zero of the sensor's frame. A
    /// beam whose end is hidden from there behind one beside it, at an edge, is left out of distances only.
    ///
    /// # Errors
    /// [`NoPose`] for the first beam at whose time there is no pose; the scan is as it was then.
    pub fn deskew(
        &mut self,
        times: &[f32],
        world_from_sensor: &Pose<D>,
        motion: &mut Motion<D>,
        taken_at: f64,
    ) -> Result<(), NoPose> {
        let sensor_from_world = world_from_sensor.inverse();
        let all = times.iter().take(self.len());
        let moved: Vec<Pose<D>> = all
            .map(|t| motion.at(taken_at + f64::from(*t)).map(|pose| sensor_from_world * pose))
            .collect::<Result<_, _>>()?;
        if !moved.is_empty() {
            self.origins.resize(self.len(), [0.0; D]);
        }
        for (i, pose) in moved.iter().enumerate() {
            self.directions[i] = pose.rotate(self.directions[i]);
            self.origins[i] = pose.transform_point(self.origins[i]);
        }
        Ok(())
    }

    /// A fan whose beams begin in several places as it would be seen from the zero of the sensor's frame: beams with the same
    /// ends, in order of bearing. Where two exchange their places the nearer end hides the other one, whose beam is left out,
    /// and so is what a scan of more than one turn saw twice. Any other scan as it is.
    pub(crate) fn seen_from_zero(&self) -> Cow<'_, Self> {
        if self.origins.is_empty() || self.order == BeamOrder::Unordered {
            return Cow::Borrowed(self);
        }
        // Bearings from the first beam on, a turn and more.
        let mut kept: Vec<(f64, f64, super::Beam<D>)> = Vec::with_capacity(self.len());
        let mut bearing = 0.0;
        let mut before: Option<[f64; 2]> = None;
        for (i, mut beam) in self.beams().enumerate() {
            let mut near = f64::INFINITY;
            if beam.free_range() > 0.0 {
                let end = along(self.origin(i), beam.direction, beam.range);
                let Some(direction) = unit(end) else { continue };
                (beam.direction, beam.range) = (direction, norm(end));
                near = beam.range;
            }
            let direction = [beam.direction[0], beam.direction[1]];
            let step = before.map_or(0.0, |b| cross(b, direction).atan2(dot(b, direction)));
            (bearing, before) = (bearing + step, Some(direction));
            while kept.last().is_some_and(|last| last.0 >= bearing && last.1 > near) {
                kept.pop();
            }
            if kept.last().is_none_or(|last| last.0 < bearing) {
                kept.push((bearing, near, beam));
            }
        }
        let first = kept.first().map_or(0.0, |k| k.0);
        kept.retain(|k| k.0 < first + std::f64::consts::TAU);
        let bearings: Vec<f64> = kept.iter().map(|k| k.0).collect();
        let mut seen = Self::from_beams(kept.into_iter().map(|(_, _, beam)| beam));
        seen.order = fan_order(&bearings);
        Cow::Owned(seen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::distance;
    use crate::geom::{Aabb, Trajectory};
    use crate::scan::{Beam, BeamKind};
    use crate::testing::point;
    use proptest::prelude::*;

    /// Constant twist, which any two poses of a trajectory give.
    fn pose<const D: usize>(time: f64) -> Pose<D> {
        let (half, mut rotation) = (0.65f64, [[0.0; D]; D]);
        let spatial = Pose::<3>::from_quaternion([0.0; 3], [0.0, 0.0, half.sin(), half.cos()]).unwrap();
        (0..D).for_each(|i| (0..D).for_each(|j| rotation[i][j] = spatial.rotation[i][j]));
        let second = Pose { rotation, translation: point([2.0, 0.3, 0.4]) };
        Pose::IDENTITY.toward(&second, time)
    }

    fn trajectory<const D: usize>() -> Trajectory<D> {
        Trajectory::new((0..40).map(|k| 0.01 * f64::from(k)).map(|t| (t, pose(t)))).unwrap()
    }

    proptest! {
        /// Points of the world, seen by a sensor that moves: where they come to lie is where they are, and rays begin where it
        /// was.
        #[test]
        fn points_come_to_lie_where_they_are(
            seen in prop::collection::vec((prop::array::uniform3(-20.0..20.0f64), 0.0..0.1f32), 1..60),
            free in 0..8usize, stamp in 0.0..0.2f64, zero in 0.05..0.25f64,
        ) {
            let free = free.min(seen.len() - 1);
            let at = |t: f32| zero + f64::from(t);
            let local: Vec<[f32; 3]> =
                seen.iter().map(|(p, t)| pose::<3>(at(*t)).inverse().transform_point(*p).map(|v| v as f32)).collect();
            let (ends, points) = local.split_at(free);
            let mut scan = PointScan::new(points.iter().copied(), [0.1, 0.0, 0.05]);
            scan.free_ends = ends.to_vec();
            scan.times = seen[free..].iter().chain(&seen[..free]).map(|s| s.1).collect();
            let still = pose::<3>(stamp);
            let trajectory = trajectory::<3>();
            scan.deskew(&still, &mut trajectory.motion(0.1), zero).unwrap();
            let all = scan.points.iter().chain(&scan.free_ends).enumerate();
            for ((i, p), (truth, t)) in all.zip(seen[free..].iter().chain(&seen[..free])) {
                prop_assert!(distance(still.transform_point(p.map(f64::from)), *truth) < 1e-4);
                let origin = still.transform_point(scan.origin_of(i).unwrap());
                prop_assert!(distance(origin, pose::<3>(at(*t)).transform_point([0.1, 0.0, 0.05])) < 1e-5);
            }
        }
    }

    #[test]
    fn what_the_trajectory_does_not_cover_stays_as_it_was() {
        let mut scan = PointScan::new([[1.0, 2.0, 3.0], [2.0, 2.0, 2.0]], [0.0; 3]);
        scan.times = vec![0.0, 0.3];
        let before = scan.clone();
        let trajectory = trajectory::<3>();
        let found = scan.deskew(&pose(0.3), &mut trajectory.motion(0.05), 0.3);
        assert!(matches!(found, Err(NoPose::After(_))), "{found:?}");
        assert_eq!(scan, before);
        // Without times there is nothing to take out.
        scan.times.clear();
        let before = scan.clone();
        scan.deskew(&pose(0.3), &mut trajectory.motion(0.05), 99.0).unwrap();
        assert_eq!(scan, before);
    }

    /// The laser of a robot that drives and turns in a square room.
    fn room_scan(beams: usize, duration: f64, stamp: f64) -> (Scan<2>, Vec<f32>) {
        let bearings: Vec<f64> =
            (0..beams).map(|i| std::f64::consts::TAU * (i as f64 / beams as f64 - 0.5)).collect();
        let times: Vec<f32> = (0..beams).map(|i| (duration * i as f64 / beams as f64) as f32).collect();
        let walls = Aabb::new([-4.0; 2], [4.0; 2]);
        let beam = |(bearing, time): (&f64, &f32)| {
            let at = pose::<2>(stamp + f64::from(*time));
            let direction = [bearing.cos(), bearing.sin()];
            let world = at.rotate(direction);
            let range = (0..2)
                .map(|k| {
                    let wall = if world[k] > 0.0 { walls.max[k] } else { walls.min[k] };
                    (wall - at.translation[k]) / world[k]
                })
                .fold(f64::INFINITY, f64::min);
            Beam { direction, range, kind: BeamKind::Hit }
        };
        let beams = bearings.iter().zip(&times).map(beam).collect();
        (Scan::from_fan(&bearings, beams), times)
    }

    #[test]
    fn beams_end_on_the_walls_and_begin_where_the_sensor_was() {
        let (mut scan, times) = room_scan(360, 0.1, 0.2);
        let still = pose::<2>(0.2);
        let off = |scan: &Scan<2>| {
            let to_wall = |p: [f64; 2]| (p[0].abs().max(p[1].abs()) - 4.0).abs();
            scan.hits_world(&still).map(to_wall).fold(0.0, f64::max)
        };
        assert!(off(&scan) > 0.1);
        let trajectory = trajectory::<2>();
        scan.deskew(&times, &still, &mut trajectory.motion(0.1), 0.2).unwrap();
        assert!(off(&scan) < 1e-6, "{}", off(&scan));
        let last = still.transform_point(scan.origin(359));
        assert!(distance(last, pose::<2>(0.2 + f64::from(times[359])).translation) < 1e-9);

        // Seen from one place the ends are the same, in order. The robot turns with the laser: the seam is seen twice.
        let seen = scan.seen_from_zero().into_owned();
        assert!(off(&seen) < 1e-6 && seen.len() > 330 && seen.len() < 360, "{}", seen.len());
        assert_eq!(seen.order(), BeamOrder::Fan { closed: true });
        assert!((0..seen.len()).all(|i| seen.origin(i) == [0.0; 2]));
        let bearing = |i: usize| {
            let [a, b] = [seen.beam(0).direction, seen.beam(i).direction];
            cross(a, b).atan2(dot(a, b)).rem_euclid(std::f64::consts::TAU)
        };
        assert!((1..seen.len()).all(|i| bearing(i) > bearing(i - 1)));
    }

    #[test]
    fn an_end_that_is_hidden_from_zero_is_left_out() {
        // Beams that cross: from zero the near one hides the far ones, whether it comes before them or after.
        for (ranges, aside) in [([1.0, 4.0, 4.0], 0.2), ([4.0, 4.0, 1.0], -0.2)] {
            let bearings = [0.0, 0.01, 0.02f64];
            let beam =
                |(range, b): (f64, &f64)| Beam { direction: [b.cos(), b.sin()], range, kind: BeamKind::Hit };
            let mut scan = Scan::from_fan(&bearings, ranges.into_iter().zip(&bearings).map(beam).collect());
            scan.origins = vec![[0.0, aside]; 3];
            let seen = scan.seen_from_zero();
            assert_eq!(seen.len(), 1, "the ends are at bearings of 0.2, and of 0.05 to 0.07");
            let end = crate::geom::vector::scale(seen.beam(0).direction, seen.beam(0).range);
            assert!((end[0] - 1.0).abs() < 1e-3 && (end[1] - aside).abs() < 0.03, "{end:?}");
        }
    }
}
