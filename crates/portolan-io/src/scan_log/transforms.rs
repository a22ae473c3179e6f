//! `transforms.json` *(nerfstudio; instant-ngp)*: posed pictures of one camera or of several, some of them with depth images.
//!
//! Cameras are `fl_x fl_y cx cy w h`, or `camera_angle_x` for a camera whose center is that of its pictures, with `k1 k2 k3 k4 p1
//! p2` and `camera_model` (`OPENCV`, `OPENCV_FISHEYE`, `PINHOLE`, ...), for all frames or for one. Poses are `transform_matrix`,
//! world from a camera that looks along -z with y up. Depth images are `depth_file_path` (nerfstudio) or `depth_path`
//! (instant-ngp), 16-bit gray of millimeters, or of `integer_depth_scale` meters.

use std::path::{Path, PathBuf};

use portolan::scan::Pinhole;
use serde_json::Value;

use super::depth_png::depth_image_size;
use super::parts::Parts;
use super::views::{Model, View, ViewCamera};
use super::{Distortion, ScanLogOptions};
use crate::bytes::open as open_input;
use crate::poses3::{PoseConvention, RawPose};
use crate::{IoError, Result};

const FILE: &str = "transforms.json";
const DEPTHS: [&str; 2] = ["depth_file_path", "depth_path"];
const UNITS_PER_METRE: f64 = 1000.0;
/// The most bytes of the file.
const LIMIT: u64 = 256 << 20;

pub(super) fn is_it(path: &Path) -> bool {
    path.join(FILE).is_file()
}

pub(super) fn open(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let file = path.join(FILE);
    let bytes = open_input(&file)?.read_all(LIMIT)?;
    let json: Value = serde_json::from_slice(&bytes).map_err(|e| {
        IoError::layout(&file, "the json", format!("not readable ({e})"), "export the cameras again")
    })?;
    read(&file, path, &json)?.parts(path, options)
}

fn read(file: &Path, folder: &Path, json: &Value) -> Result<Model> {
    let Some(frames) = json.get("frames").and_then(Value::as_array) else {
        return Err(IoError::layout(
            file,
            "the list of frames",
            "missing",
            "give frames with transform_matrix",
        ));
    };
    let mut cameras: Vec<ViewCamera> = Vec::new();
    let mut views = Vec::with_capacity(frames.len());
    for (i, frame) in frames.iter().enumerate() {
        let depth = DEPTHS
            .iter()
            .find_map(|name| frame.get(name))
            .map(|p| path_of(file, folder, i, p))
            .transpose()?;
        let color = frame.get("file_path").map(|p| path_of(file, folder, i, p)).transpose()?;
        // A camera without its size and center is worked out from the depth image.
        let Some(there) = depth.as_ref().filter(|depth| depth.is_file()) else {
            views.push(View { camera: 0, pose: pose_of(file, i, frame)?, depth, color: None });
            continue;
        };
        let camera = camera_of(file, i, [frame, json], there)?;
        let place = cameras.iter().position(|c| *c == camera).unwrap_or_else(|| {
            cameras.push(camera);
            cameras.len() - 1
        });
        let color = color.and_then(|path| with_some_ending(&path));
        views.push(View { camera: place, pose: pose_of(file, i, frame)?, depth, color });
    }
    let scale = json.get("integer_depth_scale").and_then(Value::as_f64);
    Ok(Model {
        file: file.to_owned(),
        cameras,
        views,
        convention: PoseConvention::OpenGlCamera,
        units_per_metre: scale.map_or(UNITS_PER_METRE, |meters| 1.0 / meters),
        looked_for: format!("{} of each frame", DEPTHS.join(" or ")),
        notes: Vec::new(),
    })
}

fn path_of(file: &Path, folder: &Path, i: usize, value: &Value) -> Result<PathBuf> {
    match value.as_str() {
        Some(name) if !name.is_empty() && !name.contains('\0') => Ok(folder.join(name)),
        _ => {
            Err(IoError::layout(file, format!("a path of frame {i}"), shown(value), "name a file beside it"))
        }
    }
}

/// The file, or the one that is there with an ending: the oldest files have none.
fn with_some_ending(path: &Path) -> Option<PathBuf> {
    let with = |ending: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(ending);
        PathBuf::from(name)
    };
    [path.to_owned(), with(".png"), with(".jpg")].into_iter().find(|path| path.is_file())
}

fn pose_of(file: &Path, i: usize, frame: &Value) -> Result<RawPose> {
    let entries = |rows: &Value| {
        let rows = rows.as_array().filter(|rows| (3..=4).contains(&rows.len()))?;
        let mut matrix = [[0.0, 0.0, 0.0, 1.0]; 4];
        for (to, row) in matrix.iter_mut().zip(rows) {
            let row = row.as_array().filter(|row| row.len() == 4)?;
            for (to, value) in to.iter_mut().zip(row) {
                *to = value.as_f64()?;
            }
        }
        Some(matrix)
    };
    let matrix = frame.get("transform_matrix").and_then(entries);
    let Some(matrix) = matrix else {
        let value = frame.get("transform_matrix").map_or("missing".into(), shown);
        return Err(IoError::layout(
            file,
            format!("transform_matrix of frame {i}"),
            value,
            "give 4 x 4 numbers",
        ));
    };
    Ok(RawPose { matrix, time: None, number: None, line: i as u64 + 1 })
}

