//! Poses in order of time, and the pose at a time between two of them.

use portolan::geom::Pose;
use portolan::geom::vector::{add, scale, unit};

/// Between two poses that are farther apart than this nothing is interpolated (seconds). Trajectories of lidars come at 10 Hz,
/// some at 5 Hz, with times that jitter, so that 0.1 s would refuse every other pair of them; across what is longer poses were
/// lost, and a straight line is a poor guess of where a hand went in that time.
const LONGEST_GAP: f64 = 0.25;

/// A pose of a trajectory: refused ones keep their place.
#[derive(Clone, Debug)]
pub(crate) struct TrackPose {
    /// `world_from_sensor`; `None`: refused.
    pub(crate) pose: Option<Pose<3>>,
    pub(crate) time: Option<f64>,
    pub(crate) number: Option<u64>,
}

/// The usable poses of a trajectory in order of time.
pub(crate) struct TimedPoses(Vec<(f64, Pose<3>)>);

impl TimedPoses {
    /// `None` where a pose has no time, or all times are one.
    pub(crate) fn new(track: &[TrackPose]) -> Option<Self> {
        let first = track.first()?.time?;
        let mut all_one = track.len() > 1;
        let mut sorted = Vec::with_capacity(track.len());
        for entry in track {
            let time = entry.time?;
            all_one &= time == first;
            sorted.extend(entry.pose.map(|pose| (time, pose)));
        }
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        (!all_one).then_some(Self(sorted))
    }

    /// The first and the last time.
    pub(crate) fn span(&self) -> Option<(f64, f64)> {
        Some((self.0.first()?.0, self.0.last()?.0))
    }

    /// The pose at a time; `None` where no pose lies within `tolerance` (seconds) of it. Between two poses that are at most
    /// 0.25 s apart the position moves on the straight line and the rotation on the arc between them; elsewhere the nearest
    /// pose is taken as it is.
    pub(crate) fn at(&self, time: f64, tolerance: f64) -> Option<Pose<3>> {
        let after = self.0.partition_point(|(t, _)| *t < time);
        let later = self.0.get(after);
        let earlier = after.checked_sub(1).and_then(|i| self.0.get(i));
        let near = |entry: Option<&(f64, Pose<3>)>| entry.map_or(f64::INFINITY, |(t, _)| (t - time).abs());
        let (before, beyond) = (near(earlier), near(later));
        if !(before.min(beyond) <= tolerance) {
            return None;
        }
        if let (Some((a, from)), Some((b, to))) = (earlier, later)
            && beyond > 0.0
            && b - a <= LONGEST_GAP
        {
            return Some(between(from, to, (time - a) / (b - a)));
        }
        (if before < beyond { earlier } else { later }).map(|(_, pose)| *pose)
    }
}

/// The pose at share `s` of the way.
fn between(from: &Pose<3>, to: &Pose<3>, s: f64) -> Pose<3> {
    let translation = add(scale(from.translation, 1.0 - s), scale(to.translation, s));
    let start = quaternion(&from.rotation);
    let mut end = quaternion(&to.rotation);
    let mut cos: f64 = (0..4).map(|k| start[k] * end[k]).sum();
    if cos < 0.0 {
        (end, cos) = (end.map(|v| -v), -cos);
    }
    // Slerp; near zero the sines cancel and the weights are those of the straight line.
    let angle = cos.min(1.0).acos();
    let (a, b) = match angle.sin() {
        sin if sin > 1e-9 => (((1.0 - s) * angle).sin() / sin, (s * angle).sin() / sin),
        _ => (1.0 - s, s),
    };
    let q: [f64; 4] = std::array::from_fn(|k| a * start[k] + b * end[k]);
    // The shorter arc never passes zero.
    Pose::<3>::from_quaternion(translation, q).unwrap_or(*from)
}

