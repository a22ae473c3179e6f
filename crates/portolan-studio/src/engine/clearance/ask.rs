//! What the view of clearance can be asked.

use portolan::field::UnknownSpace;
use serde::Deserialize;

/// A question. All are about the map of fusion as it is now.
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
pub(in crate::engine) enum Ask {
    /// Both fields whole, the contour and the meter.
    Open {
        /// The revision that the page has drawn: where it is still the map's, the answer is only that.
        have: Option<u64>,
    },
    /// Level rings.
    Rings {
        /// Of which field.
        field: Which,
        /// From ring to ring (meters).
        spacing: f64,
    },
    /// Gradients on a raster.
    Arrows {
        /// Of which field.
        field: Which,
        /// Where: lower left, upper right (world, meters).
        bounds: [[f64; 2]; 2],
        /// From arrow to arrow (meters).
        spacing: f64,
    },
    /// Distance, bounds and gradient of both fields at a point.
    Probe {
        /// World (meters).
        at: [f64; 2],
        /// What the bounds are about.
        unknown: Unknown,
    },
    /// Where a path of straight legs is certified, and its profile.
    Path {
        /// World (meters).
        points: Vec<[f64; 2]>,
        /// Clearance that is demanded (meters): the robot's radius.
        clearance: f64,
        /// Whether unknown space is an obstacle.
        unknown: Unknown,
    },
}

/// One of the fields.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(in crate::engine) enum Which {
    /// What the filter keeps: projective distances up to the truncation.
    Truncated,
    /// Distances to the extracted surface.
    Euclidean,
    /// What of these is certified where unknown space is an obstacle.
    Pessimistic,
}

/// What unknown space is, in the page's words.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(in crate::engine) enum Unknown {
    /// No obstacle.
    Optimistic,
    /// An obstacle.
    Pessimistic,
}

impl Unknown {
    pub(super) fn space(self) -> UnknownSpace {
        match self {
            Self::Optimistic => UnknownSpace::Optimistic,
            Self::Pessimistic => UnknownSpace::Pessimistic,
        }
    }
}
