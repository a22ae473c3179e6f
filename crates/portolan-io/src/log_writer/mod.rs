//! Logs of 3-D scans, written in the layouts of well-known data sets, so that other programs read simulated scans.
//!
//! | layout | holds | files |
//! |---|---|---|
//! | [`LogLayout::Kitti`] | end points | `velodyne/NNNNNN.bin` (x, y, z, intensity), `poses.txt`, `calib.txt`, `times.txt` |
//! | [`LogLayout::TumRgbd`] | images of a camera | `depth/TIME.png` (5000 units a meter), `rgb/TIME.png`, `depth.txt`, `rgb.txt`, `groundtruth.txt`, `calibration.txt` |
//! | [`LogLayout::SevenScenes`] | images of a camera | `frame-NNNNNN.depth.png` (millimeters), `.color.png`, `.pose.txt`, `camera-intrinsics.txt` |

mod kitti;
mod picture;
mod seven_scenes;
mod tum;

use std::path::{Path, PathBuf};

use portolan::geom::Pose;
use portolan::scan::{Frame, Pinhole, Projection, RangeImage};

use crate::{IoError, Result, write_atomic};

/// How a log lies in its folder.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LogLayout {
    /// KITTI odometry. Poses are those of the camera, so that `world_from_lidar = world_from_camera * camera_from_lidar`;
    /// the second factor is written as `Tr`. Rays without a return cannot be stored.
    Kitti {
        /// The identity for a lidar without a camera.
        camera_from_lidar: Pose<3>,
    },
    /// TUM RGB-D. TUM's own logs have no place for the numbers of the camera; they are written as `calibration.txt`
    /// (`fx fy cx cy`), as ETH3D does it, where [`ScanLog`](crate::scan_log::ScanLog) finds them.
    TumRgbd,
    /// 7-Scenes, with the numbers of the camera beside the frames.
    SevenScenes,
}

/// Writes a log scan by scan. Files of single scans are written at once, lists and poses by [`LogWriter::finish`].
pub struct LogWriter {
    folder: PathBuf,
    layout: LogLayout,
    /// Scans so far.
    count: usize,
    /// Texts that grow with every scan, by file name.
    texts: Vec<(&'static str, String)>,
    /// The camera of the first image: a layout has one for all.
    camera: Option<(Pinhole, [usize; 2])>,
}

impl LogWriter {
    /// Begins a log in a folder, which is made if it is not there. Files of the same names are replaced.
    ///
    /// # Errors
    /// [`IoError::Os`] where a folder cannot be made.
    pub fn create(folder: impl Into<PathBuf>, layout: LogLayout) -> Result<Self> {
        let folder = folder.into();
        let (folders, texts): (&[&str], _) = match &layout {
            LogLayout::Kitti { camera_from_lidar } => (&["velodyne"], kitti::texts(camera_from_lidar)),
            LogLayout::TumRgbd => (&["depth", "rgb"], tum::texts()),
            LogLayout::SevenScenes => (&[], Vec::new()),
        };
        for path in std::iter::once(folder.clone()).chain(folders.iter().map(|f| folder.join(f))) {
            std::fs::create_dir_all(&path).map_err(|e| IoError::os(&path, "make the folder", e))?;
        }
        Ok(Self { folder, layout, count: 0, texts, camera: None })
    }

    /// Adds a scan: the pose of its sensor (`world_from_sensor`; cameras look along z) and when it was taken (seconds,
    /// ascending).
    ///
    /// # Errors
    /// [`IoError::Unwritable`] for a scan that the layout cannot hold, [`IoError::Os`] where writing fails.
    pub fn push(&mut self, world_from_sensor: &Pose<3>, seconds: f64, frame: &Frame) -> Result<()> {
        match self.layout {
            LogLayout::Kitti { camera_from_lidar } => {
                let world_from_camera = *world_from_sensor * camera_from_lidar.inverse();
                self.push_kitti(&world_from_camera, seconds, frame)?;
            }
            LogLayout::TumRgbd => self.push_tum(world_from_sensor, seconds, frame)?,
            LogLayout::SevenScenes => self.push_seven_scenes(world_from_sensor, frame)?,
        }
        self.count += 1;
        Ok(())
    }

    /// Writes what belongs to all scans together, and returns their number.
    ///
    /// # Errors
    /// [`IoError::Os`] where writing fails.
    pub fn finish(mut self) -> Result<usize> {
        if let Some((Pinhole { fx, fy, cx, cy }, _)) = self.camera {
            self.texts.push(match self.layout {
                LogLayout::TumRgbd => ("calibration.txt", format!("{fx} {fy} {cx} {cy}\n")),
                _ => ("camera-intrinsics.txt", format!("{fx} 0 {cx}\n0 {fy} {cy}\n0 0 1\n")),
            });
        }
        for (name, text) in &self.texts {
            write_text(&self.folder.join(name), text)?;
        }
        Ok(self.count)
    }

    fn text(&mut self, name: &'static str) -> &mut String {
        let at = self.texts.iter().position(|t| t.0 == name).unwrap_or_else(|| {
            self.texts.push((name, String::new()));
            self.texts.len() - 1
        });
        &mut self.texts[at].1
    }

    /// The image of a pinhole camera, the same camera as before.
    fn image<'a>(&mut self, frame: &'a Frame) -> Result<&'a RangeImage> {
        let refuse = |value: &str, advice: &str| {
            Err(IoError::unwritable(&self.folder, format!("scan {}", self.count), value, advice))
        };
        let Frame::Image(image) = frame else {
            return refuse("a scan of points", "this layout holds images of a camera; write KITTI instead");
        };
        let Projection::Pinhole(camera) = &image.projection else {
            return refuse("an image of another projection", "this layout holds images of a pinhole camera");
        };
        let own = (*camera, [image.columns, image.rows]);
        if *self.camera.get_or_insert(own) != own {
            return refuse("an image of another camera", "this layout has one camera for all scans");
        }
        Ok(image)
    }
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    write_atomic(path, |out| std::io::Write::write_all(out, text.as_bytes()))
}

/// Rows of the 3x4 or 4x4 matrix of a pose, with enough digits to keep rotations orthonormal to 1e-12.
fn matrix_rows(pose: &Pose<3>) -> [[String; 4]; 3] {
    let number = |v: f64| format!("{v:.12e}");
    std::array::from_fn(|i| {
        let [a, b, c] = pose.rotation[i].map(number);
        [a, b, c, number(pose.translation[i])]
    })
}
