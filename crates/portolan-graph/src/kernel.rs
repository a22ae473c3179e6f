//! Robust kernels: they bound the influence of edges with large errors.

use crate::error::GraphError;

/// The cost of an edge as a function of its chi-square `s = r^T Omega r`. The scale `k` of each kernel is in standard
/// deviations: an edge with `sqrt(s)` below it has (nearly) its full weight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Kernel {
    /// `s`: least squares.
    #[default]
    None,
    /// `s` up to `k²`, then `2 k sqrt(s) - k²` (Huber 1964). Convex; the influence of an outlier stays constant.
    Huber(f64),
    /// `k² ln(1 + s / k²)`: the influence falls with the inverse of the error.
    Cauchy(f64),
    /// Dynamic covariance scaling (Agarwal et al. 2013) with `Phi = k²`: `s` up to `k²`, then weight
    /// `(2 k² / (k² + s))²`. Bounded by `3 k²`.
    Dcs(f64),
    /// `k² s / (k² + s)` (Geman & McClure 1987), bounded by `k²`.
    GemanMcClure(f64),
}

impl Kernel {
    /// The cost of chi-square `s` and its derivative there, which is the weight of the edge in `[0, 1]`.
    pub fn cost_and_weight(self, s: f64) -> (f64, f64) {
        match self {
            Self::None => (s, 1.0),
            Self::Huber(k) if s <= k * k => (s, 1.0),
            Self::Huber(k) => (2.0 * k * s.sqrt() - k * k, k / s.sqrt()),
            Self::Cauchy(k) => (k * k * libm::log1p(s / (k * k)), 1.0 / (1.0 + s / (k * k))),
            Self::Dcs(k) if s <= k * k => (s, 1.0),
            Self::Dcs(k) => {
                let (phi, scale) = (k * k, 2.0 / (1.0 + s / (k * k)));
                (phi * (3.0 - 2.0 * scale), scale * scale)
            }
            Self::GemanMcClure(k) => {
                let shrink = 1.0 / (1.0 + s / (k * k));
                (s * shrink, shrink * shrink)
            }
        }
    }

    /// The scale `k`; `None` for least squares.
    pub fn scale(self) -> Option<f64> {
        match self {
            Self::None => None,
            Self::Huber(k) | Self::Cauchy(k) | Self::Dcs(k) | Self::GemanMcClure(k) => Some(k),
        }
    }

    /// The same kernel with another scale.
    pub(crate) fn with_scale(self, k: f64) -> Self {
        match self {
            Self::None => Self::None,
            Self::Huber(_) => Self::Huber(k),
            Self::Cauchy(_) => Self::Cauchy(k),
            Self::Dcs(_) => Self::Dcs(k),
            Self::GemanMcClure(_) => Self::GemanMcClure(k),
        }
    }

    pub(crate) fn validate(self) -> Result<(), GraphError> {
        match self.scale() {
            Some(k) if !(1e-100..=1e100).contains(&k) => {
                Err(GraphError::Setting { name: "kernel", value: k, expected: "a scale above zero" })
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_the_derivatives_and_costs_join() {
        for k in [0.5, 1.0, 3.0] {
            for kernel in
                [Kernel::None, Kernel::Huber(k), Kernel::Cauchy(k), Kernel::Dcs(k), Kernel::GemanMcClure(k)]
            {
                for s in [1e-3, 0.1, 0.7, 2.0, 30.0, 1e4] {
                    let h = 1e-6 * s;
                    let numeric =
                        (kernel.cost_and_weight(s + h).0 - kernel.cost_and_weight(s - h).0) / (2.0 * h);
                    let weight = kernel.cost_and_weight(s).1;
                    assert!((numeric - weight).abs() < 1e-6, "{kernel:?} at {s}: {numeric} {weight}");
                }
                let (below, above) = (
                    kernel.cost_and_weight(k * k * (1.0 - 1e-9)),
                    kernel.cost_and_weight(k * k * (1.0 + 1e-9)),
                );
                assert!((below.0 - above.0).abs() < 1e-7 && (below.1 - above.1).abs() < 1e-7, "{kernel:?}");
                assert_eq!(kernel.cost_and_weight(0.0), (0.0, 1.0));
            }
        }
        assert!(Kernel::Dcs(0.0).validate().is_err() && Kernel::Huber(f64::NAN).validate().is_err());
    }
}
