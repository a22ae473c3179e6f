//! Posed pictures of a photogrammetric model with a depth image each: what `transforms.json` and COLMAP have in common.
//!
//! The numbers of a camera are those of its picture. A depth image of another size of the same shape is one of the same camera,
//! scaled: both formats say what size the camera is for, so that nothing is guessed. Both put the center of the first pixel at
//! (0.5, 0.5), which is (0, 0) here.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use portolan::geom::Pose;
use portolan::scan::Pinhole;

use super::color::color_size;
use super::depth_frames::{DepthFrame, DepthFrames};
use super::depth_png::depth_image_size;
use super::files::number_in;
use super::intrinsics::{check, color_camera};
use super::lens::Lens;
use super::parts::{LayoutPoses, Parts, ScanId};
use super::{Camera, CameraFrom, Distortion, ScanLogOptions, ScanLogStats};
use crate::poses3::{PoseConvention, RawPose};
use crate::{IoError, Result};

/// A posed picture.
pub(super) struct View {
    /// Its camera, by its place among the model's.
    pub(super) camera: usize,
    pub(super) pose: RawPose,
    /// Its depth image; `None`: it has none.
    pub(super) depth: Option<PathBuf>,
    /// The picture itself, if it is there.
    pub(super) color: Option<PathBuf>,
}

/// A camera of a model, whose first pixel has its center at (0.5, 0.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ViewCamera {
    pub(super) pinhole: Pinhole,
    pub(super) distortion: Distortion,
    /// Columns and rows of its pictures; `None`: those of the depth image.
    pub(super) size: Option<[usize; 2]>,
}

/// A model that was read.
pub(super) struct Model {
    /// The file that its cameras are from.
    pub(super) file: PathBuf,
    pub(super) cameras: Vec<ViewCamera>,
    pub(super) views: Vec<View>,
    pub(super) convention: PoseConvention,
    /// Units of depth images, unless the caller says otherwise.
    pub(super) units_per_metre: f64,
    /// Where depth images were looked for, for errors.
    pub(super) looked_for: String,
    /// What the caller should know.
    pub(super) notes: Vec<String>,
}

impl Model {
    /// The log of it.
    ///
    /// # Errors
    /// [`IoError::Layout`] where no view has a depth image, and where cameras and pictures do not fit together.
    pub(super) fn parts(mut self, path: &Path, options: &ScanLogOptions) -> Result<Parts> {
        let mut stats = ScanLogStats { notes: std::mem::take(&mut self.notes), ..ScanLogStats::default() };
        let found = self.views.len();
        let named = self.views.iter().filter(|v| v.depth.is_some()).count();
        let mut views = std::mem::take(&mut self.views);
        views.retain(|v| v.depth.as_ref().is_some_and(|depth| depth.is_file()));
        stats.missing_files = (named - views.len()) as u64;
        if views.is_empty() {
            return Err(self.no_depth(found));
        }
        if views.len() < found {
            stats.notes.push(format!("{} of {found} pictures have no depth image", found - views.len()));
        }
        let lenses = Lenses::of(&self.file, &self.cameras, &views, options)?;
        let mut colors_left_out = None;
        let mut frames = Vec::with_capacity(views.len());
        let mut scans = Vec::with_capacity(views.len());
        let mut poses = Vec::with_capacity(views.len());
        for view in views {
            let Some(depth) = view.depth else { continue };
            // Every camera of a view is there.
            let lens = lenses.0[&view.camera];
            let color = view.color.filter(|_| options.color && colors_left_out.is_none());
            // The others are looked at when they are read.
            if let (true, Some(picture), Some(expected), None) =
                (frames.is_empty(), &color, lens.color_size, &options.color_intrinsics)
                && let Ok([w, h]) = color_size(picture)
                && [w, h] != expected
            {
                let [x, y] = expected;
                colors_left_out =
                    Some(format!("{} is {w} x {h} while its camera is for {x} x {y}", picture.display()));
            }
            let name = depth.file_name().and_then(|n| n.to_str()).unwrap_or_default();
            scans.push(ScanId { path: depth.clone(), number: number_in(name), time: None });
            poses.push(Some((self.file.clone(), view.pose)));
            frames.push(DepthFrame {
                depth,
                color,
                lens: lens.depth,
                color_camera: Some((lens.color, Pose::IDENTITY)),
                size: Some(lens.depth_size),
                color_size: lens.color_size,
            });
        }
        if colors_left_out.is_some() {
            frames.iter_mut().for_each(|f| f.color = None);
        }
        let first = frames.first().map(|f: &DepthFrame| (f.lens, f.size));
        let Some((lens, size)) = first else { return Err(self.no_depth(found)) };
        let from = match &options.intrinsics {
            Some(_) => CameraFrom::Caller,
            None => CameraFrom::File(self.file.clone()),
        };
        let mut camera = Camera { distortion: lens.distortion, ..Camera::new(lens.pinhole, from, size) };
        // What the caller says of the color camera is of all.
        camera.color = color_camera(&camera, None, options)?;
        if let Some(beside) = &camera.color {
            let given = (Lens::new(beside.pinhole, beside.distortion), beside.color_from_depth);
            frames.iter_mut().for_each(|f| (f.color_camera, f.color_size) = (Some(given), None));
        }
        let source = DepthFrames::new(frames, &mut camera, self.units_per_metre, options, &mut stats)?;
        stats.colors_left_out = stats.colors_left_out.or(colors_left_out);
        let poses = LayoutPoses::PerScan(poses);
        let convention = self.convention;
        Ok(Parts { convention, camera: Some(camera), stats, ..Parts::new(path, source, scans, poses) })
    }
}

