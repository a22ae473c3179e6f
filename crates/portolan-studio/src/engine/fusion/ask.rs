//! What the view of fusion can be asked.

use serde::Deserialize;

use super::settings::Settings;

/// A question. All but `chair_fits`, `watch` and `export` are answered with a frame (`frame.rs`).
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
pub(in crate::engine) enum Ask {
    /// Everything from the beginning: what the page has drawn is gone.
    Open {},
    /// Fuses the next scans.
    Step {
        /// How many, 256 at most.
        scans: usize,
    },
    /// Goes to where so many scans are fused.
    Seek {
        /// From 0.
        scan: usize,
    },
    /// Fuses what was fused again, in another way.
    Set {
        /// All of them.
        settings: Settings,
    },
    /// Puts the middle of the chair there; it has stood there since the scan that was fused last.
    MoveChair {
        /// World (meters).
        to: [f64; 2],
    },
    /// Whether the chair could be put there: answered with why not, or `null`.
    ChairFits {
        /// World (meters).
        to: [f64; 2],
    },
    /// Follows this cell's filter from now on, and answers what it did from the beginning; `null`: follows no cell.
    Watch {
        /// Of the grid.
        cell: Option<[i32; 2]>,
    },
    /// A file of what is there now.
    Export {
        /// Which.
        file: ExportFile,
    },
}

/// Files that can be downloaded.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::engine) enum ExportFile {
    /// `esdf.bin`
    Esdf,
    /// `contour.geojson`
    Contour,
    /// `map.portolan`
    Map,
}
