//! Fitting a line to measurements: the maximum of the posterior, by gradient descent through the renderer.
//!
//! `J = Σ ½ ((ẑ − z) / s_z)² + ½ ((ĉ − c) / s_c)² + prior`: the negative logarithm of likelihood times prior. The optimum is a point; no
//! posterior uncertainty has a closed form here, so none is offered.

use super::line::{COLORS, Crossing, Far, Line};
use super::model::{Channels, Measurement, Noise, Prior, logistic, softplus, softplus_inverse};
use super::ray::{Passage, Rendered, Sample, SampleGradient, Upstream, backward, render};

/// How a step is made from a gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    #[error("a line needs at least one bin and as many reflectances as densities, got {densities} and {reflectances}")]
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

/// Root mean square residuals over a set of rays; 0 for no rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Residuals {
    /// Of the depth, m.
    pub depth: f64,
    /// Of the reflectance.
    pub reflectance: f64,
    /// Of the second moment of the return, m².
    pub second_moment: f64,
}

/// The state of the fit before a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Negative logarithm of the posterior, up to a constant.
    pub objective: f64,
    /// Residuals of the rays that the step learned from.
    pub training: Residuals,
}

/// A line being fitted to measurements. All memory is taken when it is made; steps allocate nothing.
#[derive(Clone, Debug)]
pub struct Fit {
    settings: Settings,
    measurements: Vec<(Measurement, Crossing)>,
    line: Line,
    /// `θ` of every bin, then `φ` of every bin.
    parameters: Vec<f64>,
    gradient: Vec<f64>,
    moments: Vec<[f64; 2]>,
    steps: u64,
    scratch: Scratch,
}

/// Buffers of one ray.
#[derive(Clone, Debug)]
struct Scratch {
    samples: Vec<Sample<COLORS>>,
    passages: Vec<Passage>,
    gradients: Vec<SampleGradient<COLORS>>,
}

impl Fit {
    /// A fit that starts at `line`. Densities of zero start a little above it, where the parametrisation can hold them.
    ///
    /// # Errors
    /// When a setting, the line or a measurement makes no sense.
    pub fn new(mut line: Line, training: &[Measurement], settings: Settings) -> Result<Self, FitError> {
        settings.validate()?;
        let bins = line.bins();
        if bins == 0 || line.reflectance.len() != bins {
            return Err(FitError::Line { densities: bins, reflectances: line.reflectance.len() });
        }
        let finite = |m: &Measurement| {
            [m.ray.origin, m.depth, m.reflectance, m.second_moment].iter().all(|v| v.is_finite())
        };
        if let Some(index) = training.iter().position(|m| !finite(m)) {
            return Err(FitError::Measurement { index });
        }
        let densities = line.density.iter().map(|d| softplus_inverse((d * line.resolution).max(1e-9)));
        let reflectances = line.reflectance.iter().map(|c| {
            let c = c.clamp(1e-6, 1.0 - 1e-6);
            libm::log(c / (1.0 - c))
        });
        let parameters: Vec<f64> = densities.chain(reflectances).collect();
        let measurements = training.iter().map(|m| (*m, line.crossing(&m.ray))).collect();
        apply(&parameters, &mut line);
        Ok(Self {
            settings,
            measurements,
            gradient: vec![0.0; parameters.len()],
            moments: vec![[0.0; 2]; parameters.len()],
            parameters,
            steps: 0,
            scratch: Scratch::new(bins),
            line,
        })
    }

    /// The field as it stands.
    pub fn line(&self) -> &Line {
        &self.line
    }

    /// The settings of the fit.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Steps made so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// One step of the optimiser: render every ray, send its residuals back, move the parameters. O(samples), no
    /// allocation (`benches/radiance.rs`).
    pub fn step(&mut self) -> Report {
        let report = self.descend();
        self.steps += 1;
        let steps = self.steps;
        match self.settings.optimizer {
            Optimizer::GradientDescent { rate } => {
                for (parameter, g) in self.parameters.iter_mut().zip(&self.gradient) {
                    *parameter -= rate * g;
                }
            }
            Optimizer::Adam { rate, beta1, beta2, epsilon } => {
                let bias = [beta1, beta2].map(|beta| 1.0 - libm::pow(beta, steps as f64));
                for ((parameter, g), [m, v]) in
                    self.parameters.iter_mut().zip(&self.gradient).zip(&mut self.moments)
                {
                    *m = beta1 * *m + (1.0 - beta1) * g;
                    *v = beta2 * *v + (1.0 - beta2) * g * g;
                    *parameter -= rate * (*m / bias[0]) / (libm::sqrt(*v / bias[1]) + epsilon);
                }
            }
        }
        apply(&self.parameters, &mut self.line);
        report
    }

    /// Gradient of the objective by the parameters, at the field as it stands: `θ` of every bin, then `φ`.
    pub fn gradient(&mut self) -> &[f64] {
        self.descend();
        &self.gradient
    }

    /// Residuals of any measurements under the field as it stands: for rays that were held out.
    pub fn residuals(&mut self, measurements: &[Measurement]) -> Residuals {
        let mut sums = Sums::default();
        for m in measurements {
            let crossing = self.line.crossing(&m.ray);
            let rendered = self.scratch.render(&self.line, m, &crossing, &self.settings.far);
            sums.add(&differences(&rendered, m));
        }
        sums.residuals(measurements.len())
    }

