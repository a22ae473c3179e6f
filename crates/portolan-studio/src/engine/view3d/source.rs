//! The frames that are fused: of a log that was read, or of a walk through the simulated building.

use std::sync::Arc;

use portolan::geom::Pose;
use portolan::map::{Attenuation, Tsdf3};
use portolan::scan::Frame;
use portolan::uncertainty::SurfaceSigma;
use portolan_io::scan_log::ScanLog;
use portolan_sim::SEED;
use portolan_sim::building::{
    BuildingConfig, BuildingSensor, DepthCamera, SpinningLidar, World3, building_poses, building_world,
};

use super::settings::Sensor;
use crate::engine::{BesideMap, Logs, Refusal, Source3d};

/// Scans of the lidar on its way through the building.
const LIDAR_SCANS: usize = 40;
/// Pictures of the camera on its way.
const CAMERA_FRAMES: usize = 160;
/// The camera's pixels along each side, as a share of 640 x 480.
const CAMERA_SHARE: f64 = 0.4;
/// Positions that the page gets of the sensor's way, at most.
const WAY: usize = 4000;

/// Where frames come from.
pub(super) struct Source {
    logs: Arc<Logs>,
    walk: Option<Walk>,
    /// Whether a recorded log or map has colors.
    colored: bool,
}

/// A walk through the building; its frames are made when they are first asked for.
struct Walk {
    sensor: BuildingSensor,
    kind: Sensor,
    world: World3,
    poses: Vec<Pose<3>>,
    directions: Vec<[f64; 3]>,
    frames: Vec<Option<Arc<Frame>>>,
    bytes: usize,
}

impl Source {
    pub(super) fn new(logs: &Arc<Logs>, sensor: Sensor) -> Self {
        let walk = matches!(logs.source_3d, Source3d::Building).then(|| Walk::new(sensor));
        Self { logs: logs.clone(), walk, colored: is_colored(&logs.source_3d) }
    }

    fn recorded(&self) -> Option<&ScanLog> {
        match &self.logs.source_3d {
            Source3d::Recorded { log, .. } => Some(log),
            Source3d::Building | Source3d::Map { .. } => None,
        }
    }

    /// Carries another sensor through the building.
    pub(super) fn set_sensor(&mut self, sensor: Sensor) {
        if self.walk.as_ref().is_some_and(|walk| walk.kind != sensor) {
            self.walk = Some(Walk::new(sensor));
        }
    }

    /// What is shown, for people.
    pub(super) fn name(&self) -> &str {
        match &self.logs.source_3d {
            Source3d::Building => "the simulated building",
            Source3d::Recorded { log, .. } => log.name(),
            Source3d::Map { name, .. } => name,
        }
    }

    /// The map that stands for frames.
    pub(super) fn map(&self) -> Option<&Tsdf3> {
        match &self.logs.source_3d {
            Source3d::Map { tsdf, .. } => Some(tsdf),
            Source3d::Building | Source3d::Recorded { .. } => None,
        }
    }

    /// What is known beside a map.
    fn beside(&self) -> Option<&BesideMap> {
        match &self.logs.source_3d {
            Source3d::Map { beside, .. } => Some(beside.as_ref()),
            Source3d::Building | Source3d::Recorded { .. } => None,
        }
    }

    /// How sure the surface of a map is.
    pub(super) fn sigma(&self) -> Option<&SurfaceSigma> {
        self.beside()?.sigma.as_ref()
    }

    /// Which share of the looks the cells of a map stop.
    pub(super) fn attenuation(&self) -> Option<&Attenuation<3>> {
        self.beside()?.attenuation.as_ref()
    }

    /// Returns of what moved and is not in the map (world, meters).
    pub(super) fn movers(&self) -> &[[f64; 3]] {
        self.beside().map_or(&[], |beside| &beside.movers)
    }

    /// Frames that there are.
    pub(super) fn len(&self) -> usize {
        self.walk.as_ref().map_or_else(|| self.recorded().map_or(0, ScanLog::len), |walk| walk.poses.len())
    }

    /// `world_from_sensor` of frame `i`, which there is.
    pub(super) fn pose(&self, i: usize) -> Option<Pose<3>> {
        match &self.walk {
            Some(walk) => walk.poses.get(i).copied(),
            None => self.recorded().filter(|log| i < log.len()).map(|log| *log.pose(i)),
        }
    }