/// The camera of a frame: its own numbers, else those of all.
fn camera_of(file: &Path, i: usize, from: [&Value; 2], depth: &Path) -> Result<ViewCamera> {
    let number = |name: &str| -> Result<Option<f64>> {
        let Some(value) = from.iter().find_map(|v| v.get(name)) else { return Ok(None) };
        let sane = value.as_f64().filter(|v| v.abs() < 1e9);
        sane.map(Some).ok_or_else(|| {
            IoError::layout(file, format!("{name} of frame {i}"), shown(value), "give a number")
        })
    };
    let side = |name: &str| -> Result<Option<usize>> {
        let Some(value) = number(name)? else { return Ok(None) };
        if (1.0..=1e6).contains(&value) && value.fract() == 0.0 {
            return Ok(Some(value as usize));
        }
        Err(IoError::layout(file, format!("{name} of frame {i}"), value, "give the pictures' size in pixels"))
    };
    let size = side("w")?.zip(side("h")?).map(|(w, h)| [w, h]);
    let [w, h] = match size {
        Some(size) => size,
        None => depth_image_size(depth)?,
    }
    .map(|n| n as f64);
    let focal = |name: &str, angle: &str, side: f64| -> Result<Option<f64>> {
        Ok(match (number(name)?, number(angle)?) {
            (Some(focal), _) => Some(focal),
            (None, Some(angle)) => Some(0.5 * side / (0.5 * angle).tan()),
            (None, None) => None,
        })
    };
    let fx = focal("fl_x", "camera_angle_x", w)?;
    let fy = focal("fl_y", "camera_angle_y", h)?;
    let Some(fx) = fx.or(fy) else {
        return Err(IoError::layout(
            file,
            format!("the camera of frame {i}"),
            "missing",
            "give fl_x or camera_angle_x",
        ));
    };
    if size.is_none() && number("fl_x")?.is_some() {
        let advice = "give w and h, the size of the pictures that fl_x is for";
        return Err(IoError::layout(file, format!("the size of frame {i}"), "missing", advice));
    }
    let pinhole = Pinhole {
        fx,
        fy: fy.unwrap_or(fx),
        cx: number("cx")?.unwrap_or(0.5 * w),
        cy: number("cy")?.unwrap_or(0.5 * h),
    };
    let mut k = [0.0; 6];
    for (k, name) in k.iter_mut().zip(["k1", "k2", "k3", "k4", "k5", "k6"]) {
        *k = number(name)?.unwrap_or(0.0);
    }
    let p = [number("p1")?.unwrap_or(0.0), number("p2")?.unwrap_or(0.0)];
    let model = from.iter().find_map(|v| v.get("camera_model"));
    let is_fisheye = from.iter().any(|v| v.get("is_fisheye").and_then(Value::as_bool) == Some(true));
    let distortion = match model.map(|m| m.as_str().unwrap_or_default().to_ascii_uppercase()).as_deref() {
        None if is_fisheye => Distortion::Fisheye([k[0], k[1], k[2], k[3]]),
        None
        | Some(
            "OPENCV" | "SIMPLE_RADIAL" | "RADIAL" | "PINHOLE" | "SIMPLE_PINHOLE" | "FULL_OPENCV"
            | "PERSPECTIVE",
        ) => Distortion::brown_conrady(k, p),
        Some("OPENCV_FISHEYE" | "FISHEYE" | "SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE") => {
            Distortion::Fisheye([k[0], k[1], k[2], k[3]])
        }
        Some(other) => {
            let advice = "give PINHOLE, OPENCV, FULL_OPENCV or OPENCV_FISHEYE";
            return Err(IoError::layout(file, format!("camera_model of frame {i}"), other, advice));
        }
    };
    Ok(ViewCamera { pinhole, distortion, size })
}

