//! COLMAP *(Schoenberger, Frahm 2016)*: a sparse model, text (`cameras.txt`, `images.txt`) or binary (`.bin`), with depth images
//! beside it.
//!
//! Poses are camera from world: quaternion `qw qx qy qz` and translation. **The scale of a model is arbitrary**: depth images in
//! meters fit only a model that was scaled to meters. Depth images are in `depth`, `depths` or `depth_maps`, 16-bit gray, named
//! like the pictures (`frame_1.jpg`: `frame_1.png` or `frame_1.jpg.png`), pictures in `images`.

use std::io::Read;
use std::path::{Path, PathBuf};

use portolan::scan::Pinhole;

use super::ScanLogOptions;
use super::distortion::Distortion;
use super::parts::Parts;
use super::views::{Model, View, ViewCamera};
use crate::bytes::{Input, Lines, fields, open as open_input, parse_f64, whole};
use crate::error::shown;
use crate::poses3::{PoseConvention, RawPose};
use crate::{IoError, Result};

/// Where a model is, under the folder of the log.
const PLACES: [&str; 4] = ["sparse/0", "sparse", "colmap/sparse/0", "."];
const DEPTHS: [&str; 3] = ["depth", "depths", "depth_maps"];
const PICTURES: &str = "images";
const UNITS_PER_METRE: f64 = 1000.0;
/// The most cameras and pictures of a model.
const MOST: usize = 1 << 21;
/// The longest name of a picture (bytes).
const LONGEST_NAME: usize = 4096;

/// A model of cameras: its name, its number in binary files, and how many parameters it has.
const MODELS: [(&str, i32, usize); 9] = [
    ("SIMPLE_PINHOLE", 0, 3),
    ("PINHOLE", 1, 4),
    ("SIMPLE_RADIAL", 2, 4),
    ("RADIAL", 3, 5),
    ("OPENCV", 4, 8),
    ("OPENCV_FISHEYE", 5, 8),
    ("FULL_OPENCV", 6, 12),
    ("SIMPLE_RADIAL_FISHEYE", 8, 4),
    ("RADIAL_FISHEYE", 9, 5),
];

/// A picture of the model.
struct Picture {
    name: String,
    camera_id: u64,
    pose: RawPose,
}

fn model_of(path: &Path) -> Option<PathBuf> {
    let has = |folder: &Path, ending: &str| {
        ["cameras", "images"].iter().all(|name| folder.join(format!("{name}.{ending}")).is_file())
    };
    PLACES.iter().map(|place| path.join(place)).find(|folder| has(folder, "bin") || has(folder, "txt"))
}

pub(super) fn is_it(path: &Path) -> bool {
    model_of(path).is_some()
}

pub(super) fn open(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let Some(folder) = model_of(path) else {
        let advice = format!("looked for cameras and images, .bin or .txt, in {}", PLACES.join(", "));
        return Err(IoError::layout(path, "the model", "missing", advice));
    };
    let ending = if folder.join("cameras.bin").is_file() && folder.join("images.bin").is_file() {
        "bin"
    } else {
        "txt"
    };
    let files = ["cameras", "images"].map(|name| folder.join(format!("{name}.{ending}")));
    let (cameras, mut pictures) = match ending {
        "bin" => (binary_cameras(&files[0])?, binary_pictures(&files[1])?),
        _ => (text_cameras(&files[0])?, text_pictures(&files[1])?),
    };
    pictures.sort_by(|a, b| a.name.cmp(&b.name));
    let mut views = Vec::with_capacity(pictures.len());
    for picture in pictures {
        let Some(camera) = cameras.iter().position(|(id, _)| *id == picture.camera_id) else {
            let (field, value) = (format!("the camera of {}", picture.name), picture.camera_id);
            return Err(IoError::layout(&files[1], field, value, "give the cameras of the same model"));
        };
        let color = Some(path.join(PICTURES).join(&picture.name)).filter(|file| file.is_file());
        views.push(View { camera, depth: depth_of(path, &picture.name), color, pose: picture.pose });
    }
    let model = Model {
        file: files[1].clone(),
        cameras: cameras.into_iter().map(|(_, camera)| camera).collect(),
        views,
        convention: PoseConvention::SensorFromWorld,
        units_per_metre: UNITS_PER_METRE,
        looked_for: format!("{} in {}", "NAME.png", DEPTHS.join(", ")),
        notes: vec![
            "the scale of a COLMAP model is arbitrary: its poses fit depth images in meters only if it was scaled to meters"
                .into(),
        ],
    };
    model.parts(path, options)
}