    /// Where the sensor stood when it took frame `i`.
    fn position(&self, i: usize) -> Option<[f64; 3]> {
        match self.recorded().filter(|log| i < log.len()) {
            Some(log) => Some(log.sensor_position(i)),
            None => self.pose(i).map(|pose| pose.translation),
        }
    }

    /// The sensor's way, thinned out where it is long.
    pub(super) fn way(&self) -> Vec<[f64; 3]> {
        let step = self.len().div_ceil(WAY).max(1);
        (0..self.len()).step_by(step).filter_map(|i| self.position(i)).collect()
    }

    /// Frame `i`, and where it was taken.
    ///
    /// # Errors
    /// Where `i` is out of range, or the file cannot be read.
    pub(super) fn frame(&mut self, i: usize) -> Result<(Pose<3>, Arc<Frame>), Refusal> {
        let none = || Refusal::new(format!("there is no frame {i}"));
        let pose = self.pose(i).ok_or_else(none)?;
        let frame = match (&mut self.walk, &self.logs.source_3d) {
            (Some(walk), _) => walk.frame(i).ok_or_else(none)?,
            (None, Source3d::Recorded { log, filter, .. }) => {
                // What the limits refuse is counted in the frame.
                let (frame, _) = log.filtered_frame(i, filter).map_err(Refusal::new)?;
                Arc::new(frame)
            }
            (None, _) => return Err(none()),
        };
        Ok((pose, frame))
    }

    /// The true world; `None` for recorded logs.
    pub(super) fn world(&self) -> Option<&World3> {
        self.walk.as_ref().map(|walk| &walk.world)
    }

    /// Whether frames have colors, or the map.
    pub(super) fn has_color(&self) -> bool {
        self.walk.as_ref().map_or(self.colored, |walk| walk.kind == Sensor::Camera)
    }

    /// Unit vector upward in the world.
    pub(super) fn up(&self) -> [f64; 3] {
        match &self.logs.source_3d {
            Source3d::Building => [0.0, 0.0, 1.0],
            Source3d::Recorded { up, .. } | Source3d::Map { up, .. } => *up,
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.walk.as_ref().map_or(0, |walk| walk.bytes)
    }
}

/// Whether the first frame of a log, or a map, has colors. A frame that cannot be read is told when it is fused.
fn is_colored(source: &Source3d) -> bool {
    match source {
        Source3d::Building => false,
        Source3d::Map { tsdf, .. } => tsdf.colors().is_some_and(|store| !store.is_empty()),
        Source3d::Recorded { log, .. } => match log.frame(0) {
            Ok(Frame::Image(image)) => !image.colors.is_empty(),
            Ok(Frame::Points(scan)) => !scan.colors.is_empty(),
            Err(_) => false,
        },
    }
}

impl Walk {
    fn new(kind: Sensor) -> Self {
        // Downwards further than most lidars look, so that floors are whole; what escapes through the windows is not followed
        // far, since it is not what one wants to see.
        let lidar = SpinningLidar {
            columns: 600,
            elevation: [-0.95, 0.4],
            max_range: 9.0,
            ..SpinningLidar::default()
        };
        let (scans, sensor) = match kind {
            Sensor::Lidar => (LIDAR_SCANS, BuildingSensor::Lidar(lidar)),
            Sensor::Camera => {
                (CAMERA_FRAMES, BuildingSensor::Camera(DepthCamera::default().scaled(CAMERA_SHARE)))
            }
        };
        let building = building_world(SEED);
        let poses = building_poses(&building, &BuildingConfig { scans, sensor, seed: SEED });
        let (directions, frames) = (sensor.directions(), vec![None; poses.len()]);
        Self { sensor, kind, world: building.world, poses, directions, frames, bytes: 0 }
    }

    fn frame(&mut self, i: usize) -> Option<Arc<Frame>> {
        let (place, pose) = (self.frames.get_mut(i)?, self.poses.get(i)?);
        if place.is_none() {
            let frame = self.sensor.frame(&self.world, pose, &self.directions, (SEED, i as u64));
            self.bytes += frame_bytes(&frame);
            *place = Some(Arc::new(frame));
        }
        place.clone()
    }
}

fn frame_bytes(frame: &Frame) -> usize {
    let image = |i: &portolan::scan::RangeImage| 4 * i.values.len() + 3 * i.colors.len();
    match frame {
        Frame::Image(i) => image(i),
        Frame::Points(p) => 12 * (p.points.len() + p.free_ends.len()) + p.image.as_ref().map_or(0, image),
    }
}
