//! Poses in order of time, and the pose at a time between two of them.

use portolan::geom::Pose;
use portolan::geom::vector::{add, scale, unit};

/// Between two poses that are further apart than this nothing is interpolated (seconds): a hand turns by tens of degrees
/// meanwhile.
const LONGEST_GAP: f64 = 0.1;

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
    /// 0.1 s apart the position moves on the straight line and the rotation on the arc between them; elsewhere the nearest
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
