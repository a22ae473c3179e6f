//! Stamped poses of one body in one frame: an edge of the tree, or a topic of poses.

use portolan::geom::vector::{dot, norm};
use portolan::geom::{NoPose, Pose, Trajectory};

use crate::message::RawTransform;

/// Quaternions whose length is further from one than this are counted as mended: those of `f32` are off by 1e-7.
const MENDED_FROM: f64 = 1e-4;
/// Poses of one time that are nearer than this are one (meters, entries of the rotation).
const SAME: f64 = 1e-6;
/// The longest time across which poses are interpolated is so many of their usual intervals ..
const GAP_INTERVALS: f64 = 4.0;
/// .. but within these (seconds).
const GAPS: [f64; 2] = [Trajectory::<3>::LONGEST_GAP, 2.0];
/// Poses that jump to and fro by more than this (meters) come from two publishers.
const JUMP: f64 = 0.05;

/// Collects stamped poses in the order of the bag.
#[derive(Clone, Debug, Default)]
pub struct TrackBuilder {
    samples: Vec<(i64, Pose<3>)>,
    last: Option<i64>,
    refused: u64,
    mended: u64,
    /// How often a stamp is before the last, and by how much at most (nanoseconds).
    backwards: (u64, i64),
}

/// The pose of a transform: `None` for a quaternion that is zero or anything that is not finite. The flag says that the
/// quaternion was not of length one.
pub(super) fn pose(raw: &RawTransform) -> Option<(Pose<3>, bool)> {
    let length = dot(raw.quaternion, raw.quaternion).sqrt();
    // A shorter one is noise about zero.
    let finite = length.is_finite() && raw.translation.iter().all(|v| v.is_finite());
    if !finite || length <= 1e-6 {
        return None;
    }
    let pose = Pose::<3>::from_quaternion(raw.translation, raw.quaternion)?;
    Some((pose, (length - 1.0).abs() > MENDED_FROM))
}

/// How far two poses are apart: meters, and the largest difference of an entry of the rotation, which is about an angle.
pub(super) fn apart(a: &Pose<3>, b: &Pose<3>) -> (f64, f64) {
    let entries = a.rotation.iter().flatten().zip(b.rotation.iter().flatten());
    (a.translation_to(b), entries.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max))
}

impl TrackBuilder {
    /// Takes a pose; one that cannot be used is counted.
    pub fn add(&mut self, stamp: i64, raw: &RawTransform) {
        match pose(raw) {
            None => self.refused += 1,
            Some((pose, mended)) => {
                self.mended += u64::from(mended);
                if let Some(last) = self.last
                    && stamp < last
                {
                    self.backwards.0 += 1;
                    self.backwards.1 = self.backwards.1.max(last - stamp);
                }
                self.last = Some(stamp);
                self.samples.push((stamp, pose));
            }
        }
    }

    /// Counts a quaternion that was mended elsewhere.
    pub(super) fn count_mended(&mut self) {
        self.mended += 1;
    }

    /// The track, with what is odd about it. `name` names it in notes.
    pub fn finish(mut self, name: &str) -> Track {
        let mut notes = Vec::new();
        if self.refused > 0 {
            notes
                .push(format!("{name}: {} poses refused: not finite, or a quaternion of zero", self.refused));
        }
        if self.mended > 0 {
            notes.push(format!("{name}: {} quaternions were not of length 1 and were mended", self.mended));
        }
        if self.backwards.0 > 0 {
            let most = self.backwards.1 as f64 * 1e-9;
            notes.push(format!(
                "{name}: stamps go back {} times, by up to {most:.3} s: sorted by stamp (a clock that jumps, or a log played in a loop, gives wrong poses)",
                self.backwards.0
            ));
        }
        self.samples.sort_by_key(|(stamp, _)| *stamp);
        let (mut differ, mut most) = (0u64, 0.0f64);
        let mut repeated = 0u64;
        self.samples.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                let (way, turn) = apart(&next.1, &kept.1);
                repeated += 1;
                if way > SAME || turn > SAME {
                    differ += 1;
                    most = most.max(way.max(turn));
                }
            }
            same
        });
        if differ > 0 {
            notes.push(format!(
                "{name}: {differ} times there are two poses of one stamp that differ, by up to {most:.3} (m or rad): the first is taken (two publishers?)"
            ));
        }
        if let Some(jump) = to_and_fro(&self.samples) {
            notes.push(format!(
                "{name}: poses jump to and fro by {jump:.2} m: two publishers that disagree; poses between them are wrong"
            ));
        }
        let base = self.samples.first().map_or(0, |(stamp, _)| *stamp);
        let seconds = |stamp: i64| stamp.saturating_sub(base) as f64 * 1e-9;
        let times: Vec<f64> = self.samples.iter().map(|(stamp, _)| seconds(*stamp)).collect();
        let mut gaps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
        let largest_gap = gaps.iter().copied().fold(0.0, f64::max);
        gaps.sort_by(f64::total_cmp);
        let usual = gaps.get(gaps.len() / 2).copied().unwrap_or(0.0);
        let still = self.samples.windows(2).all(|w| {
            let (way, turn) = apart(&w[0].1, &w[1].1);
            way < 1e-9 && turn < 1e-9
        });
        let longest = if still { f64::INFINITY } else { (GAP_INTERVALS * usual).clamp(GAPS[0], GAPS[1]) };
        let last = self.samples.last().map_or(0, |(stamp, _)| *stamp);
        let poses = times.into_iter().zip(self.samples.iter().map(|(_, pose)| *pose));
        // Poses are rigid, times finite and distinct: it cannot fail.
        let trajectory = Trajectory::new(poses).unwrap_or_else(|_| empty());
        Track {
            base,
            last,
            trajectory: trajectory.with_longest_gap(longest),
            largest_gap,
            usual_interval: usual,
            repeated,
            notes,
        }
    }
}

