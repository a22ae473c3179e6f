//! KITTI odometry: points of a Velodyne, poses of the left camera.

use std::io::Write;

use portolan::geom::Pose;
use portolan::scan::{Frame, Origin};

use super::{LogWriter, matrix_rows};
use crate::{IoError, Result, write_atomic};

/// `calib.txt` has placeholders for the projections of four cameras, and `Tr`, which readers need.
pub(super) fn texts(camera_from_lidar: &Pose<3>) -> Vec<(&'static str, String)> {
    let row = matrix_rows(camera_from_lidar).map(|r| r.join(" ")).join(" ");
    let projection = "1 0 0 0 0 1 0 0 0 0 1 0";
    let cameras: String = (0..4).map(|k| format!("P{k}: {projection}\n")).collect();
    let calib = format!("{cameras}Tr: {row}\n");
    vec![("calib.txt", calib), ("poses.txt", String::new()), ("times.txt", String::new())]
}

impl LogWriter {
    pub(super) fn push_kitti(
        &mut self,
        world_from_camera: &Pose<3>,
        seconds: f64,
        frame: &Frame,
    ) -> Result<()> {
        let path = self.folder.join("velodyne").join(format!("{:06}.bin", self.count));
        let points: Vec<[f32; 3]> = match frame {
            Frame::Image(image) => image.points().map(|(_, p)| p.map(|v| v as f32)).collect(),
            Frame::Points(scan) if scan.origin == Origin::Common([0.0; 3]) => scan.points.clone(),
            Frame::Points(_) => {
                let advice = "KITTI's rays begin at the origin of the points; move the points and the pose";
                let value = "not at the origin of the points";
                return Err(IoError::unwritable(&path, "the origin of rays", value, advice));
            }
        };
        write_atomic(&path, |out| {
            // Intensity is not simulated.
            let mut values = points.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0.0]);
            values.try_for_each(|v| out.write_all(&v.to_le_bytes()))
        })?;
        let pose = matrix_rows(world_from_camera).map(|r| r.join(" ")).join(" ");
        self.text("poses.txt").push_str(&(pose + "\n"));
        // The shortest digits that give the same double: of an epoch stamp the seven of KITTI's own files leave minutes.
        self.text("times.txt").push_str(&format!("{seconds:e}\n"));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{LogLayout, LogWriter};
    use super::*;
    use crate::scan_log::{ScanLog, ScanLogKind, ScanLogOptions};
    use portolan::scan::PointScan;

    #[test]
    fn stamps_since_the_epoch_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let camera_from_lidar = Pose::from_quaternion([0.1, -0.2, 0.3], [0.5, -0.5, 0.5, 0.5]).unwrap();
        let mut writer = LogWriter::create(folder.path(), LogLayout::Kitti { camera_from_lidar }).unwrap();
        let frame = Frame::Points(PointScan::new([[1.0, 2.0, 3.0]], [0.0; 3]));
        let times = [0.0, 0.1037875, 1_630_577_758.569_49, 1_630_577_758.669_501];
        let pose = Pose::from_quaternion([1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8]).unwrap();
        times.iter().for_each(|t| writer.push(&pose, *t, &frame).unwrap());
        assert_eq!(writer.finish().unwrap(), 4);
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!(log.kind(), ScanLogKind::Kitti);
        assert_eq!([0, 1, 2, 3].map(|i| log.time(i).unwrap()), times);
    }
}
