//! TUM RGB-D: pictures named by their time stamps, lists of them, and a trajectory.

use portolan::geom::Pose;
use portolan::scan::Frame;

use super::LogWriter;
use super::picture::{color_png, depth_png, quaternion};
use crate::Result;

/// Units of a depth image per meter.
const UNITS: f64 = 5000.0;

pub(super) fn texts() -> Vec<(&'static str, String)> {
    let head = |what: &str, columns: &str| format!("# {what}\n# file: 'portolan'\n# {columns}\n");
    vec![
        ("depth.txt", head("depth maps", "timestamp filename")),
        ("rgb.txt", head("color images", "timestamp filename")),
        ("groundtruth.txt", head("ground truth trajectory", "timestamp tx ty tz qx qy qz qw")),
    ]
}

impl LogWriter {
    pub(super) fn push_tum(
        &mut self,
        world_from_camera: &Pose<3>,
        seconds: f64,
        frame: &Frame,
    ) -> Result<()> {
        let image = self.image(frame)?;
        let stamp = format!("{seconds:.6}");
        depth_png(&self.folder.join(format!("depth/{stamp}.png")), image, UNITS)?;
        self.text("depth.txt").push_str(&format!("{stamp} depth/{stamp}.png\n"));
        if !image.colors.is_empty() {
            color_png(&self.folder.join(format!("rgb/{stamp}.png")), image)?;
            self.text("rgb.txt").push_str(&format!("{stamp} rgb/{stamp}.png\n"));
        }
        let [x, y, z] = world_from_camera.translation;
        let [qx, qy, qz, qw] = quaternion(world_from_camera);
        self.text("groundtruth.txt")
            .push_str(&format!("{stamp} {x:.9} {y:.9} {z:.9} {qx:.12} {qy:.12} {qz:.12} {qw:.12}\n"));
        Ok(())
    }
}
