//! The scans of a depth camera: a depth image each, perhaps with a color picture.
//!
//! Maps look through a pinhole. A depth image of a lens that distorts is made one of the pinhole behind it: every pixel takes the
//! reading of the nearest pixel of what the lens shows. A color picture of a camera of its own is looked up at the point that each
//! pixel sees; what lies behind something for that camera gets the color of what is before it.
//!
//! Depth does not depend on colors: where a picture is damaged or has another size, the frame has its depth and no colors,
//! and the picture is counted.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use portolan::geom::Pose;
use portolan::scan::{Frame, RangeImage};

use super::color::{color_size, read_color, read_color_of_any_size};
use super::depth_png::{Depth, depth_image_size, read_depth};
use super::lens::Lens;
use super::parts::FrameSource;
use super::{Camera, CameraFrom, ScanLogOptions, ScanLogStats, UnreadColors};
use crate::{IoError, Result};

/// A depth image that was found.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DepthFrame {
    pub(super) depth: PathBuf,
    /// Its color picture.
    pub(super) color: Option<PathBuf>,
    pub(super) lens: Lens,
    /// The camera of the color picture, with its `color_from_depth`; `None`: pixels are those of the depth image.
    pub(super) color_camera: Option<(Lens, Pose<3>)>,
    /// Columns and rows of the depth image; `None`: as the log's first one.
    pub(super) size: Option<[usize; 2]>,
    /// Those of a color picture of a camera of its own; `None`: as the log's first one.
    pub(super) color_size: Option<[usize; 2]>,
}

impl DepthFrame {
    /// A picture of a camera, with the color camera that belongs to it.
    pub(super) fn of(camera: &Camera, depth: PathBuf, color: Option<PathBuf>) -> Self {
        let beside = camera.color.as_ref();
        let color_camera = beside.map(|c| (Lens::new(c.pinhole, c.distortion), c.color_from_depth));
        Self { depth, color, lens: camera.lens(), color_camera, size: None, color_size: None }
    }
}

/// Reads depth images.
pub(super) struct DepthFrames {
    frames: Vec<DepthFrame>,
    units_per_metre: f64,
    /// Columns and rows of the first.
    size: Option<[usize; 2]>,
    /// Those of the first color picture that can be read.
    color_size: Option<[usize; 2]>,
    /// For each pixel of the first picture, where the lens distorts it, its source; others are worked out as they come.
    first_sources: Option<(Lens, [usize; 2], Vec<Option<u32>>)>,
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
        camera: &mut Camera,
        units_per_metre: f64,
        options: &ScanLogOptions,
        stats: &mut ScanLogStats,
    ) -> Result<Self> {
        let units_per_metre = options.depth_scale.unwrap_or(units_per_metre);
        let (mut first_size, mut first_sources) = (None, None);
        // A picture that is damaged is a scan less, also where it is the first.
        let looked_at = frames.iter().position(|frame| depth_image_size(&frame.depth).is_ok()).unwrap_or(0);
        if let Some(first) = frames.get(looked_at) {
            if !(units_per_metre > 1e-6 && units_per_metre < 1e9) {
                let advice = "give the units of a metre: 1000 for millimetres";
                let value = units_per_metre.to_string();
                return Err(IoError::layout(&first.depth, "the depth scale", value, advice));
            }
            let size = depth_image_size(&first.depth)?;
            if options.scale_intrinsics {
                let own = camera.size.filter(|own| *own != size);
                let (path, by) = (first.depth.clone(), camera.scale_to(&first.depth, size)?);
                stats.notes.extend(own.map(|[w, h]| {
                    format!("the camera of {w} x {h} was scaled to {} x {}, as asked", size[0], size[1])
                }));
                frames.iter_mut().for_each(|f| f.lens = f.lens.scaled(by));
                camera.check_size(&path, size)?;
            } else {
                camera.check_size(&first.depth, size)?;
            }
        }
        if let Some(first) = frames.get(looked_at) {
            let size = depth_image_size(&first.depth)?;
            first_size = Some(size);
            first_sources = first.lens.sources(size).map(|all| (first.lens, size, all));
            let unseen =
                |(_, _, all): &(_, _, Vec<Option<u32>>)| all.iter().filter(|s| s.is_none()).count() as u64;
            stats.pixels_beyond_lens = first_sources.as_ref().map_or(0, unseen);
        }
        if options.color {
            stats.colors_left_out = why_no_colors(&frames, camera, options)?;
        }
        if !options.color || stats.colors_left_out.is_some() {
            frames.iter_mut().for_each(|f| f.color = None);
        } else if frames.iter().any(|f| f.color.is_some()) {
            stats.scans_without_color = frames.iter().filter(|f| f.color.is_none()).count() as u64;
        }
        let of_own = frames.iter().filter(|f| f.color_camera.is_some()).filter_map(|f| f.color.as_ref());
        let color_size = of_own.take(COLORS_LOOKED_AT).find_map(|picture| color_size(picture).ok());
        Ok(Self {
            frames,
            units_per_metre,
            size: first_size,
            color_size,
            first_sources,
            unread_colors: Mutex::default(),
        })
    }

    /// The colors of a frame's picture, one for each pixel of the depth image that has one.
    fn colors(
        &self,
        frame: &DepthFrame,
        path: &Path,
        depth: &Depth,
        sources: Option<&[Option<u32>]>,
    ) -> Result<Vec<Option<[u8; 3]>>> {
        let size = [depth.columns, depth.rows];
        let Some((lens, color_from_depth)) = &frame.color_camera else {
            // The picture of the same lens: its pixels go where those of the depth went.
            let colors = read_color(path, size)?;
            return Ok(match sources {
                Some(sources) => sources.iter().map(|s| s.map(|s| colors[s as usize])).collect(),
                None => colors.into_iter().map(Some).collect(),
            });
        };
        let (color_size, colors) = read_color_of_any_size(path)?;
        if let Some([w, h]) = frame.color_size.or(self.color_size).filter(|expected| *expected != color_size)
        {
            let value = format!("{} x {}", color_size[0], color_size[1]);
            let advice =
                format!("its camera is for {w} x {h}; give pictures of one size, or map with --no-color");
            return Err(IoError::layout(path, "the size of the picture", value, advice));
        }
        let p = &frame.lens.pinhole;
        let color_of = |(i, z): (usize, &f32)| {
            let z = f64::from(*z);
            let (u, v) = ((i % depth.columns) as f64, (i / depth.columns) as f64);
            let point = [z * (u - p.cx) / p.fx, z * (v - p.cy) / p.fy, z];
            lens.pixel(color_from_depth.transform_point(point), color_size).map(|at| colors[at])
        };
        Ok(depth.values.iter().enumerate().map(color_of).collect())
    }
}

