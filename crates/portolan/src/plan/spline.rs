//! Cubic splines: Bezier pieces, and Catmull-Rom splines through points.

use super::curve::at_speed;
use super::{Curve, PlanError};
use crate::geom::vector::{along, norm, scale, sub};

/// A sequence of cubic Bezier pieces. The parameter counts pieces: `2.5` is the middle of the third.
///
/// The speed of a piece is bounded by the control points of its derivative, which lies in their convex hull; from a point
/// within a piece on, by those of the remaining part.
///
/// ```
/// use portolan::plan::{Curve, Spline};
///
/// let curve = Spline::catmull_rom(&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])?;
/// assert_eq!((curve.end(), curve.point(1.0)), (2.0, [1.0, 1.0]));
/// let straight = Spline::bezier(vec![[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]])?;
/// assert_eq!(straight.point(0.5), [1.5, 0.0, 0.0]);
/// assert!((straight.arc_length(1.0) - 3.0).abs() < 1e-12);
/// # Ok::<(), portolan::plan::PlanError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Spline<const D: usize> {
    pieces: Vec<[[f64; D]; 4]>,
}

impl<const D: usize> Spline<D> {
    /// Pieces of four control points each (world, meters). Each should start where the previous one ends: a gap between
    /// them is not checked.
    ///
    /// # Errors
    /// [`PlanError::Empty`] without pieces; [`PlanError::NotFinite`] for a coordinate or a length that is not finite.
    pub fn bezier(pieces: Vec<[[f64; D]; 4]>) -> Result<Self, PlanError> {
        if pieces.is_empty() {
            return Err(PlanError::Empty("a spline"));
        }
        let finite = |piece: &[[f64; D]; 4]| piece.as_flattened().iter().all(|v| v.is_finite());
        match pieces.iter().position(|p| !(finite(p) && speed(p).is_finite())) {
            Some(index) => Err(PlanError::NotFinite { what: "piece", index }),
            None => Ok(Self { pieces }),
        }
    }

    /// The uniform spline through all points (world, meters) *(Catmull & Rom 1974)*: the tangent at a point is parallel to
    /// the line from the previous to the next point; at the first and the last point, to the line to the neighbor.
    ///
    /// # Errors
    /// As [`Spline::bezier`]; [`PlanError::Empty`] for fewer than two points.
    pub fn catmull_rom(points: &[[f64; D]]) -> Result<Self, PlanError> {
        let last = points.len().saturating_sub(1);
        let slope = |i: usize| {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
            scale(sub(points[after], points[before]), 1.0 / (after - before) as f64)
        };
        let piece = |i: usize| {
            let (a, b) = (points[i], points[i + 1]);
            [a, along(a, slope(i), 1.0 / 3.0), along(b, slope(i + 1), -1.0 / 3.0), b]
        };
        Self::bezier((0..last).map(piece).collect())
    }

    /// The pieces' control points.
    pub fn pieces(&self) -> &[[[f64; D]; 4]] {
        &self.pieces
    }

    /// Arc length up to a parameter (meters), by Gauss quadrature with five points on every eighth of a piece: relative
    /// error about 1e-6 where the curve has no cusps. For reports; no check uses it. O(pieces).
    pub fn arc_length(&self, t: f64) -> f64 {
        let t = t.clamp(0.0, self.end());
        let mut sum = 0.0;
        for (i, piece) in self.pieces.iter().enumerate() {
            let part = (t - i as f64).clamp(0.0, 1.0) / 8.0;
            for eighth in 0..8 {
                let middle = (f64::from(eighth) + 0.5) * part;
                sum += GAUSS.iter().fold(0.0, |s, (x, w)| {
                    s + 0.5 * part * w * norm(derivative(piece, middle + 0.5 * part * x))
                });
            }
        }
        sum
    }

    /// The piece of a parameter, and the place in it.
    fn place(&self, t: f64) -> (usize, f64) {
        // As an integer NaN is 0.
        let i = (t.max(0.0) as usize).min(self.pieces.len() - 1);
        (i, (t - i as f64).clamp(0.0, 1.0))
    }
}

impl<const D: usize> Curve<D> for Spline<D> {
    fn end(&self) -> f64 {
        self.pieces.len() as f64
    }

    fn point(&self, t: f64) -> [f64; D] {
        let (i, u) = self.place(t);
        let [a, b, c, d] = self.pieces[i];
        let v = 1.0 - u;
        let weights = [v * v * v, 3.0 * v * v * u, 3.0 * v * u * u, u * u * u];
        std::array::from_fn(|k| weights[0] * a[k] + weights[1] * b[k] + weights[2] * c[k] + weights[3] * d[k])
    }

