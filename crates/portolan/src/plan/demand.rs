//! The clearance demanded of a point, and the verdict of a field about it.

use crate::answer::Answer;
use crate::field::{Clearance, ClearanceField, UnknownSpace};

/// The clearance that a check demands, what counts as an obstacle, and the limits of the check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Least clearance (meters). With a negative value or NaN nothing is certified.
    pub clearance: f64,
    /// Whether unknown space is an obstacle.
    pub unknown: UnknownSpace,
    /// Shortest step along a path (meters): a path is refused, possibly as [`Cause::Undecided`], where the certified
    /// clearance is below `clearance + tolerance`. At least a thousandth of a cell is used.
    pub tolerance: f64,
    /// Largest number of queries to the field for one path, or for one sphere in one motion; beyond it the result is
    /// [`Cause::Undecided`].
    pub max_queries: usize,
}

impl Demand {
    /// This clearance (meters), unknown space an obstacle, a tolerance of 1 mm, at most a million queries.
    pub fn new(clearance: f64) -> Self {
        Self { clearance, unknown: UnknownSpace::default(), tolerance: 1e-3, max_queries: 1_000_000 }
    }

    /// The same demand, with unknown space as free ([`UnknownSpace::Optimistic`]).
    pub fn optimistic(self) -> Self {
        Self { unknown: UnknownSpace::Optimistic, ..self }
    }

    /// The demand of the center of a sphere of this radius (meters).
    pub(super) fn beyond(&self, radius: f64) -> Self {
        // A negative demand, which certifies nothing, must stay negative.
        let clearance = if self.clearance >= 0.0 { self.clearance + radius } else { f64::NAN };
        Self { clearance, ..*self }
    }

    pub(super) fn tolerance_in<const D: usize>(&self, field: &(impl ClearanceField<D> + ?Sized)) -> f64 {
        // Either may be NaN; `max` takes the other.
        self.tolerance.max(1e-3 * field.resolution()).max(1e-9)
    }

    /// The verdict about a point, from bounds as tight as the field has.
    pub(super) fn at<const D: usize>(
        &self,
        field: &(impl ClearanceField<D> + ?Sized),
        p_world: [f64; D],
    ) -> Verdict {
        self.judge(field, p_world, || field.clearance(p_world, self.unknown))
    }

    /// The verdict about a point, from bounds that may be wider.
    pub(super) fn met_at<const D: usize>(
        &self,
        field: &(impl ClearanceField<D> + ?Sized),
        p_world: [f64; D],
    ) -> Verdict {
        self.judge(field, p_world, || field.clearance_against(p_world, self.unknown, self.clearance))
    }

    fn judge<const D: usize>(
        &self,
        field: &(impl ClearanceField<D> + ?Sized),
        p_world: [f64; D],
        ask: impl FnOnce() -> Answer<Clearance>,
    ) -> Verdict {
        let refused = |cause| Verdict::Refused { cause, reach: 0.0 };
        if !p_world.iter().all(|v| v.is_finite()) {
            return refused(Cause::Outside);
        }
        match ask() {
            Answer::Outside => refused(Cause::Outside),
            Answer::Unknown => refused(Cause::Unknown),
            Answer::Known(found) => self.of(field, p_world, found),
            Answer::Saturated(found) => self.of(field, p_world, Clearance { upper: f64::INFINITY, ..found }),
        }
    }

    fn of<const D: usize>(
        &self,
        field: &(impl ClearanceField<D> + ?Sized),
        p_world: [f64; D],
        found: Clearance,
    ) -> Verdict {
        if found.inside {
            return Verdict::Refused {
                cause: Cause::TooNear,
                reach: (self.clearance - found.upper).max(0.0),
            };
        }
        if self.clearance >= 0.0 && found.lower >= self.clearance {
            return Verdict::Free(found);
        }
        if found.upper < self.clearance {
            // The distance is 1-Lipschitz.
            let cause = self.near_what(field, p_world);
            return Verdict::Refused { cause, reach: self.clearance - found.upper };
        }
        Verdict::Refused { cause: Cause::Undecided, reach: 0.0 }
    }

    /// Which of the two kinds of obstacle is too near. A second query, for refused points alone.
    fn near_what<const D: usize>(
        &self,
        field: &(impl ClearanceField<D> + ?Sized),
        p_world: [f64; D],
    ) -> Cause {
        if self.unknown == UnknownSpace::Optimistic {
            return Cause::TooNear;
        }
        match field.clearance(p_world, UnknownSpace::Optimistic) {
            Answer::Known(surface) if surface.upper < self.clearance => Cause::TooNear,
            _ => Cause::Unknown,
        }
    }
}

/// Why a point is not certified.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cause {
    /// The surface is nearer than demanded, or the point lies behind it.
    TooNear,
    /// The point lies in unknown space, or, with [`UnknownSpace::Pessimistic`], nearer to it than demanded.
    Unknown,
    /// The point lies outside the map, or has a coordinate that is NaN.
    Outside,
    /// The demand lies between the bounds of the field: the clearance is within the tolerance of it, the field maintains
    /// distances only up to less than it, or the check reached [`Demand::max_queries`].
    Undecided,
}

/// The verdict of a field about one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    Free(Clearance),
    Refused {
        cause: Cause,
        /// Nothing within this distance (meters) can be certified either.
        reach: f64,
    },
}
