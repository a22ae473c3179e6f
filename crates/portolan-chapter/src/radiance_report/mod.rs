//! One seed fitted with several sets of channels: as text, as JSON, as pictures.

mod document;
mod pictures;
mod text;

use crate::gallery::Clock;
use crate::radiance::{Channels, Experiment, FitError, NAMED_SEEDS, NamedSeed, Outcome, Terms};
use serde_json::Value;
use std::path::Path;

/// Surfaces nearer than this do not count as empty space (meters).
const MARGIN: f64 = 0.3;
/// Steps into the second channel after which its terms are shown.
const BEGUN: usize = 500;

/// A seed and, where it has one, its name.
#[derive(Clone, Copy, Debug)]
pub struct Seed {
    /// The number.
    pub value: u64,
    /// What it shows, where it is one that is worth seeing.
    pub named: Option<NamedSeed>,
}

impl Seed {
    /// A seed of this number.
    pub fn of(value: u64) -> Self {
        Self { value, named: NAMED_SEEDS.iter().find(|named| named.seed == value).copied() }
    }
}

/// One fit, and how long it took.
#[derive(Debug)]
struct Run {
    channels: Channels,
    outcome: Outcome,
    seconds: f64,
}

/// Why depth alone keeps the density that it parked, and what the second channel does about it.
#[derive(Debug)]
struct Explanation {
    /// The bin with most density in empty space under depth alone.
    bin: usize,
    /// Its gradient where depth alone ended.
    stuck: Vec<Terms>,
    /// Its gradient a little later, with reflectance in the likelihood.
    begun: Vec<Terms>,
}

/// The fits of one seed, side by side.
#[derive(Debug)]
pub struct Comparison {
    experiment: Experiment,
    seed: Seed,
    runs: Vec<Run>,
    explanation: Option<Explanation>,
}

impl Comparison {
    /// Fits the scene of an experiment once for each set of channels.
    ///
    /// # Errors
    /// When the settings make no sense.
    pub fn new(
        experiment: Experiment,
        seed: Seed,
        channels: &[Channels],
        clock: &mut Clock<'_>,
    ) -> Result<Self, FitError> {
        let mut runs = Vec::new();
        for &channels in channels {
            let begin = clock();
            let outcome = experiment.run(seed.value, channels)?;
            runs.push(Run { channels, outcome, seconds: clock() - begin });
        }
        let explanation = explain(&experiment, seed.value, &runs)?;
        Ok(Self { experiment, seed, runs, explanation })
    }

    /// Names and bytes of all pictures and of `radiance.json`, which has no times: the same bytes for the same seed.
    ///
    /// # Errors
    /// Where the numbers cannot be written as JSON.
    pub fn files(&self) -> serde_json::Result<Vec<(&'static str, Vec<u8>)>> {
        Ok(vec![
            ("density.png", pictures::density(self)),
            ("transmittance.png", pictures::transmittance(self)),
            ("rays.png", pictures::rays(self)),
            ("residuals.png", pictures::residuals(self)),
            ("bias.png", pictures::bias(&self.experiment)),
            ("radiance.json", document::full(self)?),
        ])
    }

    /// The results without the long lists, with times, and where the files are.
    pub fn summary(&self, out: &Path, files: &[&str]) -> Value {
        document::summary(self, out, files)
    }

    /// The results for people: a table of the fits, and why the worst bin stays or goes.
    pub fn text(&self) -> String {
        text::report(self)
    }
}

/// The terms of the worst bin of the fit by depth alone; `None` when that was not run.
fn explain(experiment: &Experiment, seed: u64, runs: &[Run]) -> Result<Option<Explanation>, FitError> {
    let Some(stuck) = runs.iter().find(|run| run.channels == Channels::Depth) else { return Ok(None) };
    let Some(bin) = stuck.outcome.worst_bin(&experiment.scene, MARGIN) else { return Ok(None) };
    let start = stuck.outcome.fit.line().clone();
    let begun = Experiment { steps: BEGUN, ..experiment.clone() };
    let begun = begun.run_from(start, seed, Channels::DepthReflectance)?;
    let explanation =
        Explanation { bin, stuck: stuck.outcome.fit.explain(bin), begun: begun.fit.explain(bin) };
    Ok(Some(explanation))
}

/// Name of a set of channels, as on the command line.
fn name(channels: Channels) -> &'static str {
    match channels {
        Channels::Depth => "depth",
        Channels::DepthReflectance => "depth-reflectance",
        Channels::DepthReflectanceSpread => "depth-reflectance-spread",
    }
}

/// The same in words.
fn title(channels: Channels) -> &'static str {
    match channels {
        Channels::Depth => "depth alone",
        Channels::DepthReflectance => "depth and reflectance",
        Channels::DepthReflectanceSpread => "depth, reflectance and spread",
    }
}
