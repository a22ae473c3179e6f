//! A part of a rigid motion: constant twist between two poses, and beyond them.

use super::Pose;
use super::vector::{add, cross3, dot, norm, scale, sub, unit};

/// What turns and moves between two poses at constant twist: an axis, an angle about it, and the way.
///
/// Made once for a pair of poses and asked for many shares of the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Twist {
    axis: [f64; 3],
    /// Radians, in `[0, pi]`.
    angle: f64,
    /// The translation along the axis, across it, and across both.
    along: [f64; 3],
    across: [f64; 3],
    third: [f64; 3],
}

impl Twist {
    /// The twist of a motion, by the shorter way round.
    pub(super) fn of<const D: usize>(motion: &Pose<D>) -> Self {
        let (axis, angle) = axis_angle(&motion.rotation);
        let t = std::array::from_fn(|k| if k < D { motion.translation[k] } else { 0.0 });
        let along = scale(axis, dot(axis, t));
        let across = sub(t, along);
        Self { axis, angle, along, across, third: cross3(axis, across) }
    }

    /// The motion after a share of the time: 0 none, 1 all of it, beyond 1 and below 0 what comes after and was before.
    ///
    /// The rotation is that of slerp. Position follows the screw: of a way `t` across the axis,
    /// `(e^{i s a} - 1) / (e^{i a} - 1) t` in the plane that turns, which is `sin(s a / 2) / sin(a / 2) e^{i (s - 1) a / 2} t`.
    pub(super) fn share<const D: usize>(&self, s: f64) -> Pose<D> {
        let half = 0.5 * self.angle;
        // Of a tiny angle the quotient of sines is that of their arguments.
        let length = if half > 1e-9 { (s * half).sin() / half.sin() } else { s };
        let (sin, cos) = ((s - 1.0) * half).sin_cos();
        let t =
            add(scale(self.along, s), scale(add(scale(self.across, cos), scale(self.third, sin)), length));
        let rotation = about(self.axis, s * self.angle);
        Pose {
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| rotation[i][j])),
            translation: std::array::from_fn(|k| t[k]),
        }
    }
}

impl<const D: usize> Pose<D> {
    /// The pose at share `s` of the way to another, at constant twist: 0 is this pose, 1 the other, beyond lies what the same
    /// motion would have come to.
    ///
    /// The rotation is that of slerp, by the shorter way round. The position follows the arc that a body with constant velocity
    /// and turn rate describes, not the chord, so that every point fixed to the body is at the same place whichever frame of
    /// the body the poses are of. Over a tenth of a second at 2 m/s and 90 degrees/s arc and chord are 4 mm apart in the
    /// middle.
    pub fn toward(&self, other: &Self, s: f64) -> Self {
        *self * Twist::of(&(self.inverse() * *other)).share(s)
    }
}

/// The axis and the angle in `[0, pi]` of a rotation; in 2-D the axis is plus or minus z.
fn axis_angle<const D: usize>(r: &[[f64; D]; D]) -> ([f64; 3], f64) {
    let [x, y, z, w] = match D {
        2 => {
            let half = 0.5 * r[1][0].atan2(r[0][0]);
            [0.0, 0.0, half.sin(), half.cos()]
        }
        3 => quaternion(std::array::from_fn(|i| std::array::from_fn(|j| r[i][j]))),
        _ => unreachable!("poses have two or three dimensions"),
    };
    let [x, y, z, w] = if w < 0.0 { [-x, -y, -z, -w] } else { [x, y, z, w] };
    let sine = norm([x, y, z]);
    // Without a rotation any axis serves; in 2-D it must be that of the plane.
    (unit([x, y, z]).unwrap_or([0.0, 0.0, 1.0]), 2.0 * sine.atan2(w))
}

/// The rotation by an angle about a unit axis *(Rodrigues 1840)*.
fn about([x, y, z]: [f64; 3], angle: f64) -> [[f64; 3]; 3] {
    let (sin, cos) = angle.sin_cos();
    let c = 2.0 * (0.5 * angle).sin().powi(2);
    [
        [cos + c * x * x, c * x * y - sin * z, c * x * z + sin * y],
        [c * x * y + sin * z, cos + c * y * y, c * y * z - sin * x],
        [c * x * z - sin * y, c * y * z + sin * x, cos + c * z * z],
    ]
}

