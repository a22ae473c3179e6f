//! Settings of a truncated signed distance field.

use super::MapError;
use crate::cell::{TsdfRule, TsdfRuleError};
use crate::sweep::{LONGEST_RAY_CELLS, ProjectiveSettings, WeightModel};

/// How beams without rows and columns become observations of cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BeamSweep {
    /// At cell centers, with the range interpolated between neighboring beams.
    #[default]
    CellCentre,
    /// The textbook's march along every beam; puts surfaces about a quarter of a cell too far away.
    March,
}

/// How a 3-D scan of points becomes observations of cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointSweep {
    /// By its rows and columns where it has them, else ray by ray.
    #[default]
    Projective,
    /// Always ray by ray.
    Rays,
}

/// Default weight of free space against a surface's 1. On real logs, full of table legs, surfaces that weigh as much as the
/// beams that pass beside them are carved away (held-out ranges within two cells at 5 cm cells, Intel Research Lab and
/// Freiburg 079: 85.4 and 75.8 %, with a weight of 1 82.1 and 67.4 %). What has gone fades as fast with any weight.
pub const CARVE_WEIGHT: f32 = 0.2;

/// Default clamp of the weight of signed distances: half of a stale distance is left after 89 observations.
pub const W_MAX: f32 = 128.0;

/// Settings of a [`Tsdf`](super::Tsdf), in 2-D and 3-D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TsdfConfig<const D: usize> {
    /// Edge of a cell (meters).
    pub resolution: f64,
    /// Lower corner of cell 0 (world, meters): near to the map, and a multiple of the resolution, so that the lattices of
    /// two maps coincide.
    pub origin: [f64; D],
    /// Truncation tau (meters): two to four cells, and less than half of the thinnest wall that is seen from both sides.
    pub truncation: f64,
    /// Clamp of the weight, in observations: of a stale distance half is left after `ln 2 / ln(1 + 1 / W_max)` of them,
    /// whatever they weigh up to 1 ([`TsdfRule::half_life`]). Infinity: never forget.
    pub w_max: f32,
    /// Whether the free space up to the surfaces is fused too. It costs memory and time, and buys the difference between
    /// free and unknown, and that what has gone disappears.
    pub carve: bool,
    /// Weight of an observation of free space beyond the truncation, times that of its ray. The textbook's is 1. With
    /// less, what was seen of a surface counts for more than that beams passed near it: thin things survive. What has gone
    /// fades as fast as with 1.
    pub carve_weight: f32,
    /// How much each ray is trusted. Behind a surface the weight falls linearly to 0 at the truncation.
    pub weights: WeightModel,
    /// How beams become observations.
    pub beams: BeamSweep,
    /// How 3-D scans of points become observations.
    pub points: PointSweep,
    /// Surfaces of images and points nearer than this are not used (meters along the ray). Beams are limited when their
    /// scan is made ([`crate::scan::RangeLimits`]).
    pub min_range: f64,
    /// Surfaces of images and points farther than this are not used, but the space up to there is free (meters along the
    /// ray).
    pub max_range: f64,
    /// Whether colors are fused beside distances, where scans have them.
    pub color: bool,
    /// Clamp of a color's weight, at most 255.
    pub color_w_max: f32,
}

impl<const D: usize> Default for TsdfConfig<D> {
    /// Cells of 5 cm, tau three cells, with carving at [`CARVE_WEIGHT`], clamp [`W_MAX`].
    fn default() -> Self {
        Self {
            resolution: 0.05,
            origin: [0.0; D],
            truncation: 0.15,
            w_max: W_MAX,
            carve: true,
            carve_weight: CARVE_WEIGHT,
            weights: WeightModel::default(),
            beams: BeamSweep::default(),
            points: PointSweep::default(),
            min_range: 0.0,
            max_range: 100.0,
            color: false,
            color_w_max: 64.0,
        }
    }
}

impl<const D: usize> TsdfConfig<D> {
    /// The default with the textbook's weights: free space weighs 1, as a surface does, and `W_max` is 64.
    pub fn textbook() -> Self {
        Self { w_max: 64.0, carve_weight: 1.0, ..Self::default() }
    }

    /// The filter, if all settings are possible.
    pub(crate) fn rule(&self) -> Result<TsdfRule, MapError> {
        let rule = TsdfRule { truncation: self.truncation as f32, w_max: self.w_max };
        rule.validate()?;
        if !(self.carve_weight > 0.0 && self.carve_weight <= 1.0) {
            return Err(MapError::CarveWeight(self.carve_weight));
        }
        if !(self.color_w_max > 0.0) {
            return Err(TsdfRuleError::WeightClamp(self.color_w_max).into());
        }
        let most = LONGEST_RAY_CELLS * self.resolution;
        let (min, max) = (self.min_range, self.max_range);
        if !(min >= 0.0 && max > min && max + self.truncation <= most) {
            return Err(MapError::Ranges { min, max, most });
        }
        Ok(rule)
    }

    /// The weight of free space that sweeps give; 0: none.
    pub(super) fn free_weight(&self) -> f32 {
        if self.carve { self.carve_weight } else { 0.0 }
    }

    /// What the sweeps of images and points need.
    pub(super) fn projective(&self) -> ProjectiveSettings {
        ProjectiveSettings {
            truncation: self.truncation,
            carve_weight: self.free_weight(),
            weights: self.weights,
            min_range: self.min_range,
            max_range: self.max_range,
            color: self.color,
        }
    }
}
