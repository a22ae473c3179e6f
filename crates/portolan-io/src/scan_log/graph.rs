//! OctoMap's scan graphs as logs: scans and poses in one file.
//!
//! Points are doubles. Where they are far from their zero, frames have them about whole meters, which the poses add again.

use std::path::{Path, PathBuf};

use portolan::geom::Pose;
use portolan::scan::Frame;

use super::ScanLogOptions;
use super::cloud_frames::{about, file_from_frames};
use super::files::has_extension;
use super::parts::{FrameSource, LayoutPoses, Parts, ScanId};
use crate::Result;
use crate::poses3::RawPose;
use crate::scan_graph::{ScanGraphNode, read_scan_graph};

pub(super) fn is_it(path: &Path) -> bool {
    path.is_file() && path.file_name().and_then(|n| n.to_str()).is_some_and(|n| has_extension(n, "graph"))
}

/// All scans are in memory: the file has to be read to its end to find them.
struct GraphFrames {
    path: PathBuf,
    nodes: Vec<ScanGraphNode>,
    /// Whole meters that are taken off every point: the offset of the first scan with points.
    base: [f64; 3],
}

impl FrameSource for GraphFrames {
    fn frame(&self, i: usize) -> Result<Frame> {
        let cloud = about(self.nodes[i].cloud.clone(), self.base, &self.path)?;
        Ok(Frame::Points(cloud.into_scan([0.0; 3])))
    }

    fn origin(&self, _i: usize) -> [f64; 3] {
        self.base.map(|v| 0.0 - v)
    }
}

pub(super) fn open(path: &Path, _options: &ScanLogOptions) -> Result<Parts> {
    let nodes = read_scan_graph(path)?;
    let scan = |node: &ScanGraphNode| ScanId { path: path.into(), number: Some(node.id.into()), time: None };
    let pose = |node: &ScanGraphNode| {
        let Pose { rotation, translation } = node.world_from_sensor;
        Some((path.to_owned(), RawPose::new(rotation, translation, 1)))
    };
    let base = nodes.iter().find(|node| !node.cloud.points.is_empty()).map_or([0.0; 3], |n| n.cloud.offset);
    let scans = nodes.iter().map(scan).collect();
    let poses = LayoutPoses::PerScan(nodes.iter().map(pose).collect());
    let source = GraphFrames { path: path.into(), nodes, base };
    Ok(Parts { posed_from_sensor: file_from_frames(base), ..Parts::new(path, source, scans, poses) })
}