/// The depth image of a picture.
fn depth_of(path: &Path, name: &str) -> Option<PathBuf> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let names = [format!("{stem}.png"), format!("{name}.png")];
    DEPTHS
        .iter()
        .flat_map(|folder| names.iter().map(move |n| path.join(folder).join(n)))
        .find(|file| file.is_file())
}

fn text_cameras(path: &Path) -> Result<Vec<(u64, ViewCamera)>> {
    let mut lines = Lines::of(open_input(path)?);
    let mut cameras = Vec::new();
    while let Some((number, line)) = lines.next_numbered()? {
        let mut words = fields(line).peekable();
        if words.peek().is_none_or(|w| w.starts_with(b"#")) {
            continue;
        }
        let bad =
            |field: &str| IoError::text(path, number, field, shown(line), "write ID MODEL W H PARAMETERS");
        let id = words.next().and_then(whole::<u64>).ok_or_else(|| bad("the number of the camera"))?;
        let model = words.next().map(|w| String::from_utf8_lossy(w).into_owned()).unwrap_or_default();
        let size = [words.next(), words.next()].map(|w| w.and_then(whole::<u64>));
        let [Some(w), Some(h)] = size else { return Err(bad("the size of the camera")) };
        let parameters: Option<Vec<f64>> = words.take(16).map(parse_f64).collect();
        let parameters = parameters.ok_or_else(|| bad("the parameters of the camera"))?;
        IoError::unless_full(path, number, cameras.len(), MOST, "cameras", "model")?;
        cameras.push((id, camera(path, id, &model, [w, h], &parameters)?));
    }
    Ok(cameras)
}

fn text_pictures(path: &Path) -> Result<Vec<Picture>> {
    let mut lines = Lines::of(open_input(path)?);
    let mut pictures = Vec::new();
    while let Some((number, line)) = lines.next_numbered()? {
        let Some(picture) = picture_of(path, number, line)? else { continue };
        IoError::unless_full(path, number, pictures.len(), MOST, "pictures", "model")?;
        pictures.push(picture);
        // The points of the picture, perhaps none: an empty line.
        lines.next_line()?;
    }
    Ok(pictures)
}

/// The picture of a line; `None` for a comment and an empty line.
fn picture_of(path: &Path, number: u64, line: &[u8]) -> Result<Option<Picture>> {
    let mut words = fields(line).peekable();
    if words.peek().is_none_or(|w| w.starts_with(b"#")) {
        return Ok(None);
    }
    let bad = |field: &str| {
        IoError::text(
            path,
            number,
            field,
            shown(line),
            "write ID QW QX QY QZ TX TY TZ CAMERA NAME, then its points",
        )
    };
    words.next().and_then(whole::<u64>).ok_or_else(|| bad("the number of the picture"))?;
    let numbers: Option<Vec<f64>> = words.by_ref().take(7).map(parse_f64).collect();
    let Some(&[w, x, y, z, tx, ty, tz]) = numbers.as_deref() else {
        return Err(bad("the pose of the picture"));
    };
    let camera_id = words.next().and_then(whole::<u64>).ok_or_else(|| bad("the camera of the picture"))?;
    // A name may have spaces: it is the rest of the line.
    let after_word = |rest: &[u8]| rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
    let name = (0..9).fold(line.trim_ascii(), |rest, _| rest[after_word(rest)..].trim_ascii_start());
    if name.is_empty() {
        return Err(bad("the name of the picture"));
    }
    let name = named(path, String::from_utf8_lossy(name).into_owned())?;
    Ok(Some(Picture { name, camera_id, pose: RawPose::from_quaternion([tx, ty, tz], [x, y, z, w], number) }))
}

/// A name that leads nowhere else.
fn named(path: &Path, name: String) -> Result<String> {
    if name.is_empty() || name.contains('\0') || name.len() > LONGEST_NAME {
        let value: String = name.chars().take(40).collect();
        return Err(IoError::layout(
            path,
            "the name of a picture",
            format!("{value:?}"),
            "give names of files",
        ));
    }
    Ok(name)
}

