//! What is demanded of a place, and what a field says to it.

use crate::answer::Answer;
use crate::field::{Clearance, ClearanceField, UnknownSpace};

/// How far from everything a place must be, and what counts as everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Least clearance (metres). Negative or NaN: nothing is certified.
    pub clearance: f64,
    /// Whether unknown space is an obstacle.
    pub unknown: UnknownSpace,
    /// Paths are certified in steps no shorter than this (metres): where less than `clearance + tolerance` is certified, a
    /// path is refused, at worst as undecided. A thousandth of a cell where it is smaller.
    pub tolerance: f64,
    /// A check of one path or one motion of one sphere gives up after so many questions to the field, and says undecided.
    pub max_queries: usize,
}

impl Demand {
    /// This clearance (metres), unknown space an obstacle; steps of at least 1 mm, up to a million of them.
    pub fn new(clearance: f64) -> Self {
        Self { clearance, unknown: UnknownSpace::Pessimistic, tolerance: 1e-3, max_queries: 1_000_000 }
    }

    /// The same about unknown space that is no obstacle.
    pub fn optimistic(self) -> Self {
        Self { unknown: UnknownSpace::Optimistic, ..self }
    }

    /// The same with this much more clearance (metres): for a sphere of this radius.
    pub(super) fn beyond(&self, radius: f64) -> Self {
        // A demand that certifies nothing must not become one that does.
        let clearance = if self.clearance >= 0.0 { self.clearance + radius } else { f64::NAN };
        Self { clearance, ..*self }
    }

    pub(super) fn tolerance_in<const D: usize>(&self, field: &(impl ClearanceField<D> + ?Sized)) -> f64 {
        // Either may be NaN; `max` takes the other.
        self.tolerance.max(1e-3 * field.resolution()).max(1e-9)
    }

    /// What the field says of a point, as exactly as it can.
    pub(super) fn at<const D: usize>(
        &self,
        field: &(impl ClearanceField<D> + ?Sized),
        p_world: [f64; D],
    ) -> Verdict {
        self.judge(field, p_world, || field.clearance(p_world, self.unknown))
    }

    /// What the field says of a point, where only the verdict counts: bounds may be wider.
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
            // The distance changes by no more than one goes.
            let cause = self.near_what(field, p_world);
            return Verdict::Refused { cause, reach: self.clearance - found.upper };
        }
        Verdict::Refused { cause: Cause::Undecided, reach: 0.0 }
    }

    /// Which of the two obstacles is too near. A second question, of refused places alone.
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

/// Why a place is not certified.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cause {
    /// A surface is nearer than demanded, or the place is inside of one.
    TooNear,
    /// It lies in unknown space; with [`UnknownSpace::Pessimistic`] also: nearer to it than demanded.
    Unknown,
    /// It lies outside of the map, or is no place at all (NaN).
    Outside,
    /// What the field knows lies on both sides of what is demanded: within the tolerance of the limit, or further than
    /// the field maintains distances; or the check gave up.
    Undecided,
}

/// What a field says of one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    Free(Clearance),
    Refused {
        cause: Cause,
        /// Nothing within this distance (metres) can be certified either.
        reach: f64,
    },
}
