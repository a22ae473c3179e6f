//! Samples of the clearance along a path, for plots.

use super::{Curve, PlanError};
use crate::answer::Answer;
use crate::field::{Clearance, ClearanceField, UnknownSpace};

/// The clearance at one point of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileSample<const D: usize> {
    /// Parameter of the curve: for [`Waypoints`](super::Waypoints) the arc length (meters).
    pub at: f64,
    /// The point (world, meters).
    pub point: [f64; D],
    /// Lower and upper bound of the clearance.
    pub clearance: Answer<Clearance>,
}

/// Largest number of samples of a profile.
const MOST: usize = 1_000_000;

/// Clearance at points of a path at most `spacing` meters apart, both ends included; for
/// [`Waypoints`](super::Waypoints) exactly `spacing` apart, except for the last step. Between the samples use
/// [`check_path`](super::check_path). O(length / spacing).
///
/// # Errors
/// [`PlanError::Range`] where `spacing` is not positive, [`PlanError::TooMany`] for more than a million samples.
///
/// ```
/// use portolan::field::UnknownSpace;
/// use portolan::plan::{Waypoints, clearance_profile};
/// # use portolan::{Answer, field::{Clearance, ClearanceField}};
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
/// let path = Waypoints::new(vec![[1.0, 0.0], [3.0, 0.0]])?;
/// let profile = clearance_profile(field, &path, 0.5, UnknownSpace::Pessimistic)?;
/// let lower: Vec<f64> = profile.iter().filter_map(|s| Some(s.clearance.known()?.lower)).collect();
/// assert_eq!(lower, [3.0, 2.5, 2.0, 1.5, 1.0]);
/// # Ok::<(), portolan::plan::PlanError>(())
/// ```
pub fn clearance_profile<const D: usize>(
    field: &(impl ClearanceField<D> + ?Sized),
    path: &(impl Curve<D> + ?Sized),
    spacing: f64,
    unknown: UnknownSpace,
) -> Result<Vec<ProfileSample<D>>, PlanError> {
    if !(spacing > 0.0) {
        return Err(PlanError::Range { what: "the spacing of a profile", value: spacing, must: "positive" });
    }
    let mut samples = Vec::new();
    let mut t = 0.0;
    loop {
        let point = path.point(t);
        samples.push(ProfileSample { at: t, point, clearance: field.clearance(point, unknown) });
        if t >= path.end() {
            return Ok(samples);
        }
        let next = path.advance(t, spacing);
        if samples.len() == MOST || !(next > t) {
            return Err(PlanError::TooMany { what: "a profile", limit: MOST });
        }
        t = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::testing::Scene;
    use crate::plan::{Spline, Waypoints};

    #[test]
    fn ends_are_sampled_and_steps_are_no_longer_than_asked() {
        let scene = Scene::<2>::empty();
        let path = Waypoints::new(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 0.25]]).unwrap();
        let profile = clearance_profile(&scene, &path, 0.5, UnknownSpace::Optimistic).unwrap();
        assert_eq!(profile.iter().map(|s| s.at).collect::<Vec<_>>(), [0.0, 0.5, 1.0, 1.25]);
        assert_eq!(profile[3].point, [1.0, 0.25]);
        let spline = Spline::catmull_rom(&[[0.0, 0.0], [1.0, 2.0], [3.0, 0.0]]).unwrap();
        let profile = clearance_profile(&scene, &spline, 0.1, UnknownSpace::Optimistic).unwrap();
        for pair in profile.windows(2) {
            assert!(crate::geom::vector::distance(pair[0].point, pair[1].point) <= 0.1 + 1e-12);
        }
        let one = Waypoints::new(vec![[0.0, 0.0]]).unwrap();
        assert_eq!(clearance_profile(&scene, &one, 0.5, UnknownSpace::Optimistic).unwrap().len(), 1);
    }

    #[test]
    fn absurd_spacings_are_refused() {
        let scene = Scene::<2>::empty();
        let path = Waypoints::new(vec![[0.0, 0.0], [1e150, 0.0]]).unwrap();
        for spacing in [0.0, -1.0, f64::NAN, 1.0] {
            assert!(clearance_profile(&scene, &path, spacing, UnknownSpace::Optimistic).is_err());
        }
        // The whole of it in one step.
        assert_eq!(
            clearance_profile(&scene, &path, f64::INFINITY, UnknownSpace::Optimistic).unwrap().len(),
            2
        );
    }
}
