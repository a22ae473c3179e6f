//! Checks of many poses or motions, on all cores.

use super::{Body, BodyCheck, Demand, Motion, MotionCheck, check_motion, check_pose};
use crate::field::ClearanceField;
use crate::geom::Pose;
use crate::parallel;

/// [`check_pose`] of many poses (world from body), in their order. Runs on all cores with the feature `parallel`; results
/// do not depend on it.
///
/// ```
/// use portolan::geom::Pose;
/// use portolan::plan::{Body, Demand, check_poses};
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
/// // A field with a wall at x = 4 m.
/// let robot = Body::of(&[([0.0, 0.0], 0.3)])?;
/// let poses: Vec<_> = (0..5).map(|i| Pose::<2>::new(f64::from(i), 0.0, 0.0)).collect();
/// let free: Vec<_> = check_poses(field, &robot, &poses, &Demand::new(0.1)).iter().map(|c| c.is_free()).collect();
/// assert_eq!(free, [true, true, true, true, false]);
/// # Ok::<(), portolan::plan::PlanError>(())
/// ```
pub fn check_poses<const D: usize>(
    field: &(impl ClearanceField<D> + ?Sized),
    body: &Body<D>,
    poses: &[Pose<D>],
    demand: &Demand,
) -> Vec<BodyCheck> {
    parallel::map(poses, 64, |pose| check_pose(field, body, pose, demand))
}

/// [`check_motion`] of many motions, in their order, such as the edges of a roadmap. Runs on all cores with the feature
/// `parallel`; results do not depend on it.
pub fn check_motions<const D: usize>(
    field: &(impl ClearanceField<D> + ?Sized),
    body: &Body<D>,
    motions: &[Motion<D>],
    demand: &Demand,
) -> Vec<MotionCheck> {
    parallel::map(motions, 4, |motion| check_motion(field, body, motion, demand))
}
