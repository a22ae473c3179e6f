//! `CameraInfo`: the numbers of a camera.

use super::header::Header;
use super::values::Record;
use crate::Result;

/// A camera as its driver declares it.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraInfo {
    /// The time, and the camera's optical frame.
    pub header: Header,
    /// Columns of its pictures.
    pub width: usize,
    /// Rows of its pictures.
    pub height: usize,
    /// `plumb_bob`, `rational_polynomial`, `equidistant`, ..; empty where there is none.
    pub distortion_model: String,
    /// The numbers of the distortion.
    pub d: Vec<f64>,
    /// The matrix of the pictures as they are, row by row. All zero: not calibrated.
    pub k: [f64; 9],
    /// The rotation of rectified pictures.
    pub r: [f64; 9],
    /// The matrix of rectified pictures, row by row.
    pub p: [f64; 12],
    /// Pixels joined to one, across and down; 0 counts as 1.
    pub binning: [usize; 2],
}

impl CameraInfo {
    /// Reads a `sensor_msgs/CameraInfo`; ROS 1 writes its matrices with capitals.
    ///
    /// # Errors
    /// [`BagError::Message`](crate::BagError) for fields that are missing or of another kind.
    pub fn of(message: &Record<'_>) -> Result<Self> {
        let numbers = |name: &str| {
            let capital = name.to_ascii_uppercase();
            message.numbers(if message.has(&capital) { &capital } else { name })
        };
        Ok(Self {
            header: Header::of(message)?,
            width: message.size("width")?,
            height: message.size("height")?,
            distortion_model: message.text("distortion_model")?.into_owned(),
            d: numbers("d")?.iter().collect(),
            k: matrix(message, "k", numbers("k")?.iter())?,
            r: matrix(message, "r", numbers("r")?.iter())?,
            p: matrix(message, "p", numbers("p")?.iter())?,
            binning: [message.size("binning_x")?, message.size("binning_y")?],
        })
    }

    /// Focal lengths and center `[fx, fy, cx, cy]` (pixels) of pictures as they are; `None` where the camera is not calibrated.
    pub fn pinhole(&self) -> Option<[f64; 4]> {
        let [fx, _, cx, _, fy, cy, ..] = self.k;
        (fx > 0.0 && fy > 0.0 && self.k.iter().all(|v| v.is_finite())).then_some([fx, fy, cx, cy])
    }

    /// Whether a number of the distortion is not zero.
    pub fn is_distorted(&self) -> bool {
        self.d.iter().any(|v| *v != 0.0)
    }
}

fn matrix<const N: usize>(
    message: &Record<'_>,
    name: &str,
    numbers: impl ExactSizeIterator<Item = f64>,
) -> Result<[f64; N]> {
    let count = numbers.len();
    let all: Vec<f64> = numbers.collect();
    all.try_into().map_err(|_| message.fault(name, format!("{count} numbers"), format!("the matrix has {N}")))
}
