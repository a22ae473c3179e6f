//! 7-Scenes: three files a frame.

use portolan::geom::Pose;
use portolan::scan::Frame;

use super::picture::{color_png, depth_png};
use super::{LogWriter, matrix_rows, write_text};
use crate::Result;

/// Units of a depth image per meter.
const UNITS: f64 = 1000.0;

impl LogWriter {
    pub(super) fn push_seven_scenes(&mut self, world_from_camera: &Pose<3>, frame: &Frame) -> Result<()> {
        let image = self.image(frame)?;
        let file = |what: &str| self.folder.join(format!("frame-{:06}.{what}", self.count));
        depth_png(&file("depth.png"), image, UNITS)?;
        if !image.colors.is_empty() {
            color_png(&file("color.png"), image)?;
        }
        let rows = matrix_rows(world_from_camera).map(|r| r.join("\t") + "\n").concat();
        write_text(&file("pose.txt"), &format!("{rows}0\t0\t0\t1\n"))
    }
}
