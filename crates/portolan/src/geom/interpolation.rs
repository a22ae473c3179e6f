//! Multilinear interpolation between cell centers.

/// Value at a point between `2^D` neighboring samples, and its exact derivative per cell (not per meter).
///
/// `base` is the linear index of the lowest sample, `strides` the distances in memory between neighbors, `fraction` the
/// position of the point between them, in `[0, 1]` along each axis. The gradient is the exact derivative of the interpolant.
/// NaN samples give NaN.
///
/// # Panics
/// Where a sample is outside the array.
#[inline(always)]
pub fn interpolate<const D: usize>(
    values: &[f32],
    strides: &[usize; D],
    base: usize,
    fraction: &[f64; D],
) -> (f64, [f64; D]) {
    let mut corners = [0.0f64; 8];
    for c in 0..1usize << D {
        let mut at = base;
        for k in 0..D {
            at += ((c >> k) & 1) * strides[k];
        }
        corners[c] = f64::from(values[at]);
    }
    // Fold the highest axis first; the slope along an axis is folded along with the values.
    let mut slopes = [[0.0f64; 8]; D];
    for k in (0..D).rev() {
        let (half, t) = (1usize << k, fraction[k]);
        for c in 0..half {
            let (low, high) = (corners[c], corners[c + half]);
            slopes[k][c] = high - low;
            corners[c] = low + t * (high - low);
            for above in k + 1..D {
                let (low, high) = (slopes[above][c], slopes[above][c + half]);
                slopes[above][c] = low + t * (high - low);
            }
        }
    }
    (corners[0], std::array::from_fn(|k| slopes[k][0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::point;
    use proptest::prelude::*;

    fn gradient_is_the_derivative<const D: usize>(values: &[f32], fraction: [f64; 3]) {
        let fraction: [f64; D] = point(fraction);
        let strides: [usize; D] = std::array::from_fn(|k| 1 << k);
        let (_, gradient) = interpolate(values, &strides, 0, &fraction);
        for k in 0..D {
            let h = 1e-5;
            let (mut low, mut high) = (fraction, fraction);
            low[k] -= h;
            high[k] += h;
            let slope = (interpolate(values, &strides, 0, &high).0
                - interpolate(values, &strides, 0, &low).0)
                / (2.0 * h);
            assert!((slope - gradient[k]).abs() < 1e-9);
        }
        for c in 0..1usize << D {
            let corner = std::array::from_fn(|k| ((c >> k) & 1) as f64);
            assert_eq!(interpolate(values, &strides, 0, &corner).0, f64::from(values[c]));
        }
    }

    proptest! {
        #[test]
        fn gradient_is_the_derivative_2d_and_3d(
            v in prop::collection::vec(-1.0f32..1.0, 8), f in prop::array::uniform3(0.01..0.99f64),
        ) {
            gradient_is_the_derivative::<2>(&v, f);
            gradient_is_the_derivative::<3>(&v, f);
        }
    }
}
