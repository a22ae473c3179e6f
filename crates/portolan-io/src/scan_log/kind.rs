//! The kinds of logs: their names, and the functions that recognize and open them.

use std::path::Path;

use super::parts::Parts;
use super::{ScanLogOptions, bigbird, clouds, graph, kitti, redwood, seven_scenes, stanford, tum_rgbd};
use crate::Result;

/// A kind of log of 3-D scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ScanLogKind {
    /// A folder of `frame-NNNNNN.depth.png` with `frame-NNNNNN.pose.txt` (7-Scenes, 3DMatch).
    SevenScenes,
    /// A folder with `depth.txt`, `rgb.txt` and `groundtruth.txt` (TUM RGB-D, ETH3D SLAM).
    TumRgbd,
    /// A folder `masked_depth` with `pose/poses.txt` (BigBIRD as the GPIS tools store it).
    BigBird,
    /// A folder `depth` of pictures with a trajectory (Redwood, Open3D) or with poses in a folder `pose` (ScanNet).
    Redwood,
    /// A folder `velodyne` of `.bin` scans with `poses.txt` and `calib.txt` (KITTI, SemanticKITTI).
    Kitti,
    /// A `.conf` file with range scans in PLY files (Stanford), or its folder.
    Stanford,
    /// A scan graph of OctoMap.
    ScanGraph,
    /// A folder of PCD, PLY, `.bin` or text files with a file of poses, or of PCD files in the world's frame; a single cloud.
    Clouds,
}

/// The names and functions of a kind.
struct Format {
    word: &'static str,
    label: &'static str,
    /// Whether a file or folder is of this kind. Reads no more than a few names and bytes.
    is_it: fn(&Path) -> bool,
    open: fn(&Path, &ScanLogOptions) -> Result<Parts>,
}

impl ScanLogKind {
    /// All kinds, in the order in which they are tried.
    pub const ALL: [Self; 8] = [
        Self::SevenScenes,
        Self::TumRgbd,
        Self::BigBird,
        Self::Redwood,
        Self::Kitti,
        Self::Stanford,
        Self::ScanGraph,
        Self::Clouds,
    ];

    fn format(self) -> Format {
        match self {
            Self::SevenScenes => Format {
                word: "seven-scenes",
                label: "depth images with poses (7-Scenes)",
                is_it: seven_scenes::is_it,
                open: seven_scenes::open,
            },
            Self::TumRgbd => Format {
                word: "tum",
                label: "depth images with times (TUM RGB-D)",
                is_it: tum_rgbd::is_it,
                open: tum_rgbd::open,
            },
            Self::BigBird => Format {
                word: "bigbird",
                label: "masked depth images of an object (BigBIRD)",
                is_it: bigbird::is_it,
                open: bigbird::open,
            },
            Self::Redwood => Format {
                word: "redwood",
                label: "depth images with a trajectory (Redwood)",
                is_it: redwood::is_it,
                open: redwood::open,
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

    /// The kind of a file or folder by its layout, names and first bytes; `None` for anything else.
    pub fn recognize(path: &Path) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| (kind.format().is_it)(path))
    }

    pub(super) fn parts(self, path: &Path, options: &ScanLogOptions) -> Result<Parts> {
        (self.format().open)(path, options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_word_of_its_own() {
        for (i, kind) in ScanLogKind::ALL.into_iter().enumerate() {
            assert_eq!(ScanLogKind::from_word(kind.word()), Some(kind));
            assert!(ScanLogKind::ALL[..i].iter().all(|other| other.label() != kind.label()));
        }
        assert_eq!(ScanLogKind::from_word("rosbag"), None);
    }

    #[test]
    fn other_folders_are_no_logs() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(ScanLogKind::recognize(folder.path()), None);
        assert_eq!(ScanLogKind::recognize(&folder.path().join("missing")), None);
        std::fs::create_dir(folder.path().join("depth")).unwrap();
        std::fs::write(folder.path().join("a.log"), "0 0 1\n").unwrap();
        assert_eq!(ScanLogKind::recognize(folder.path()), None);
        std::fs::write(folder.path().join("depth/0.png"), "").unwrap();
        assert_eq!(ScanLogKind::recognize(folder.path()), Some(ScanLogKind::Redwood));
    }
}
