//! The header: what the maps are, and what the writer says about them.

use portolan::cell::OccupancyModel;
use portolan::geom::Grid;
use portolan::map::BeamSweep;
use portolan::sweep::WeightModel;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// What the writer of a map says about it, in its own words: nothing here is needed to read the maps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapHeader {
    /// Names of the logs that were fused, in order.
    #[serde(default)]
    pub logs: Vec<String>,
    /// Scans that were fused.
    #[serde(default)]
    pub scans: u64,
    /// Every so many-th scan was left out of fusion, for evaluation.
    #[serde(default)]
    pub hold_out: Option<u64>,
    /// Only every so many-th scan of the log was looked at.
    #[serde(default)]
    pub every: Option<u64>,
    /// How the maps were made.
    #[serde(default)]
    pub settings: Map<String, Value>,
    /// Counts of beams and scans.
    #[serde(default)]
    pub statistics: Map<String, Value>,
    /// Everything else.
    #[serde(flatten)]
    pub more: Map<String, Value>,
}

/// Place and shape of a dense map.
#[derive(Serialize, Deserialize)]
pub(super) struct Place {
    pub(super) origin: [f64; 2],
    pub(super) resolution: f64,
    pub(super) shape: [u64; 2],
}

#[derive(Serialize, Deserialize)]
pub(super) struct Model {
    p_hit: f64,
    p_miss: f64,
    p_min: f64,
    p_max: f64,
    p_prior: f64,
    wall_depth: Option<f64>,
}

/// The maps that this program knows, as the header describes them.
#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub(super) enum Entry {
    OccupancyGrid {
        cell: String,
        chunk: String,
        #[serde(flatten)]
        place: Place,
        model: Model,
    },
    Quadtree {
        cell: String,
        chunk: String,
        origin: [f64; 2],
        resolution: f64,
        depth: u32,
        model: Model,
    },
    Tsdf {
        cell: String,
        chunk: String,
        #[serde(flatten)]
        place: Place,
        truncation: f64,
        /// `null`: never forget.
        w_max: Option<f32>,
        carve_weight: f32,
        sweep: String,
        weights: String,
    },
}

pub(super) const LOG_ODDS: &str = "log-odds-i8";
pub(super) const SIGNED_DISTANCE: &str = "signed-distance-f32";

impl Place {
    pub(super) fn of(grid: &Grid<2>) -> Self {
        let Grid { lattice, shape } = grid;
        Self { origin: lattice.origin, resolution: lattice.resolution, shape: shape.map(|s| s as u64) }
    }
}

impl Model {
    pub(super) fn of(model: &OccupancyModel) -> Self {
        let OccupancyModel { p_hit, p_miss, p_min, p_max, p_prior, wall_depth } = *model;
        Self { p_hit, p_miss, p_min, p_max, p_prior, wall_depth }
    }

    pub(super) fn model(&self) -> OccupancyModel {
        let Self { p_hit, p_miss, p_min, p_max, p_prior, wall_depth } = *self;
        OccupancyModel { p_hit, p_miss, p_min, p_max, p_prior, wall_depth }
    }
}

/// The word for a sweep in files and on the command line.
pub fn sweep_word(sweep: BeamSweep) -> &'static str {
    match sweep {
        BeamSweep::CellCentre => "cell-centre",
        BeamSweep::March => "march",
    }
}

/// The sweep of a word.
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

/// The weight model of a word.
pub fn weights_of(word: &str) -> Option<WeightModel> {
    use WeightModel::*;
    let all = [Constant, InverseSquare, CosIncidence, InverseSquareCosIncidence];
    all.into_iter().find(|&w| weights_word(w) == word)
}
