//! Settings of a fit, and what can be wrong with them.

use super::line::Far;
use super::model::{Channels, Noise, Prior};
use serde::Serialize;

/// How a step is made from a gradient.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Optimizer {
    /// `θ ← θ − rate ∇J`.
    GradientDescent {
        /// Step per unit of gradient.
        rate: f64,
    },
    /// Steps normalised by running moments of the gradient *(Kingma & Ba 2015, algorithm 1)*.
    Adam {
        /// Largest step of a parameter.
        rate: f64,
        /// Decay of the first moment.
        beta1: f64,
        /// Decay of the second moment.
        beta2: f64,
        /// Added to the root of the second moment.
        epsilon: f64,
    },
}

impl Optimizer {
    /// Adam with the decay rates and the epsilon of the paper.
    pub fn adam(rate: f64) -> Self {
        Self::Adam { rate, beta1: 0.9, beta2: 0.999, epsilon: 1e-8 }
    }
}

/// Settings of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What enters the likelihood.
    pub channels: Channels,
    /// How well it was measured.
    pub noise: Noise,
    /// What is believed beforehand.
    pub prior: Prior,
    /// How steps are made.
    pub optimizer: Optimizer,
    /// What lies behind the line.
    pub far: Far,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            channels: Channels::Depth,
            noise: Noise::default(),
            prior: Prior::default(),
            optimizer: Optimizer::GradientDescent { rate: 2e-4 },
            far: Far::default(),
        }
    }
}

/// Why a fit cannot start.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// A setting has no meaning.
    #[error("{field} is {value}, but must be {must}")]
    Setting {
        /// Name of the setting.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// The line has bins without density or reflectance, or none.
    #[error(
        "a line needs at least one bin and as many reflectances as densities, got {densities} and {reflectances}"
    )]
    Line {
        /// Number of densities.
        densities: usize,
        /// Number of reflectances.
        reflectances: usize,
    },
    /// A measurement is not finite.
    #[error("measurement {index} is not finite")]
    Measurement {
        /// Its place in the list.
        index: usize,
    },
}

impl Settings {
    /// Checks every number once.
    ///
    /// # Errors
    /// The first setting that has no meaning.
    pub fn validate(&self) -> Result<(), FitError> {
        let rate = match self.optimizer {
            Optimizer::GradientDescent { rate } | Optimizer::Adam { rate, .. } => rate,
        };
        let positive = [
            ("noise.depth", self.noise.depth),
            ("noise.reflectance", self.noise.reflectance),
            ("noise.second_moment", self.noise.second_moment),
            ("prior.density_spread", self.prior.density_spread),
            ("prior.reflectance_spread", self.prior.reflectance_spread),
            ("optimizer.rate", rate),
            ("far.depth", self.far.depth),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(FitError::Setting { field, value, must: "finite and positive" });
            }
        }
        for (field, value) in
            [("prior.density_mean", self.prior.density_mean), ("far.reflectance", self.far.reflectance)]
        {
            if !value.is_finite() {
                return Err(FitError::Setting { field, value, must: "finite" });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_without_meaning_are_named() {
        assert_eq!(Settings::default().validate(), Ok(()));
        let noise = Noise { depth: 0.0, ..Noise::default() };
        let error = Settings { noise, ..Settings::default() }.validate().unwrap_err();
        assert_eq!(error.to_string(), "noise.depth is 0, but must be finite and positive");
        let optimizer = Optimizer::adam(f64::NAN);
        assert!(Settings { optimizer, ..Settings::default() }.validate().is_err());
    }
}
