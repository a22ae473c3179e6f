//! Places in an image as whole numbers: steps of 1/64 of a pixel.

/// Pixels have this many steps.
pub(super) const STEPS: i32 = 1 << STEP_BITS;
/// Bits of a step.
pub(super) const STEP_BITS: u32 = 6;

/// A coordinate that is in no image (pixels).
pub(super) const NOWHERE: f32 = 60_000.0;

/// Pixels to steps of a pixel.
#[inline(always)]
pub(super) fn steps(pixels: f32) -> i32 {
    nearest_integer(pixels.clamp(-NOWHERE, NOWHERE) * STEPS as f32)
}

/// Rounds numbers up to 2^22, by the bits of a sum: `as` checks for numbers too large, which keeps it from being
/// vectorised.
#[inline(always)]
pub(super) fn nearest_integer(v: f32) -> i32 {
    const SHIFT: f32 = 12_582_912.0; // 1.5 * 2^23
    (v + SHIFT).to_bits().wrapping_sub(SHIFT.to_bits()) as i32
}
