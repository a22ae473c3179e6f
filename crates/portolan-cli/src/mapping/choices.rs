//! Values of settings that are chosen from a list.

use portolan::map::BeamSweep;
use portolan::sweep::WeightModel;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::dimension::Dimension;

/// Maps that can be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum MapKind {
    /// Occupancy grid (2-D)
    Grid,
    /// Occupancy tree: a quadtree in 2-D, an octree in 3-D
    #[value(alias = "octree")]
    Tree,
    /// Truncated signed distance field
    Tsdf,
    /// Hits per meter: how many beams end in each cell, over the length of all
    Attenuation,
    /// Euclidean signed distance field, derived from the tsdf
    Esdf,
    /// Contour, derived from the tsdf (2-D)
    Contour,
    /// Triangle mesh, derived from the tsdf (3-D)
    Mesh,
}

impl MapKind {
    /// Its word on the command line.
    pub(crate) fn word(self) -> String {
        word(&self)
    }

    /// Whether points without rays make it.
    pub(crate) fn is_of_points(self) -> bool {
        matches!(self, Self::Tree | Self::Esdf)
    }

    /// The only dimension that it is made in; `None`: both.
    pub(crate) fn only(self) -> Option<Dimension> {
        match self {
            Self::Grid | Self::Contour => Some(Dimension::Two),
            Self::Mesh => Some(Dimension::Three),
            Self::Tree | Self::Tsdf | Self::Attenuation | Self::Esdf => None,
        }
    }
}

/// How scans become evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SweepArg {
    /// 2-D: distances at cell centers, ranges interpolated between beams
    CellCentre,
    /// 2-D: the textbook's march along beams
    March,
    /// 3-D: through rows and columns where a scan has them, or where they are found and keep its points; exact rays otherwise (summary.json says which, and why)
    Auto,
    /// 3-D: every ray is traced
    Exact,
    /// 3-D: the same as auto
    Projective,
}

impl SweepArg {
    /// The dimension whose scans it is for.
    pub(crate) fn only(self) -> Dimension {
        match self {
            Self::CellCentre | Self::March => Dimension::Two,
            Self::Auto | Self::Exact | Self::Projective => Dimension::Three,
        }
    }

    pub(super) fn usual(dimension: Dimension) -> Self {
        match dimension {
            Dimension::Two => Self::CellCentre,
            Dimension::Three => Self::Auto,
        }
    }

    /// As the library's 2-D distances have it.
    pub(super) fn beams(self) -> BeamSweep {
        if self == Self::March { BeamSweep::March } else { BeamSweep::CellCentre }
    }
}

/// Weights of beams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum WeightsArg {
    /// 1 for every beam
    #[default]
    Constant,
    /// 1 / range²
    Range,
    /// Cosine of the angle of incidence
    Incidence,
    /// Product of the last two
    RangeIncidence,
}

impl WeightsArg {
    /// Of the library's.
    pub(super) fn of(model: WeightModel) -> Self {
        match model {
            WeightModel::Constant => Self::Constant,
            WeightModel::InverseSquare => Self::Range,
            WeightModel::CosIncidence => Self::Incidence,
            WeightModel::InverseSquareCosIncidence => Self::RangeIncidence,
        }
    }

    /// As the library has it.
    pub(super) fn model(self) -> WeightModel {
        match self {
            Self::Constant => WeightModel::Constant,
            Self::Range => WeightModel::InverseSquare,
            Self::Incidence => WeightModel::CosIncidence,
            Self::RangeIncidence => WeightModel::InverseSquareCosIncidence,
        }
    }
}

/// The word of a value on the command line.
pub(super) fn word(value: &impl Serialize) -> String {
    json!(value).as_str().unwrap_or_default().to_owned()
}
