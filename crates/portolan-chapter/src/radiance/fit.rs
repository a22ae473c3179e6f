//! Fitting a line to measurements: the maximum of the posterior, by gradient descent through the renderer.
//!
//! `J = Σ ½ ((ẑ − z) / s_z)² + ½ ((ĉ − c) / s_c)² + prior`: the negative logarithm of likelihood times
//! prior. The optimum is a point; no posterior uncertainty has a closed form here, so none is offered.

use super::line::{COLORS, Crossing, Far, Line, LineRay};
use super::model::{Channels, Measurement, Noise, logistic, softplus, softplus_inverse};
use super::ray::{Background, Passage, Rendered, Sample, SampleGradient, Upstream, backward, render};
use super::settings::{FitError, Optimizer, Settings};
use serde::Serialize;

/// Root mean square residuals over a set of rays; 0 for no rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
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
pub(super) struct Scratch {
    pub(super) samples: Vec<Sample<COLORS>>,
    pub(super) passages: Vec<Passage>,
    gradients: Vec<SampleGradient<COLORS>>,
}

impl Fit {
    /// A fit that starts at `line`. Densities of zero start a little above it, where the parametrisation
    /// can hold them.
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

    /// What the optimizer moves: `θ` of every bin, then `φ`, as [`Prior`](super::Prior) describes them.
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// The settings of the fit.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Steps made so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// One step of the optimizer: render every ray, send its residuals back, move the parameters.
    /// O(samples), no allocation (`benches/radiance.rs`).
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

    /// Objective and residuals of the field as it stands.
    pub fn report(&mut self) -> Report {
        self.descend()
    }

    /// The measurements to learn from, and the bins that their rays cross.
    pub(super) fn measurements(&self) -> &[(Measurement, Crossing)] {
        &self.measurements
    }

    /// What the field as it stands renders along any ray.
    pub fn render(&self, ray: &LineRay) -> Rendered<COLORS> {
        let crossing = self.line.crossing(ray);
        Scratch::new(crossing.count).render(&self.line, ray, &crossing, &self.settings.far)
    }

    /// Residuals of any measurements under the field as it stands: for rays that were held out.
    pub fn residuals(&mut self, measurements: &[Measurement]) -> Residuals {
        let mut sums = Sums::default();
        for m in measurements {
            let crossing = self.line.crossing(&m.ray);
            let rendered = self.scratch.render(&self.line, &m.ray, &crossing, &self.settings.far);
            sums.add(&differences(&rendered, m));
        }
        sums.residuals(measurements.len())
    }

    /// Samples rendered and differentiated in a step: the cost of one, up to a factor.
    pub fn samples_per_step(&self) -> usize {
        self.measurements.iter().map(|(_, crossing)| crossing.count).sum()
    }

    /// Bytes held by the field, the parameters, the optimizer and the scratch space.
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
            let rendered = self.scratch.render(&self.line, &m.ray, crossing, &far);
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
        let density_precision = 1.0 / (prior.density_spread * prior.density_spread);
        let reflectance_precision = if channels.reflectance() {
            1.0 / (prior.reflectance_spread * prior.reflectance_spread)
        } else {
            0.0
        };
        for bin in 0..bins {
            let off = theta[bin] - prior.density_mean;
            by_density[bin] =
                by_density[bin] * logistic(theta[bin]) / self.line.resolution + density_precision * off;
            let c = self.line.reflectance[bin];
            by_reflectance[bin] = by_reflectance[bin] * c * (1.0 - c) + reflectance_precision * phi[bin];
            objective += 0.5 * (density_precision * off * off + reflectance_precision * phi[bin] * phi[bin]);
        }
        Report { objective, training: sums.residuals(self.measurements.len()) }
    }
}

impl Scratch {
    pub(super) fn new(bins: usize) -> Self {
        let sample = Sample { density: 0.0, length: 0.0, depth: 0.0, color: [0.0; COLORS] };
        Self {
            samples: vec![sample; bins],
            passages: vec![Passage::default(); bins],
            gradients: vec![SampleGradient::ZERO; bins],
        }
    }

