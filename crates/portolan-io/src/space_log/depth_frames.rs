//! The scans of a depth camera: a depth image each.

use std::path::PathBuf;

use portolan::scan::{Frame, Pinhole, Projection, RangeImage, RefusedBeams};

use super::depth_png::{depth_image_size, read_depth};
use super::parts::FrameSource;
use super::{Camera, SpaceLogOptions};
use crate::IoError;

/// A depth image that was found.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DepthFrame {
    pub(super) depth: PathBuf,
    pub(super) pinhole: Pinhole,
}

/// Reads depth images.
pub(super) struct DepthFrames {
    frames: Vec<DepthFrame>,
    units_per_metre: f64,
}

impl DepthFrames {
    /// `units_per_metre` is the format's, which the caller may overrule. The first picture is looked at: a camera of another
    /// size, or pictures of another kind, fail here and not in the middle of the log.
    pub(super) fn new(
        frames: Vec<DepthFrame>,
        camera: &Camera,
        units_per_metre: f64,
        options: &SpaceLogOptions,
    ) -> Result<Self, IoError> {
        let units_per_metre = options.depth_scale.unwrap_or(units_per_metre);
        if let Some(first) = frames.first() {
            if !(units_per_metre > 1e-6 && units_per_metre < 1e9) {
                let advice = "give the units of a metre: 1000 for millimetres";
                let value = units_per_metre.to_string();
                return Err(IoError::layout(&first.depth, "the depth scale", value, advice));
            }
            let size = depth_image_size(&first.depth)?;
            camera.check_size(&first.depth, size)?;
        }
        Ok(Self { frames, units_per_metre })
    }
}

impl FrameSource for DepthFrames {
    fn frame(&self, i: usize) -> Result<Frame, IoError> {
        let frame = &self.frames[i];
        let depth = read_depth(&frame.depth, self.units_per_metre)?;
        Ok(Frame::Image(RangeImage {
            projection: Projection::Pinhole(frame.pinhole),
            columns: depth.columns,
            rows: depth.rows,
            values: depth.values,
            colors: Vec::new(),
            refused: RefusedBeams::default(),
        }))
    }
}
