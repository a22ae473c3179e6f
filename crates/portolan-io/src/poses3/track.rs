//! Poses in order of time, and the pose at a time between two of them.

use portolan::geom::{Pose, Trajectory, TrajectoryError};

/// A pose of a trajectory: refused ones keep their place.
#[derive(Clone, Debug)]
pub(crate) struct TrackPose {
    /// `world_from_sensor`; `None`: refused.
    pub(crate) pose: Option<Pose<3>>,
    pub(crate) time: Option<f64>,
    pub(crate) number: Option<u64>,
}

/// The usable poses of a trajectory in order of time.
pub(crate) struct TimedPoses(Trajectory<3>);

impl TimedPoses {
    /// `None` where a pose has no time, or all times are one.
    ///
    /// # Errors
    /// Poses of one time that contradict each other.
    pub(crate) fn new(track: &[TrackPose]) -> Result<Option<Self>, TrajectoryError> {
        let Some(first) = track.first().and_then(|entry| entry.time) else { return Ok(None) };
        let mut all_one = track.len() > 1;
        let mut stamped = Vec::with_capacity(track.len());
        for entry in track {
            let Some(time) = entry.time else { return Ok(None) };
            all_one &= time == first;
            stamped.extend(entry.pose.map(|pose| (time, pose)));
        }
        if all_one {
            return Ok(None);
        }
        Trajectory::new(stamped).map(|poses| Some(Self(poses)))
    }

    /// The poses.
    pub(crate) fn trajectory(&self) -> &Trajectory<3> {
        &self.0
    }

    /// The first and the last time.
    pub(crate) fn span(&self) -> Option<(f64, f64)> {
        self.0.span()
    }

    /// The pose at a time; `None` where no pose lies within `tolerance` (seconds) of it. Where its neighbours say how the sensor
    /// moved it is that of [`Trajectory::at`], else the nearest pose as it is.
    pub(crate) fn at(&self, time: f64, tolerance: f64) -> Option<Pose<3>> {
        let (nearest, pose) = self.0.nearest(time)?;
        if !((nearest - time).abs() <= tolerance) {
            return None;
        }
        Some(self.0.at(time, tolerance).unwrap_or(*pose))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::geom::vector::distance;

    fn track(poses: &[(f64, Option<Pose<3>>)]) -> Vec<TrackPose> {
        poses.iter().map(|(time, pose)| TrackPose { pose: *pose, time: Some(*time), number: None }).collect()
    }

    fn timed(poses: &[(f64, Option<Pose<3>>)]) -> Option<TimedPoses> {
        TimedPoses::new(&track(poses)).unwrap()
    }

    fn about_z(x: f64, angle: f64) -> Pose<3> {
        Pose::<3>::from_quaternion([x, 0.0, 0.0], [0.0, 0.0, (angle / 2.0).sin(), (angle / 2.0).cos()])
            .unwrap()
    }

    #[test]
    fn between_poses_the_twist_is_constant() {
        // Out of order, one refused, then a gap.
        let poses = [
            (0.10, Some(about_z(1.0, 1.0))),
            (0.00, Some(about_z(0.0, 0.0))),
            (0.05, None),
            (9.00, Some(about_z(5.0, -2.0))),
        ];
        let poses = timed(&poses).unwrap();
        assert_eq!(poses.span(), Some((0.0, 9.0)));
        let near_to = |time: f64, tolerance: f64, expected: Pose<3>| {
            let found = poses.at(time, tolerance).unwrap();
            let off = distance(found.transform_point([1.0; 3]), expected.transform_point([1.0; 3]));
            assert!(off < 1e-12 && found.is_rigid(), "{time}: {found:?}");
        };
        let share = |s: f64| about_z(0.0, 0.0).toward(&about_z(1.0, 1.0), s);
        near_to(0.0, 0.02, about_z(0.0, 0.0));
        near_to(0.1, 0.0, about_z(1.0, 1.0));
        near_to(0.02, 0.02, share(0.2));
        near_to(0.085, 0.02, share(0.85));
        assert_eq!(poses.at(0.05, 0.02), None, "too far from both");
        near_to(0.05, 0.05, share(0.5));
        near_to(-0.01, 0.02, share(-0.1));
        near_to(0.11, 0.02, share(1.1)); // the gap after it is too long to interpolate
        near_to(9.02, 0.021, about_z(5.0, -2.0)); // nothing says how it moved there
        assert_eq!(poses.at(f64::NAN, 1.0), None);
        assert!(timed(&[(0.0, Some(Pose::IDENTITY)); 3]).is_none(), "zero is no time");
    }

    #[test]
    fn ten_and_five_poses_a_second_are_interpolated_and_lost_ones_are_not() {
        for period in [0.1, 0.2] {
            // Not all of these times are exactly a period apart.
            let poses: Vec<_> = (0..50).map(|k| (period * f64::from(k), f64::from(k))).collect();
            let poses: Vec<_> = poses.iter().map(|(t, x)| (*t, Some(about_z(*x, 0.0)))).collect();
            let poses = timed(&poses).unwrap();
            for k in 0..49 {
                let found = poses.at(period * (f64::from(k) + 0.25), 0.06).unwrap();
                assert!((found.translation[0] - f64::from(k) - 0.25).abs() < 1e-9, "{period} {k}");
            }
        }
        let gap = [(0.0, Some(about_z(0.0, 0.0))), (0.3, Some(about_z(3.0, 0.0)))];
        let nearest = timed(&gap).unwrap().at(0.05, 0.06).unwrap();
        assert_eq!(nearest.translation[0], 0.0);
    }
}
