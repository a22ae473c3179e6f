//! Cubic interpolation between the `4^D` samples around a point.

/// A signed distance with its derivatives, all of one interpolant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smooth<const D: usize> {
    /// Signed distance (meters), positive in free space.
    pub distance: f64,
    /// Its exact first derivatives (per meter): continuous.
    pub gradient: [f64; D],
    /// Its exact second derivatives (per square meter), symmetric. They jump where a point crosses a plane of centers.
    pub hessian: [[f64; D]; D],
}

/// Samples of a neighbourhood, x fastest, the first `4^D` of them; the point lies between the two in the middle along
/// every axis. NaN: not known.
pub(super) type Neighbourhood = [f32; 64];

/// Weights of four samples in a row at `t` in `[0, 1]` between the middle two, and their first and second derivatives:
/// the spline through the samples whose slope at each is half the difference of its neighbours *(Catmull & Rom 1974; Keys
/// 1981 with a = -1/2)*.
#[inline(always)]
fn weights(t: f64) -> [[f64; 4]; 3] {
    let (sq, cube) = (t * t, t * t * t);
    [
        [
            sq - 0.5 * (t + cube),
            1.0 - 2.5 * sq + 1.5 * cube,
            0.5 * t + 2.0 * sq - 1.5 * cube,
            0.5 * (cube - sq),
        ],
        [2.0 * t - 0.5 - 1.5 * sq, 4.5 * sq - 5.0 * t, 0.5 + 4.0 * t - 4.5 * sq, 1.5 * sq - t],
        [2.0 - 3.0 * t, 9.0 * t - 5.0, 4.0 - 9.0 * t, 3.0 * t - 1.0],
    ]
}

/// Value, gradient and, with `HESSIAN`, second derivatives (0 otherwise), per cell and not per meter.
///
/// The slowest axis first, so that sums run over samples that lie side by side: what is left is a plane of values, one of
/// slopes and one of second derivatives along it.
#[inline(always)]
pub(super) fn cubic<const D: usize, const HESSIAN: bool>(
    samples: &Neighbourhood,
    fraction: &[f64; D],
) -> Smooth<D> {
    let (x, y) = (weights(fraction[0]), weights(fraction[1]));
    // The lower half of the Hessian, row by row.
    let (distance, gradient, hessian) = if D == 2 {
        let plane = std::array::from_fn(|i| f64::from(samples[i]));
        let v = if HESSIAN { patch::<2>(&plane, &x, &y) } else { patch::<1>(&plane, &x, &y) };
        (v.value, [v.slope[0], v.slope[1], 0.0], [v.bend[0], v.bend[1], v.bend[2], 0.0, 0.0, 0.0])
    } else {
        let z = weights(fraction[2]);
        let (values, slopes) = (planes(samples, &z[0]), planes(samples, &z[1]));
        if HESSIAN {
            let (v, s) = (patch::<2>(&values, &x, &y), patch::<1>(&slopes, &x, &y));
            let b = patch::<0>(&planes(samples, &z[2]), &x, &y);
            let hessian = [v.bend[0], v.bend[1], v.bend[2], s.slope[0], s.slope[1], b.value];
            (v.value, [v.slope[0], v.slope[1], s.value], hessian)
        } else {
            let (v, s) = (patch::<1>(&values, &x, &y), patch::<0>(&slopes, &x, &y));
            (v.value, [v.slope[0], v.slope[1], s.value], [0.0; 6])
        }
    };
    let lower = |a: usize, b: usize| hessian[a * (a + 1) / 2 + b];
    Smooth {
        distance,
        gradient: std::array::from_fn(|k| gradient[k]),
        hessian: std::array::from_fn(|a| std::array::from_fn(|b| lower(a.max(b), a.min(b)))),
    }
}

/// A bicubic patch at one point: value, (x, y), (xx, xy, yy).
struct Patch {
    value: f64,
    slope: [f64; 2],
    bend: [f64; 3],
}

