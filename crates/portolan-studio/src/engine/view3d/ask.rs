//! What the 3-D view can be asked.

use serde::{Deserialize, Serialize};

use super::settings::Settings;

/// A question. `open`, `step`, `seek`, `set`, `color` and `mesh` are answered with what is new of the mesh.
///
/// Places are meters from the origin that the answer to `open` has, so that a map far from the world's zero is drawn as finely as one
/// near it.
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
pub(in crate::engine) enum Ask {
    /// Everything from the beginning: what the page has drawn is gone.
    Open {},
    /// Fuses the next frames, as far as a quarter of a second goes, but at least one.
    Step {
        /// How many, 64 at most.
        frames: usize,
    },
    /// Goes towards where so many frames are fused, as far as a quarter of a second goes: asked again until it is there.
    Seek {
        /// From 0.
        frame: usize,
    },
    /// Begins again in another way.
    Set {
        /// All of them.
        settings: Settings,
    },
    /// Colors the mesh by something else.
    Color {
        /// By what.
        by: ColorBy,
    },
    /// The rest of the mesh, or the next part of it.
    Mesh {},
    /// A layer of cells of a field.
    Slice {
        /// Which.
        slice: Slice,
    },
    /// What a ray meets first: the surface, or a slice.
    Pick {
        /// Where the ray begins.
        origin: [f64; 3],
        /// Where it goes, of any length.
        direction: [f64; 3],
        /// The slice that is shown.
        slice: Option<Slice>,
    },
    /// Selects a cell from now on; `null`: deselects it.
    Voxel {
        /// Its index.
        cell: Option<[i32; 3]>,
    },
    /// More of what scans did to the cell that is looked at: asked again until it is complete.
    History {},
    /// A file of what is there now.
    Export {
        /// Which.
        file: ExportFile,
    },
}

/// What the surface is colored by.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::engine) enum ColorBy {
    /// How high it is; the page takes it from the positions.
    #[default]
    Height,
    /// The colors that were seen.
    Color,
    /// The weight of the cell that holds the place.
    Weight,
    /// The signed distance to the true surface.
    Error,
    /// The standard deviation of the surface.
    Sigma,
    /// The share of the looks that passed the cell that holds the place.
    Passed,
}

/// A layer of cells.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::engine) struct Slice {
    /// Of which field.
    pub(super) field: Field,
    /// Across which axis: 0, 1 or 2.
    pub(super) axis: usize,
    /// Where on it (meters from the origin).
    pub(super) at: f64,
}

/// What there is at every cell.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(in crate::engine) enum Field {
    /// The truncated signed distance.
    Tsdf,
    /// The Euclidean signed distance.
    Esdf,
    /// The probability of being occupied.
    Occupancy,
}

/// Files that can be downloaded.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::engine) enum ExportFile {
    /// `mesh.ply`
    Ply,
    /// `mesh.glb`
    Glb,
    /// `esdf.bin`
    Esdf,
    /// `octree.bt`
    Octree,
}
