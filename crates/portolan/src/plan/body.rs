//! A robot as a rigid set of spheres.

use super::PlanError;
use crate::geom::vector::{along, distance};

/// A sphere of a body; in 2-D a disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere<const D: usize> {
    /// Center in the frame of the body (meters).
    pub center: [f64; D],
    /// Radius (meters); 0 for a point.
    pub radius: f64,
}

/// A rigid robot as a union of spheres in its own frame. It is free at a pose where all spheres are free.
///
/// ```
/// use portolan::plan::Body;
///
/// // A round robot with a bumper.
/// let robot = Body::of(&[([0.0, 0.0], 0.2), ([0.15, 0.0], 0.12)])?;
/// // A capsule, 60 cm long with a radius of 5 cm, covered by spheres that extend it by 5 mm at most.
/// let arm = Body::default().with_capsule([0.0, 0.0, 0.2], [0.6, 0.0, 0.2], 0.05, 0.005)?;
/// assert_eq!((robot.spheres().len(), arm.spheres().len()), (2, 15));
/// # Ok::<(), portolan::plan::PlanError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Body<const D: usize> {
    spheres: Vec<Sphere<D>>,
}

/// Largest number of spheres of a body.
const MOST: usize = 100_000;

impl<const D: usize> Body<D> {
    /// A body of spheres with these centers (frame of the body) and radii (meters).
    ///
    /// # Errors
    /// [`PlanError::Empty`] without spheres, and as [`Body::with_sphere`].
    pub fn of(spheres: &[([f64; D], f64)]) -> Result<Self, PlanError> {
        if spheres.is_empty() {
            return Err(PlanError::Empty("a body"));
        }
        spheres.iter().try_fold(Self::default(), |body, &(center, radius)| body.with_sphere(center, radius))
    }

    /// The body with another sphere.
    ///
    /// # Errors
    /// [`PlanError::NotFinite`] for a center that is not finite, [`PlanError::Range`] for a radius that is negative or
    /// not finite, [`PlanError::TooMany`] beyond 100,000 spheres.
    pub fn with_sphere(mut self, center: [f64; D], radius: f64) -> Result<Self, PlanError> {
        if !center.iter().all(|v| v.is_finite()) {
            return Err(PlanError::NotFinite { what: "sphere", index: self.spheres.len() });
        }
        if !(radius >= 0.0 && radius.is_finite()) {
            let must = "finite and not negative";
            return Err(PlanError::Range { what: "the radius of a sphere", value: radius, must });
        }
        if self.spheres.len() == MOST {
            return Err(PlanError::TooMany { what: "a body", limit: MOST });
        }
        self.spheres.push(Sphere { center, radius });
        Ok(self)
    }

    /// The body with a capsule: all points within `radius` of the segment from `a` to `b` (frame of the body, meters).
    ///
    /// The capsule is covered by equal spheres along the segment: with centers `h` apart, each of its points is at most
    /// `h / 2` along and `radius` across from the nearest center, so spheres of radius `sqrt(radius^2 + h^2 / 4)` contain
    /// it. `h` is chosen so that this radius exceeds that of the capsule by at most `excess` (meters).
    ///
    /// # Errors
    /// As [`Body::with_sphere`]; [`PlanError::Range`] where `excess` is not positive.
    pub fn with_capsule(self, a: [f64; D], b: [f64; D], radius: f64, excess: f64) -> Result<Self, PlanError> {
        if !(excess > 0.0 && excess.is_finite()) {
            return Err(PlanError::Range {
                what: "the excess of a capsule",
                value: excess,
                must: "positive",
            });
        }
        if !(radius >= 0.0) {
            return self.with_sphere(a, radius);
        }
        let widest = 2.0 * (excess * (2.0 * radius + excess)).sqrt();
        let length = distance(a, b);
        let gaps = (length / widest).ceil();
        if gaps >= MOST as f64 {
            return Err(PlanError::TooMany { what: "a body", limit: MOST });
        }
        // With NaN this is 0, and the center is refused.
        let gaps = gaps as usize;
        let half = if gaps > 0 { 0.5 * length / gaps as f64 } else { 0.0 };
        let ab = std::array::from_fn(|k| b[k] - a[k]);
        (0..=gaps).try_fold(self, |body, i| {
            // Slightly more than the root, which is rounded.
            let covering = radius.hypot(half) * (1.0 + 4.0 * f64::EPSILON);
            body.with_sphere(along(a, ab, i as f64 / gaps.max(1) as f64), covering)
        })
    }

    /// The spheres, in the order in which they were added.
    pub fn spheres(&self) -> &[Sphere<D>] {
        &self.spheres
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::point_segment;
    use crate::plan::testing::point;
    use proptest::prelude::*;

    /// Every point of the capsule is in a sphere, and no sphere reaches further out than was allowed.
    fn covers<const D: usize>(a: [f64; D], b: [f64; D], radius: f64, excess: f64, at: [f64; D]) {
        let body = Body::default().with_capsule(a, b, radius, excess).unwrap();
        let from_segment = point_segment(at, a, b).0;
        let depth = |s: &Sphere<D>| s.radius - distance(at, s.center);
        let depth = body.spheres().iter().map(depth).fold(f64::NEG_INFINITY, f64::max);
        assert!(from_segment > radius || depth >= 0.0, "{at:?} is left out");
        assert!(depth <= 0.0 || from_segment <= radius + excess * (1.0 + 1e-9), "{at:?} is covered");
        assert!(body.spheres().iter().all(|s| s.radius <= (radius + excess) * (1.0 + 1e-12)));
    }

    proptest! {
        #[test]
        fn covers_2d_and_3d(
            a in prop::array::uniform3(-1.0..1.0f64), b in prop::array::uniform3(-1.0..1.0f64),
            radius in 0.0..0.5f64, excess in 1e-3..0.3f64, at in prop::collection::vec(prop::array::uniform3(-1.5..1.5f64), 50),
        ) {
            for p in at {
                covers::<2>(point(a), point(b), radius, excess, point(p));
                covers::<3>(a, b, radius, excess, p);
            }
        }
    }

    #[test]
    fn a_capsule_of_no_length_is_a_sphere() {
        let body = Body::default().with_capsule([1.0, 2.0], [1.0, 2.0], 0.3, 0.01).unwrap();
        assert_eq!(body.spheres().len(), 1);
        assert_eq!(body.spheres()[0].center, [1.0, 2.0]);
    }

    #[test]
    fn bad_bodies_are_refused() {
        assert!(Body::<2>::of(&[]).is_err());
        for (center, radius) in [([f64::NAN, 0.0], 0.1), ([0.0, 0.0], -0.1), ([0.0, 0.0], f64::NAN)] {
            assert!(Body::of(&[(center, radius)]).is_err());
        }
        let capsule = |b: f64, radius, excess| Body::default().with_capsule([0.0], [b], radius, excess);
        assert!(capsule(1.0, 0.1, 0.0).is_err() && capsule(1.0, 0.1, f64::NAN).is_err());
        assert!(capsule(1.0, f64::NAN, 0.1).is_err() && capsule(f64::NAN, 0.1, 0.1).is_err());
        assert!(capsule(1e12, 0.1, 1e-6).is_err() && capsule(f64::INFINITY, 0.1, 0.1).is_err());
    }
}
