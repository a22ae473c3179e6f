//! The numbers of a camera, and where they come from.

use std::fmt;
use std::path::{Path, PathBuf};

use portolan::geom::Pose;
use portolan::scan::Pinhole;
use serde_json::Value;

use super::lens::{Lens, scaled};
use super::{ColorCamera, Distortion, ScanLogOptions};
use crate::bytes::{open, parse_f64};
use crate::{IoError, Result};

/// The camera that a caller gives.
#[derive(Clone, Debug, PartialEq)]
pub enum Intrinsics {
    /// The numbers themselves.
    Pinhole(Pinhole),
    /// A file: a 3x3 or 4x4 matrix or `fx fy cx cy` as text, or Open3D's json.
    File(PathBuf),
}

impl Intrinsics {
    /// The value of `--intrinsics`: four numbers `fx,fy,cx,cy`, or else the name of a file.
    pub fn from_word(word: &str) -> Self {
        let numbers: Option<Vec<f64>> = word.split(',').map(|w| parse_f64(w.trim().as_bytes())).collect();
        match numbers.as_deref() {
            Some(&[fx, fy, cx, cy]) => Self::Pinhole(Pinhole { fx, fy, cx, cy }),
            _ => Self::File(word.into()),
        }
    }

    /// `option` names where the numbers were given, for errors.
    pub(super) fn camera(&self, option: &str) -> Result<Camera> {
        match self {
            Self::File(path) => read_intrinsics(path),
            Self::Pinhole(pinhole) => {
                check(pinhole, Path::new(option))?;
                Ok(Camera::new(*pinhole, CameraFrom::Caller, None))
            }
        }
    }
}

/// Where the numbers of a camera come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CameraFrom {
    /// The caller gave them.
    Caller,
    /// A file.
    File(PathBuf),
    /// No file has them; they are those that the makers of the data set publish.
    DataSet(&'static str),
}

impl fmt::Display for CameraFrom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Caller => write!(f, "given"),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::DataSet(name) => write!(f, "published for {name}"),
        }
    }
}

/// The camera of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Its numbers (pixels); of the first camera, where there are several.
    pub pinhole: Pinhole,
    /// Where they come from.
    pub from: CameraFrom,
    /// Columns and rows of the pictures that they are for, if the file has them.
    pub size: Option<[usize; 2]>,
    /// Its lens.
    pub distortion: Distortion,
    /// The color camera, where it is not this one.
    pub color: Option<ColorCamera>,
}

impl Camera {
    pub(crate) fn new(pinhole: Pinhole, from: CameraFrom, size: Option<[usize; 2]>) -> Self {
        Self { pinhole, from, size, distortion: Distortion::None, color: None }
    }

    pub(crate) fn lens(&self) -> Lens {
        Lens::new(self.pinhole, self.distortion)
    }

    /// Makes it the camera of pictures of this size, and returns by how much it was scaled. It is only done where the camera's own
    /// size is known, and of the same shape to 1 %.
    ///
    /// # Errors
    /// [`IoError::Layout`] where it is not.
    pub(super) fn scale_to(&mut self, picture: &Path, [columns, rows]: [usize; 2]) -> Result<[f64; 2]> {
        let Some([w, h]) = self.size else {
            let advice =
                "its size is not known; give --intrinsics a json with width and height, or scale it yourself";
            return Err(IoError::layout(picture, "the camera to scale", self.from.to_string(), advice));
        };
        let by = [columns as f64 / w.max(1) as f64, rows as f64 / h.max(1) as f64];
        if (by[0] / by[1] - 1.0).abs() > 0.01 || !by.iter().all(|s| s.is_normal()) {
            let advice = format!(
                "the camera is for {w} x {h}, which is of another shape; give the depth camera with --intrinsics"
            );
            return Err(IoError::layout(
                picture,
                "the size of the picture",
                format!("{columns} x {rows}"),
                advice,
            ));
        }
        (self.pinhole, self.size) = (scaled(self.pinhole, by), Some([columns, rows]));
        Ok(by)
    }

