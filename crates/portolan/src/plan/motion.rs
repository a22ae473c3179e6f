//! The straight motion of a body from one pose to another, and its check.

use super::demand::{Cause, Demand};
use super::path::Walk;
use super::pose_check::BodyClearance;
use super::{Body, Curve};
use crate::field::ClearanceField;
use crate::geom::Pose;
use crate::geom::vector::{along, distance, norm, sub};

/// The straight motion between two poses: the origin of the body moves along a line while the body turns about one axis,
/// both at constant speed. It turns the shorter way; at half a turn either way.
///
/// ```
/// use portolan::geom::Pose;
/// use portolan::plan::Motion;
///
/// let quarter = Motion::new(Pose::<2>::new(0.0, 0.0, 0.0), Pose::<2>::new(2.0, 1.0, 1.5));
/// let half = quarter.pose(0.5);
/// assert_eq!(half.translation, [1.0, 0.5]);
/// assert!((half.theta() - 0.75).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<const D: usize> {
    from: Pose<D>,
    to: Pose<D>,
    /// Radians, 0 to pi.
    angle: f64,
    /// Of the unit axis, in the body's frame: skew-symmetric, `K v` is the axis times `v`.
    turn: [[f64; D]; D],
}

impl<const D: usize> Motion<D> {
    /// From pose to pose (world from body, rigid).
    pub fn new(from: Pose<D>, to: Pose<D>) -> Self {
        let relative = from.inverse() * Pose { translation: [0.0; D], ..to };
        let (angle, turn) = angle_and_turn(&relative.rotation);
        Self { from, to, angle, turn }
    }

    /// The first pose.
    pub fn start(&self) -> &Pose<D> {
        &self.from
    }

    /// The last pose.
    pub fn goal(&self) -> &Pose<D> {
        &self.to
    }

    /// The pose at the fraction `u` of the motion, 0 to 1. By Rodrigues' formula, also in 2-D:
    /// `R(u) = R0 (I + sin(u a) K + (1 - cos(u a)) K^2)`.
    pub fn pose(&self, u: f64) -> Pose<D> {
        let (sin, cos) = (u * self.angle).sin_cos();
        let k = &self.turn;
        let rotation = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let square: f64 = (0..D).map(|l| k[i][l] * k[l][j]).sum();
                f64::from(i == j) + sin * k[i][j] + (1.0 - cos) * square
            })
        });
        let offset_world = sub(self.to.translation, self.from.translation);
        let rotated = self.from * Pose { rotation, translation: [0.0; D] };
        Pose { translation: along(self.from.translation, offset_world, u), ..rotated }
    }

    /// A bound of the path length (meters) of a point of the body (frame of the body): the path of the body's origin plus
    /// an arc about the axis.
    pub fn length_of(&self, p_body: [f64; D]) -> f64 {
        let arm: [f64; D] = std::array::from_fn(|i| (0..D).map(|j| self.turn[i][j] * p_body[j]).sum());
        distance(self.from.translation, self.to.translation) + self.angle * norm(arm)
    }
}

