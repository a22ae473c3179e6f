//! What the page's sliders set.

use portolan::map::{CARVE_WEIGHT, TsdfConfig, W_MAX};
use portolan_io::{sweep_of, sweep_word, weights_of, weights_word};
use serde::{Deserialize, Serialize};

use crate::engine::Refusal;
use crate::engine::recipe::within;

/// How scans are made and fused.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub(in crate::engine) struct Settings {
    /// Edge of a cell (meters).
    pub(in crate::engine) resolution: f64,
    /// Truncation (meters).
    pub(in crate::engine) truncation: f64,
    /// Clamp of the weight; `null`: never forget.
    pub(in crate::engine) w_max: Option<f64>,
    /// Standard deviation of simulated ranges (meters); does nothing to recorded logs.
    pub(in crate::engine) noise: f64,
    /// Whether free space is fused, too.
    pub(in crate::engine) carve: bool,
    /// What an observation of free space weighs.
    pub(in crate::engine) carve_weight: f64,
    /// Word of the weight model.
    pub(in crate::engine) weights: String,
    /// Word of the sweep.
    pub(in crate::engine) sweep: String,
}

impl Settings {
    /// Those that `map` has, so that the same log gives the same map.
    pub(super) fn of_log() -> Self {
        let carve_weight = (1e4 * f64::from(CARVE_WEIGHT)).round() / 1e4;
        Self { carve_weight, w_max: Some(W_MAX.into()), ..Self::default() }
    }
}

impl Default for Settings {
    /// The textbook's, with the default sweep.
    fn default() -> Self {
        let config = TsdfConfig::<2>::textbook();
        Self {
            resolution: config.resolution,
            truncation: config.truncation,
            w_max: Some(config.w_max.into()),
            noise: portolan_sim::Lidar::default().noise,
            carve: true,
            carve_weight: config.carve_weight.into(),
            weights: weights_word(config.weights).into(),
            sweep: sweep_word(config.beams).into(),
        }
    }
}

impl Settings {
    /// As the map takes them, without cells.
    ///
    /// # Errors
    /// Names the setting that is out of its range.
    pub(in crate::engine) fn config(&self) -> Result<TsdfConfig<2>, Refusal> {
        let resolution = within("resolution", self.resolution, 0.01, 1.0)?;
        let truncation = within("truncation", self.truncation, resolution, 10.0)?;
        within("noise", self.noise, 0.0, 0.5)?;
        let carve_weight = within("carve_weight", self.carve_weight, 0.01, 1.0)?;
        let w_max = self.w_max.map_or(Ok(f64::INFINITY), |w| within("w_max", w, 0.5, 1e6))?;
        let unknown = |what: &str, word: &str| Refusal::new(format!("there is no {what} \"{word}\""));
        Ok(TsdfConfig {
            resolution,
            truncation,
            w_max: w_max as f32,
            carve_weight: carve_weight as f32,
            carve: self.carve,
            beams: sweep_of(&self.sweep).ok_or_else(|| unknown("sweep", &self.sweep))?,
            weights: weights_of(&self.weights).ok_or_else(|| unknown("weight model", &self.weights))?,
            ..TsdfConfig::textbook()
        })
    }
}
