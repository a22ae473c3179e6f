//! The kinds of maps that this version reads and writes.

use serde_json::Value;

/// A kind of map: a kind of store and a kind of cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Grid,
    Tree,
    Tsdf,
    OccupancyBricks,
    TsdfBricks,
    ColorBricks,
    Attenuation,
}

/// The names of a kind in a file.
pub(super) struct Names {
    /// The map, in the header.
    pub(super) map: &'static str,
    /// Its cells, in the header.
    pub(super) cell: &'static str,
    /// The tag under which its chunks are written.
    pub(super) chunk: &'static str,
}

impl Kind {
    const ALL: [Self; 7] = [
        Self::Grid,
        Self::Tree,
        Self::Tsdf,
        Self::OccupancyBricks,
        Self::TsdfBricks,
        Self::ColorBricks,
        Self::Attenuation,
    ];

    /// The kind of an entry of the header; `None`: this version does not read it.
    pub(super) fn of<const D: usize>(entry: &Value) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| {
            let names = kind.names::<D>();
            entry["kind"] == names.map && entry["cell"] == names.cell
        })
    }

    pub(super) fn names<const D: usize>(self) -> Names {
        let (map, cell, chunk) = match self {
            Self::Grid => ("occupancy-grid", "log-odds-i8", "GRID"),
            Self::Tree => (if D == 2 { "quadtree" } else { "octree" }, "log-odds-i8", "TREE"),
            Self::Tsdf => ("tsdf", "signed-distance-f32", "TSDF"),
            Self::OccupancyBricks => ("occupancy-bricks", "log-odds-i8", "OBRICKS"),
            Self::TsdfBricks => ("tsdf-bricks", "signed-distance-f32", "TBRICKS"),
            Self::ColorBricks => ("color-bricks", "color-u16", "CBRICKS"),
            Self::Attenuation => ("attenuation-bricks", "hits-lengths-u32", "ABRICKS"),
        };
        Names { map, cell, chunk }
    }
}