/// Angle and unit axis of a rotation. The axis comes from what is skew in the matrix (`sin a K`) where that is large, and
/// from what is symmetric (`cos a I + (1 - cos a) n n^T`) near half a turn, where it is not.
fn angle_and_turn<const D: usize>(m: &[[f64; D]; D]) -> (f64, [[f64; D]; D]) {
    let trace: f64 = (0..D).map(|k| m[k][k]).sum();
    let mut turn: [[f64; D]; D] = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (m[i][j] - m[j][i])));
    let sin = (0.5 * turn.as_flattened().iter().map(|v| v * v).sum::<f64>()).sqrt();
    let cos = 0.5 * (trace - (D as f64 - 2.0));
    let angle = sin.atan2(cos);
    if cos > -0.5 {
        // Without a rotation the axis is arbitrary: zero.
        let inverse = if sin > 0.0 { 1.0 / sin } else { 0.0 };
        turn.as_flattened_mut().iter_mut().for_each(|v| *v *= inverse);
        return (angle, turn);
    }
    let sign_of = |skew: f64| if skew < 0.0 { -1.0 } else { 1.0 };
    let mut unit = [[0.0; D]; D];
    if D == 2 {
        unit[1][0] = sign_of(turn[1][0]);
        unit[0][1] = -unit[1][0];
        return (angle, unit);
    }
    let outer =
        |i: usize, j: usize| (0.5 * (m[i][j] + m[j][i]) - if i == j { cos } else { 0.0 }) / (1.0 - cos);
    let largest = (0..D).fold(0, |best, k| if outer(k, k) > outer(best, best) { k } else { best });
    let n: [f64; D] = std::array::from_fn(|k| outer(k, largest));
    // The skew part has the sign of the rotation.
    let skew = |k: usize| turn[(k + 2) % D][(k + 1) % D];
    let way: f64 = (0..D).map(|k| n[k] * skew(k)).sum();
    let scale = sign_of(way) / norm(n);
    for k in 0..D {
        unit[(k + 2) % D][(k + 1) % D] = n[k] * scale;
        unit[(k + 1) % D][(k + 2) % D] = -n[k] * scale;
    }
    (angle, unit)
}

/// The path of one point of a body; its parameter is the fraction of the motion.
struct Carried<'a, const D: usize> {
    motion: &'a Motion<D>,
    p_body: [f64; D],
    length: f64,
}

impl<const D: usize> Curve<D> for Carried<'_, D> {
    fn end(&self) -> f64 {
        1.0
    }

    fn point(&self, t: f64) -> [f64; D] {
        self.motion.pose(t).transform_point(self.p_body)
    }

    fn advance(&self, t: f64, length: f64) -> f64 {
        super::curve::at_speed(t, length, self.length, 1.0)
    }
}

/// The result of [`check_motion`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionCheck {
    /// The whole motion has the clearance demanded.
    Free(BodyClearance),
    /// A part of the motion is not certified.
    Refused {
        /// Fractions of the motion, 0 to 1: up to the first the body is certified; from the first to the second the sphere
        /// below is not.
        from_to: [f64; 2],
        /// Index of the sphere that is refused first.
        sphere: usize,
        /// Why it is refused.
        cause: Cause,
    },
}

impl MotionCheck {
    /// Whether the whole motion is certified.
    pub fn is_free(&self) -> bool {
        matches!(self, Self::Free(_))
    }
}