fn empty() -> Trajectory<3> {
    Trajectory::new([]).unwrap_or_else(|_| unreachable!("nothing contradicts nothing"))
}

/// How far the poses jump, where they alternate between two places: the pose after the next is near, the next is not.
fn to_and_fro(samples: &[(i64, Pose<3>)]) -> Option<f64> {
    let (mut jumps, mut most) = (0usize, 0.0f64);
    for w in samples.windows(3) {
        let step = w[0].1.translation_to(&w[1].1);
        if step > JUMP && w[0].1.translation_to(&w[2].1) < 0.2 * step {
            jumps += 1;
            most = most.max(step);
        }
    }
    (jumps >= 5 && jumps * 10 >= samples.len()).then_some(most)
}

/// Stamped poses of a body, and the pose at a time.
///
/// Between poses the body moves at constant twist ([`Trajectory`]). Across more than four usual intervals (0.25 s at least, 2 s at
/// most) nothing is interpolated, unless all poses are one.
#[derive(Clone, Debug)]
pub struct Track {
    /// What times are counted from (nanoseconds), so that they are exact.
    base: i64,
    last: i64,
    trajectory: Trajectory<3>,
    largest_gap: f64,
    usual_interval: f64,
    repeated: u64,
    notes: Vec<String>,
}

impl Track {
    /// Number of poses of different stamps.
    pub fn len(&self) -> usize {
        self.trajectory.len()
    }

    /// Whether it has no pose.
    pub fn is_empty(&self) -> bool {
        self.trajectory.is_empty()
    }

    /// The first and the last stamp (nanoseconds); `None` without poses.
    pub fn span(&self) -> Option<(i64, i64)> {
        (!self.is_empty()).then_some((self.base, self.last))
    }

    /// The longest time between two poses (seconds); 0 for fewer than two.
    pub fn largest_gap(&self) -> f64 {
        self.largest_gap
    }

    /// The median time between two poses (seconds); 0 for fewer than two.
    pub fn usual_interval(&self) -> f64 {
        self.usual_interval
    }

    /// Poses that were left out because another has the same stamp.
    pub fn repeated(&self) -> u64 {
        self.repeated
    }

    /// What is odd about it.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Length of the way from pose to pose (meters).
    pub fn path_length(&self) -> f64 {
        let mut before: Option<[f64; 3]> = None;
        let mut all = 0.0;
        for (_, pose) in self.trajectory.iter() {
            let step = before.map(|b| [0, 1, 2].map(|k| pose.translation[k] - b[k]));
            all += step.map_or(0.0, norm);
            before = Some(pose.translation);
        }
        all
    }

    /// The pose at a stamp (nanoseconds); beyond the ends and into gaps the motion goes on for at most `tolerance` seconds. O(log n).
    ///
    /// # Errors
    /// [`NoPose`] with the gap in seconds.
    pub fn at(&self, stamp: i64, tolerance: f64) -> Result<Pose<3>, NoPose> {
        let time = stamp.saturating_sub(self.base) as f64 * 1e-9;
        match self.trajectory.at(time, tolerance) {
            // A single pose says nothing of motion, but near its time it holds.
            Err(NoPose::Before(gap) | NoPose::After(gap)) if gap <= tolerance && self.len() == 1 => {
                self.trajectory.nearest(time).map(|(_, pose)| *pose).ok_or(NoPose::Empty)
            }
            answer => answer,
        }
    }
}
