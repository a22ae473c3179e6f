//! One pose as a file has it, and why it may be refused.

use std::fmt;

use portolan::geom::{Pose, PoseError};

use super::PoseConvention;

/// A rotation that is off by more than this counts as mended (that is beyond the rounding of six decimals).
pub const MENDED_FROM: f64 = 1e-5;

/// A pose as it is in a file, before a convention is applied.
#[derive(Clone, Debug, PartialEq)]
pub struct RawPose {
    /// Rows of the 4x4 matrix. A time stamp in `[3][3]` has been taken out.
    pub matrix: [[f64; 4]; 4],
    /// The stamp (seconds of the file's clock), if the file has stamps.
    pub time: Option<f64>,
    /// The scan to which the file assigns it, if it does.
    pub number: Option<u64>,
    /// Where it begins in the file: line number, from 1.
    pub line: u64,
}

impl RawPose {
    /// A pose of rotation and translation.
    pub(crate) fn new(rotation: [[f64; 3]; 3], translation: [f64; 3], line: u64) -> Self {
        let row = |k: usize| [rotation[k][0], rotation[k][1], rotation[k][2], translation[k]];
        let matrix = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
        Self { matrix, time: None, number: None, line }
    }

    /// A pose of translation and quaternion `(x, y, z, w)`. The quaternion is not normalized: one of length `n` gives a
    /// rotation that is off by `n^4 - 1`, so that a wrong one is refused like any other pose.
    pub(crate) fn from_quaternion(translation: [f64; 3], [x, y, z, w]: [f64; 4], line: u64) -> Self {
        let rotation = [
            [w * w + x * x - y * y - z * z, 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), w * w - x * x + y * y - z * z, 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), w * w - x * x - y * y + z * z],
        ];
        Self::new(rotation, translation, line)
    }

    /// The pose `world_from_sensor`, and how far its rotation was off. One that is orthonormal to 1e-2 is made exactly so
    /// (see [`Pose::from_matrix`]); beyond [`MENDED_FROM`] that counts as mended.
    ///
    /// # Errors
    /// [`PoseFault`] for numbers that are not a pose.
    pub fn resolve(&self, convention: PoseConvention) -> Result<(Pose<3>, f64), PoseFault> {
        convention.resolve(&self.matrix)
    }
}

/// Why a pose is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PoseFault {
    /// An entry is NaN or infinite: "tracking was lost" in many data sets.
    NotFinite,
    /// The rotation is off by so much, more than 1e-2; 2 for a mirror.
    NotRigid(f64),
    /// The last row is not `0 0 0 1`, and the last element no time stamp (see [`crate::poses3`]).
    LastRow([f64; 4]),
    /// The translation has an entry of so many meters.
    TooFar(f64),
}

impl From<PoseError> for PoseFault {
    fn from(error: PoseError) -> Self {
        match error {
            PoseError::NotFinite => Self::NotFinite,
            PoseError::NotRigid(off) => Self::NotRigid(off),
        }
    }
}

impl fmt::Display for PoseFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "the pose has an entry that is not finite"),
            Self::NotRigid(off) => {
                write!(f, "the pose is not rigid: its rotation is off by {off:.2e} (1e-2 is tolerated)")
            }
            Self::LastRow([0.0, 0.0, 0.0, d]) => write!(
                f,
                "the last row of the pose is 0 0 0 {d}, not 0 0 0 1 (time stamps there ascend from pose to pose)"
            ),
            Self::LastRow([a, b, c, d]) => write!(
                f,
                "the last row of the pose is {a} {b} {c} {d}, not 0 0 0 1 (a matrix that is stored column by column needs \
                 --pose-convention column-major)"
            ),
            Self::TooFar(far) => write!(f, "the pose is {far:e} m away"),
        }
    }
}
