//! The kinds of logs: their words, what recognises them, what opens them.

use std::path::Path;

use super::parts::Parts;
use super::{SpaceLogOptions, clouds, graph, kitti, seven_scenes, stanford};
use crate::IoError;

/// A kind of log of scans of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SpaceLogKind {
    /// A folder of `frame-NNNNNN.depth.png` with `frame-NNNNNN.pose.txt` (7-Scenes, 3DMatch).
    SevenScenes,
    /// A folder `velodyne` of `.bin` scans with `poses.txt` and `calib.txt` (KITTI, SemanticKITTI).
    Kitti,
    /// A `.conf` file with range scans in PLY files (Stanford), or its folder.
    Stanford,
    /// A scan graph of OctoMap.
    ScanGraph,
    /// A folder of PCD, PLY, `.bin` or text files with a file of poses, or of PCD files in the world's frame; a single cloud.
    Clouds,
}

/// What the crate knows of a kind.
struct Format {
    word: &'static str,
    label: &'static str,
    /// Whether a file or folder is of this kind. Reads no more than a few names and bytes.
    is_it: fn(&Path) -> bool,
    open: fn(&Path, &SpaceLogOptions) -> Result<Parts, IoError>,
}

impl SpaceLogKind {
    /// All kinds, in the order in which they are tried.
    pub const ALL: [Self; 5] =
        [Self::SevenScenes, Self::Kitti, Self::Stanford, Self::ScanGraph, Self::Clouds];

    fn format(self) -> Format {
        match self {
            Self::SevenScenes => Format {
                word: "seven-scenes",
                label: "depth images with poses (7-Scenes)",
                is_it: seven_scenes::is_it,
                open: seven_scenes::open,
            },
            Self::Kitti => Format {
                word: "kitti",
                label: "lidar scans with poses (KITTI)",
                is_it: kitti::is_it,
                open: kitti::open,
            },
            Self::Stanford => Format {
                word: "stanford",
                label: "range scans with a .conf file (Stanford)",
                is_it: stanford::is_it,
                open: stanford::open,
            },
            Self::ScanGraph => Format {
                word: "scan-graph",
                label: "scan graph (OctoMap)",
                is_it: graph::is_it,
                open: graph::open,
            },
            Self::Clouds => {
                Format { word: "clouds", label: "clouds of points", is_it: clouds::is_it, open: clouds::open }
            }
        }
    }

    /// The word of `--format`.
    pub fn word(self) -> &'static str {
        self.format().word
    }

    /// The kind of a word; `None` where no kind has it.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.word() == word)
    }

    /// The kind in words.
    pub fn label(self) -> &'static str {
        self.format().label
    }

    /// The kind of a file or folder by its layout, names and first bytes; `None` where it is no such log.
    pub fn recognise(path: &Path) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| (kind.format().is_it)(path))
    }

    pub(super) fn parts(self, path: &Path, options: &SpaceLogOptions) -> Result<Parts, IoError> {
        (self.format().open)(path, options)
    }
}
