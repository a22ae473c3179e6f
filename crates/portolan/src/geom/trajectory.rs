//! Poses with stamps, and the pose at a time.

use super::Pose;
use super::twist::Twist;

/// Stamped poses of a body, ascending in time, with the pose at any time that they cover.
///
/// Between two poses, and for a little beyond the first and the last, the body moves at constant twist ([`Pose::toward`]): rotation
/// by slerp, position along the arc. Where neighbouring poses are further apart than the longest gap, some were lost; nothing
/// is interpolated there.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory<const D: usize> {
    times: Vec<f64>,
    poses: Vec<Pose<D>>,
    longest_gap: f64,
}

/// Why stamped poses are no trajectory.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// A stamp is NaN or infinite.
    #[error("pose {0} has a time that is not finite")]
    Time(usize),
    /// A pose is not finite, or its rotation is not orthonormal to 1e-6.
    #[error("pose {0} is not rigid")]
    NotRigid(usize),
    /// Two poses have the same stamp and are not one: more than a centimeter or a hundredth of a radian apart.
    #[error(
        "two poses of the time {time} contradict each other: they are {apart:.3} m and {turn:.3} rad apart"
    )]
    Contradiction {
        /// Their stamp (seconds).
        time: f64,
        /// Between their positions (meters).
        apart: f64,
        /// Between their rotations: the largest difference of an entry, which is about an angle (radians).
        turn: f64,
    },
}

/// Why there is no pose at a time.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoPose {
    /// The trajectory has no pose at all.
    #[error("there is no pose at all")]
    Empty,
    /// The time is NaN or infinite.
    #[error("the time is not finite")]
    Time,
    /// The time lies before the first pose, by so much (seconds), or is near it but no second pose says how the body moved.
    #[error("it is {0:.3} s before the first pose")]
    Before(f64),
    /// The time lies after the last pose, by so much (seconds), or is near it but no other pose says how the body moved.
    #[error("it is {0:.3} s after the last pose")]
    After(f64),
    /// The time lies between two poses that are so far apart (seconds), too far to be interpolated between.
    #[error("the poses around it are {0:.3} s apart")]
    Gap(f64),
}

/// Two poses of one time that are closer than this are one (meters, radians).
const SAME: f64 = 1e-2;

impl<const D: usize> Trajectory<D> {
    /// Between two poses that are further apart than this nothing is interpolated, unless the caller says so (seconds).
    /// Poses of lidars come at 10 Hz, some at 5 Hz, with times that jitter, so that 0.1 s would refuse every other pair of them;
    /// across what is longer poses were lost, and an even motion is a poor guess of where a hand went in that time.
    pub const LONGEST_GAP: f64 = 0.25;

    /// A trajectory of `(seconds, target_from_source)` in any order. Poses of the same time that agree to a centimeter and a
    /// hundredth of a radian are one, the first of them. O(n log n).
    ///
    /// # Errors
    /// [`TrajectoryError`] for a time or a pose that cannot be used (with its place in what was given), and for poses that
    /// contradict each other.
    pub fn new(stamped: impl IntoIterator<Item = (f64, Pose<D>)>) -> Result<Self, TrajectoryError> {
        let mut all: Vec<(f64, Pose<D>)> = stamped.into_iter().collect();
        for (i, (time, pose)) in all.iter().enumerate() {
            if !time.is_finite() {
                return Err(TrajectoryError::Time(i));
            }
            if !pose.is_rigid() {
                return Err(TrajectoryError::NotRigid(i));
            }
        }
        // Stable, so that the first of equals is the first given; -0.0 and 0.0 are one time.
        all.sort_by(|a, b| (a.0 + 0.0).total_cmp(&(b.0 + 0.0)));
        let (mut times, mut poses): (Vec<f64>, Vec<Pose<D>>) = (Vec::new(), Vec::new());
        for (time, pose) in all {
            let same_time = times.last().is_some_and(|last| *last == time);
            if let (true, Some(other)) = (same_time, poses.last()) {
                let apart = pose.translation_to(other);
                let entries = pose.rotation.iter().flatten().zip(other.rotation.iter().flatten());
                let turn = entries.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                if apart > SAME || turn > SAME {
                    return Err(TrajectoryError::Contradiction { time, apart, turn });
                }
                continue;
            }
            times.push(time);
            poses.push(pose);
        }
        Ok(Self { times, poses, longest_gap: Self::LONGEST_GAP })
    }

