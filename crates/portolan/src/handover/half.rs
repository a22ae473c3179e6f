//! Half precision, for consumers on GPUs.

/// The `f16` (IEEE 754 binary16, as bits) nearest to a number, ties to even. Values that are too large become infinite,
/// NaN stays NaN.
pub fn f16_from_f32(value: f32) -> u16 {
    let bits = value.to_bits();
    let sign = ((bits >> 16) & 0x8000) as u16;
    let magnitude = bits & 0x7fff_ffff;
    if magnitude > 0x7f80_0000 {
        return sign | 0x7e00;
    }
    // 65520, from which on rounding ends at infinity.
    if magnitude >= 0x477f_f000 {
        return sign | 0x7c00;
    }
    let (rest, shift) = if magnitude >= 0x3880_0000 {
        // A normal number: exponents biased by 15 instead of 127, ten of 23 bits kept.
        (magnitude - (112 << 23), 13)
    } else {
        // Below 2^-14: a multiple of 2^-24, the leading one written out.
        let shift = 126 - (magnitude >> 23);
        if shift > 24 {
            return sign;
        }
        ((magnitude & 0x007f_ffff) | 0x0080_0000, shift)
    };
    let kept = rest >> shift;
    let (lost, half) = (rest & ((1 << shift) - 1), 1 << (shift - 1));
    let up = lost > half || (lost == half && kept & 1 == 1);
    sign | (kept + u32::from(up)) as u16
}

/// The value of an `f16` (as bits), exact.
pub fn f32_from_f16(bits: u16) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from((bits >> 10) & 0x1f), f32::from(bits & 0x3ff));
    sign * match exponent {
        0 => fraction * 2f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        e => (1024.0 + fraction) * 2f32.powi(e - 25),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_half_is_itself() {
        for bits in 0..=u16::MAX {
            let value = f32_from_f16(bits);
            if value.is_nan() {
                assert!(f32_from_f16(f16_from_f32(value)).is_nan());
            } else {
                assert_eq!(f16_from_f32(value), bits, "{value}");
            }
        }
        assert_eq!(
            [1.0, -2.0, 65504.0, 65519.9, 65520.0, 6e-8, 2e-8].map(f16_from_f32),
            [0x3c00, 0xc000, 0x7bff, 0x7bff, 0x7c00, 1, 0]
        );
        assert_eq!(f16_from_f32(f32::NEG_INFINITY), 0xfc00);
    }

    /// Halfway between two neighbors, and a hair to either side: all of them.
    #[test]
    fn ties_go_to_even() {
        for low in 0..0x7bff_u16 {
            let (a, b) = (f32_from_f16(low), f32_from_f16(low + 1));
            let middle = 0.5 * (a + b); // exact: one bit more
            let even = if low & 1 == 0 { low } else { low + 1 };
            assert_eq!(f16_from_f32(middle), even, "{middle}");
            assert_eq!(f16_from_f32(f32::from_bits(middle.to_bits() - 1)), low);
            assert_eq!(f16_from_f32(f32::from_bits(middle.to_bits() + 1)), low + 1);
            assert_eq!(f16_from_f32(-middle), even | 0x8000);
        }
    }

    proptest! {
        #[test]
        fn nothing_is_nearer(value in -65_504f32..65_504.0) {
            let bits = f16_from_f32(value);
            let error = (f32_from_f16(bits) - value).abs();
            for other in [bits.wrapping_sub(1), bits.wrapping_add(1)] {
                let at = f32_from_f16(other);
                prop_assert!(!at.is_finite() || (at - value).abs() >= error);
            }
        }
    }
}