/// The unit quaternion `(x, y, z, w)` of a rotation: from the largest of its four squares, which never cancels
/// *(Shepperd 1978)*.
fn quaternion(r: &[[f64; 3]; 3]) -> [f64; 4] {
    let trace = r[0][0] + r[1][1] + r[2][2];
    let squares = [r[0][0], r[1][1], r[2][2], trace];
    let largest = (0..4).fold(3, |best, k| if squares[k] > squares[best] { k } else { best });
    if largest == 3 {
        let q = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1], 1.0 + trace];
        return unit(q).unwrap_or(q);
    }
    let (i, j, k) = (largest, (largest + 1) % 3, (largest + 2) % 3);
    let mut q = [0.0; 4];
    q[i] = 1.0 + r[i][i] - r[j][j] - r[k][k];
    q[j] = r[i][j] + r[j][i];
    q[k] = r[i][k] + r[k][i];
    q[3] = r[k][j] - r[j][k];
    unit(q).unwrap_or(q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;
    use portolan::geom::vector::distance;

    fn track(poses: &[(f64, Option<Pose<3>>)]) -> Vec<TrackPose> {
        poses.iter().map(|(time, pose)| TrackPose { pose: *pose, time: Some(*time), number: None }).collect()
    }

    fn about_z(x: f64, angle: f64) -> Pose<3> {
        Pose::<3>::from_quaternion([x, 0.0, 0.0], [0.0, 0.0, (angle / 2.0).sin(), (angle / 2.0).cos()])
            .unwrap()
    }

    #[test]
    fn between_poses_the_way_is_straight_and_the_turn_even() {
        // Out of order, one refused, then a gap.
        let poses = [
            (0.10, Some(about_z(1.0, 1.0))),
            (0.00, Some(about_z(0.0, 0.0))),
            (0.05, None),
            (9.00, Some(about_z(5.0, -2.0))),
        ];
        let poses = TimedPoses::new(&track(&poses)).unwrap();
        assert_eq!(poses.span(), Some((0.0, 9.0)));
        let near = |time: f64, tolerance: f64, x: f64, angle: f64| {
            let (found, expected) = (poses.at(time, tolerance).unwrap(), about_z(x, angle));
            let off = distance(found.transform_point([1.0; 3]), expected.transform_point([1.0; 3]));
            assert!(off < 1e-12 && found.is_rigid(), "{time}: {found:?}");
        };
        near(0.0, 0.02, 0.0, 0.0);
        near(0.1, 0.0, 1.0, 1.0);
        near(0.02, 0.02, 0.2, 0.2);
        near(0.085, 0.02, 0.85, 0.85);
        assert_eq!(poses.at(0.05, 0.02), None, "too far from both");
        near(0.05, 0.05, 0.5, 0.5);
        near(-0.01, 0.02, 0.0, 0.0);
        near(0.11, 0.02, 1.0, 1.0); // the gap after it is too long to interpolate
        near(9.02, 0.021, 5.0, -2.0);
        assert_eq!(poses.at(f64::NAN, 1.0), None);
        assert!(TimedPoses::new(&track(&[(0.0, Some(Pose::IDENTITY)); 3])).is_none(), "zero is no time");
    }

    #[test]
    fn ten_and_five_poses_a_second_are_interpolated_and_lost_ones_are_not() {
        for period in [0.1, 0.2] {
            // Not all of these times are exactly a period apart.
            let poses: Vec<_> = (0..50).map(|k| (period * f64::from(k), f64::from(k))).collect();
            let poses: Vec<_> = poses.iter().map(|(t, x)| (*t, Some(about_z(*x, 0.0)))).collect();
            let poses = TimedPoses::new(&track(&poses)).unwrap();
            for k in 0..49 {
                let found = poses.at(period * (f64::from(k) + 0.25), 0.06).unwrap();
                assert!((found.translation[0] - f64::from(k) - 0.25).abs() < 1e-9, "{period} {k}");
            }
        }
        let gap = track(&[(0.0, Some(about_z(0.0, 0.0))), (0.3, Some(about_z(3.0, 0.0)))]);
        let nearest = TimedPoses::new(&gap).unwrap().at(0.05, 0.06).unwrap();
        assert_eq!(nearest.translation[0], 0.0);
    }

    #[test]
    fn quaternions_of_rotations_give_the_rotation_again() {
        let mut random = Random(3);
        for k in 0..2000 {
            let mut q = [0; 4].map(|_| 2.0 * random.unit() - 1.0);
            // Half turns are where a trace alone would cancel.
            q[3] *= [1.0, 1e-9, 0.0][k % 3];
            let Some(pose) = Pose::<3>::from_quaternion([0.0; 3], q) else { continue };
            let again = Pose::<3>::from_quaternion([0.0; 3], quaternion(&pose.rotation)).unwrap();
            for p in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
                assert!(distance(pose.transform_point(p), again.transform_point(p)) < 1e-12);
            }
        }
    }
}
