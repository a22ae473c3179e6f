//! Curves with a bounded speed.

use super::PlanError;

/// A curve with bounds of its arc length: what a path check needs of a path.
pub trait Curve<const D: usize> {
    /// The parameter of its end; that of its start is 0. Finite, not negative.
    fn end(&self) -> f64;

    /// The point (world) at a parameter from 0 to [`Curve::end`].
    fn point(&self, t: f64) -> [f64; D];

    /// A parameter beyond `t`, at most [`Curve::end`], such that the curve from `t` to there is no longer than `length`
    /// (meters, positive). A larger parameter makes for fewer steps; one that is too large makes certificates false.
    fn advance(&self, t: f64, length: f64) -> f64;
}

/// A function of a parameter with a given bound of its speed.
///
/// ```
/// use portolan::plan::{Curve, SpeedLimited};
///
/// // A circle of 2 m, once around.
/// let circle = SpeedLimited::new(|t: f64| [2.0 * t.cos(), 2.0 * t.sin()], std::f64::consts::TAU, 2.0)?;
/// assert_eq!(circle.advance(1.0, 0.5), 1.25);
/// // A helix, which climbs 0.1 m a turn: the speed of both motions together.
/// let helix = SpeedLimited::new(|t: f64| [t.cos(), t.sin(), 0.1 * t / 6.0], 60.0, 1.0f64.hypot(0.1 / 6.0))?;
/// assert!(helix.advance(59.9, 1.0) == helix.end());
/// # Ok::<(), portolan::plan::PlanError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct SpeedLimited<F> {
    at: F,
    end: f64,
    speed: f64,
}

impl<F> SpeedLimited<F> {
    /// The curve `at(t)` for `t` from 0 to `end`, which nowhere moves faster than `speed` meters per unit of `t`.
    /// The bound is not verified; certificates hold only if it does.
    ///
    /// # Errors
    /// [`PlanError::Range`] where `end` or `speed` is negative or not finite.
    pub fn new<const D: usize>(at: F, end: f64, speed: f64) -> Result<Self, PlanError>
    where
        F: Fn(f64) -> [f64; D],
    {
        for (what, value) in [("the end of a curve", end), ("the speed of a curve", speed)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(PlanError::Range { what, value, must: "finite and not negative" });
            }
        }
        Ok(Self { at, end, speed })
    }
}

impl<const D: usize, F: Fn(f64) -> [f64; D]> Curve<D> for SpeedLimited<F> {
    fn end(&self) -> f64 {
        self.end
    }

    fn point(&self, t: f64) -> [f64; D] {
        (self.at)(t)
    }

    fn advance(&self, t: f64, length: f64) -> f64 {
        at_speed(t, length, self.speed, self.end)
    }
}

/// The parameter after `length` at a constant speed; the end at speed 0.
pub(super) fn at_speed(t: f64, length: f64, speed: f64, end: f64) -> f64 {
    if speed > 0.0 { (t + length / speed).min(end) } else { end }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn promises_must_be_numbers() {
        let still = |_: f64| [0.0, 0.0];
        for (end, speed) in [(f64::NAN, 1.0), (1.0, f64::NAN), (-1.0, 1.0), (f64::INFINITY, 1.0), (1.0, -0.1)]
        {
            assert!(SpeedLimited::new(still, end, speed).is_err());
        }
        let resting = SpeedLimited::new(still, 3.0, 0.0).unwrap();
        assert_eq!(resting.advance(0.0, 1e-9), 3.0);
    }
}