    pub(super) fn render(
        &mut self,
        line: &Line,
        ray: &LineRay,
        crossing: &Crossing,
        far: &Far,
    ) -> Rendered<COLORS> {
        line.sample(ray, crossing, &mut self.samples);
        let count = crossing.count;
        render(&self.samples[..count], &far.background(), &mut self.passages[..count])
    }

    /// Gradients by the samples of the ray that was rendered last.
    pub(super) fn backward(
        &mut self,
        count: usize,
        background: &Background<COLORS>,
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
pub(super) fn differences(rendered: &Rendered<COLORS>, m: &Measurement) -> [f64; 3] {
    [rendered.depth - m.depth, rendered.color[0] - m.reflectance, rendered.color[1] - m.second_moment]
}

/// `1 / s²` per channel, 0 for those that are not measured.
pub(super) fn precisions(channels: Channels, noise: &Noise) -> [f64; 3] {
    let of = |on: bool, s: f64| if on { 1.0 / (s * s) } else { 0.0 };
    [
        of(true, noise.depth),
        of(channels.reflectance(), noise.reflectance),
        of(channels.spread(), noise.second_moment),
    ]
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

#[cfg(test)]
mod tests {
    use super::super::{Prior, Scene};
    use super::*;

    fn corridor(seed: u64, channels: Channels) -> Fit {
        let scene = Scene::corridor();
        let settings = Settings { channels, ..Settings::default() };
        let (training, _) = scene.measure(&settings.noise, seed);
        Fit::new(scene.random_start(seed), &training, settings).unwrap()
    }

    #[test]
    fn gradient_is_that_of_the_objective() {
        for (seed, channels) in
            [(1, Channels::Depth), (2, Channels::DepthReflectance), (3, Channels::DepthReflectanceSpread)]
        {
            let mut fit = corridor(seed, channels);
            let gradient = fit.gradient().to_vec();
            let largest = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
            for (i, g) in gradient.iter().enumerate() {
                let at = |h: f64| {
                    let mut moved = fit.clone();
                    moved.parameters[i] += h;
                    apply(&moved.parameters, &mut moved.line);
                    moved.report().objective
                };
                let numeric = (at(1e-4) - at(-1e-4)) / 2e-4;
                assert!((numeric - g).abs() < 1e-6 * largest, "{channels:?} parameter {i}: {numeric} {g}");
            }
        }
    }

    #[test]
    fn runs_repeat_bit_for_bit() {
        let run = |optimizer| {
            let mut fit = corridor(5, Channels::DepthReflectance);
            fit.settings.optimizer = optimizer;
            for _ in 0..200 {
                fit.step();
            }
            fit.line
        };
        for optimizer in [Optimizer::GradientDescent { rate: 1e-4 }, Optimizer::adam(0.02)] {
            assert_eq!(run(optimizer), run(optimizer));
        }
    }

    #[test]
    fn adam_lowers_the_objective_and_densities_stay_positive() {
        let mut fit = corridor(4, Channels::DepthReflectanceSpread);
        fit.settings.optimizer = Optimizer::adam(0.02);
        let before = fit.report().objective;
        for _ in 0..1000 {
            fit.step();
        }
        assert!(fit.report().objective < 0.05 * before);
        assert!(fit.line().density.iter().all(|d| *d >= 0.0));
        assert!(fit.line().reflectance.iter().all(|c| (0.0..=1.0).contains(c)));
    }

    #[test]
    fn bad_input_is_refused_and_empty_input_is_not() {
        let line = Line::uniform(0.0, 0.1, 0, 1.0, 0.5);
        assert!(matches!(Fit::new(line, &[], Settings::default()), Err(FitError::Line { .. })));
        let line = Line::uniform(0.0, 0.1, 4, 0.0, 0.0);
        let ray = LineRay { origin: f64::NAN, ascending: true };
        let m = Measurement { ray, depth: 1.0, reflectance: 0.5, second_moment: 1.0 };
        let error = Fit::new(line.clone(), &[m], Settings::default()).unwrap_err();
        assert_eq!(error, FitError::Measurement { index: 0 });
        let mut fit =
            Fit::new(line, &[], Settings { prior: Prior::default(), ..Settings::default() }).unwrap();
        assert!(fit.step().objective.is_finite());
        assert_eq!(fit.residuals(&[]), Residuals::default());
        assert!(fit.memory_bytes() > 4 * 8 * 6);
    }
}
