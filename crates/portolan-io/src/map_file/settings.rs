//! The settings of maps in the header, and the words for what they choose.

use portolan::cell::OccupancyModel;
use portolan::map::BeamSweep;
use portolan::sweep::WeightModel;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Settings of an occupancy map.
#[derive(Serialize, Deserialize)]
pub(super) struct OccupancySettings {
    #[serde(with = "Model")]
    pub(super) model: OccupancyModel,
    #[serde(flatten)]
    pub(super) more: Map<String, Value>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "OccupancyModel")]
pub(super) struct Model {
    p_hit: f64,
    p_miss: f64,
    p_min: f64,
    p_max: f64,
    p_prior: f64,
    wall_depth: Option<f64>,
}

/// Settings of a TSDF.
#[derive(Serialize, Deserialize)]
pub(super) struct TsdfSettings {
    pub(super) truncation: f64,
    /// `None`, `null` in JSON: never forget.
    pub(super) w_max: Option<f32>,
    pub(super) carve_weight: f32,
    pub(super) weights: String,
    #[serde(flatten)]
    pub(super) more: Map<String, Value>,
}

/// The name of the setting that only dense TSDFs have.
pub(super) const SWEEP: &str = "sweep";

impl TsdfSettings {
    pub(super) fn new(
        truncation: f64,
        w_max: f32,
        carve_weight: f32,
        weights: WeightModel,
        more: Map<String, Value>,
    ) -> Self {
        let w_max = Some(w_max).filter(|w| w.is_finite());
        Self { truncation, w_max, carve_weight, weights: weights_word(weights).into(), more }
    }
}

/// Settings of a map of colors.
#[derive(Serialize, Deserialize)]
pub(super) struct ColorSettings {
    pub(super) w_max: f32,
    #[serde(flatten)]
    pub(super) more: Map<String, Value>,
}

/// Settings of a map of hits per meter.
#[derive(Serialize, Deserialize)]
pub(super) struct AttenuationSettings {
    /// Scans; `None`, `null` in JSON: never forget.
    pub(super) half_life: Option<u16>,
    /// Units of length in a cell's edge.
    pub(super) length_units: u32,
    #[serde(flatten)]
    pub(super) more: Map<String, Value>,
}

/// The word for a sweep in files and on the command line.
pub fn sweep_word(sweep: BeamSweep) -> &'static str {
    match sweep {
        BeamSweep::CellCentre => "cell-centre",
        BeamSweep::March => "march",
    }
}

/// The sweep of a word; `None` for any other word.
pub fn sweep_of(word: &str) -> Option<BeamSweep> {
    [BeamSweep::CellCentre, BeamSweep::March].into_iter().find(|&s| sweep_word(s) == word)
}

/// The word for a weight model in files and on the command line.
pub fn weights_word(weights: WeightModel) -> &'static str {
    match weights {
        WeightModel::Constant => "constant",
        WeightModel::InverseSquare => "range",
        WeightModel::CosIncidence => "incidence",
        WeightModel::InverseSquareCosIncidence => "range-incidence",
    }
}

/// The weight model of a word; `None` for any other word.
pub fn weights_of(word: &str) -> Option<WeightModel> {
    use WeightModel::*;
    let all = [Constant, InverseSquare, CosIncidence, InverseSquareCosIncidence];
    all.into_iter().find(|&w| weights_word(w) == word)
}