fn camera(path: &Path, id: u64, model: &str, size: [u64; 2], p: &[f64]) -> Result<ViewCamera> {
    let refuse = |what: &str, value: String, advice: String| {
        IoError::layout(path, format!("the {what} of camera {id}"), value, advice)
    };
    let Some((_, _, count)) = MODELS.iter().find(|(name, ..)| *name == model) else {
        let names = MODELS.map(|m| m.0).join(", ");
        return Err(refuse(
            "model",
            model.to_owned(),
            format!("give one of {names}; or undistort the pictures"),
        ));
    };
    if p.len() != *count {
        return Err(refuse("number of parameters", p.len().to_string(), format!("{model} has {count}")));
    }
    if let Some(bad) = p.iter().find(|v| !(v.abs() <= 1e6)) {
        return Err(refuse("parameters", bad.to_string(), "give pixels and coefficients".into()));
    }
    if size.iter().any(|n| *n == 0 || *n > 1 << 20) {
        return Err(refuse("size", format!("{} x {}", size[0], size[1]), "give that of its pictures".into()));
    }
    let one_focal = matches!(
        model,
        "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE"
    );
    let (pinhole, k) = if one_focal {
        (Pinhole { fx: p[0], fy: p[0], cx: p[1], cy: p[2] }, &p[3..])
    } else {
        (Pinhole { fx: p[0], fy: p[1], cx: p[2], cy: p[3] }, &p[4..])
    };
    let at = |i: usize| k.get(i).copied().unwrap_or(0.0);
    let distortion = match model {
        "SIMPLE_PINHOLE" | "PINHOLE" => Distortion::None,
        "SIMPLE_RADIAL" | "RADIAL" => Distortion::brown_conrady([at(0), at(1), 0.0, 0.0, 0.0, 0.0], [0.0; 2]),
        "OPENCV_FISHEYE" => Distortion::Fisheye([at(0), at(1), at(2), at(3)]),
        "SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE" => Distortion::Fisheye([at(0), at(1), 0.0, 0.0]),
        // OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6.
        _ => Distortion::brown_conrady([at(0), at(1), at(4), at(5), at(6), at(7)], [at(2), at(3)]),
    };
    Ok(ViewCamera { pinhole, distortion, size: Some(size.map(|n| n as usize)) })
}

/// Reads numbers of a binary file, which may end anywhere.
struct Bytes<'a> {
    path: &'a Path,
    input: Input,
    at: u64,
}

impl<'a> Bytes<'a> {
    fn open(path: &'a Path) -> Result<Self> {
        Ok(Self { path, input: open_input(path)?, at: 0 })
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.input.read_exact(&mut bytes).map_err(|_| self.ends())?;
        self.at += N as u64;
        Ok(bytes)
    }

    fn ends(&self) -> IoError {
        IoError::binary(self.path, self.at, "the model", "cut short", "copy the file again")
    }

    fn u64(&mut self) -> Result<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64> {
        self.take().map(f64::from_le_bytes)
    }

    /// A number of things, of which no more is believed than the limit.
    fn count(&mut self, what: &str) -> Result<u64> {
        let at = self.at;
        let count = self.u64()?;
        if count > MOST as u64 {
            return Err(IoError::binary(
                self.path,
                at,
                format!("the number of {what}"),
                count,
                "check that this is a model",
            ));
        }
        Ok(count)
    }

    fn skip(&mut self, count: u64) -> Result<()> {
        let skipped = std::io::copy(&mut self.input.by_ref().take(count), &mut std::io::sink());
        if skipped.map_err(|_| self.ends())? < count {
            return Err(self.ends());
        }
        self.at += count;
        Ok(())
    }
}

fn binary_cameras(path: &Path) -> Result<Vec<(u64, ViewCamera)>> {
    let mut bytes = Bytes::open(path)?;
    let mut cameras = Vec::new();
    for _ in 0..bytes.count("cameras")? {
        let (id, at) = (u64::from(bytes.u32()?), bytes.at);
        let number = bytes.u32()? as i32;
        let Some((model, _, count)) = MODELS.iter().find(|(_, n, _)| *n == number) else {
            let names = MODELS.map(|m| m.0).join(", ");
            let advice = format!("the models that are read are {names}; undistort the pictures");
            return Err(IoError::binary(path, at, format!("the model of camera {id}"), number, advice));
        };
        let size = [bytes.u64()?, bytes.u64()?];
        let parameters: Vec<f64> = (0..*count).map(|_| bytes.f64()).collect::<Result<_>>()?;
        cameras.push((id, camera(path, id, model, size, &parameters)?));
    }
    Ok(cameras)
}

