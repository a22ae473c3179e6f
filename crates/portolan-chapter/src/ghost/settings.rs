//! How the experiment is done: the maps, the laps, and the chair's place.

use portolan::geom::Aabb;
use portolan::map::{BeamSweep, TsdfConfig};
use portolan::sweep::WeightModel;
use portolan_sim::{LapConfig, World};

/// How the experiment is done.
#[derive(Clone, Debug, PartialEq)]
pub struct GhostSettings {
    /// Clamps of the weight, one run each.
    pub w_max: Vec<f32>,
    /// Edge of a cell (meters).
    pub resolution: f64,
    /// Truncation (meters).
    pub truncation: f64,
    /// How scans become observations.
    pub sweep: BeamSweep,
    /// How much each beam is trusted.
    pub weights: WeightModel,
    /// Weight of free space against a surface's 1.
    pub carve_weight: f32,
    /// One lap.
    pub lap: LapConfig,
    /// After so many laps the chair moves, saturated or not.
    pub max_laps_before: usize,
    /// The run ends after so many laps with the moved chair, at the latest.
    pub max_laps_after: usize,
    /// The run goes on until every measured cell was re-observed for so many predicted half-lives.
    pub half_lives: f64,
    /// Laps of a world in which nothing moves over which the noise of the map is measured, after half as many to
    /// forget the beginning; 0 or 1: not measured.
    pub noise_laps: usize,
}

impl Default for GhostSettings {
    /// The chapter's map (5 cm, tau 15 cm), `W_max` of 4, 24 and 64, four laps, three half-lives.
    fn default() -> Self {
        Self {
            w_max: vec![4.0, 24.0, 64.0],
            resolution: 0.05,
            truncation: 0.15,
            sweep: BeamSweep::default(),
            weights: WeightModel::default(),
            carve_weight: 1.0,
            lap: LapConfig::default(),
            max_laps_before: 4,
            max_laps_after: 16,
            half_lives: 3.0,
            noise_laps: 16,
        }
    }
}

pub(super) fn map_config(settings: &GhostSettings, w_max: f32) -> TsdfConfig<2> {
    TsdfConfig {
        w_max,
        truncation: settings.truncation,
        beams: settings.sweep,
        weights: settings.weights,
        carve_weight: settings.carve_weight,
        ..TsdfConfig::textbook()
    }
}

/// The `k`-th lap: each has noise of its own.
pub(super) fn lap_config(settings: &GhostSettings, k: usize) -> LapConfig {
    LapConfig { first_index: settings.lap.first_index + (k * settings.lap.scans) as u64, ..settings.lap }
}

/// Where the chair of a world stands.
pub fn chair(world: &World) -> Aabb<2> {
    world.solids().iter().filter(|s| s.name == "chair").fold(Aabb::EMPTY, |b, s| b.union(s.aabb()))
}
