//! The header: what the writer noted, and one entry per map.

use portolan::geom::{Grid, Lattice};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::kind::{Kind, Names};

/// What the writer of a file noted about its maps; none of it is needed to read them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapHeader {
    /// Names of the fused logs, in order.
    #[serde(default)]
    pub logs: Vec<String>,
    /// Number of fused scans.
    #[serde(default)]
    pub scans: u64,
    /// Every n-th scan was kept out of fusion, for evaluation; `None`: all were fused.
    #[serde(default)]
    pub hold_out: Option<u64>,
    /// Only every n-th scan of the log was used; `None`: all.
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

/// A map as the header describes it.
#[derive(Serialize, Deserialize)]
pub(super) struct Entry {
    /// Kind of the map.
    #[serde(rename = "kind")]
    pub(super) map: String,
    /// Kind of its cells.
    cell: String,
    /// Tag of its chunks.
    pub(super) chunk: String,
    #[serde(flatten)]
    pub(super) place: Place,
    /// Settings of the kind, with those that this version does not know.
    #[serde(flatten)]
    pub(super) settings: Map<String, Value>,
}

/// Where the cells of a map are.
#[derive(Serialize, Deserialize)]
pub(super) struct Place {
    /// World position of the lower corner of cell 0 (meters).
    pub(super) origin: Vec<f64>,
    /// Edge of a cell (meters).
    pub(super) resolution: f64,
    /// Cells along each axis, of a dense map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) shape: Option<Vec<u64>>,
    /// Levels below the root, of a tree.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) depth: Option<u32>,
}

impl Entry {
    pub(super) fn new<const D: usize>(
        kind: Kind,
        place: Place,
        settings: &impl Serialize,
    ) -> serde_json::Result<Self> {
        let Names { map, cell, chunk } = kind.names::<D>();
        let settings = serde_json::from_value(serde_json::to_value(settings)?)?;
        Ok(Self { map: map.into(), cell: cell.into(), chunk: chunk.into(), place, settings })
    }
}

impl Place {
    pub(super) fn of_lattice<const D: usize>(lattice: &Lattice<D>) -> Self {
        Self { origin: lattice.origin.to_vec(), resolution: lattice.resolution, shape: None, depth: None }
    }

    pub(super) fn of_grid<const D: usize>(grid: &Grid<D>) -> Self {
        let shape = grid.shape.iter().map(|&cells| cells as u64).collect();
        Self { shape: Some(shape), ..Self::of_lattice(&grid.lattice) }
    }
}