impl Model {
    fn no_depth(&self, found: usize) -> IoError {
        let value = format!("0 of {found}");
        let advice = format!("looked for {}; maps are made of depth, not of pictures alone", self.looked_for);
        IoError::layout(&self.file, "the number of pictures with a depth image", value, advice)
    }
}

/// A camera as its depth images and its pictures have it.
#[derive(Clone, Copy)]
struct ViewLens {
    depth: Lens,
    depth_size: [usize; 2],
    color: Lens,
    /// `None`: as the first picture.
    color_size: Option<[usize; 2]>,
}

/// Those of the cameras that have views, by their place among the model's.
struct Lenses(HashMap<usize, ViewLens>);

impl Lenses {
    /// By the first depth image of each camera.
    fn of(file: &Path, cameras: &[ViewCamera], views: &[View], options: &ScanLogOptions) -> Result<Self> {
        let mut all = HashMap::new();
        let given = options.intrinsics.as_ref().map(|i| i.camera("--intrinsics")).transpose()?;
        for view in views {
            let Some(depth) = view.depth.as_ref().filter(|_| !all.contains_key(&view.camera)) else {
                continue;
            };
            let Some(camera) = cameras.get(view.camera) else {
                return Err(IoError::layout(
                    file,
                    "the camera of a picture",
                    view.camera,
                    "give a whole model",
                ));
            };
            let size = depth_image_size(depth)?;
            let mut own = *camera;
            own.distortion = options.distortion.unwrap_or(own.distortion);
            own.pinhole = Pinhole { cx: own.pinhole.cx - 0.5, cy: own.pinhole.cy - 0.5, ..own.pinhole };
            check(&own.pinhole, file)?;
            let color = Lens::new(own.pinhole, own.distortion);
            let lens = match &given {
                // Of the depth images, as they are.
                Some(given) => {
                    given.check_size(depth, size)?;
                    Lens::new(given.pinhole, options.distortion.unwrap_or_default())
                }
                None => {
                    let [w, h] = own.size.unwrap_or(size);
                    let by = [size[0] as f64 / w.max(1) as f64, size[1] as f64 / h.max(1) as f64];
                    if (by[0] / by[1] - 1.0).abs() > 0.01 || !by.iter().all(|s| s.is_normal()) {
                        let advice = format!("its camera is for {w} x {h}, which is of another shape");
                        let value = format!("{} x {}", size[0], size[1]);
                        return Err(IoError::layout(depth, "the size of the depth image", value, advice));
                    }
                    color.scaled(by)
                }
            };
            all.insert(view.camera, ViewLens { depth: lens, depth_size: size, color, color_size: own.size });
        }
        Ok(Self(all))
    }
}