fn shown(value: &Value) -> String {
    value.to_string().chars().take(80).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::testing::*;
    use crate::scan_log::{ScanLog, ScanLogKind};
    use crate::testing::{no_panic, says};
    use portolan::geom::Pose;
    use portolan::scan::Projection;

    /// The matrix of a camera that looks along -z with y up.
    fn opengl(pose: &Pose<3>) -> String {
        let row = |k: usize| {
            let [a, b, c] = pose.rotation[k];
            format!("[{a}, {}, {}, {}]", -b, -c, pose.translation[k])
        };
        format!("[{}, {}, {}, [0, 0, 0, 1]]", row(0), row(1), row(2))
    }

    fn frames(count: usize) -> String {
        let one = |i: usize| {
            let matrix = opengl(&camera_pose(i));
            format!(
                r#"{{"file_path": "images/{i}.png", "depth_file_path": "depths/{i}.png", "transform_matrix": {matrix}}}"#
            )
        };
        (0..count).map(one).collect::<Vec<_>>().join(",\n")
    }

    fn folder_of(count: usize, camera: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for i in 0..count {
            write_depth(&folder.path().join(format!("depths/{i}.png")), i, 1000.0);
            write_color(&folder.path().join(format!("images/{i}.png")), [9, i as u8, 3]);
        }
        write(&folder.path().join(FILE), format!("{{{camera}, \"frames\": [{}]}}", frames(count)));
        folder
    }

    /// The small camera, with the first pixel's center at a half.
    const CAMERA: &str = r#""fl_x": 10, "fl_y": 12, "cx": 4, "cy": 3, "w": 8, "h": 6"#;

    #[test]
    fn nerfstudio_and_instant_ngp() {
        let folder = folder_of(5, CAMERA);
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!((log.kind(), log.len()), (ScanLogKind::Transforms, 5));
        for i in 0..5 {
            assert_is_picture(&log, i, i);
            let seen = image(&log, i);
            let Projection::Pinhole(camera) = seen.projection else { panic!("a camera") };
            assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], SMALL_CAMERA);
            // Pixels without a reading have no color of their own camera.
            assert_eq!((seen.colors[2], seen.colors.len()), ([9, i as u8, 3], 48));
        }
        // Of pictures five times as large: the same camera.
        let folder = folder_of(2, r#""fl_x": 50, "fl_y": 60, "cx": 20, "cy": 15, "w": 40, "h": 30"#);
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_is_picture(&log, 1, 1);
        let why = log.stats().colors_left_out.clone().unwrap();
        assert!(why.contains("is 8 x 6 while its camera is for 40 x 30"), "{why}");
        // An angle of view: 8 pixels of 10 pixels' focal length.
        let angle = 2.0 * (0.4f64).atan();
        let other = frames(2).replace("depth_file_path", "depth_path");
        let text = format!(
            r#"{{"camera_angle_x": {angle}, "fl_y": 12, "w": 8, "h": 6, "integer_depth_scale": 0.001, "frames": [{other}]}}"#
        );
        write(&folder.path().join(FILE), text);
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_is_picture(&log, 1, 1);
    }

    #[test]
    fn what_is_missing_is_counted_or_refused() {
        let folder = folder_of(4, CAMERA);
        let file = folder.path().join(FILE);
        std::fs::remove_file(folder.path().join("depths/2.png")).unwrap();
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!((log.len(), log.stats().missing_files), (3, 1));
        let text = std::fs::read_to_string(&file).unwrap();
        let refused = |from: &str, to: &str, part: &str| {
            write(&file, text.replace(from, to));
            says(ScanLog::open(folder.path(), &ScanLogOptions::default()), part);
        };
        refused("\"depth_file_path\"", "\"no\"", "the number of pictures with a depth image is 0 of 4");
        refused("\"frames\"", "\"scenes\"", "the list of frames is missing");
        refused("\"transform_matrix\"", "\"matrix\"", "transform_matrix of frame 0 is missing");
        refused("\"fl_x\": 10", "\"fl_x\": \"ten\"", "fl_x of frame 0 is \"ten\"; give a number");
        refused("\"fl_x\": 10", "\"fl_x\": -10", "fx is -10");
        refused("\"w\": 8, \"h\": 6", "\"w\": 8", "the size of frame 0 is missing");
        refused("\"w\": 8, \"h\": 6", "\"w\": 6, \"h\": 8", "which is of another shape");
        refused("\"w\": 8", "\"w\": 8.5", "w of frame 0 is 8.5");
        refused(
            "\"fl_x\"",
            "\"camera_model\": \"EQUIRECTANGULAR\", \"fl_x\"",
            "camera_model of frame 0 is EQUIRECTANGULAR",
        );
        refused("{", "", "the json is not readable");
        no_panic(text.as_bytes(), 7, 300, |bytes| {
            let json: Value = serde_json::from_slice(&bytes).unwrap_or_default();
            read(&file, folder.path(), &json).map(|_| ())
        });
    }

    #[test]
    fn lenses_of_both_kinds() {
        for (text, expected) in [
            (
                r#""k1": 0.1, "p1": 0.2"#,
                Distortion::brown_conrady([0.1, 0.0, 0.0, 0.0, 0.0, 0.0], [0.2, 0.0]),
            ),
            (
                r#""camera_model": "OPENCV_FISHEYE", "k1": 0.1, "k4": 0.3"#,
                Distortion::Fisheye([0.1, 0.0, 0.0, 0.3]),
            ),
            (r#""is_fisheye": true"#, Distortion::Fisheye([0.0; 4])),
        ] {
            let folder = folder_of(1, &format!("{CAMERA}, {text}"));
            let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
            assert_eq!(log.camera().unwrap().distortion, expected);
        }
    }
}