    /// With another longest gap (seconds). Infinity: everything between the first and the last pose is interpolated.
    pub fn with_longest_gap(self, seconds: f64) -> Self {
        Self { longest_gap: seconds, ..self }
    }

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there is no pose.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Times and poses, ascending.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (f64, &Pose<D>)> + '_ {
        self.times.iter().copied().zip(&self.poses)
    }

    /// The first and the last time (seconds); `None` without poses.
    pub fn span(&self) -> Option<(f64, f64)> {
        Some((*self.times.first()?, *self.times.last()?))
    }

    /// The pose whose time is nearest, as it is, and its time; the earlier of two as near. `None` without poses or for a time
    /// that is NaN. O(log n).
    pub fn nearest(&self, time: f64) -> Option<(f64, &Pose<D>)> {
        let after = self.times.partition_point(|t| *t < time);
        let off = |i: usize| (self.times[i] - time).abs();
        let around = [after.checked_sub(1), (after < self.len()).then_some(after)].into_iter().flatten();
        let best = around.filter(|i| off(*i) >= 0.0).min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
        Some((self.times[best], &self.poses[best]))
    }

    /// The pose at a time (seconds). Between neighbours that are at most the longest gap apart it is interpolated; before the
    /// first pose, after the last and inside of longer gaps the motion of the neighbours on the near side goes on, for at most
    /// `tolerance` seconds from the near pose. That motion is taken over at least as long a time as it goes on for, so
    /// that the noise of poses is not multiplied. A pose at the very time is returned as it is, bit for bit. O(log n).
    ///
    /// # Errors
    /// [`NoPose`] says what is missing and by how much.
    pub fn at(&self, time: f64, tolerance: f64) -> Result<Pose<D>, NoPose> {
        Motion::new(self, tolerance).at(time)
    }

    /// Asks for the poses at many times, of which consecutive ones lie between the same two poses more often than not; the
    /// answers are those of [`Trajectory::at`].
    pub fn motion(&self, tolerance: f64) -> Motion<'_, D> {
        Motion::new(self, tolerance)
    }
}

/// A trajectory that is asked for many times ([`Trajectory::motion`]): keeps the twist that the last answer came from.
#[derive(Clone, Debug)]
pub struct Motion<'a, const D: usize> {
    trajectory: &'a Trajectory<D>,
    tolerance: f64,
    /// The two poses, and the twist between them.
    last: Option<([usize; 2], Twist)>,
}

impl<'a, const D: usize> Motion<'a, D> {
    fn new(trajectory: &'a Trajectory<D>, tolerance: f64) -> Self {
        Self { trajectory, tolerance, last: None }
    }