    /// Samples rendered and differentiated in a step: the cost of one, up to a factor.
    pub fn samples_per_step(&self) -> usize {
        self.measurements.iter().map(|(_, crossing)| crossing.count).sum()
    }

    /// Bytes held by the field, the parameters, the optimiser and the scratch space.
    pub fn memory_bytes(&self) -> usize {
        fn bytes<T>(v: &Vec<T>) -> usize {
            v.capacity() * size_of::<T>()
        }
        size_of::<Self>()
            + bytes(&self.measurements)
            + bytes(&self.line.density)
            + bytes(&self.line.reflectance)
            + bytes(&self.parameters)
            + bytes(&self.gradient)
            + bytes(&self.moments)
            + bytes(&self.scratch.samples)
            + bytes(&self.scratch.passages)
            + bytes(&self.scratch.gradients)
    }

    /// Fills the gradient, reports the objective.
    fn descend(&mut self) -> Report {
        let Settings { channels, noise, prior, far, .. } = self.settings;
        let bins = self.line.bins();
        let precision = precisions(channels, &noise);
        let background = far.background();
        let (by_density, by_reflectance) = self.gradient.split_at_mut(bins);
        by_density.fill(0.0);
        by_reflectance.fill(0.0);
        let mut sums = Sums::default();
        let mut objective = 0.0;
        for (m, crossing) in &self.measurements {
            let rendered = self.scratch.render(&self.line, m, crossing, &far);
            let d = differences(&rendered, m);
            sums.add(&d);
            objective += 0.5 * (0..3).map(|c| precision[c] * d[c] * d[c]).sum::<f64>();
            let upstream =
                Upstream { depth: precision[0] * d[0], color: [precision[1] * d[1], precision[2] * d[2]] };
            for (i, g) in
                self.scratch.backward(crossing.count, &background, &rendered, &upstream).iter().enumerate()
            {
                by_density[crossing.bin(i)] += g.density;
                by_reflectance[crossing.bin(i)] += g.color[0];
            }
        }
        let (theta, phi) = self.parameters.split_at(bins);
        let density_precision = prior.density_spread.powi(-2);
        let reflectance_precision =
            if channels.reflectance() { prior.reflectance_spread.powi(-2) } else { 0.0 };
        for bin in 0..bins {
            let off = theta[bin] - prior.density_mean;
            by_density[bin] = by_density[bin] * logistic(theta[bin]) / self.line.resolution + density_precision * off;
            let c = self.line.reflectance[bin];
            by_reflectance[bin] = by_reflectance[bin] * c * (1.0 - c) + reflectance_precision * phi[bin];
            objective += 0.5 * (density_precision * off * off + reflectance_precision * phi[bin] * phi[bin]);
        }
        Report { objective, training: sums.residuals(self.measurements.len()) }
    }
}

impl Scratch {
    fn new(bins: usize) -> Self {
        let sample = Sample { density: 0.0, length: 0.0, depth: 0.0, color: [0.0; COLORS] };
        Self {
            samples: vec![sample; bins],
            passages: vec![Passage::default(); bins],
            gradients: vec![SampleGradient::ZERO; bins],
        }
    }

    fn render(&mut self, line: &Line, m: &Measurement, crossing: &Crossing, far: &Far) -> Rendered<COLORS> {
        line.sample(&m.ray, crossing, &mut self.samples);
        let count = crossing.count;
        render(&self.samples[..count], &far.background(), &mut self.passages[..count])
    }

    /// Gradients by the samples of the ray that was rendered last.
    fn backward(
        &mut self,
        count: usize,
        background: &super::ray::Background<COLORS>,
        rendered: &Rendered<COLORS>,
        upstream: &Upstream<COLORS>,
    ) -> &[SampleGradient<COLORS>] {
        let gradients = &mut self.gradients[..count];
        backward(&self.samples[..count], background, &self.passages[..count], rendered, upstream, gradients);
        gradients
    }
}

/// Sums of squared differences per channel.
#[derive(Default)]
struct Sums([f64; 3]);

impl Sums {
    fn add(&mut self, differences: &[f64; 3]) {
        for (sum, d) in self.0.iter_mut().zip(differences) {
            *sum += d * d;
        }
    }

    fn residuals(&self, count: usize) -> Residuals {
        let [depth, reflectance, second_moment] = self.0.map(|sum| libm::sqrt(sum / count.max(1) as f64));
        Residuals { depth, reflectance, second_moment }
    }
}

/// Rendered minus measured: depth, reflectance, second moment.
fn differences(rendered: &Rendered<COLORS>, m: &Measurement) -> [f64; 3] {
    [rendered.depth - m.depth, rendered.color[0] - m.reflectance, rendered.color[1] - m.second_moment]
}

/// `1 / s²` per channel, 0 for those that are not measured.
fn precisions(channels: Channels, noise: &Noise) -> [f64; 3] {
    let of = |on: bool, s: f64| if on { 1.0 / (s * s) } else { 0.0 };
    [of(true, noise.depth), of(channels.reflectance(), noise.reflectance), of(channels.spread(), noise.second_moment)]
}

/// The field that the parameters describe.
fn apply(parameters: &[f64], line: &mut Line) {
    let (theta, phi) = parameters.split_at(line.bins());
    for (density, theta) in line.density.iter_mut().zip(theta) {
        *density = softplus(*theta) / line.resolution;
    }
    for (reflectance, phi) in line.reflectance.iter_mut().zip(phi) {
        *reflectance = logistic(*phi);
    }
}