/// Derivatives up to `ORDER`; 0 beyond.
#[inline(always)]
fn patch<const ORDER: usize>(plane: &[f64; 16], x: &[[f64; 4]; 3], y: &[[f64; 4]; 3]) -> Patch {
    let sum = |w: &[f64; 4], f: &[f64; 4]| (w[0] * f[0] + w[1] * f[1]) + (w[2] * f[2] + w[3] * f[3]);
    let row = |w: &[f64; 4]| -> [f64; 4] {
        std::array::from_fn(|i| sum(w, &[plane[i], plane[i + 4], plane[i + 8], plane[i + 12]]))
    };
    let values = row(&y[0]);
    let mut patch = Patch { value: sum(&x[0], &values), slope: [0.0; 2], bend: [0.0; 3] };
    if ORDER >= 1 {
        let slopes = row(&y[1]);
        patch.slope = [sum(&x[1], &values), sum(&x[0], &slopes)];
        if ORDER >= 2 {
            patch.bend = [sum(&x[2], &values), sum(&x[1], &slopes), sum(&x[0], &row(&y[2]))];
        }
    }
    patch
}

/// Four planes of samples taken together.
#[inline(always)]
fn planes(samples: &Neighbourhood, w: &[f64; 4]) -> [f64; 16] {
    let mut plane = [0.0; 16];
    for i in 0..16 {
        let f = |j: usize| f64::from(samples[i + 16 * j]);
        plane[i] = (w[0] * f(0) + w[1] * f(1)) + (w[2] * f(2) + w[3] * f(3));
    }
    plane
}