/// The unit quaternion `(x, y, z, w)` of a rotation: from the largest of its four squares, which never cancels
/// *(Shepperd 1978)*.
fn quaternion(r: [[f64; 3]; 3]) -> [f64; 4] {
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
    use crate::geom::vector::distance;
    use crate::testing::{Random, point};
    use proptest::prelude::*;

    fn pose_3d(t: [f64; 3], q: [f64; 4]) -> Pose<3> {
        Pose::<3>::from_quaternion(t, q).unwrap_or(Pose::IDENTITY)
    }

    fn near<const D: usize>(a: &Pose<D>, b: &Pose<D>, tolerance: f64) {
        for p in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 2.0, 3.0]] {
            let off = distance(a.transform_point(point(p)), b.transform_point(point(p)));
            assert!(off < tolerance, "{off}: {a:?} {b:?}");
        }
    }

    /// The definition: the motion by a share of 1/n, n times, is the motion; and shares add up.
    fn laws<const D: usize>(from: Pose<D>, to: Pose<D>, body: Pose<D>) {
        near(&from.toward(&to, 0.0), &from, 1e-9);
        near(&from.toward(&to, 1.0), &to, 1e-9);
        let motion = Twist::of(&(from.inverse() * to));
        let step: Pose<D> = motion.share(0.125);
        let all = (0..8).fold(from, |pose, _| pose * step);
        near(&all, &to, 1e-8);
        near(&(from * step * motion.share(0.7)), &from.toward(&to, 0.825), 1e-9);
        near(&(from * motion.share(1.4) * motion.share(-0.9)), &from.toward(&to, 0.5), 1e-9);
        // Which frame of the body the poses are of makes no difference.
        near(&(from * body).toward(&(to * body), 0.3), &(from.toward(&to, 0.3) * body), 1e-8);
    }

    proptest! {
        #[test]
        fn shares_of_a_motion_are_motions(
            t in prop::array::uniform6(-3.0..3.0f64), q in prop::array::uniform4(-1.0..1.0f64),
            p in prop::array::uniform4(-1.0..1.0f64), angles in prop::array::uniform2(-1.5..1.5f64),
        ) {
            let (a, b) = ([t[0], t[1], t[2]], [t[3], t[4], t[5]]);
            let body = pose_3d([0.3, -0.2, 0.9], [0.1, 0.4, -0.2, 0.8]);
            laws(pose_3d(a, q), pose_3d(b, p), body);
            laws(Pose::<2>::new(t[0], t[1], angles[0]), Pose::<2>::new(t[2], t[3], angles[1]), Pose::<2>::new(0.3, -1.0, 2.0));
        }
    }

    #[test]
    fn a_robot_on_a_circle_stays_on_it() {
        // Radius 2 about the zero, a quarter turn: velocity and turn rate are constant.
        let on_circle =
            |a: f64| Pose::<2>::new(2.0 * a.cos(), 2.0 * a.sin(), a + std::f64::consts::FRAC_PI_2);
        let (from, to) = (on_circle(0.2), on_circle(1.7));
        for s in [-0.4, 0.0, 0.3, 0.5, 1.0, 1.6] {
            near(&from.toward(&to, s), &on_circle(0.2 + 1.5 * s), 1e-12);
        }
        let still = from.toward(&from, 0.4);
        near(&still, &from, 1e-15);
        // Without a turn the way is straight, however small the turn that rounding leaves.
        for turn in [0.0, 1e-17, 1e-12, 1e-9] {
            let straight = Pose::<2>::new(0.0, 0.0, 0.0).toward(&Pose::<2>::new(3.0, 1.0, turn), 0.5);
            near(&straight, &Pose::<2>::new(1.5, 0.5, 0.5 * turn), 1e-8);
        }
    }

    #[test]
    fn quaternions_of_rotations_give_the_rotation_again() {
        let mut random = Random(3);
        for k in 0..2000 {
            let mut q = [0; 4].map(|_| 2.0 * random.unit() - 1.0);
            // Half turns are where a trace alone would cancel.
            q[3] *= [1.0, 1e-9, 0.0][k % 3];
            let Some(pose) = Pose::<3>::from_quaternion([0.0; 3], q) else { continue };
            near(&pose_3d([0.0; 3], quaternion(pose.rotation)), &pose, 1e-12);
            let (axis, angle) = axis_angle(&pose.rotation);
            near(&Pose { rotation: about(axis, angle), translation: [0.0; 3] }, &pose, 1e-12);
        }
    }
}
