//! What maps a mapper makes, and how.

use crate::cell::{AttenuationRule, OccupancyModel, TsdfRule};
use crate::geom::Aabb;
use crate::map::{BeamSweep, CARVE_WEIGHT, MapError, PointSweep, TsdfConfig, W_MAX};
use crate::sweep::{LONGEST_RAY_CELLS, OccupancySweep, WeightModel};

/// Share of the beams through a cell that says that something stands there: on real logs the least that keeps table legs and
/// poles without calling grazed floor an obstacle.
pub const THIN: f64 = 0.145;

/// Settings of a [`Mapper`](super::Mapper).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapperSettings<const D: usize> {
    /// Edge of a cell (meters).
    pub resolution: f64,
    /// Lower corner of cell 0 (world, meters). `None`: zero, or where the first scan is far from zero (a million cells) the
    /// multiple of the resolution next to its sensor.
    pub origin: Option<[f64; D]>,
    /// Truncation of the signed distances (meters); `None`: three cells.
    pub truncation: Option<f64>,
    /// Clamp of the weight of signed distances, in observations ([`TsdfConfig::w_max`]). Infinity: never forget.
    pub w_max: f32,
    /// Whether free space goes into the signed distances. Without it is unknown there.
    pub carve: bool,
    /// Weight of free space against a surface's 1.
    pub carve_weight: f32,
    /// How much each beam is trusted.
    pub weights: WeightModel,
    /// How beams become signed distances.
    pub beams: BeamSweep,
    /// Whether 3-D scans of points and images are always followed ray by ray, which is slower.
    pub exact: bool,
    /// The occupancy map to make; `None`: no such map.
    pub occupancy: Option<OccupancyModel>,
    /// The map of hits per meter to make, and how it forgets; `None`: no such map.
    pub attenuation: Option<AttenuationRule>,
    /// Whether signed distances are made: surface and Euclidean distances are derived from them.
    pub distances: bool,
    /// Whether colors are fused beside distances, where scans have them.
    pub color: bool,
    /// Only cells in this box (world, meters) are changed; `None`: everywhere.
    pub bounds: Option<Aabb<D>>,
    /// Bytes that the maps may take together.
    pub memory: usize,
    /// Euclidean distances are kept up to here (meters).
    pub max_distance: f64,
    /// Share of the beams through a cell that must end in it for the cell to be an obstacle of Euclidean distances without
    /// being surface; whatever is more likely occupied than not is one, too. 0: the surface alone is an obstacle.
    pub thin: f64,
}

/// Counts forget as the filter of distances does with the clamp [`W_MAX`].
fn usual_attenuation() -> AttenuationRule {
    AttenuationRule::of_half_life(TsdfRule { truncation: 1.0, w_max: W_MAX }.half_life(1.0))
}

impl<const D: usize> MapperSettings<D> {
    /// All maps with cells of this edge (meters): truncation three cells, free space at [`CARVE_WEIGHT`], clamp [`W_MAX`],
    /// Euclidean distances up to a meter, no limit of memory.
    pub fn new(resolution: f64) -> Self {
        Self {
            resolution,
            origin: None,
            truncation: None,
            w_max: W_MAX,
            carve: true,
            carve_weight: CARVE_WEIGHT,
            weights: WeightModel::default(),
            beams: BeamSweep::default(),
            exact: false,
            occupancy: Some(OccupancyModel::default()),
            attenuation: Some(usual_attenuation()),
            distances: true,
            color: false,
            bounds: None,
            memory: usize::MAX,
            max_distance: 1.0,
            thin: THIN,
        }
    }

    /// The truncation in meters.
    pub fn truncation(&self) -> f64 {
        self.truncation.unwrap_or_else(|| {
            // Without the rounding error that would show in every file (0.15000000000000002).
            let exact = 3.0 * self.resolution;
            format!("{exact:.9e}").parse().unwrap_or(exact)
        })
    }

    /// What the maps do not check themselves.
    pub(crate) fn check(&self) -> Result<(), MapError> {
        let possible = self.max_distance > 0.0 && self.max_distance.is_finite();
        if possible { Ok(()) } else { Err(MapError::MaxDistance(self.max_distance)) }
    }

    /// Settings of the signed distances, on a lattice with this origin.
    pub fn tsdf(&self, origin: [f64; D]) -> TsdfConfig<D> {
        let truncation = self.truncation();
        TsdfConfig {
            resolution: self.resolution,
            origin,
            truncation,
            w_max: self.w_max,
            carve: self.carve,
            carve_weight: self.carve_weight,
            weights: self.weights,
            beams: self.beams,
            points: if self.exact { PointSweep::Rays } else { PointSweep::Projective },
            min_range: 0.0,
            // Scans are limited when they are made; the map's own limit is as far as it reaches.
            max_range: LONGEST_RAY_CELLS * self.resolution - truncation,
            color: self.color,
            ..TsdfConfig::default()
        }
    }

    /// With the filter of signed distances that are there already.
    pub(super) fn with_filter(self, config: &TsdfConfig<D>) -> Self {
        let TsdfConfig { resolution, truncation, w_max, carve_weight, weights, .. } = *config;
        Self { resolution, truncation: Some(truncation), w_max, carve_weight, weights, ..self }
    }

    /// How the maps of occupancy and of hits per meter read 3-D scans.
    pub fn occupancy_sweep(&self) -> OccupancySweep {
        if self.exact { OccupancySweep::Exact } else { OccupancySweep::Auto }
    }

    /// The origin of the lattice, where the first scan was taken at `first` (world, meters).
    pub fn origin_near(&self, first: [f64; D]) -> [f64; D] {
        const FAR_CELLS: f64 = 1e6;
        let r = self.resolution;
        let near = |v: f64| if (v / r).abs() < FAR_CELLS { 0.0 } else { (v / r).round() * r };
        self.origin.unwrap_or(first.map(near))
    }
}
