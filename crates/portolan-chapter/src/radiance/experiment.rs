//! One run of the toy: a scene, a start, a fit, and what became of it. The named seeds show what to look for.

use super::fit::{Fit, Report, Residuals, Scratch};
use super::line::{Far, Line, LineRay};
use super::model::{Channels, Measurement};
use super::scene::Scene;
use super::settings::{FitError, Settings};
use serde::Serialize;

/// A seed worth looking at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct NamedSeed {
    /// Its name.
    pub name: &'static str,
    /// The seed.
    pub seed: u64,
    /// What it shows, with [`Experiment::default`].
    pub shows: &'static str,
}

/// A lucky start: solid matter only where there are walls. Depth alone is enough, also for rays that were
/// held out.
pub const LUCKY: NamedSeed =
    NamedSeed { name: "lucky", seed: 127, shows: "a lucky start: depth alone fits the held-out rays too" };

/// Training residuals at the noise floor, held-out residuals of a meter.
pub const AMBIGUOUS: NamedSeed = NamedSeed {
    name: "ambiguous",
    seed: 136,
    shows: "depth alone fits its own rays to the noise and is a metre wrong on held-out ones",
};

/// Density of the start stays parked in empty space under depth alone; reflectance clears it.
pub const PARKED: NamedSeed = NamedSeed {
    name: "parked",
    seed: 41,
    shows: "depth alone keeps density of the start parked in empty space; with reflectance it clears",
};

/// Two channels fit all they are shown and leave density parked between gray surfaces: a dark clump in
/// front of a bright wall has both the mean distance and the mean color that were measured.
pub const TWO_NOT_ENOUGH: NamedSeed = NamedSeed {
    name: "two-not-enough",
    seed: 175,
    shows: "between gray walls two channels do not clear it; the spread of the return does",
};

/// An opaque clump in empty space: next to nothing passes, so no channel of these rays can tell. Gradient
/// descent leaves it there; Adam, which scales small gradients up, does not.
pub const OPAQUE: NamedSeed = NamedSeed {
    name: "opaque",
    seed: 2,
    shows: "an invented opaque bin has next to no gradient in any channel, and stays",
};

/// All named seeds.
pub const NAMED_SEEDS: [NamedSeed; 5] = [LUCKY, AMBIGUOUS, PARKED, TWO_NOT_ENOUGH, OPAQUE];

/// What to run.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// The world and the rays.
    pub scene: Scene,
    /// How to fit; its channels are those given to [`Experiment::run`].
    pub settings: Settings,
    /// Steps of the optimizer.
    pub steps: usize,
}

impl Default for Experiment {
    /// The corridor, plain gradient descent, 20 000 steps: the setting of the named seeds.
    fn default() -> Self {
        Self { scene: Scene::corridor(), settings: Settings::default(), steps: 20_000 }
    }
}

/// The fit at one step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Progress {
    /// Negative logarithm of the posterior, up to a constant.
    pub objective: f64,
    /// Residuals of the rays to learn from.
    pub training: Residuals,
    /// Residuals of the rays that were held out.
    pub held_out: Residuals,
}

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The field at the start.
    pub start: Line,
    /// Measurements that were learned from.
    pub training: Vec<Measurement>,
    /// Measurements that were held out.
    pub held_out: Vec<Measurement>,
    /// Before every step, and after the last one.
    pub curve: Vec<Progress>,
    /// Most light that any training ray brought to each bin, at the start, at the end and every hundred
    /// steps.
    pub reach: Vec<f64>,
    /// The fit, with the field that it found.
    pub fit: Fit,
}

impl Experiment {
    /// Measures the scene, starts at random, fits. The same seed gives the same noise and the same start
    /// for any channels.
    ///
    /// # Errors
    /// When the settings make no sense.
    pub fn run(&self, seed: u64, channels: Channels) -> Result<Outcome, FitError> {
        self.run_from(self.scene.random_start(seed), seed, channels)
    }

    /// The same from a given field: to see whether another channel frees what one got stuck on.
    ///
    /// # Errors
    /// When the settings or the field make no sense.
    pub fn run_from(&self, start: Line, seed: u64, channels: Channels) -> Result<Outcome, FitError> {
        let settings = Settings { channels, ..self.settings };
        let (training, held_out) = self.scene.measure(&settings.noise, seed);
        let mut fit = Fit::new(start, &training, settings)?;
        let start = fit.line().clone();
        let mut reach = vec![0.0; start.bins()];
        let mut curve = Vec::with_capacity(self.steps + 1);
        for step in 0..self.steps {
            if step % 100 == 0 {
                add_reach(fit.line(), &training, &mut reach);
            }
            let of_held_out = fit.residuals(&held_out);
            let Report { objective, training } = fit.step();
            curve.push(Progress { objective, training, held_out: of_held_out });
        }
        add_reach(fit.line(), &training, &mut reach);
        let Report { objective, training: of_training } = fit.report();
        curve.push(Progress { objective, training: of_training, held_out: fit.residuals(&held_out) });
        Ok(Outcome { start, training, held_out, curve, reach, fit })
    }
}

impl Outcome {
    /// Residuals at the end.
    pub fn last(&self) -> Progress {
        self.curve[self.curve.len() - 1]
    }

    /// What was measured along every ray, and whether that was held out.
    pub fn rays(&self) -> impl Iterator<Item = (&Measurement, bool)> {
        self.training.iter().map(|m| (m, false)).chain(self.held_out.iter().map(|m| (m, true)))
    }

    /// [`Scene::misplaced`] of the field that was found.
    pub fn misplaced(&self, scene: &Scene, margin: f64) -> f64 {
        scene.misplaced(self.fit.line(), margin)
    }

    /// [`Scene::worst_bin`] of the field that was found.
    pub fn worst_bin(&self, scene: &Scene, margin: f64) -> Option<usize> {
        scene.worst_bin(self.fit.line(), margin)
    }
}

/// Transmittance along a ray at each of its samples, in the order of the ray, and behind the last one.
pub fn transmittance(line: &Line, ray: &LineRay) -> Vec<f64> {
    let crossing = line.crossing(ray);
    let mut scratch = Scratch::new(crossing.count);
    let rendered = scratch.render(line, ray, &crossing, &Far::default());
    scratch.passages.iter().map(|p| p.transmittance).chain([rendered.transmittance]).collect()
}

fn add_reach(line: &Line, training: &[Measurement], reach: &mut [f64]) {
    for m in training {
        let crossing = line.crossing(&m.ray);
        for (i, t) in transmittance(line, &m.ray).iter().take(crossing.count).enumerate() {
            let bin = crossing.bin(i);
            reach[bin] = t.max(reach[bin]);
        }
    }
}