fn binary_pictures(path: &Path) -> Result<Vec<Picture>> {
    let mut bytes = Bytes::open(path)?;
    let mut pictures = Vec::new();
    for i in 0..bytes.count("pictures")? {
        bytes.u32()?;
        let mut n = [0.0; 7];
        for value in &mut n {
            *value = bytes.f64()?;
        }
        let [w, x, y, z, tx, ty, tz] = n;
        let camera_id = u64::from(bytes.u32()?);
        let mut name = Vec::new();
        loop {
            let [byte] = bytes.take()?;
            if byte == 0 || name.len() > LONGEST_NAME {
                break;
            }
            name.push(byte);
        }
        let at = bytes.at;
        let points = bytes.u64()?;
        let Some(size) = points.checked_mul(24) else {
            return Err(IoError::binary(
                path,
                at,
                "the number of points",
                points,
                "check that this is a model",
            ));
        };
        bytes.skip(size)?;
        let pose = RawPose::from_quaternion([tx, ty, tz], [x, y, z, w], i + 1);
        pictures.push(Picture {
            name: named(path, String::from_utf8_lossy(&name).into_owned())?,
            camera_id,
            pose,
        });
    }
    Ok(pictures)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::testing::*;
    use crate::scan_log::{ScanLog, ScanLogKind};
    use crate::testing::{no_panic, says};
    use portolan::scan::Projection;

    /// A file of these bytes.
    fn temporary(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
        let (folder, path) = crate::testing::temporary("model");
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    /// `qw qx qy qz tx ty tz` of the camera from the world: the pictures are turned about z only.
    fn extrinsic(i: usize) -> [f64; 7] {
        let camera_from_world = camera_pose(i).inverse();
        let (sin, cos) = (0.05 * i as f64 + 0.2).sin_cos();
        let [x, y, z] = camera_from_world.translation;
        [cos, 0.0, 0.0, -sin, x, y, z]
    }

    fn text(count: usize) -> [String; 2] {
        let line = |i: usize| {
            let numbers: Vec<String> = extrinsic(i).iter().map(ToString::to_string).collect();
            // A picture without points has an empty line.
            let points = if i.is_multiple_of(2) { "1.5 2.5 -1 3.5 4.5 7" } else { "" };
            format!("{} {} 3 picture {i}.jpg\n{points}\n", i + 1, numbers.join(" "))
        };
        ["# Camera list\n3 PINHOLE 8 6 10 12 4 3\n".into(), (0..count).map(line).collect()]
    }

    fn binary(count: usize) -> [Vec<u8>; 2] {
        let mut cameras = [1u64.to_le_bytes().to_vec(), [3u32, 1].map(u32::to_le_bytes).concat()].concat();
        [8u64, 6].iter().for_each(|n| cameras.extend(n.to_le_bytes()));
        [10.0f64, 12.0, 4.0, 3.0].iter().for_each(|v| cameras.extend(v.to_le_bytes()));
        let mut images = (count as u64).to_le_bytes().to_vec();
        for i in 0..count {
            images.extend((i as u32 + 1).to_le_bytes());
            extrinsic(i).iter().for_each(|v| images.extend(v.to_le_bytes()));
            images.extend(3u32.to_le_bytes());
            images.extend(format!("picture {i}.jpg\0").bytes());
            let points = 2 * (i as u64 % 2);
            images.extend(points.to_le_bytes());
            images.extend(vec![7; 24 * points as usize]);
        }
        [cameras, images]
    }

    fn depths_in(folder: &Path, count: usize) {
        for i in 0..count {
            let name = if i.is_multiple_of(2) {
                format!("depth/picture {i}.png")
            } else {
                format!("depth/picture {i}.jpg.png")
            };
            write_depth(&folder.join(name), i, 1000.0);
        }
    }

    fn is_the_log(folder: &Path) {
        let log = ScanLog::open(folder, &ScanLogOptions::default()).unwrap();
        assert_eq!((log.kind(), log.len()), (ScanLogKind::Colmap, 4));
        for i in 0..4 {
            assert_is_picture(&log, i, i);
            let Projection::Pinhole(camera) = image(&log, i).projection else { panic!("a camera") };
            assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], SMALL_CAMERA);
        }
        assert!(log.stats().notes[0].contains("scale"));
    }

    #[test]
    fn text_and_binary_models_are_the_same_log() {
        let folder = tempfile::tempdir().unwrap();
        depths_in(folder.path(), 4);
        let [cameras, images] = text(4);
        write(&folder.path().join("sparse/0/cameras.txt"), cameras);
        write(&folder.path().join("sparse/0/images.txt"), images);
        is_the_log(folder.path());
        let folder = tempfile::tempdir().unwrap();
        depths_in(folder.path(), 4);
        let [cameras, images] = binary(4);
        write(&folder.path().join("sparse/cameras.bin"), cameras);
        write(&folder.path().join("sparse/images.bin"), images);
        is_the_log(folder.path());
    }

    #[test]
    fn every_camera_model() {
        let read = |model: &str, p: &[f64]| camera("c".as_ref(), 1, model, [640, 480], p);
        let simple = Pinhole { fx: 500.0, fy: 500.0, cx: 320.0, cy: 240.0 };
        let both = Pinhole { fy: 501.0, ..simple };
        let radial = |k1, k2| Distortion::brown_conrady([k1, k2, 0.0, 0.0, 0.0, 0.0], [0.0; 2]);
        for (model, p, pinhole, lens) in [
            ("SIMPLE_PINHOLE", &[500.0, 320.0, 240.0][..], simple, Distortion::None),
            ("PINHOLE", &[500.0, 501.0, 320.0, 240.0], both, Distortion::None),
            ("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, 0.1], simple, radial(0.1, 0.0)),
            ("RADIAL", &[500.0, 320.0, 240.0, 0.1, 0.2], simple, radial(0.1, 0.2)),
            (
                "OPENCV",
                &[500.0, 501.0, 320.0, 240.0, 0.1, 0.2, 0.3, 0.4],
                both,
                Distortion::brown_conrady([0.1, 0.2, 0.0, 0.0, 0.0, 0.0], [0.3, 0.4]),
            ),
            (
                "FULL_OPENCV",
                &[500.0, 501.0, 320.0, 240.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8],
                both,
                Distortion::brown_conrady([0.1, 0.2, 0.5, 0.6, 0.7, 0.8], [0.3, 0.4]),
            ),
            (
                "OPENCV_FISHEYE",
                &[500.0, 501.0, 320.0, 240.0, 0.1, 0.2, 0.3, 0.4],
                both,
                Distortion::Fisheye([0.1, 0.2, 0.3, 0.4]),
            ),
        ] {
            let found = read(model, p).unwrap();
            assert_eq!(
                (found.pinhole, found.distortion, found.size),
                (pinhole, lens, Some([640, 480])),
                "{model}"
            );
            says(read(model, &p[1..]), "the number of parameters of camera 1 is");
        }
        says(read("FOV", &[1.0; 5]), "the model of camera 1 is FOV; give one of SIMPLE_PINHOLE");
        says(read("PINHOLE", &[f64::NAN; 4]), "the parameters of camera 1 is NaN");
    }

    #[test]
    fn broken_models_are_refused() {
        let [cameras, images] = binary(3);
        let (_folder, file) = temporary(&cameras);
        assert_eq!(binary_cameras(&file).unwrap().len(), 1);
        for (at, value, part) in [
            (0usize, 0xffu8, "cut short"),
            (7, 0xff, "the number of cameras is"),
            (12, 77, "the model of camera 3 is 77"),
            (22, 0xff, "the size of camera 3 is"),
        ] {
            let mut bad = cameras.clone();
            bad[at] = value;
            let (_folder, file) = temporary(&bad);
            says(binary_cameras(&file), part);
        }
        for bytes in [&images[..], &cameras[..]] {
            for end in [0, 5, 8, 40, bytes.len() - 1] {
                let (_folder, file) = temporary(&bytes[..end]);
                says(binary_pictures(&file).and(binary_cameras(&file).map(|_| ())), "cut short");
            }
        }
        no_panic(&images, 9, 200, |bytes| {
            let (_folder, file) = temporary(&bytes);
            binary_pictures(&file).map(|_| ())
        });
        let [cameras, images] = text(2);
        for (from, to, part) in [
            ("1 0.98", "one 0.98", "line 1: the number of the picture"),
            (" 3 picture 0.jpg", " three picture 0.jpg", "line 1: the camera of the picture"),
            (" 3 picture 0.jpg", "", "line 1: the camera of the picture"),
        ] {
            let (_folder, file) = temporary(images.replacen(from, to, 1).as_bytes());
            says(text_pictures(&file), part);
        }
        let (_folder, file) = temporary(cameras.replace("8 6", "8 six").as_bytes());
        says(text_cameras(&file), "line 2: the size of the camera");
    }
}
