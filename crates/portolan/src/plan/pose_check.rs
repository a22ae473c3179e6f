//! The certified check of a body at a pose.

use super::demand::{Cause, Demand, Verdict};
use super::{Body, Sphere};
use crate::field::ClearanceField;
use crate::geom::Pose;

/// The result of [`check_pose`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BodyCheck {
    /// Every sphere has the clearance demanded.
    Free(BodyClearance),
    /// A sphere is not certified.
    Refused {
        /// Index of the first sphere that is refused.
        sphere: usize,
        /// Why it is refused.
        cause: Cause,
    },
}

impl BodyCheck {
    /// Whether the body is certified.
    pub fn is_free(&self) -> bool {
        matches!(self, Self::Free(_))
    }
}

/// Bounds of the distance between the surface of the body and the nearest obstacle (meters).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyClearance {
    /// Lower bound, at least the demand; not tighter than the check needs.
    pub lower: f64,
    /// Upper bound; infinite where no obstacle is within the range of the field, and for a body without spheres.
    pub upper: f64,
    /// Index of the sphere with the least lower bound.
    pub sphere: usize,
}

impl BodyClearance {
    pub(super) const NOTHING: Self = Self { lower: f64::INFINITY, upper: f64::INFINITY, sphere: 0 };

    /// Includes the clearance of the surface of one sphere.
    pub(super) fn include(&mut self, sphere: usize, lower: f64, upper: f64) {
        if lower < self.lower {
            (self.lower, self.sphere) = (lower, sphere);
        }
        self.upper = self.upper.min(upper);
    }
}

/// Checks a body at a pose: the center of every sphere must have the demanded clearance plus its radius. With a demand of 0
/// a certified sphere lies entirely in free space. O(spheres).
///
/// ```
/// use portolan::geom::Pose;
/// use portolan::plan::{Body, BodyCheck, Cause, Demand, check_pose};
/// # use portolan::{Answer, field::{Clearance, ClearanceField, UnknownSpace}};
/// # struct Wall;
/// # impl<const D: usize> ClearanceField<D> for Wall {
/// #     fn clearance(&self, p: [f64; D], _: UnknownSpace) -> Answer<Clearance> {
/// #         let d = 4.0 - p[0];
/// #         Answer::Known(Clearance { lower: d.abs(), upper: d.abs(), inside: d < 0.0 })
/// #     }
/// #     fn distance_and_gradient(&self, p: [f64; D]) -> Answer<(f64, [f64; D])> {
/// #         Answer::Known((4.0 - p[0], std::array::from_fn(|k| if k == 0 { -1.0 } else { 0.0 })))
/// #     }
/// #     fn resolution(&self) -> f64 { 0.05 }
/// # }
/// # let field = &Wall;
/// // A field with a wall at x = 4 m; a robot with a long front.
/// let robot = Body::of(&[([0.0, 0.0], 0.3), ([0.5, 0.0], 0.1)])?;
/// let facing = |theta| check_pose(field, &robot, &Pose::<2>::new(3.5, 0.0, theta), &Demand::new(0.05));
/// assert!(facing(std::f64::consts::PI).is_free());
/// assert_eq!(facing(0.0), BodyCheck::Refused { sphere: 1, cause: Cause::TooNear });
///
/// // The same in 3-D.
/// let drone = Body::of(&[([0.0, 0.0, 0.0], 0.4)])?;
/// let hovering = Pose::<3> { translation: [3.5, 0.0, 1.0], ..Pose::IDENTITY };
/// assert!(check_pose(field, &drone, &hovering, &Demand::new(0.05)).is_free());
/// # Ok::<(), portolan::plan::PlanError>(())
/// ```
pub fn check_pose<const D: usize>(
    field: &(impl ClearanceField<D> + ?Sized),
    body: &Body<D>,
    world_from_body: &Pose<D>,
    demand: &Demand,
) -> BodyCheck {
    let mut free = BodyClearance::NOTHING;
    for (sphere, &Sphere { center, radius }) in body.spheres().iter().enumerate() {
        match demand.beyond(radius).met_at(field, world_from_body.transform_point(center)) {
            Verdict::Free(found) => free.include(sphere, found.lower - radius, found.upper - radius),
            Verdict::Refused { cause, .. } => return BodyCheck::Refused { sphere, cause },
        }
    }
    BodyCheck::Free(free)
}