/// Checks all poses of a motion: the center of every sphere is followed in certified steps as by
/// [`check_path`](super::check_path), with [`Motion::length_of`] as the bound of its path length.
///
/// ```
/// use portolan::geom::Pose;
/// use portolan::plan::{Body, Cause, Demand, Motion, MotionCheck, check_motion};
/// # use portolan::{Answer, field::{Clearance, ClearanceField, UnknownSpace}};
/// # struct Wall;
/// # impl ClearanceField<2> for Wall {
/// #     fn clearance(&self, p: [f64; 2], _: UnknownSpace) -> Answer<Clearance> {
/// #         let d = 4.0 - p[0];
/// #         Answer::Known(Clearance { lower: d.abs(), upper: d.abs(), inside: d < 0.0 })
/// #     }
/// #     fn distance_and_gradient(&self, p: [f64; 2]) -> Answer<(f64, [f64; 2])> {
/// #         Answer::Known((4.0 - p[0], [-1.0, 0.0]))
/// #     }
/// #     fn resolution(&self) -> f64 { 0.05 }
/// # }
/// # let field = &Wall;
/// // A field with a wall at x = 4 m; the front of the robot swings through it: free at both ends, but not in between.
/// let robot = Body::of(&[([0.0, 0.0], 0.3), ([0.5, 0.0], 0.1)])?;
/// let swing = Motion::new(Pose::<2>::new(3.5, 0.0, 1.5), Pose::<2>::new(3.5, 0.0, -1.5));
/// let MotionCheck::Refused { from_to: [from, to], sphere, cause } = check_motion(field, &robot, &swing, &Demand::new(0.05))
/// else { panic!("the wall") };
/// assert!(from > 0.05 && to < 0.95 && sphere == 1 && cause == Cause::TooNear);
/// # Ok::<(), portolan::plan::PlanError>(())
/// ```
pub fn check_motion<const D: usize>(
    field: &(impl ClearanceField<D> + ?Sized),
    body: &Body<D>,
    motion: &Motion<D>,
    demand: &Demand,
) -> MotionCheck {
    let mut free = BodyClearance::NOTHING;
    let mut first = None;
    let mut end = 1.0;
    for (sphere, s) in body.spheres().iter().enumerate() {
        let path = Carried { motion, p_body: s.center, length: motion.length_of(s.center) };
        let demand = demand.beyond(s.radius);
        // For the other spheres only the part before the first refusal matters.
        let mut walk =
            Walk::<_, _, D> { field, path: &path, demand: &demand, end, queries: demand.max_queries };
        match walk.free(0.0) {
            Ok(found) => free.include(sphere, found.lower - s.radius, found.upper - s.radius),
            // Of two spheres refused at the same place the first one is reported.
            Err(stop) if first.is_none() || stop.at < end => {
                walk.end = 1.0;
                first = Some((sphere, walk.violation(stop)));
                end = stop.at;
            }
            Err(_) => {}
        }
    }
    match first {
        None => MotionCheck::Free(free),
        Some((sphere, found)) => {
            MotionCheck::Refused { from_to: [found.from, found.to], sphere, cause: found.cause }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::testing::{Scene, point, scenes};
    use crate::plan::{Demand, check_motions, check_pose, check_poses};
    #[cfg(feature = "parallel")]
    use crate::testing::with_threads;
    use proptest::prelude::*;

    /// 2-D poses turn by the first number, 3-D poses by a quaternion.
    fn pose<const D: usize>(t: [f64; 3], q: [f64; 4]) -> Pose<D> {
        let rotation: [[f64; D]; D] = if D == 2 {
            let flat = Pose::<2>::new(0.0, 0.0, 7.0 * q[0]).rotation;
            std::array::from_fn(|i| std::array::from_fn(|j| flat[i][j]))
        } else {
            let turned = Pose::<3>::from_quaternion([0.0; 3], q).unwrap_or(Pose::IDENTITY).rotation;
            std::array::from_fn(|i| std::array::from_fn(|j| turned[i][j]))
        };
        Pose { rotation, translation: point(t) }
    }

    fn off<const D: usize>(a: &Pose<D>, b: &Pose<D>) -> f64 {
        let rows = a.rotation.as_flattened().iter().zip(b.rotation.as_flattened());
        rows.map(|(x, y)| (x - y).abs()).fold(distance(a.translation, b.translation), f64::max)
    }

    /// Ends where it should, stays rigid, and nothing moves faster than said.
    fn is_straight<const D: usize>(from: Pose<D>, to: Pose<D>, p_body: [f64; D]) {
        let motion = Motion::new(from, to);
        // Half a turn leaves the axis to what is left after rounding: 1e-8 is its root.
        assert!(off(&motion.pose(0.0), &from) < 1e-12 && off(&motion.pose(1.0), &to) < 1e-7);
        let length = motion.length_of(p_body);
        let mut sum = 0.0;
        for i in 0..200 {
            let at = |i: i32| motion.pose(f64::from(i) / 200.0);
            assert!(at(i).is_rigid());
            let step = distance(at(i).transform_point(p_body), at(i + 1).transform_point(p_body));
            assert!(step <= length / 200.0 * (1.0 + 1e-9) + 1e-12, "{step} of {length}");
            sum += step;
        }
        assert!(sum <= length * (1.0 + 1e-9) + 1e-12);
    }

    /// What is called free is free at many poses of the way, up to where it is.
    fn is_true<const D: usize>(scene: &Scene<D>, body: &Body<D>, motion: &Motion<D>, demand: &Demand) {
        let found = check_motion(scene, body, motion, demand);
        let (end, least) = match found {
            MotionCheck::Free(free) => (1.0, free.lower),
            MotionCheck::Refused { from_to: [from, to], sphere, .. } => {
                assert!(from <= to && sphere < body.spheres().len());
                (from, demand.clearance)
            }
        };
        // Where it is refused at once, nothing is free.
        for i in (0..=1000).filter(|_| end > 0.0) {
            let pose = motion.pose(end * f64::from(i) / 1000.0);
            for s in body.spheres() {
                let truth = scene.truth(pose.transform_point(s.center), demand.unknown);
                assert!(truth.is_some_and(|d| d - s.radius >= least - 1e-12), "{truth:?} {s:?} {found:?}");
            }
        }
        if let MotionCheck::Free(free) = found {
            let bounds = (0..=1000).map(|i| motion.pose(f64::from(i) / 1000.0)).flat_map(|pose| {
                body.spheres().iter().filter_map(move |s| {
                    Some(scene.truth(pose.transform_point(s.center), demand.unknown)? - s.radius)
                })
            });
            // The samples come as near as half their distance to the nearest place.
            let nearest = bounds.fold(f64::INFINITY, f64::min);
            assert!(free.upper >= nearest - 0.02, "{free:?} {nearest}");
        }
    }

    type RandomPose = ([f64; 3], [f64; 4]);

    fn poses() -> impl Strategy<Value = RandomPose> {
        (prop::array::uniform3(-4.0..4.0f64), prop::array::uniform4(-1.0..1.0f64))
    }

    fn body<const D: usize>(spheres: &[([f64; 3], f64)]) -> Body<D> {
        Body::of(&spheres.iter().map(|(c, r)| (point(*c), *r)).collect::<Vec<_>>()).unwrap()
    }

    fn bodies() -> impl Strategy<Value = Vec<([f64; 3], f64)>> {
        prop::collection::vec((prop::array::uniform3(-0.5..0.5f64), 0.0..0.3f64), 1..5)
    }

    proptest! {
        #[test]
        fn is_straight_2d_and_3d(a in poses(), b in poses(), p in prop::array::uniform3(-2.0..2.0f64)) {
            is_straight::<2>(pose(a.0, a.1), pose(b.0, b.1), point(p));
            is_straight::<3>(pose(a.0, a.1), pose(b.0, b.1), p);
        }
        #[test]
        fn what_is_certified_is_free_2d_and_3d(
            flat in scenes::<2>(), scene in scenes::<3>(), b in bodies(), from in poses(), to in poses(),
            clearance in 0.0..0.2f64,
        ) {
            let demand = Demand::new(clearance);
            let motion = Motion::new(pose(from.0, from.1), pose(to.0, to.1));
            is_true(&flat, &body(&b), &motion, &demand);
            let motion = Motion::new(pose(from.0, from.1), pose(to.0, to.1));
            is_true(&scene, &body(&b), &motion, &demand);
        }
    }

    #[test]
    fn turns_near_nothing_and_near_half_a_turn() {
        let p = [0.3, -0.7, 1.1];
        for angle in [0.0, 1e-12, 1e-9, 1e-6, 3.0, 3.12, std::f64::consts::PI, -std::f64::consts::PI] {
            is_straight(Pose::<2>::new(1.0, 2.0, 0.4), Pose::<2>::new(1.0, 2.0, 0.4 + angle), [0.3, -0.7]);
            for axis in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, -0.8], [-0.48, 0.6, 0.64]] {
                let (sin, cos) = (0.5f64 * angle).sin_cos();
                let q = [axis[0] * sin, axis[1] * sin, axis[2] * sin, cos];
                let from = pose::<3>([0.0; 3], [0.1, 0.2, -0.3, 0.9]);
                is_straight(from, from * pose([0.0; 3], q), p);
                let motion = Motion::new(from, from * pose([0.0; 3], q));
                assert!((motion.angle - angle.abs()).abs() < 1e-7, "{} {angle}", motion.angle);
            }
        }
        // Straight on: no point moves further than the body.
        let on = Motion::new(Pose::<2>::new(0.0, 0.0, 1.0), Pose::<2>::new(3.0, 4.0, 1.0));
        assert_eq!(on.length_of([10.0, 10.0]), 5.0);
    }

    #[test]
    fn the_first_sphere_in_time_ends_a_motion_and_the_first_in_order_a_pose() {
        let mut scene = Scene::<2>::empty();
        scene.balls = vec![([2.0, 0.0], 0.5)];
        let body = Body::of(&[([0.0, 0.0], 0.1), ([0.4, 0.0], 0.1), ([0.4, 0.1], 0.1)]).unwrap();
        let drive = Motion::new(Pose::<2>::new(0.0, 0.0, 0.0), Pose::<2>::new(2.0, 0.0, 0.0));
        let MotionCheck::Refused { from_to, sphere, cause } =
            check_motion(&scene, &body, &drive, &Demand::new(0.0))
        else {
            panic!("a ball is in the way")
        };
        assert_eq!((sphere, cause), (1, Cause::TooNear));
        // The nose meets the ball after one meter and leaves it after 2.2, beyond the end.
        assert!((from_to[0] - 0.5).abs() < 1e-3 && from_to[1] == 1.0, "{from_to:?}");
        let at = check_pose(&scene, &body, drive.goal(), &Demand::new(0.0));
        assert_eq!(at, crate::plan::BodyCheck::Refused { sphere: 0, cause: Cause::TooNear });
        let nothing = Body::<2>::default();
        assert!(check_motion(&scene, &nothing, &drive, &Demand::new(0.0)).is_free());
    }

    #[test]
    fn poses_that_are_none_are_refused() {
        let scene = Scene::<2>::empty();
        let body = Body::of(&[([0.0, 0.0], 0.1)]).unwrap();
        let lost = Pose::<2>::new(f64::NAN, 0.0, 0.0);
        assert!(!check_pose(&scene, &body, &lost, &Demand::new(0.0)).is_free());
        let twisted = Pose::<2> { rotation: [[f64::NAN; 2]; 2], translation: [0.0; 2] };
        for (from, to) in [(lost, Pose::IDENTITY), (Pose::IDENTITY, lost), (Pose::IDENTITY, twisted)] {
            let check = check_motion(&scene, &body, &Motion::new(from, to), &Demand::new(0.0));
            assert!(!check.is_free(), "{check:?}");
        }
        let negative = Demand::new(-0.05);
        assert!(!check_pose(&scene, &body, &Pose::IDENTITY, &negative).is_free());
    }

    #[test]
    #[cfg(feature = "parallel")]
    fn batches_are_the_same_on_any_number_of_threads() {
        let mut scene = Scene::<2>::empty();
        scene.balls = vec![([2.0, 0.0], 0.5), ([-1.0, 1.0], 0.9)];
        let body = Body::of(&[([0.0, 0.0], 0.1), ([0.4, 0.0], 0.1)]).unwrap();
        let at = |i: i32, a: f64| (f64::from(i) * a).fract() * 8.0 - 4.0;
        let poses: Vec<_> =
            (0..700).map(|i| Pose::<2>::new(at(i, 0.618), at(i, 0.755), at(i, 0.57))).collect();
        let motions: Vec<_> = poses.windows(2).map(|p| Motion::new(p[0], p[1])).collect();
        let of = |threads| {
            let demand = Demand::new(0.05);
            with_threads(threads, || {
                (check_poses(&scene, &body, &poses, &demand), check_motions(&scene, &body, &motions, &demand))
            })
        };
        let (one, three) = (of(1), of(3));
        assert!(one == three && one.0.len() == 700 && one.1.len() == 699);
        let free = one.0.iter().filter(|c| c.is_free()).count();
        assert!(free > 100 && free < 700, "{free}");
    }
}
