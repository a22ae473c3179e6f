//! The kinds of logs: their names, and the functions that recognize and open them.

use std::path::Path;

use super::parts::Parts;
use super::{
    ScanLogOptions, bigbird, clouds, colmap, graph, kitti, redwood, seven_scenes, stanford, transforms,
    tum_rgbd,
};
use crate::Result;
use crate::ros_log::{is_bag, open_bag};

/// A kind of log of 3-D scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ScanLogKind {
    /// A folder of `frame-NNNNNN.depth.png` with `frame-NNNNNN.pose.txt` (7-Scenes, 3DMatch).
    SevenScenes,
    /// A folder with `depth.txt`, `rgb.txt` and `groundtruth.txt` (TUM RGB-D, ETH3D SLAM), or with a file of any name that pairs
    /// pictures; such a file.
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
    /// A bag of ROS 1 or ROS 2: a file or a folder.
    Bag,
    /// A folder with `transforms.json`, which names depth images (nerfstudio, instant-ngp).
    Transforms,
    /// A folder with a sparse model of COLMAP and depth images.
    Colmap,
    /// A folder of PCD, PLY, `.bin` or text files with a file of poses, or of PCD files in the world's frame; a single cloud.
    Clouds,
}

/// Whether a file or folder is of a kind, by a few names and bytes; and what opens it.
type Functions = (fn(&Path) -> bool, fn(&Path, &ScanLogOptions) -> Result<Parts>);

impl ScanLogKind {
    /// All kinds, in the order in which they are tried.
    pub const ALL: [Self; 11] = [
        Self::SevenScenes,
        Self::TumRgbd,
        Self::BigBird,
        Self::Redwood,
        Self::Kitti,
        Self::Stanford,
        Self::ScanGraph,
        Self::Transforms,
        Self::Colmap,
        Self::Clouds,
        Self::Bag,
    ];

    fn functions(self) -> Functions {
        match self {
            Self::SevenScenes => (seven_scenes::is_it, seven_scenes::open),
            Self::TumRgbd => (tum_rgbd::is_it, tum_rgbd::open),
            Self::BigBird => (bigbird::is_it, bigbird::open),
            Self::Redwood => (redwood::is_it, redwood::open),
            Self::Kitti => (kitti::is_it, kitti::open),
            Self::Stanford => (stanford::is_it, stanford::open),
            Self::ScanGraph => (graph::is_it, graph::open),
            Self::Transforms => (transforms::is_it, transforms::open),
            Self::Colmap => (colmap::is_it, colmap::open),
            Self::Clouds => (clouds::is_it, clouds::open),
            Self::Bag => (is_bag, open_bag),
        }
    }

    /// The word of `--format`, and the kind in words.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::SevenScenes => ("seven-scenes", "depth images with poses (7-Scenes)"),
            Self::TumRgbd => ("tum", "depth images with times (TUM RGB-D)"),
            Self::BigBird => ("bigbird", "masked depth images of an object (BigBIRD)"),
            Self::Redwood => ("redwood", "depth images with a trajectory (Redwood)"),
            Self::Kitti => ("kitti", "lidar scans with poses (KITTI)"),
            Self::Stanford => ("stanford", "range scans with a .conf file (Stanford)"),
            Self::ScanGraph => ("scan-graph", "scan graph (OctoMap)"),
            Self::Transforms => ("transforms", "depth images with transforms.json (nerfstudio, instant-ngp)"),
            Self::Colmap => ("colmap", "depth images with a COLMAP model"),
            Self::Clouds => ("clouds", "clouds of points"),
            Self::Bag => ("bag", "a bag of ROS"),
        }
    }

    /// The word of `--format`.
    pub fn word(self) -> &'static str {
        self.names().0
    }

    /// The kind of a word; `None` where no kind has it.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.word() == word)
    }

    /// The kind in words.
    pub fn label(self) -> &'static str {
        self.names().1
    }

    /// The kind of a file or folder by its layout, names and first bytes; `None` for anything else.
    pub fn recognize(path: &Path) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.functions().0(path))
    }

    pub(super) fn parts(self, path: &Path, options: &ScanLogOptions) -> Result<Parts> {
        self.functions().1(path, options)
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
