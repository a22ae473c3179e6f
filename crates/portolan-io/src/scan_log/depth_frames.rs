//! The scans of a depth camera: a depth image each, perhaps with a color picture.
//!
//! Depth does not depend on colors: where a picture is damaged or has another size, the frame has its depth and no colors,
//! and the picture is counted.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use portolan::scan::{Frame, Pinhole, RangeImage};

use super::color::{color_size, read_color};
use super::depth_png::{depth_image_size, read_depth};
use super::parts::FrameSource;
use super::{Camera, ScanLogOptions, ScanLogStats, UnreadColors};
use crate::{IoError, Result};

/// A depth image that was found.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DepthFrame {
    pub(super) depth: PathBuf,
    /// Its color picture, of the same pixels.
    pub(super) color: Option<PathBuf>,
    pub(super) pinhole: Pinhole,
}

/// Reads depth images.
pub(super) struct DepthFrames {
    frames: Vec<DepthFrame>,
    units_per_metre: f64,
    /// Why colors of frames that were read could not be, by frame: the same after any order of reading.
    unread_colors: Mutex<BTreeMap<usize, String>>,
}

/// How many color pictures are read when a log is opened.
const COLORS_LOOKED_AT: usize = 16;

impl DepthFrames {
    /// `units_per_metre` is the format's, which the caller may overrule. The first pictures are looked at: a camera of
    /// another size, or depth of another kind, fails here and not in the middle of the log; colors of another size than
    /// the depth, or of which the first cannot be read, are left out, and `stats` has the reason.
    pub(super) fn new(
        mut frames: Vec<DepthFrame>,
        camera: &Camera,
        units_per_metre: f64,
        options: &ScanLogOptions,
        stats: &mut ScanLogStats,
    ) -> Result<Self> {
        let units_per_metre = options.depth_scale.unwrap_or(units_per_metre);
        if let Some(first) = frames.first() {
            if !(units_per_metre > 1e-6 && units_per_metre < 1e9) {
                let advice = "give the units of a metre: 1000 for millimetres";
                let value = units_per_metre.to_string();
                return Err(IoError::layout(&first.depth, "the depth scale", value, advice));
            }
            camera.check_size(&first.depth, depth_image_size(&first.depth)?)?;
        }
        if options.color {
            stats.colors_left_out = why_no_colors(&frames)?;
        }
        if !options.color || stats.colors_left_out.is_some() {
            frames.iter_mut().for_each(|f| f.color = None);
        } else if frames.iter().any(|f| f.color.is_some()) {
            stats.scans_without_color = frames.iter().filter(|f| f.color.is_none()).count() as u64;
        }
        Ok(Self { frames, units_per_metre, unread_colors: Mutex::default() })
    }
}

/// Why existing color pictures are not used, by the first that can be read.
fn why_no_colors(frames: &[DepthFrame]) -> Result<Option<String>> {
    let mut why = None;
    let pictures = frames.iter().filter_map(|f| Some((&f.depth, f.color.as_ref()?)));
    for (depth, color) in pictures.take(COLORS_LOOKED_AT) {
        match color_size(color) {
            Ok([x, y]) => {
                let [w, h] = depth_image_size(depth)?;
                let other = [w, h] != [x, y];
                return Ok(other.then(|| format!("they are {x} x {y} while the depth images are {w} x {h}")));
            }
            Err(error) => {
                why.get_or_insert_with(|| format!("the first of them cannot be read: {error}"));
            }
        }
    }
    Ok(why)
}

/// The color picture of a name in a folder, whatever it is packed with.
pub(super) fn color_beside(folder: &Path, stem: &str) -> Option<PathBuf> {
    let names = ["jpg", "png", "jpeg"].map(|extension| folder.join(format!("{stem}.{extension}")));
    names.into_iter().find(|path| path.is_file())
}

impl FrameSource for DepthFrames {
    fn frame(&self, i: usize) -> Result<Frame> {
        let frame = &self.frames[i];
        let depth = read_depth(&frame.depth, self.units_per_metre)?;
        let colors = match &frame.color {
            Some(path) => match read_color(path, [depth.columns, depth.rows]) {
                Ok(colors) => colors,
                Err(error) => {
                    let mut unread = self.unread_colors.lock().unwrap_or_else(PoisonError::into_inner);
                    unread.insert(i, error.to_string());
                    Vec::new()
                }
            },
            None => Vec::new(),
        };
        let image = RangeImage::from_depth(frame.pinhole, depth.columns, depth.rows, depth.values);
        Ok(Frame::Image(image.with_colors(colors)))
    }

    fn unread_colors(&self) -> Option<UnreadColors> {
        let unread = self.unread_colors.lock().unwrap_or_else(PoisonError::into_inner);
        let (_, first) = unread.first_key_value()?;
        Some(UnreadColors { pictures: unread.len() as u64, first: first.clone() })
    }
}
