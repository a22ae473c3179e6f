//! The measurement model around the renderer: what was measured, how well, and what is believed beforehand.

use super::line::LineRay;
use serde::Serialize;

/// Which quantities of a ray enter the likelihood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Channels {
    /// Depth alone.
    Depth,
    /// Depth and reflectance.
    DepthReflectance,
    /// Depth, reflectance and the second moment of the return: how far it is spread along the ray.
    DepthReflectanceSpread,
}

impl Channels {
    /// Whether the reflectance is measured.
    pub fn reflectance(self) -> bool {
        self != Self::Depth
    }

    /// Whether the spread of the return is measured.
    pub fn spread(self) -> bool {
        self == Self::DepthReflectanceSpread
    }
}

/// Standard deviations of the Gaussian noise of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// Of the depth, m.
    pub depth: f64,
    /// Of the reflectance.
    pub reflectance: f64,
    /// Of the second moment of the return, m².
    pub second_moment: f64,
}

impl Default for Noise {
    /// A modest range finder: 3 cm, 3 % reflectance, and the spread of a return to 25 dm².
    fn default() -> Self {
        Self { depth: 0.03, reflectance: 0.03, second_moment: 0.25 }
    }
}

/// What was measured along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// The ray.
    pub ray: LineRay,
    /// Distance, m.
    pub depth: f64,
    /// Reflectance of what was hit.
    pub reflectance: f64,
    /// Mean square distance of the return, m²; the square of the depth for a single opaque surface.
    pub second_moment: f64,
}

/// Independent Gaussian beliefs about the parameters before any ray was seen.
///
/// Densities are `softplus(θ) / resolution`, so that `softplus(θ)` is the optical depth `σδ` of a bin and
/// no step can make it negative; reflectances are `logistic(φ)`, between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Prior {
    /// Mean of `θ`.
    pub density_mean: f64,
    /// Standard deviation of `θ`.
    pub density_spread: f64,
    /// Standard deviation of `φ` about 0, which is a reflectance of one half.
    pub reflectance_spread: f64,
}

impl Default for Prior {
    /// Space is mostly empty (`σδ` = 0.05), but that is a weak belief; no reflectance is surprising.
    fn default() -> Self {
        Self { density_mean: -3.0, density_spread: 10.0, reflectance_spread: 2.0 }
    }
}

/// `ln(1 + e^θ)` without overflow.
pub fn softplus(theta: f64) -> f64 {
    theta.max(0.0) + libm::log1p(libm::exp(-theta.abs()))
}

/// The `θ` whose [`softplus`] is `x`; `x` is positive.
pub fn softplus_inverse(x: f64) -> f64 {
    x + libm::log(-libm::expm1(-x))
}

/// `1 / (1 + e^−θ)` without overflow; the derivative of [`softplus`].
pub fn logistic(theta: f64) -> f64 {
    let e = libm::exp(-theta.abs());
    if theta < 0.0 { e / (1.0 + e) } else { 1.0 / (1.0 + e) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parametrisations_invert_and_do_not_overflow() {
        for x in [1e-9, 0.05, 1.0, 5.0, 50.0, 1e4] {
            assert!((softplus(softplus_inverse(x)) - x).abs() < 1e-9 * x.max(1e-6), "{x}");
        }
        assert_eq!(softplus(-1e6), 0.0);
        assert_eq!(softplus(1e6), 1e6);
        assert_eq!((logistic(-1e6), logistic(0.0), logistic(1e6)), (0.0, 0.5, 1.0));
        for theta in [-20.0, -1.0, 0.3, 4.0] {
            let slope = (softplus(theta + 1e-6) - softplus(theta - 1e-6)) / 2e-6;
            assert!((slope - logistic(theta)).abs() < 1e-8);
        }
    }
}