/// Why existing color pictures are not used, by the first that can be read.
///
/// # Errors
/// A color camera that the caller gave and that is not one of these pictures.
fn why_no_colors(frames: &[DepthFrame], camera: &Camera, options: &ScanLogOptions) -> Result<Option<String>> {
    let mut why = None;
    let pictures = frames.iter().filter_map(|f| Some((f, &f.depth, f.color.as_ref()?)));
    for (frame, depth, color) in pictures.take(COLORS_LOOKED_AT) {
        match color_size(color) {
            Ok(size) if frame.color_camera.is_some() => {
                let Some(beside) = &camera.color else { return Ok(None) };
                let own = options.color_intrinsics.as_ref().map(|given| given.camera("--color-intrinsics"));
                let own = own.transpose()?.and_then(|c| c.size);
                let published = matches!(beside.from, CameraFrom::DataSet(_)).then_some([640, 480]);
                let fits = Camera::new(beside.pinhole, beside.from.clone(), own.or(published))
                    .check_size(color, size);
                return match fits {
                    Err(error) if options.color_intrinsics.is_some() => Err(error),
                    Err(error) => Ok(Some(format!("they are not of the color camera ({error})"))),
                    Ok(()) => Ok(None),
                };
            }
            Ok([x, y]) => {
                let Ok([w, h]) = depth_image_size(depth) else { continue };
                let other = [w, h] != [x, y];
                return Ok(other.then(|| {
                    format!(
                        "they are {x} x {y} while the depth images are {w} x {h} (--color-intrinsics names a camera of their \
                         own)"
                    )
                }));
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
        let mut depth = read_depth(&frame.depth, self.units_per_metre)?;
        let size = [depth.columns, depth.rows];
        if let Some([w, h]) = frame.size.or(self.size).filter(|expected| *expected != size) {
            let value = format!("{} x {}", size[0], size[1]);
            let advice = format!("the first of its camera is {w} x {h}; give depth images of one size");
            return Err(IoError::layout(&frame.depth, "the size of the depth image", value, advice));
        }
        let worked_out;
        let sources = match &self.first_sources {
            Some((lens, of, sources)) if (*lens, *of) == (frame.lens, size) => Some(sources.as_slice()),
            _ => {
                worked_out = frame.lens.sources(size);
                worked_out.as_deref()
            }
        };
        if let Some(sources) = sources {
            depth.values = sources.iter().map(|s| s.map_or(0.0, |s| depth.values[s as usize])).collect();
        }
        let colors = match &frame.color {
            Some(path) => match self.colors(frame, path, &depth, sources) {
                Ok(colors) => colors,
                Err(error) => {
                    let mut unread = self.unread_colors.lock().unwrap_or_else(PoisonError::into_inner);
                    unread.insert(i, error.to_string());
                    Vec::new()
                }
            },
            None => Vec::new(),
        };
        let image = RangeImage::from_depth(frame.lens.pinhole, depth.columns, depth.rows, depth.values);
        Ok(Frame::Image(match colors.iter().all(Option::is_some) {
            true => image.with_colors(colors.into_iter().flatten().collect::<Vec<_>>()),
            false => image.with_some_colors(colors),
        }))
    }

    fn unread_colors(&self) -> Option<UnreadColors> {
        let unread = self.unread_colors.lock().unwrap_or_else(PoisonError::into_inner);
        let (_, first) = unread.first_key_value()?;
        Some(UnreadColors { pictures: unread.len() as u64, first: first.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::testing::*;
    use crate::scan_log::{Distortion, Intrinsics, ScanLog};
    use crate::testing::{real_data, says};
    use portolan::scan::{Pinhole, Projection};

    const OWN: Pinhole = Pinhole { fx: 10.0, fy: 12.0, cx: 3.5, cy: 2.5 };

    /// A Redwood log of one picture, 2 m deep at every pixel, without a file of its camera.
    fn log_of(size: [usize; 2]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let pixels = size[0] * size[1];
        write(&folder.path().join("depth/0.png"), gray_png(size, &vec![2000; pixels]));
        write(&folder.path().join("trajectory.log"), format!("0 0 1\n{}", matrix_text(&Pose::IDENTITY)));
        folder
    }

    /// A color picture whose red is the column and whose green is the row.
    fn write_places(folder: &Path, [columns, rows]: [usize; 2]) {
        let pixel = |i: usize| [(i % columns) as u8, (i / columns) as u8, 7];
        let bytes: Vec<u8> = (0..columns * rows).flat_map(pixel).collect();
        let png = png_of([columns, rows], png::ColorType::Rgb, png::BitDepth::Eight, &bytes);
        write(&folder.join("color/0.png"), png);
    }

    fn own() -> ScanLogOptions {
        ScanLogOptions { intrinsics: Some(Intrinsics::Pinhole(OWN)), ..ScanLogOptions::default() }
    }

    #[test]
    fn a_camera_of_another_size_is_refused_or_scaled_when_asked() {
        let folder = log_of([320, 240]);
        let open = |options: ScanLogOptions| ScanLog::open(folder.path(), &options);
        says(
            open(ScanLogOptions::default()),
            "the size of the picture is 320 x 240; the camera is for 640 x 480",
        );
        let scaled = open(ScanLogOptions { scale_intrinsics: true, ..ScanLogOptions::default() }).unwrap();
        let Projection::Pinhole(camera) = image(&scaled, 0).projection else { panic!("a camera") };
        assert_eq!(camera, Pinhole { fx: 262.5, fy: 262.5, cx: 159.5, cy: 119.5 });
        assert_eq!(scaled.camera().unwrap().pinhole, camera);
        assert_eq!(scaled.stats().notes, ["the camera of 640 x 480 was scaled to 320 x 240, as asked"]);
        // The caller's numbers, without a size.
        let whole = Intrinsics::Pinhole(Pinhole { fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5 });
        says(
            open(ScanLogOptions { intrinsics: Some(whole), ..ScanLogOptions::default() }),
            "far from the middle",
        );
    }

    #[test]
    fn colors_of_a_camera_of_its_own_are_looked_up_where_points_are() {
        let folder = log_of(SIZE);
        write_places(folder.path(), [40, 30]);
        let without = ScanLog::open(folder.path(), &own()).unwrap();
        let why = without.stats().colors_left_out.clone().unwrap();
        assert!(why.contains("they are 40 x 30 while the depth images are 8 x 6"), "{why}");
        // Twice the focal length in pixels of its own, and 0.1 m to the right of the depth camera.
        let color = Pinhole { fx: 20.0, fy: 24.0, cx: 19.5, cy: 14.5 };
        let options = ScanLogOptions {
            color_intrinsics: Some(Intrinsics::Pinhole(color)),
            color_from_depth: Some(Pose { translation: [-0.1, 0.0, 0.0], ..Pose::IDENTITY }),
            ..own()
        };
        let log = ScanLog::open(folder.path(), &options).unwrap();
        let seen = image(&log, 0);
        for i in 0..SIZE[0] * SIZE[1] {
            let (u, v) = ((i % 8) as f64, (i / 8) as f64);
            let place = [20.0 * ((u - 3.5) / 10.0 - 0.05) + 19.5, 24.0 * (v - 2.5) / 12.0 + 14.5];
            let [x, y] = place.map(|p| p.round() as u8);
            assert_eq!(seen.colors[i], [x, y, 7], "{i}");
        }
        assert!(seen.colored.is_empty());
        // 1 m to the right it sees only some of the points.
        let far = Some(Pose { translation: [-1.9, 0.0, 0.0], ..Pose::IDENTITY });
        let log = ScanLog::open(folder.path(), &ScanLogOptions { color_from_depth: far, ..options.clone() })
            .unwrap();
        let seen = image(&log, 0);
        assert_eq!(seen.colored[..8], [false, false, false, false, true, true, true, true].map(|c| c));
        assert_eq!(seen.check(), Ok(()));
        // A color camera of another picture is an error where it was given.
        let other = Some(Intrinsics::Pinhole(Pinhole { cx: 319.5, ..color }));
        says(
            ScanLog::open(folder.path(), &ScanLogOptions { color_intrinsics: other, ..options }),
            "far from the middle",
        );
    }

    #[test]
    fn a_lens_that_distorts_is_undone_for_depth_and_colors_alike() {
        let folder = log_of(SIZE);
        let depths: Vec<u16> = (0..48).map(|i| 1000 + i).collect();
        write(&folder.path().join("depth/0.png"), gray_png(SIZE, &depths));
        write_places(folder.path(), SIZE);
        let lens = Distortion::of_model("plumb_bob", &[0.9, 0.0, 0.0, 0.0]).unwrap();
        let log = ScanLog::open(folder.path(), &ScanLogOptions { distortion: Some(lens), ..own() }).unwrap();
        let seen = image(&log, 0);
        let mut beyond = 0;
        for i in 0..48 {
            let (x, y) = (((i % 8) as f64 - 3.5) / 10.0, ((i / 8) as f64 - 2.5) / 12.0);
            // The formula itself: a ray is shown further out by 1 + 0.9 r^2.
            let f = 1.0 + 0.9 * (x * x + y * y);
            let (u, v) = ((10.0 * f * x + 3.5).round(), (12.0 * f * y + 2.5).round());
            let inside = (0.0..8.0).contains(&u) && (0.0..6.0).contains(&v);
            let source = v.max(0.0) as usize * 8 + u.max(0.0) as usize;
            let depth = if inside { (1000 + source) as f32 / 1000.0 } else { 0.0 };
            assert!((seen.values[i] - depth).abs() < 1e-6, "{i}");
            assert_eq!(seen.colored.get(i).copied().unwrap_or(true), inside, "{i}");
            if inside {
                assert_eq!(seen.colors[i], [u as u8, v as u8, 7], "{i}");
            }
            beyond += u64::from(!inside);
        }
        assert_eq!(log.stats().pixels_beyond_lens, beyond);
        assert!(beyond > 0 && seen.hits() > 24);
    }

    #[test]
    fn the_red_kitchen_has_a_color_camera_of_its_own() {
        let Some(folder) = real_data("rgbd_redkitchen") else { return };
        let log = ScanLog::open(&folder, &ScanLogOptions::default()).unwrap();
        let color = log.camera().unwrap().color.clone().unwrap();
        assert_eq!((color.pinhole.fx, color.color_from_depth), (525.0, Pose::IDENTITY));
        let as_depth = ScanLogOptions {
            color_intrinsics: Some(Intrinsics::Pinhole(log.camera().unwrap().pinhole)),
            ..ScanLogOptions::default()
        };
        let registered = ScanLog::open(&folder, &as_depth).unwrap();
        let (own, same) = (image(&log, 0), image(&registered, 0));
        let picture = read_color(&folder.join("frame-000000.color.jpg"), [640, 480]).unwrap();
        // Pixel (520, 240) sees what the color camera shows at 320 + 200 * 525 / 585 = 499.5.
        let at = |column: usize| 200 * 640 + column;
        let seen = |i: usize| own.values[i] > 0.0;
        let i = (500..540).map(at).find(|i| seen(*i)).unwrap();
        let (u, v) = ((i % 640) as f64, (i / 640) as f64);
        let place = [(u - 320.0) * 525.0 / 585.0 + 320.0, (v - 240.0) * 525.0 / 585.0 + 240.0];
        let [x, y] = place.map(|p| p.round() as usize);
        assert_eq!(own.colors[i], picture[640 * y + x]);
        assert_eq!(same.colors[i], picture[i]);
    }
}
