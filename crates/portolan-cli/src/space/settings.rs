//! What the maps of a run in space are made with.

use portolan::cell::{OccupancyModel, TsdfRule};
use portolan::geom::{Aabb, Lattice};
use portolan::map::{Occupancy, PointSweep, Tsdf3, TsdfConfig};
use portolan::scan::{Body, FrameFilter};
use portolan::sweep::{LONGEST_RAY_CELLS, WeightModel};
use portolan_io::weights_word;
use serde_json::{Map, Value, json};

use super::SpaceMaps;
use crate::esdf::EsdfArg;
use crate::json::object;
use crate::mapping::{MapKind, map_word};
use crate::saved::check_agree;

/// All that decides what the maps will hold.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub(crate) resolution: f64,
    pub(crate) truncation: f64,
    pub(crate) w_max: f32,
    pub(crate) weights: WeightModel,
    pub(crate) sweep: OccupancySweep,
    pub(crate) carve: bool,
    pub(crate) carve_weight: f32,
    pub(crate) color: bool,
    pub(crate) filter: FrameFilter,
    pub(crate) every: Option<u64>,
    pub(crate) hold_out: Option<u64>,
    pub(crate) bounds: Option<Aabb<3>>,
    pub(crate) max_distance: f64,
    pub(crate) maps: Vec<MapKind>,
    pub(crate) esdf: EsdfArg,
}

impl Settings {
    /// Whether a map is wanted.
    pub(crate) fn wants(&self, kind: MapKind) -> bool {
        self.maps.contains(&kind)
    }

    /// Settings of the distance field, about a lattice's origin.
    pub(crate) fn tsdf_config(&self, origin: [f64; 3]) -> TsdfConfig {
        TsdfConfig {
            resolution: self.resolution,
            origin,
            truncation: self.truncation,
            w_max: self.w_max,
            weights: self.weights,
            carve: self.carve,
            carve_weight: self.carve_weight,
            color: self.color,
            sweep: match self.sweep {
                OccupancySweep::Exact => PointSweep::Rays,
                _ => PointSweep::Projective,
            },
            // What is beyond the caller's limit is cut before; the map's own is as far as it reaches.
            max_range: LONGEST_RAY_CELLS * self.resolution - self.truncation,
            ..TsdfConfig::default()
        }
    }

    /// Empty maps about a lattice's origin.
    pub(crate) fn empty_maps(&self, origin: [f64; 3]) -> anyhow::Result<SpaceMaps> {
        let lattice = Lattice::new(origin, self.resolution);
        let occupancy =
            self.wants(MapKind::Tree).then(|| Occupancy::new(lattice, OccupancyModel::default(), self.sweep));
        let tsdf = self.wants(MapKind::Tsdf).then(|| Tsdf3::new(self.tsdf_config(origin)));
        Ok(SpaceMaps { occupancy: occupancy.transpose()?, tsdf: tsdf.transpose()? })
    }

    /// Observations of weight 1 after which a saturated cell has lost half the error of a stale estimate.
    pub(crate) fn half_life(&self) -> f64 {
        TsdfRule { truncation: self.truncation as f32, w_max: self.w_max }.half_life(1.0)
    }

    /// The settings as they are written into files.
    pub(crate) fn to_json(&self) -> Map<String, Value> {
        let finite = |v: f64| v.is_finite().then_some(v);
        let bodies = self.filter.body.iter().map(|b| match b {
            Body::Box(b) => json!([b.min, b.max].concat()),
            Body::Sphere { center: [x, y, z], radius } => json!([x, y, z, radius]),
        });
        object(json!({
            "resolution": self.resolution,
            "truncation": self.truncation,
            "w_max": finite(f64::from(self.w_max)),
            "half_life": finite(self.half_life()),
            "weights": weights_word(self.weights),
            "sweep": sweep_word(self.sweep),
            "carve": self.carve,
            "carve_weight": f64::from((self.carve_weight * 1e4).round()) / 1e4,
            "color": self.color,
            "min_range": self.filter.min_range,
            "max_range": finite(self.filter.max_range),
            "self_filter": bodies.collect::<Vec<_>>(),
            "every": self.every.unwrap_or(1),
            "hold_out": self.hold_out,
            "bounds": self.bounds.map(|b| [b.min, b.max].concat()),
            "max_distance": self.max_distance,
            "maps": self.maps.iter().map(|&m| map_word(m)).collect::<Vec<_>>(),
            "esdf": self.esdf.word(),
        }))
    }

    /// Refuses to go on with a map that was made with other settings.
    pub(crate) fn check_agree(&self, theirs: &Map<String, Value>, name: &str) -> anyhow::Result<()> {
        let ours = self.to_json();
        const SHAPING: [&str; 12] = [
            "resolution",
            "truncation",
            "w_max",
            "weights",
            "sweep",
            "carve",
            "carve_weight",
            "color",
            "min_range",
            "max_range",
            "self_filter",
            "hold_out",
        ];
        check_agree(&ours, theirs, &SHAPING, name)
    }
}

/// The word for a sweep in files and on the command line.
pub(crate) fn sweep_word(sweep: OccupancySweep) -> &'static str {
    match sweep {
        OccupancySweep::Auto => "auto",
        OccupancySweep::Exact => "exact",
        OccupancySweep::Projective => "projective",
    }
}

/// The sweep of a word.
pub(crate) fn sweep_of(word: &str) -> Option<OccupancySweep> {
    let all = [OccupancySweep::Auto, OccupancySweep::Exact, OccupancySweep::Projective];
    all.into_iter().find(|&s| sweep_word(s) == word)
}