    /// The pose at a time (seconds): as [`Trajectory::at`].
    ///
    /// # Errors
    /// As [`Trajectory::at`].
    pub fn at(&mut self, time: f64) -> Result<Pose<D>, NoPose> {
        let Trajectory { times, poses, longest_gap } = self.trajectory;
        if !time.is_finite() {
            return Err(NoPose::Time);
        }
        if times.is_empty() {
            return Err(NoPose::Empty);
        }
        let after = times.partition_point(|t| *t < time);
        if times.get(after).is_some_and(|t| *t == time) {
            return Ok(poses[after]);
        }
        // The pair whose motion holds at this time, the nearer pose first.
        let pair = match (after.checked_sub(1), (after < times.len()).then_some(after)) {
            (Some(a), Some(b)) if times[b] - times[a] <= *longest_gap => Some([a, b]),
            (Some(a), Some(b)) => {
                let (since, until) = (time - times[a], times[b] - time);
                let from_a = (since <= self.tolerance).then(|| self.back_from(a, since)).flatten();
                let from_b = (until <= self.tolerance).then(|| self.on_from(b, until)).flatten();
                let pair = if since <= until { from_a.or(from_b) } else { from_b.or(from_a) };
                Some(pair.ok_or(NoPose::Gap(times[b] - times[a]))?)
            }
            (Some(a), None) => {
                let since = time - times[a];
                let pair = (since <= self.tolerance).then(|| self.back_from(a, since)).flatten();
                Some(pair.ok_or(NoPose::After(since))?)
            }
            (None, Some(b)) => {
                let until = times[b] - time;
                let pair = (until <= self.tolerance).then(|| self.on_from(b, until)).flatten();
                Some(pair.ok_or(NoPose::Before(until))?)
            }
            (None, None) => None,
        };
        let [a, b] = pair.ok_or(NoPose::Empty)?;
        let twist = match self.last {
            Some((of, twist)) if of == [a, b] => twist,
            _ => {
                let twist = Twist::of(&(poses[a].inverse() * poses[b]));
                self.last = Some(([a, b], twist));
                twist
            }
        };
        Ok(poses[a] * twist.share((time - times[a]) / (times[b] - times[a])))
    }

    /// Pose `a` and an earlier one that together say how the body moved before `a`: over `long` seconds, where no gap is in
    /// between.
    fn back_from(&self, a: usize, long: f64) -> Option<[usize; 2]> {
        let times = &self.trajectory.times;
        let mut found = None;
        for i in (0..a).rev() {
            if times[i + 1] - times[i] > self.trajectory.longest_gap {
                break;
            }
            found = Some([a, i]);
            if times[a] - times[i] >= long {
                break;
            }
        }
        found
    }