    /// A camera whose size is not known fits where its center is in the middle part of the picture.
    ///
    /// # Errors
    /// [`IoError::Layout`] where the camera is not one of pictures of this size: a common mix-up.
    pub(crate) fn check_size(&self, picture: &Path, size: [usize; 2]) -> Result<()> {
        let Pinhole { cx, cy, .. } = self.pinhole;
        let inside = |c: f64, n: usize| (0.3..=0.7).contains(&((c + 0.5) / n as f64));
        let fits = match self.size {
            Some(own) => own == size,
            None => inside(cx, size[0]) && inside(cy, size[1]),
        };
        if fits {
            return Ok(());
        }
        let advice = match (self.size, &self.from) {
            (Some([w, h]), _) => {
                format!(
                    "the camera is for {w} x {h}; give the camera of these pictures with --intrinsics, or scale it with \
                     --scale-intrinsics"
                )
            }
            (None, _) => format!(
                "the camera has its center at {cx}, {cy}, far from the middle; give the camera of these pictures with \
                 --intrinsics, as json with width and height if its center is there"
            ),
        };
        Err(IoError::layout(picture, "the size of the picture", format!("{} x {}", size[0], size[1]), advice))
    }
}

/// The camera that the caller gave.
///
/// # Errors
/// Those of reading its file.
pub(crate) fn given_camera(options: &ScanLogOptions) -> Result<Option<Camera>> {
    options.intrinsics.as_ref().map(|given| given.camera("--intrinsics")).transpose()
}

