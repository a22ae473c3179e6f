//! OctoMap's scan graphs as logs: scans and poses in one file.

use std::path::Path;

use portolan::geom::Pose;
use portolan::scan::Frame;

use super::cloud_frames::about;
use super::files::{has_extension, name_of};
use super::parts::{FrameSource, LayoutPoses, Parts, ScanId};
use super::{SpaceLogOptions, SpaceLogStats};
use crate::IoError;
use crate::poses3::{PoseConvention, RawPose};
use crate::scan_graph::{ScanGraphNode, read_scan_graph};

pub(super) fn is_it(path: &Path) -> bool {
    path.is_file() && path.file_name().and_then(|n| n.to_str()).is_some_and(|n| has_extension(n, "graph"))
}

/// All scans are in memory: the file has to be read to its end to find them.
struct GraphFrames(Vec<ScanGraphNode>);

impl FrameSource for GraphFrames {
    fn frame(&self, i: usize) -> Result<Frame, IoError> {
        Ok(Frame::Points(about(self.0[i].cloud.clone(), [0.0; 3]).into_scan([0.0; 3])))
    }
}

pub(super) fn open(path: &Path, _options: &SpaceLogOptions) -> Result<Parts, IoError> {
    let nodes = read_scan_graph(path)?;
    let scan = |node: &ScanGraphNode| ScanId { path: path.into(), number: Some(node.id.into()), time: None };
    let pose = |node: &ScanGraphNode| {
        let Pose { rotation, translation } = node.world_from_sensor;
        Some((path.to_owned(), RawPose::new(rotation, translation, 1)))
    };
    Ok(Parts {
        name: name_of(path),
        scans: nodes.iter().map(scan).collect(),
        poses: LayoutPoses::PerScan(nodes.iter().map(pose).collect()),
        source: Box::new(GraphFrames(nodes)),
        convention: PoseConvention::WorldFromSensor,
        posed_from_sensor: None,
        camera: None,
        stats: SpaceLogStats::default(),
    })
}
