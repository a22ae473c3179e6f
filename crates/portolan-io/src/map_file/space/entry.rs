//! How the header describes maps of space.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::super::header::{LOG_ODDS, Model, SIGNED_DISTANCE};
use super::super::weights_word;
use super::{ColorBricks, OccupancyBricks, TsdfBricks};
use portolan::geom::Lattice;
use portolan::store::Store;

/// The maps of space that this program knows.
#[derive(Serialize, Deserialize)]
#[serde(tag = "kind")]
pub(super) enum Entry {
    #[serde(rename = "occupancy-bricks")]
    Occupancy {
        cell: String,
        chunk: String,
        #[serde(flatten)]
        place: Place,
        model: Model,
        #[serde(flatten)]
        more: Map<String, Value>,
    },
    #[serde(rename = "tsdf-bricks")]
    Tsdf {
        cell: String,
        chunk: String,
        #[serde(flatten)]
        place: Place,
        truncation: f64,
        /// `null`: never forget.
        w_max: Option<f32>,
        carve_weight: f32,
        weights: String,
        #[serde(flatten)]
        more: Map<String, Value>,
    },
    #[serde(rename = "color-bricks")]
    Color {
        cell: String,
        chunk: String,
        #[serde(flatten)]
        place: Place,
        w_max: f32,
        #[serde(flatten)]
        more: Map<String, Value>,
    },
}

/// Where the cells of bricks are.
#[derive(Serialize, Deserialize)]
pub(super) struct Place {
    pub(super) origin: [f64; 3],
    pub(super) resolution: f64,
}

impl Place {
    fn of(lattice: &Lattice<3>) -> Self {
        Self { origin: lattice.origin, resolution: lattice.resolution }
    }
}

/// Kind of the cells of a kind of map; `None`: this program does not know it.
pub(super) fn cell_of(kind: &str) -> Option<&'static str> {
    Some(match kind {
        "occupancy-bricks" => LOG_ODDS,
        "tsdf-bricks" => SIGNED_DISTANCE,
        "color-bricks" => COLOR,
        _ => return None,
    })
}

const COLOR: &str = "color-u16";

impl Entry {
    pub(super) fn of_occupancy(map: &OccupancyBricks) -> Self {
        Self::Occupancy {
            cell: LOG_ODDS.into(),
            chunk: "OBRICKS".into(),
            place: Place::of(map.store.lattice()),
            model: Model::of(&map.model),
            more: map.more.clone(),
        }
    }

    pub(super) fn of_tsdf(map: &TsdfBricks) -> Self {
        Self::Tsdf {
            cell: SIGNED_DISTANCE.into(),
            chunk: "TBRICKS".into(),
            place: Place::of(map.store.lattice()),
            truncation: map.truncation,
            w_max: map.w_max.is_finite().then_some(map.w_max),
            carve_weight: map.carve_weight,
            weights: weights_word(map.weights).into(),
            more: map.more.clone(),
        }
    }

    pub(super) fn of_colors(map: &ColorBricks) -> Self {
        Self::Color {
            cell: COLOR.into(),
            chunk: "CBRICKS".into(),
            place: Place::of(map.store.lattice()),
            w_max: map.w_max,
            more: map.more.clone(),
        }
    }
}
