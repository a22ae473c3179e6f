//! Angles of points in `f32`, in a form that the compiler turns into vector instructions.

use std::f32::consts::{FRAC_PI_2, PI};

/// `atan(a) / a` as a polynomial in `a^2` on `[0, 1]`, fitted for the least largest error (6e-9 before rounding).
const ATAN: [f32; 9] = [
    0.999_999_9,
    -0.333_325_98,
    0.199_859_14,
    -0.141_612_8,
    0.104_991_28,
    -0.072_352_31,
    0.039_785_547,
    -0.014_403_998,
    0.002_457_384_7,
];

/// `atan2(y, x)` within 5e-7 rad, without a branch or a call. `(0, 0)` gives 0; the arguments must be finite.
#[inline(always)]
pub(crate) fn atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = if ay < ax { (ay, ax) } else { (ax, ay) };
    let a = small / if large > f32::MIN_POSITIVE { large } else { 1.0 };
    let s = a * a;
    let mut r = ATAN[8];
    for k in (0..8).rev() {
        r = r * s + ATAN[k];
    }
    r *= a;
    r = if ay < ax { r } else { FRAC_PI_2 - r };
    r = if large > f32::MIN_POSITIVE { r } else { 0.0 };
    r = if x < 0.0 { PI - r } else { r };
    if y < 0.0 { -r } else { r }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn axes_and_zero() {
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert_eq!(atan2(0.0, 2.0), 0.0);
        assert_eq!(atan2(3.0, 0.0), FRAC_PI_2);
        assert_eq!(atan2(-3.0, 0.0), -FRAC_PI_2);
        assert_eq!(atan2(0.0, -1.0), PI);
        assert!(atan2(1e-42, 1e-42).is_finite());
    }

    proptest! {
        #[test]
        fn within_its_bound(y in -50.0..50.0f32, x in -50.0..50.0f32, scale in -20..20i32) {
            let (y, x) = (y * (scale as f32).exp2(), x);
            let exact = f64::from(y).atan2(f64::from(x));
            prop_assert!((f64::from(atan2(y, x)) - exact).abs() < 5e-7, "{}", atan2(y, x));
        }
    }
}
