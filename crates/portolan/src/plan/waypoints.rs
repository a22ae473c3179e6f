//! A path of straight segments.

use super::{Curve, PlanError};
use crate::geom::vector::{along, distance, sub};

/// Straight segments from point to point. The parameter is the arc length (meters).
///
/// ```
/// use portolan::plan::{Curve, Waypoints};
///
/// let path = Waypoints::new(vec![[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])?;
/// assert_eq!((path.end(), path.point(5.0)), (7.0, [3.0, 2.0]));
/// let path = Waypoints::new(vec![[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]])?;
/// assert_eq!(path.point(0.25), [0.0, 0.0, 1.25]);
/// # Ok::<(), portolan::plan::PlanError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Waypoints<const D: usize> {
    points: Vec<[f64; D]>,
    /// Arc length at each point.
    reached: Vec<f64>,
}

impl<const D: usize> Waypoints<D> {
    /// A path through points (world, meters), at least one.
    ///
    /// # Errors
    /// [`PlanError::Empty`] without points; [`PlanError::NotFinite`] for a coordinate or a length that is not finite.
    pub fn new(points: Vec<[f64; D]>) -> Result<Self, PlanError> {
        if points.is_empty() {
            return Err(PlanError::Empty("a path"));
        }
        let mut reached = Vec::with_capacity(points.len());
        let mut length = 0.0;
        for (i, p) in points.iter().enumerate() {
            if i > 0 {
                length += distance(points[i - 1], *p);
            }
            // The length alone does not show an infinite coordinate of a single point.
            if !(length.is_finite() && p.iter().all(|v| v.is_finite())) {
                return Err(PlanError::NotFinite { what: "point", index: i });
            }
            reached.push(length);
        }
        Ok(Self { points, reached })
    }

    /// The points.
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// Arc length at which each point is reached (meters).
    pub fn reached(&self) -> &[f64] {
        &self.reached
    }

    /// The total length (meters).
    pub fn length(&self) -> f64 {
        self.reached[self.reached.len() - 1]
    }
}

impl<const D: usize> Curve<D> for Waypoints<D> {
    fn end(&self) -> f64 {
        self.length()
    }

    /// O(log points).
    fn point(&self, t: f64) -> [f64; D] {
        let next = self.reached.partition_point(|&s| s <= t);
        let (Some(&from), Some(last)) =
            (self.reached.get(next.wrapping_sub(1)), self.points.get(next.max(1) - 1))
        else {
            return self.points[0];
        };
        let Some(&end) = self.points.get(next) else { return *last };
        along(*last, sub(end, *last), ((t - from) / (self.reached[next] - from)).clamp(0.0, 1.0))
    }

    fn advance(&self, t: f64, length: f64) -> f64 {
        (t + length).min(self.end())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_coincide_are_passed() {
        let path = Waypoints::new(vec![[1.0, 1.0], [1.0, 1.0], [2.0, 1.0], [2.0, 1.0]]).unwrap();
        assert_eq!(path.end(), 1.0);
        assert_eq!(path.point(0.0), [1.0, 1.0]);
        assert_eq!(path.point(0.5), [1.5, 1.0]);
        assert_eq!(path.point(1.0), [2.0, 1.0]);
        assert_eq!(path.point(-1.0), [1.0, 1.0]);
        assert_eq!(path.point(9.0), [2.0, 1.0]);
        let one = Waypoints::new(vec![[3.0, 4.0]]).unwrap();
        assert_eq!((one.end(), one.point(0.0)), (0.0, [3.0, 4.0]));
    }

    #[test]
    fn bad_points_are_refused() {
        assert_eq!(Waypoints::<2>::new(vec![]), Err(PlanError::Empty("a path")));
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            let error = Waypoints::new(vec![[0.0, 0.0], [bad, 0.0], [0.0, 0.0]]).unwrap_err();
            assert!(matches!(error, PlanError::NotFinite { index: 1, .. }), "{error}");
        }
        assert!(Waypoints::new(vec![[f64::INFINITY, 0.0]]).is_err());
    }
}
