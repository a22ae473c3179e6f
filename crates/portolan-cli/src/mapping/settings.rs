//! What the maps of a run are made with.

use portolan::cell::{OccupancyModel, TsdfRule};
use portolan::geom::{Aabb, Grid};
use portolan::map::{BeamSweep, OccupancyGrid, Quadtree, Tsdf, TsdfConfig};
use portolan::scan::RangeLimits;
use portolan::sweep::WeightModel;
use portolan_io::{MapFile, sweep_word, weights_word};
use serde_json::{Map, Value, json};

use super::Maps;
use crate::esdf::EsdfArg;
use crate::json::object;
use crate::saved::check_agree;

/// Maps that can be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub(crate) enum MapKind {
    /// Occupancy grid
    Grid,
    /// Occupancy quadtree, in space octree
    #[value(alias = "octree")]
    Tree,
    /// Truncated signed distance field
    Tsdf,
    /// Euclidean signed distance field, derived from the tsdf
    Esdf,
    /// Contour, derived from the tsdf of a planar log
    Contour,
    /// Mesh, derived from the tsdf of a log of space
    Mesh,
}

/// All that decides what the maps will hold.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub(crate) resolution: f64,
    pub(crate) truncation: f64,
    pub(crate) w_max: f32,
    pub(crate) weights: WeightModel,
    pub(crate) sweep: BeamSweep,
    pub(crate) carve: bool,
    pub(crate) carve_weight: f32,
    pub(crate) limits: RangeLimits,
    pub(crate) every: Option<u64>,
    pub(crate) hold_out: Option<u64>,
    pub(crate) bounds: Option<Aabb<2>>,
    pub(crate) maps: Vec<MapKind>,
    pub(crate) esdf: EsdfArg,
}

impl Settings {
    /// Whether a map is wanted.
    pub(crate) fn wants(&self, kind: MapKind) -> bool {
        self.maps.contains(&kind)
    }

    /// Empty maps over a grid.
    pub(crate) fn empty_maps(&self, grid: &Grid<2>) -> anyhow::Result<Maps> {
        let model = OccupancyModel::default();
        let config = TsdfConfig {
            truncation: self.truncation,
            w_max: self.w_max,
            sweep: self.sweep,
            weights: self.weights,
            carve_weight: self.carve_weight,
            ..TsdfConfig::default()
        };
        let made = |kind| self.wants(kind);
        Ok(Maps {
            grid: made(MapKind::Grid).then(|| OccupancyGrid::covering(*grid, model)).transpose()?,
            tree: made(MapKind::Tree).then(|| Quadtree::covering(grid, model)).transpose()?,
            tsdf: made(MapKind::Tsdf).then(|| Tsdf::new(config.with_grid(grid))).transpose()?,
        })
    }

    /// Observations of weight 1 after which a saturated cell has lost half the error of a stale estimate.
    pub(crate) fn half_life(&self) -> f64 {
        TsdfRule { truncation: self.truncation as f32, w_max: self.w_max }.half_life(1.0)
    }

    /// How the distances forget, for people.
    pub(crate) fn forgetting(&self) -> String {
        match self.w_max.is_finite() {
            true => format!(
                "W_max {}: half of a stale distance is left after {:.2} observations",
                (100.0 * self.w_max).round() / 100.0,
                self.half_life()
            ),
            false => "W_max infinite: nothing is forgotten".to_owned(),
        }
    }

    /// The settings as they are written into files.
    pub(crate) fn to_json(&self) -> Map<String, Value> {
        let finite = |v: f64| v.is_finite().then_some(v);
        object(json!({
            "resolution": self.resolution,
            "truncation": self.truncation,
            "w_max": finite(f64::from(self.w_max)),
            "half_life": finite(self.half_life()),
            "weights": weights_word(self.weights),
            "sweep": sweep_word(self.sweep),
            "carve": self.carve,
            "carve_weight": f64::from((self.carve_weight * 1e4).round()) / 1e4,
            "min_range": self.limits.min,
            "max_range": finite(self.limits.max),
            "no_return": finite(self.limits.no_return),
            "no_return_free": self.limits.no_return_free,
            "every": self.every.unwrap_or(1),
            "hold_out": self.hold_out,
            "bounds": self.bounds.map(|b| [b.min[0], b.min[1], b.max[0], b.max[1]]),
            "maps": self.maps.iter().map(|&m| map_word(m)).collect::<Vec<_>>(),
            "esdf": self.esdf.word(),
        }))
    }

    /// Refuses to go on with a map that was made with other settings.
    pub(crate) fn check_agree(&self, file: &MapFile<2>, name: &str) -> anyhow::Result<()> {
        let (ours, theirs) = (self.to_json(), &file.header.settings);
        const SHAPING: [&str; 10] = [
            "resolution",
            "truncation",
            "w_max",
            "weights",
            "sweep",
            "carve",
            "carve_weight",
            "min_range",
            "max_range",
            "hold_out",
        ];
        check_agree(&ours, theirs, &SHAPING, name)
    }
}

/// The word for a map on the command line.
pub(crate) fn map_word(kind: MapKind) -> &'static str {
    match kind {
        MapKind::Grid => "grid",
        MapKind::Tree => "tree",
        MapKind::Tsdf => "tsdf",
        MapKind::Esdf => "esdf",
        MapKind::Contour => "contour",
        MapKind::Mesh => "mesh",
    }
}