/// Fills unknown samples beside the `2^D` in the middle with the straight line through the two next to them, axis by
/// axis. `false` where one of the middle is unknown.
///
/// All are filled: behind the pass along an axis, whatever lies beside the middle along the axes so far is known.
pub(super) fn complete<const D: usize>(samples: &mut Neighbourhood) -> bool {
    let place = |i: usize, k: usize| i >> (2 * k) & 3;
    let middle = |i: usize, k: usize| matches!(place(i, k), 1 | 2);
    let cells = 1 << (2 * D);
    if (0..cells).any(|i| (0..D).all(|k| middle(i, k)) && samples[i].is_nan()) {
        return false;
    }
    for k in 0..D {
        let step = 1 << (2 * k);
        for i in (0..cells).filter(|&i| !middle(i, k)) {
            if samples[i].is_nan() {
                let (near, far) = match place(i, k) {
                    0 => (samples[i + step], samples[i + 2 * step]),
                    _ => (samples[i - step], samples[i - 2 * step]),
                };
                samples[i] = 2.0 * near - far;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn place<const D: usize>(i: usize) -> [f64; D] {
        std::array::from_fn(|k| f64::from((i >> (2 * k) & 3) as u32) - 1.0)
    }

    fn filled<const D: usize>(f: impl Fn([f64; D]) -> f64) -> Neighbourhood {
        std::array::from_fn(|i| if i < 1 << (2 * D) { f(place(i)) as f32 } else { f32::NAN })
    }

    /// Derivatives against central differences of the interpolant itself: errors of `h^2` times a third derivative,
    /// which is below 100 for samples up to 1, and of rounding over `h`.
    fn derivatives_are_those_of_the_value<const D: usize>(samples: &Neighbourhood, at: [f64; D]) {
        let h = 1e-4;
        let got = cubic::<D, true>(samples, &at);
        let plain = cubic::<D, false>(samples, &at);
        assert_eq!((plain.distance, plain.gradient), (got.distance, got.gradient));
        for k in 0..D {
            let moved = |by: f64| {
                let mut p = at;
                p[k] += by;
                cubic::<D, true>(samples, &p)
            };
            let (low, high) = (moved(-h), moved(h));
            let slope = (high.distance - low.distance) / (2.0 * h);
            assert!((slope - got.gradient[k]).abs() < 1e-5, "{slope} {got:?}");
            for a in 0..D {
                let bend = (high.gradient[a] - low.gradient[a]) / (2.0 * h);
                assert!((bend - got.hessian[k][a]).abs() < 1e-5, "{bend} {got:?}");
                assert_eq!(got.hessian[k][a], got.hessian[a][k]);
            }
        }
    }

    /// Quadratics with coefficients that `f32` holds exactly come out as they are.
    fn quadratics_are_reproduced<const D: usize>(c: &[i32], at: [f64; D]) {
        let c = |i: usize| f64::from(c[i]) / 8.0;
        let f = |p: [f64; D]| {
            let mut sum = c(0);
            for a in 0..D {
                sum += c(1 + a) * p[a];
                for b in a..D {
                    sum += c(4 + 3 * a + b) * p[a] * p[b];
                }
            }
            sum
        };
        let got = cubic::<D, true>(&filled(f), &at);
        assert!((got.distance - f(at)).abs() < 1e-12);
        for a in 0..D {
            let mut slope = c(1 + a);
            for b in 0..D {
                let bend = c(4 + 3 * a.min(b) + a.max(b)) * if a == b { 2.0 } else { 1.0 };
                assert!((got.hessian[a][b] - bend).abs() < 1e-11);
                slope += bend * at[b];
            }
            assert!((got.gradient[a] - slope).abs() < 1e-11);
        }
    }

    /// The missing are filled, and exactly so where the field is a plane.
    fn planes_are_completed<const D: usize>(c: &[i32], missing: &[bool]) {
        let f =
            |p: [f64; D]| (0..D).fold(f64::from(c[0]) / 8.0, |sum, k| sum + f64::from(c[k + 1]) / 8.0 * p[k]);
        let whole = filled(f);
        let mut torn = whole;
        for i in (0..1 << (2 * D)).filter(|&i| missing[i]) {
            torn[i] = f32::NAN;
        }
        let middle = |i: usize| place::<D>(i).iter().all(|v| (0.0..=1.0).contains(v));
        let known = (0..1 << (2 * D)).all(|i| !middle(i) || !missing[i]);
        assert_eq!(complete::<D>(&mut torn), known);
        if known {
            assert_eq!(torn[..1 << (2 * D)], whole[..1 << (2 * D)]);
        }
    }

    fn coefficients() -> impl Strategy<Value = Vec<i32>> {
        prop::collection::vec(-80..80i32, 13)
    }

    proptest! {
        #[test]
        fn derivatives_are_those_of_the_value_2d_and_3d(
            samples in prop::collection::vec(-1.0..1.0f32, 64), at in prop::array::uniform3(0.0..1.0f64),
        ) {
            let samples: Neighbourhood = std::array::from_fn(|i| samples[i]);
            derivatives_are_those_of_the_value::<2>(&samples, [at[0], at[1]]);
            derivatives_are_those_of_the_value::<3>(&samples, at);
        }
        #[test]
        fn quadratics_are_reproduced_2d_and_3d(c in coefficients(), at in prop::array::uniform3(0.0..1.0f64)) {
            quadratics_are_reproduced::<2>(&c, [at[0], at[1]]);
            quadratics_are_reproduced::<3>(&c, at);
        }
        #[test]
        fn planes_are_completed_2d_and_3d(
            c in coefficients(), missing in prop::collection::vec(prop::bool::weighted(0.1), 64), dense: bool,
        ) {
            let missing: Vec<bool> = (0..64).map(|i| {
                let middle = (0..3).all(|k| matches!(i >> (2 * k) & 3, 1 | 2));
                if dense && i < 64 { !middle } else { missing[i] }
            }).collect();
            planes_are_completed::<2>(&c, &missing);
            planes_are_completed::<3>(&c, &missing);
        }
        /// From one cell into the next value and gradient go on: all samples are shared but the outermost.
        #[test]
        fn the_gradient_is_continuous_across_faces(
            samples in prop::collection::vec(-1.0..1.0f32, 80), t in prop::array::uniform2(0.0..1.0f64),
        ) {
            let cell = |shift: usize| -> Neighbourhood {
                std::array::from_fn(|i| samples[(i / 4) * 5 + i % 4 + shift])
            };
            let low = cubic::<3, true>(&cell(0), &[1.0, t[0], t[1]]);
            let high = cubic::<3, true>(&cell(1), &[0.0, t[0], t[1]]);
            prop_assert!((low.distance - high.distance).abs() < 1e-12);
            for k in 0..3 {
                prop_assert!((low.gradient[k] - high.gradient[k]).abs() < 1e-12);
            }
        }
    }
}