    /// The same with poses after `b`.
    fn on_from(&self, b: usize, long: f64) -> Option<[usize; 2]> {
        let times = &self.trajectory.times;
        let mut found = None;
        for i in b + 1..times.len() {
            if times[i] - times[i - 1] > self.trajectory.longest_gap {
                break;
            }
            found = Some([b, i]);
            if times[i] - times[b] >= long {
                break;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::distance;
    use proptest::prelude::*;

    /// A turn about the zero at 1.5 rad/s, 2 m from it: constant twist for all time.
    fn circle(time: f64) -> Pose<2> {
        let a = 1.5 * time;
        Pose::<2>::new(2.0 * a.cos(), 2.0 * a.sin(), a)
    }

    fn of(times: &[f64]) -> Trajectory<2> {
        Trajectory::new(times.iter().map(|t| (*t, circle(*t)))).unwrap()
    }

    fn near(found: Result<Pose<2>, NoPose>, expected: Pose<2>) {
        let found = found.unwrap();
        assert!(distance(found.translation, expected.translation) < 1e-9, "{found:?} {expected:?}");
        assert!(distance(found.rotation[0], expected.rotation[0]) < 1e-9);
    }

    #[test]
    fn constant_twist_is_followed_between_beyond_and_into_gaps() {
        let poses = of(&[0.2, 0.0, 0.1, 5.0, 5.1]);
        assert_eq!((poses.len(), poses.span()), (5, Some((0.0, 5.1))));
        for time in [0.0, 0.04, 0.1, 0.17, -0.03, -0.1, 0.26, 4.95, 5.14] {
            near(poses.at(time, 0.1), circle(time));
        }
        assert_eq!(poses.at(0.1, 0.0).unwrap(), circle(0.1), "bit for bit");
        assert_eq!(poses.at(0.25, 0.04), Err(NoPose::Gap(4.8)));
        assert_eq!(poses.at(2.0, 0.1), Err(NoPose::Gap(4.8)));
        assert!(matches!(poses.at(-0.2, 0.1), Err(NoPose::Before(gap)) if (gap - 0.2).abs() < 1e-12));
        assert!(matches!(poses.at(5.3, 0.1), Err(NoPose::After(gap)) if (gap - 0.2).abs() < 1e-12));
        assert_eq!(poses.at(f64::NAN, 0.1), Err(NoPose::Time));
        near(poses.clone().with_longest_gap(5.0).at(2.0, 0.0), {
            let (a, b) = (circle(0.2), circle(5.0));
            a.toward(&b, 1.8 / 4.8)
        });
        assert_eq!(poses.nearest(0.16).unwrap().0, 0.2);
        assert_eq!(poses.nearest(-9.0).unwrap().0, 0.0);
        assert!(poses.nearest(f64::NAN).is_none());
    }

    #[test]
    fn one_pose_says_nothing_of_motion() {
        let one = of(&[1.0]);
        assert_eq!(one.at(1.0, 0.1).unwrap(), circle(1.0));
        assert!(matches!(one.at(1.01, 0.1), Err(NoPose::After(_))));
        assert!(matches!(one.at(0.99, 0.1), Err(NoPose::Before(_))));
        assert_eq!(of(&[]).at(0.0, 1.0), Err(NoPose::Empty));
        // A pose between two gaps neither.
        let lonely = of(&[0.0, 1.0, 2.0]);
        assert_eq!(lonely.at(1.01, 0.1), Err(NoPose::Gap(1.0)));
    }

    #[test]
    fn a_motion_goes_on_as_it_was_over_as_long_a_time() {
        // Poses at 1 kHz with a millimeter of noise: the last two alone would say 1 m/s.
        let noisy = (0..100).map(|k| {
            let x = if k % 2 == 0 { 0.0 } else { 1e-3 };
            (1e-3 * f64::from(k), Pose::<2>::new(x, 0.0, 0.0))
        });
        let found = Trajectory::new(noisy).unwrap().at(0.149, 0.1).unwrap();
        assert!(found.translation[0].abs() < 2.1e-3, "{found:?}");
    }

    #[test]
    fn what_is_no_trajectory_is_refused() {
        let at = |time: f64, x: f64| (time, Pose::<2>::new(x, 0.0, 0.0));
        assert_eq!(Trajectory::new([at(0.0, 0.0), at(f64::NAN, 0.0)]), Err(TrajectoryError::Time(1)));
        let broken = Pose { rotation: [[1.0, 0.1], [0.0, 1.0]], translation: [0.0; 2] };
        assert_eq!(Trajectory::new([(0.0, broken)]), Err(TrajectoryError::NotRigid(0)));
        let two = Trajectory::new([at(1.0, 0.0), at(2.0, 0.0), at(1.0, 5.0)]);
        assert!(matches!(two, Err(TrajectoryError::Contradiction { time: 1.0, apart: 5.0, .. })), "{two:?}");
        let turned = Trajectory::new([at(1.0, 0.0), (1.0, Pose::<2>::new(0.0, 0.0, 0.1))]);
        assert!(matches!(turned, Err(TrajectoryError::Contradiction { .. })), "{turned:?}");
        let same = Trajectory::new([at(1.0, 0.001), at(0.0, 0.0), at(1.0, 0.002), at(-0.0, 0.0)]).unwrap();
        assert_eq!(
            same.iter().map(|(t, p)| (t, p.translation[0])).collect::<Vec<_>>(),
            [(0.0, 0.0), (1.0, 0.001)]
        );
    }

    proptest! {
        /// Asking many times in a row gives the answers of asking once.
        #[test]
        fn what_is_kept_changes_no_answer(
            times in prop::collection::vec(0.0..3.0f64, 1..12), asked in prop::collection::vec(-0.5..3.5f64, 1..40),
        ) {
            let poses = of(&times);
            let mut motion = poses.motion(0.2);
            for t in asked {
                prop_assert_eq!(motion.at(t), poses.at(t, 0.2));
                if let Ok(pose) = motion.at(t) {
                    prop_assert!(pose.is_rigid() && distance(pose.translation, circle(t).translation) < 1e-6);
                }
            }
        }
    }
}