    /// O(pieces passed).
    fn advance(&self, t: f64, length: f64) -> f64 {
        let (first, mut u) = self.place(t);
        let mut left = length;
        for (i, piece) in self.pieces.iter().enumerate().skip(first) {
            let speed = speed(&rest(piece, u));
            let stop = at_speed(u, left, speed, 1.0);
            if stop < 1.0 {
                return i as f64 + stop;
            }
            left -= (1.0 - u) * speed;
            u = 0.0;
            if !(left > 0.0) {
                return (i + 1) as f64;
            }
        }
        self.end()
    }
}

/// Bound of a piece's speed (meters per piece).
fn speed<const D: usize>(piece: &[[f64; D]; 4]) -> f64 {
    piece.windows(2).map(|p| 3.0 * norm(sub(p[1], p[0]))).fold(0.0, f64::max)
}

/// The part of a piece from `u` on, with the derivative of the whole: its control points times `1 / (1 - u)`, which has the
/// speed per piece. By de Casteljau's construction on the derivative's control points.
fn rest<const D: usize>(piece: &[[f64; D]; 4], u: f64) -> [[f64; D]; 4] {
    let slopes: [[f64; D]; 3] = std::array::from_fn(|i| sub(piece[i + 1], piece[i]));
    let mix = |a: [f64; D], b: [f64; D]| along(scale(a, 1.0 - u), b, u);
    let (low, high) = (mix(slopes[0], slopes[1]), mix(slopes[1], slopes[2]));
    let zero = [0.0; D];
    let first = mix(low, high);
    let second = along(first, high, 1.0);
    [zero, first, second, along(second, slopes[2], 1.0)]
}

fn derivative<const D: usize>(piece: &[[f64; D]; 4], u: f64) -> [f64; D] {
    scale(rest(piece, u)[1], 3.0)
}

/// Places in -1 to 1 and weights of Gauss' quadrature.
const GAUSS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::distance;
    use crate::testing::point;
    use proptest::prelude::*;

    /// Chords of the curve between a parameter and where `advance` lands are no longer than was allowed, in total.
    fn keeps_its_promise<const D: usize>(points: &[[f64; 3]], t: f64, length: f64) {
        let points: Vec<[f64; D]> = points.iter().map(|p| point(*p)).collect();
        let Ok(spline) = Spline::catmull_rom(&points) else { return };
        let t = t * spline.end();
        let next = spline.advance(t, length);
        assert!(next > t || t >= spline.end());
        let mut sum = 0.0;
        let at = |i: u32| spline.point(t + (next - t) * f64::from(i) / 500.0);
        for i in 0..500 {
            sum += distance(at(i), at(i + 1));
        }
        assert!(sum <= length * (1.0 + 1e-9) + 1e-12, "{sum} of {length}");
        let exact = spline.arc_length(next) - spline.arc_length(t);
        // Chords are shorter than the curve; cusps are where quadrature is worst.
        assert!((exact - sum).abs() < 2e-3 * (1.0 + spline.arc_length(spline.end())), "{exact} {sum}");
    }

    proptest! {
        #[test]
        fn keeps_its_promise_2d_and_3d(
            p in prop::collection::vec(prop::array::uniform3(-3.0..3.0f64), 2..7),
            t in 0.0..1.0f64, l in 1e-3..9.0f64,
        ) {
            keeps_its_promise::<2>(&p, t, l);
            keeps_its_promise::<3>(&p, t, l);
        }
    }

    #[test]
    fn the_curve_runs_through_its_points() {
        let points = [[0.0, 0.0], [1.0, 2.0], [3.0, -1.0], [3.0, -1.0], [5.0, 0.0]];
        let spline = Spline::catmull_rom(&points).unwrap();
        for (i, p) in points.iter().enumerate() {
            assert!(distance(spline.point(i as f64), *p) < 1e-15);
        }
        // A quarter of a circle as a cubic: longer than the circle's by 2.7e-4 of the radius at most.
        let c = 0.552_284_749_831;
        let arc = Spline::bezier(vec![[[1.0, 0.0], [1.0, c], [c, 1.0], [0.0, 1.0]]]).unwrap();
        assert!((arc.arc_length(1.0) - std::f64::consts::FRAC_PI_2).abs() < 3e-4);
    }

    #[test]
    fn degenerate_splines() {
        assert!(Spline::<2>::catmull_rom(&[]).is_err());
        assert!(Spline::catmull_rom(&[[1.0, 1.0]]).is_err());
        assert!(Spline::catmull_rom(&[[1.0, f64::NAN], [0.0, 0.0]]).is_err());
        assert!(Spline::catmull_rom(&[[1e200, 0.0], [0.0, 0.0]]).is_err());
        let still = Spline::catmull_rom(&[[1.0, 1.0], [1.0, 1.0]]).unwrap();
        assert_eq!(still.advance(0.0, 1e-3), 1.0);
        assert!(still.point(f64::NAN)[0].is_nan());
    }
}
