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
}

impl Kind {
    const ALL: [Self; 6] =
        [Self::Grid, Self::Tree, Self::Tsdf, Self::OccupancyBricks, Self::TsdfBricks, Self::ColorBricks];

    /// The kind of an entry of the header; `None`: this version does not read it.
    pub(super) fn of<const D: usize>(entry: &Value) -> Option<Self> {
        let known = |kind: &Self| entry["kind"] == kind.word::<D>() && entry["cell"] == kind.cell();
        Self::ALL.into_iter().find(known)
    }

    /// Its name in the header.
    pub(super) fn word<const D: usize>(self) -> &'static str {
        match self {
            Self::Grid => "occupancy-grid",
            Self::Tree if D == 2 => "quadtree",
            Self::Tree => "octree",
            Self::Tsdf => "tsdf",
            Self::OccupancyBricks => "occupancy-bricks",
            Self::TsdfBricks => "tsdf-bricks",
            Self::ColorBricks => "color-bricks",
        }
    }

    /// The name of its cells in the header.
    pub(super) fn cell(self) -> &'static str {
        match self {
            Self::Grid | Self::Tree | Self::OccupancyBricks => "log-odds-i8",
            Self::Tsdf | Self::TsdfBricks => "signed-distance-f32",
            Self::ColorBricks => "color-u16",
        }
    }

    /// The tag under which its chunks are written.
    pub(super) fn chunk(self) -> &'static str {
        match self {
            Self::Grid => "GRID",
            Self::Tree => "TREE",
            Self::Tsdf => "TSDF",
            Self::OccupancyBricks => "OBRICKS",
            Self::TsdfBricks => "TBRICKS",
            Self::ColorBricks => "CBRICKS",
        }
    }
}
