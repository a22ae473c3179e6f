//! Poses along a path through rooms.

use portolan::geom::Pose;
use portolan::geom::vector::{along, distance, scale, sub, unit};

/// Length of path over which corners are rounded (meters).
const ROUNDING: f64 = 0.6;
/// Number of points averaged for it.
const PLACES: usize = 13;

/// A closed path on the floor, with rounded corners.
pub(super) struct Walk {
    corners: Vec<[f64; 2]>,
    length: f64,
}

impl Walk {
    pub(super) fn new(corners: &[[f64; 2]]) -> Self {
        let mut corners = corners.to_vec();
        corners.extend(corners.first().copied());
        let length = corners.windows(2).map(|w| distance(w[0], w[1])).sum();
        Self { corners, length }
    }

    /// On the corners' polyline, at an arc length.
    fn on_polyline(&self, s: f64) -> [f64; 2] {
        let mut rest = s - self.length * (s / self.length).floor();
        for w in self.corners.windows(2) {
            let leg = distance(w[0], w[1]);
            if rest <= leg {
                return along(w[0], sub(w[1], w[0]), if leg > 0.0 { rest / leg } else { 0.0 });
            }
            rest -= leg;
        }
        self.corners[0]
    }

    fn at(&self, s: f64) -> [f64; 2] {
        let sum = (0..PLACES).fold([0.0; 2], |sum, k| {
            let off = ROUNDING * ((k as f64 + 0.5) / PLACES as f64 - 0.5);
            along(sum, self.on_polyline(s + off), 1.0)
        });
        scale(sum, 1.0 / PLACES as f64)
    }

    /// Position and unit heading at a fraction of the path.
    pub(super) fn after(&self, share: f64) -> ([f64; 2], [f64; 2]) {
        let s = share * self.length;
        let heading = unit(sub(self.at(s + 0.15), self.at(s - 0.15))).unwrap_or([1.0, 0.0]);
        (self.at(s), heading)
    }
}

/// The pose of a body (x forward, y left, z up) at a position: `turn` to the left of the heading, `pitch` down, `roll` to
/// the right (radians).
pub(super) fn body_pose(place: [f64; 3], heading: [f64; 2], turn: f64, pitch: f64, roll: f64) -> Pose<3> {
    let rotated = |rotation| Pose { rotation, translation: [0.0; 3] };
    let yaw = |[c, s]: [f64; 2]| rotated([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]);
    let cos_sin = |angle: f64| [libm::cos(angle), libm::sin(angle)];
    let [c, s] = cos_sin(pitch);
    let pitch = rotated([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]);
    let [c, s] = cos_sin(roll);
    let roll = rotated([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]);
    Pose { translation: place, ..yaw(heading) * yaw(cos_sin(turn)) * pitch * roll }
}

/// A camera's axes (x right, y down, z forward) in those of its body (x forward, y left, z up).
pub(super) const BODY_FROM_CAMERA: Pose<3> =
    Pose { rotation: [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], translation: [0.0; 3] };