/// The camera of a log: what the caller gave, else the first of these files that is there, else what the data set's makers
/// publish.
///
/// # Errors
/// [`IoError::Layout`] where the camera is unknown, and the errors of reading.
pub(super) fn find_camera(
    folder: &Path,
    files: &[&str],
    published: Option<(&'static str, [f64; 4])>,
    options: &ScanLogOptions,
) -> Result<Camera> {
    let camera = camera_of(folder, files, published, options)?;
    Ok(Camera { distortion: options.distortion.unwrap_or(camera.distortion), ..camera })
}

fn camera_of(
    folder: &Path,
    files: &[&str],
    published: Option<(&'static str, [f64; 4])>,
    options: &ScanLogOptions,
) -> Result<Camera> {
    if let Some(given) = &options.intrinsics {
        return given.camera("--intrinsics");
    }
    if let Some(file) = files.iter().map(|name| folder.join(name)).find(|file| file.is_file()) {
        return read_intrinsics(&file);
    }
    let Some((name, [fx, fy, cx, cy])) = published else {
        let advice = format!("give fx,fy,cx,cy or a file with --intrinsics, or put it at {}", files[0]);
        return Err(IoError::layout(folder, "the camera", "unknown", advice));
    };
    // All that is published here is of the first Kinect and its like.
    Ok(Camera::new(Pinhole { fx, fy, cx, cy }, CameraFrom::DataSet(name), Some([640, 480])))
}

/// The four numbers of a camera.
pub(super) fn pinhole([fx, fy, cx, cy]: [f64; 4]) -> Pinhole {
    Pinhole { fx, fy, cx, cy }
}

/// The color camera of a log: what the caller gave of it, else what is published for the data set. `None`: colors are pixels of
/// the depth image.
///
/// # Errors
/// Those of reading what the caller gave.
pub(super) fn color_camera(
    depth: &Camera,
    published: Option<(&'static str, [f64; 4])>,
    options: &ScanLogOptions,
) -> Result<Option<ColorCamera>> {
    let asked = options.color_from_depth.is_some() || options.color_distortion.is_some();
    let camera = match (&options.color_intrinsics, published) {
        (Some(given), _) => given.camera("--color-intrinsics")?,
        (None, Some((name, numbers))) => Camera::new(pinhole(numbers), CameraFrom::DataSet(name), None),
        // The depth camera's numbers, elsewhere or behind another lens.
        (None, None) if asked => depth.clone(),
        (None, None) => return Ok(None),
    };
    Ok(Some(ColorCamera {
        pinhole: camera.pinhole,
        distortion: options.color_distortion.unwrap_or_default(),
        color_from_depth: options.color_from_depth.unwrap_or(Pose::IDENTITY),
        from: camera.from,
    }))
}

/// Reads the numbers of a camera: nine numbers of a 3x3 matrix, sixteen of a 4x4 one, four (`fx fy cx cy`), or json
/// (`intrinsic_matrix` of Open3D, which is column by column, or `fx`, `fy`, `cx`, `cy`).
fn read_intrinsics(path: &Path) -> Result<Camera> {
    const LIMIT: u64 = 1 << 20;
    let bytes = open(path)?.read_all(LIMIT)?;
    let text = String::from_utf8_lossy(&bytes);
    let unreadable = |value: &str| {
        let advice = "give a 3x3 matrix or fx fy cx cy as text, or Open3D's json with intrinsic_matrix";
        IoError::layout(path, "the camera matrix", value, advice)
    };
    let (numbers, size) = if text.trim_start().starts_with('{') {
        let json: Value =
            serde_json::from_str(&text).map_err(|e| unreadable(&format!("not readable as json ({e})")))?;
        of_json(&json).ok_or_else(|| unreadable("not in the json"))?
    } else {
        let lines = text.lines().map(|line| line.split('#').next().unwrap_or(""));
        let words = lines.flat_map(|l| l.split(|c: char| c.is_whitespace() || ",;[]".contains(c)));
        let numbers: Option<Vec<f64>> =
            words.filter(|w| !w.is_empty()).take(17).map(|w| parse_f64(w.as_bytes())).collect();
        (numbers.ok_or_else(|| unreadable("not all numbers"))?, None)
    };
    // The pinhole camera here has no skew.
    let ([fx, fy, cx, cy], skew) = match *numbers {
        [fx, fy, cx, cy] => ([fx, fy, cx, cy], 0.0),
        [fx, skew, cx, a, fy, cy, b, c, _] | [fx, skew, cx, _, a, fy, cy, _, b, c, _, _, _, _, _, _]
            if a == 0.0 && b == 0.0 && c == 0.0 =>
        {
            ([fx, fy, cx, cy], skew)
        }
        [fx, 0.0, 0.0, skew, fy, 0.0, cx, cy, _] => ([fx, fy, cx, cy], skew),
        _ => {
            return Err(unreadable(&format!("{} numbers of another layout", numbers.len())));
        }
    };
    if skew.abs() > 1e-3 * fx.abs() {
        return Err(IoError::layout(path, "the skew", skew, "give a camera without skew"));
    }
    let pinhole = Pinhole { fx, fy, cx, cy };
    check(&pinhole, path)?;
    Ok(Camera::new(pinhole, CameraFrom::File(path.into()), size))
}

/// Numbers of a matrix, perhaps nested, and columns and rows of the picture.
fn of_json(json: &Value) -> Option<(Vec<f64>, Option<[usize; 2]>)> {
    let side = |name: &str| json.get(name)?.as_u64().and_then(|v| usize::try_from(v).ok());
    let size = side("width").zip(side("height")).map(|(w, h)| [w, h]);
    if let Some(matrix) = json.get("intrinsic_matrix") {
        let flat = |v: &Value| match v {
            Value::Array(inner) => inner.clone(),
            other => vec![other.clone()],
        };
        let entries = matrix.as_array()?.iter().flat_map(flat).take(17);
        return Some((entries.map(|v| v.as_f64()).collect::<Option<_>>()?, size));
    }
    let number = |name: &str| json.get(name)?.as_f64();
    Some((vec![number("fx")?, number("fy")?, number("cx")?, number("cy")?], size))
}

pub(super) fn check(p: &Pinhole, path: &Path) -> Result<()> {
    for (name, value, low) in
        [("fx", p.fx, 1e-3), ("fy", p.fy, 1e-3), ("cx", p.cx, -MOST), ("cy", p.cy, -MOST)]
    {
        if !(value >= low && value <= MOST) {
            let advice = "give pixels; focal lengths are positive, y points down";
            return Err(IoError::layout(path, name, value, advice));
        }
    }
    Ok(())
}

/// No camera has so many pixels in a row.
const MOST: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{no_panic, says};

    fn read(text: &[u8]) -> Result<Camera> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read_intrinsics(file.path())
    }

    const OPEN3D: &str =
        r#"{"width": 640, "height": 480, "intrinsic_matrix": [525, 0, 0, 0, 526, 0, 319.5, 239.5, 1]}"#;

    #[test]
    fn all_layouts_are_the_same_camera() {
        let expected = Pinhole { fx: 525.0, fy: 526.0, cx: 319.5, cy: 239.5 };
        for text in [
            "5.25e2 0 319.5\n0 526 239.5\n0 0 1\n",
            "525,0,319.5,0\n0,526,239.5,0\n0,0,1,0\n0,0,0,1\n",
            "# fx fy cx cy\n525 526 319.5 239.5",
            "[[525, 0, 319.5], [0, 526, 239.5], [0, 0, 1]]",
            OPEN3D,
            r#"{"fx": 525, "fy": 526, "cx": 319.5, "cy": 239.5, "w": 1}"#,
            r#"{"intrinsic_matrix": [[525, 0, 319.5], [0, 526, 239.5], [0, 0, 1]]}"#,
        ] {
            assert_eq!(read(text.as_bytes()).unwrap().pinhole, expected, "{text}");
        }
        assert_eq!(Intrinsics::from_word("525, 526,319.5,239.5"), Intrinsics::Pinhole(expected));
        assert_eq!(Intrinsics::from_word("a,b.json"), Intrinsics::File("a,b.json".into()));
        let camera = read(OPEN3D.as_bytes()).unwrap();
        assert!(camera.check_size("x".as_ref(), [640, 480]).is_ok());
        says(camera.check_size("x".as_ref(), [320, 240]), "the camera is for 640 x 480");
        // Without a size the center tells: in a corner, or in the middle of a quarter.
        let unsized_camera = Camera { size: None, ..camera };
        assert!(unsized_camera.check_size("x".as_ref(), [640, 480]).is_ok());
        for other in [[320, 240], [1280, 960]] {
            says(unsized_camera.check_size("x".as_ref(), other), "far from the middle");
        }
        let mut scaled = read(OPEN3D.as_bytes()).unwrap();
        assert_eq!(scaled.scale_to("x".as_ref(), [320, 240]).unwrap(), [0.5, 0.5]);
        assert_eq!(scaled.pinhole, Pinhole { fx: 262.5, fy: 263.0, cx: 159.5, cy: 119.5 });
        says(scaled.scale_to("x".as_ref(), [320, 320]), "which is of another shape");
        says(unsized_camera.clone().scale_to("x".as_ref(), [320, 240]), "its size is not known");
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        for (text, part) in [
            ("", "the camera matrix is 0 numbers"),
            ("1 2 3", "the camera matrix is 3 numbers"),
            ("{", "not readable as json"),
            ("{}", "not in the json"),
            ("a b c d", "not all numbers"),
            ("481 -480 319.5 239.5", "fy is -480; give pixels"),
            ("nan 480 319.5 239.5", "fx is NaN"),
            ("500 9 320 0 500 240 0 0 1", "the skew is 9"),
        ] {
            says(read(text.as_bytes()), part);
        }
        no_panic(OPEN3D.as_bytes(), 8, 300, |bytes| read(&bytes));
    }
}
