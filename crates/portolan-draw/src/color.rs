//! The palette of all pictures, distinguishable for color-blind readers and in print.
//!
//! Signed distance runs from orange (negative, behind a surface) through transparent at zero to blue
//! (positive, free space); measurements are green, extracted surfaces purple, ground truth gray and dashed.

/// An sRGB color with straight (not premultiplied) alpha, 8 bits per channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Color {
    /// Red, 0 to 255.
    pub r: u8,
    /// Green, 0 to 255.
    pub g: u8,
    /// Blue, 0 to 255.
    pub b: u8,
    /// Opacity: 0 is transparent, 255 opaque.
    pub a: u8,
}

impl Color {
    /// An opaque color from `0xRRGGBB`.
    pub const fn hex(rgb: u32) -> Self {
        Self { r: (rgb >> 16) as u8, g: (rgb >> 8) as u8, b: rgb as u8, a: 255 }
    }

    /// The same color with opacity `alpha` in 0 to 1 (clamped; NaN is transparent).
    pub fn with_alpha(self, alpha: f64) -> Self {
        Self { a: (alpha.clamp(0.0, 1.0) * 255.0).round() as u8, ..self }
    }

    /// Linear mix in sRGB: `self` at `t` = 0, `other` at 1 (clamped; NaN counts as 0).
    pub fn mix(self, other: Self, t: f64) -> Self {
        let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
        let channel = |a: u8, b: u8| (f64::from(a) + t * (f64::from(b) - f64::from(a))).round() as u8;
        Self {
            r: channel(self.r, other.r),
            g: channel(self.g, other.g),
            b: channel(self.b, other.b),
            a: channel(self.a, other.a),
        }
    }

    /// `self` blended over the opaque color `below`.
    pub fn over(self, below: Self) -> Self {
        let opaque = Self { a: 255, ..self };
        below.mix(opaque, f64::from(self.a) / 255.0)
    }
}

/// Fully transparent.
pub const TRANSPARENT: Color = Color { r: 255, g: 255, b: 255, a: 0 };
/// The paper: background of every picture.
pub const PAPER: Color = Color::hex(0xFFFFFF);
/// Text and axes.
pub const INK: Color = Color::hex(0x1F2933);
/// Secondary text: subtitles, units.
pub const MUTED: Color = Color::hex(0x5F6B76);
/// Grid lines and frames.
pub const GRID: Color = Color::hex(0xDDE1E6);
/// Measurements: beams, hits.
pub const MEASUREMENT: Color = Color::hex(0x159A6C);
/// Extracted surfaces: contour, mesh, the estimate's zero set.
pub const SURFACE: Color = Color::hex(0x7A3E9D);
/// Ground truth; drawn dashed.
pub const TRUTH: Color = Color::hex(0x7C858E);
/// Never observed: neither free nor occupied.
pub const UNKNOWN: Color = Color::hex(0xDCD9D3);
/// Free space, positive distance.
pub const POSITIVE: Color = Color::hex(0x1F6FB5);
/// Behind a surface, negative distance.
pub const NEGATIVE: Color = Color::hex(0xDE6B0E);
/// Occupied, at probability 1.
pub const OCCUPIED: Color = Color::hex(0x1B2733);
/// Free, at probability 0.
pub const FREE: Color = Color::hex(0xF7FBFE);

/// Colors for the series of a chart, in the order in which to use them.
pub const SERIES: [Color; 6] =
    [POSITIVE, NEGATIVE, MEASUREMENT, SURFACE, Color::hex(0xC2497F), Color::hex(0x8A6D1B)];

/// The signed distance `d`, saturating at `±limit` (same unit): orange below zero, transparent at zero, blue
/// above. NaN is [`UNKNOWN`].
pub fn signed_distance(d: f64, limit: f64) -> Color {
    if d.is_nan() {
        return UNKNOWN;
    }
    let strength = if limit > 0.0 { (d.abs() / limit).min(1.0) } else { 1.0 };
    // The exponent keeps the neighborhood of the surface legible on a screen.
    let tone = if d < 0.0 { NEGATIVE } else { POSITIVE };
    if d == 0.0 { TRANSPARENT } else { tone.with_alpha(0.9 * strength.powf(0.8)) }
}

/// The occupancy probability `p`: white where free, dark where occupied; NaN is [`UNKNOWN`].
///
/// The ramp is steepest at 0.5, so that cells clamped to 0.12 or 0.97 are nearly as light or dark as possible.
pub fn occupancy(p: f64) -> Color {
    if p.is_nan() {
        return UNKNOWN;
    }
    let p = p.clamp(0.0, 1.0);
    FREE.mix(OCCUPIED, p * p * (3.0 - 2.0 * p))
}

/// A one-sided quantity (distance to the nearest obstacle, weight, density) as `t` in 0 to 1, from light to
/// dark blue; NaN is [`UNKNOWN`].
pub fn sequential(t: f64) -> Color {
    const STOPS: [Color; 4] =
        [Color::hex(0xF6FAFD), Color::hex(0xA9CFE8), Color::hex(0x3E8CC2), Color::hex(0x123A63)];
    if t.is_nan() {
        return UNKNOWN;
    }
    let place = t.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let stop = (place as usize).min(STOPS.len() - 2);
    STOPS[stop].mix(STOPS[stop + 1], place - stop as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sign_is_the_meaning() {
        assert_eq!(signed_distance(0.0, 1.0).a, 0);
        assert_eq!(signed_distance(-3.0, 1.0), NEGATIVE.with_alpha(0.9));
        assert_eq!(signed_distance(3.0, 1.0), POSITIVE.with_alpha(0.9));
        assert!(signed_distance(0.2, 1.0).a < signed_distance(0.4, 1.0).a);
        assert_eq!(signed_distance(f64::NAN, 1.0), UNKNOWN);
        assert_eq!(signed_distance(1.0, 0.0).a, POSITIVE.with_alpha(0.9).a);
    }

    #[test]
    fn ramps_meet_their_ends() {
        assert_eq!(occupancy(0.0), FREE);
        assert_eq!(occupancy(1.0), OCCUPIED);
        assert_eq!(occupancy(f64::NAN), UNKNOWN);
        assert_eq!(sequential(-1.0), Color::hex(0xF6FAFD));
        assert_eq!(sequential(2.0), Color::hex(0x123A63));
    }

    #[test]
    fn over_blends_by_opacity() {
        assert_eq!(TRANSPARENT.over(INK), INK);
        assert_eq!(SURFACE.over(PAPER), SURFACE);
        assert_eq!(Color::hex(0).with_alpha(0.5).over(PAPER), Color::hex(0x7F7F7F));
    }
}
