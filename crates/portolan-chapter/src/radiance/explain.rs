//! Why a bin moves, or does not: the factors of its gradient, ray by ray.
//!
//! The chapter's `∂z/∂σ_k = δ [T_{k+1} t_k − (Σ_{i>k} T_i α_i t_i + T_n t_far)]` holds for every channel
//! with its own values `v`. Divided by what passes bin `k`, the bracket is a difference of two values:
//!
//! ```text
//! ∂v/∂σ_k = δ · T_{k+1} · (v_k − v̄_k),    v̄_k = (Σ_{i>k} T_i α_i v_i + T_n v_far) / T_{k+1}
//! ```
//!
//! `T_{k+1}` is the same for all channels: no channel sees past an opaque bin. The contrast `v_k − v̄_k`
//! and the residual in front of it are each channel's own: those a second channel can repair.

use super::fit::{Fit, Scratch, differences, precisions};
use super::model::{Measurement, logistic};
use super::ray::Upstream;
use serde::Serialize;

/// One channel's share in the gradient of one bin by one ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Term {
    /// Rendered minus measured, in standard deviations of the noise.
    pub residual: f64,
    /// Value of the bin minus the mean value behind it, `v_k − v̄_k`; 0 where nothing passes.
    pub contrast: f64,
    /// `∂v/∂σ_k`.
    pub slope: f64,
    /// Contribution to `∂J/∂σ_k`: negative asks for more density. 0 for a channel outside the likelihood.
    pub pull: f64,
}

/// The gradient of one bin's density by one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// The ray and what was measured along it.
    pub measurement: Measurement,
    /// Share `T_{k+1}` of the light that passes the bin.
    pub passes: f64,
    /// Depth, m.
    pub depth: Term,
    /// Reflectance.
    pub reflectance: Term,
    /// Second moment of the return, m².
    pub second_moment: Term,
}

/// How the pulls on one bin become its entry in the gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sum {
    /// `∂J/∂σ` by all rays and channels: the sum of their pulls.
    pub pulls: f64,
    /// `∂σ/∂θ`: little where there is next to no density, `1 / resolution` where there is much.
    pub chain: f64,
    /// What the prior adds to `∂J/∂θ`.
    pub prior: f64,
}

impl Sum {
    /// `∂J/∂θ`: the entry of [`Fit::gradient`].
    pub fn gradient(&self) -> f64 {
        self.pulls * self.chain + self.prior
    }
}

impl Terms {
    /// The pulls of all channels.
    pub fn pull(&self) -> f64 {
        self.depth.pull + self.reflectance.pull + self.second_moment.pull
    }
}

impl Fit {
    /// Adds up the terms of a bin, as [`Fit::explain`] gave them for the field as it stands.
    ///
    /// # Panics
    /// When there is no such bin.
    pub fn add_up(&self, bin: usize, terms: &[Terms]) -> Sum {
        let theta = self.parameters()[bin];
        let prior = self.settings().prior;
        Sum {
            pulls: terms.iter().map(Terms::pull).sum(),
            chain: logistic(theta) / self.line().resolution,
            prior: (theta - prior.density_mean) / (prior.density_spread * prior.density_spread),
        }
    }

    /// The factors of `∂J/∂σ` of a bin at the field as it stands, for every ray to learn from that crosses
    /// it.
    pub fn explain(&self, bin: usize) -> Vec<Terms> {
        let line = self.line();
        let settings = self.settings();
        let background = settings.far.background();
        let precision = precisions(settings.channels, &settings.noise);
        let noise = [settings.noise.depth, settings.noise.reflectance, settings.noise.second_moment];
        let mut out = Vec::new();
        for (measurement, crossing) in self.measurements() {
            let Some(k) = crossing.sample_in(bin) else { continue };
            let mut scratch = Scratch::new(crossing.count);
            let rendered = scratch.render(line, &measurement.ray, crossing, &settings.far);
            let passes = scratch.passages.get(k + 1).map_or(rendered.transmittance, |p| p.transmittance);
            let difference = differences(&rendered, measurement);
            let mut term = |channel: usize| {
                let unit = |c: usize| if c == channel { 1.0 } else { 0.0 };
                let upstream = Upstream { depth: unit(0), color: [unit(1), unit(2)] };
                let slope = scratch.backward(crossing.count, &background, &rendered, &upstream)[k].density;
                let through = scratch.samples[k].length * passes;
                Term {
                    residual: difference[channel] / noise[channel],
                    contrast: if through > 0.0 { slope / through } else { 0.0 },
                    slope,
                    pull: precision[channel] * difference[channel] * slope,
                }
            };
            let [depth, reflectance, second_moment] = [term(0), term(1), term(2)];
            out.push(Terms { measurement: *measurement, passes, depth, reflectance, second_moment });
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::super::line::{Line, LineRay};
    use super::super::{Channels, Settings};
    use super::*;

    #[test]
    fn pulls_add_up_to_the_gradient() {
        let ray = |origin, ascending| Measurement {
            ray: LineRay { origin, ascending },
            depth: 0.5,
            reflectance: 0.7,
            second_moment: 0.3,
        };
        let mut line = Line::uniform(0.0, 0.1, 12, 3.0, 0.4);
        line.reflectance[7] = 0.9;
        let settings = Settings { channels: Channels::DepthReflectanceSpread, ..Settings::default() };
        let mut fit = Fit::new(line, &[ray(0.05, true), ray(1.1, false)], settings).unwrap();
        for bin in [0, 5, 11] {
            let terms = fit.explain(bin);
            let sum = fit.add_up(bin, &terms);
            let gradient = fit.gradient()[bin];
            assert!((sum.gradient() - gradient).abs() < 1e-12 * gradient.abs(), "{sum:?} {gradient}");
        }
        assert_eq!(fit.explain(11).len(), 1, "the descending ray starts below bin 11");
    }

    #[test]
    fn contrast_is_the_bracket_of_the_chapter() {
        // One bin at 3 m that lets e^-1 pass, nothing behind: the contrast is 3 m - 10 m.
        let line = Line { origin: 2.95, resolution: 0.1, density: vec![10.0], reflectance: vec![0.5] };
        let m = Measurement {
            ray: LineRay { origin: 0.0, ascending: true },
            depth: 3.0,
            reflectance: 0.5,
            second_moment: 9.0,
        };
        let fit = Fit::new(line, &[m], Settings::default()).unwrap();
        let terms = fit.explain(0);
        assert!((terms[0].depth.contrast + 7.0).abs() < 1e-9);
        assert!((terms[0].passes - (-1.0_f64).exp()).abs() < 1e-9);
    }
}
