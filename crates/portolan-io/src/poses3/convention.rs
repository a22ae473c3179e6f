//! What the numbers of a pose mean.

use portolan::geom::Pose;

use super::PoseFault;

/// What a rotation `R` and a translation `t` in a file mean. The words are those of `--pose-convention`.
///
/// A wrong convention never shows in one scan alone: every scan has the right shape, and they do not fit together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum PoseConvention {
    /// `world-from-sensor`: `p_world = R p + t`. 7-Scenes, TUM, KITTI, Redwood, ScanNet.
    #[default]
    WorldFromSensor,
    /// `sensor-from-world`: `p_world = R^T (p - t)`. "Extrinsics" of cameras: COLMAP, Open3D's integrate().
    SensorFromWorld,
    /// `transposed-rotation`: `p_world = R^T p + t`: the rotation of one direction with the translation of the other.
    /// Stanford's `.conf` (the quaternion is the conjugate) and BigBIRD as the GPIS tools store it. Neither of the two
    /// conventions above fits such poses, only a check of both at once shows it.
    TransposedRotation,
    /// `column-major`: the 4x4 matrix is stored column by column, so that the translation is its last row.
    ColumnMajor,
    /// `opengl-camera`: world from a camera that looks along -z with y up (Blender, NeRF); turned to x right, y down, z
    /// forward.
    OpenGlCamera,
}

impl PoseConvention {
    /// All conventions.
    pub const ALL: [Self; 5] = [
        Self::WorldFromSensor,
        Self::SensorFromWorld,
        Self::TransposedRotation,
        Self::ColumnMajor,
        Self::OpenGlCamera,
    ];

    /// The word of `--pose-convention`.
    pub fn word(self) -> &'static str {
        match self {
            Self::WorldFromSensor => "world-from-sensor",
            Self::SensorFromWorld => "sensor-from-world",
            Self::TransposedRotation => "transposed-rotation",
            Self::ColumnMajor => "column-major",
            Self::OpenGlCamera => "opengl-camera",
        }
    }

    /// The convention of a word; `None` where no convention has it.
    pub fn from_word(word: &str) -> Option<Self> {
        match word {
            "conjugated-rotation" => Some(Self::TransposedRotation),
            _ => Self::ALL.into_iter().find(|c| c.word() == word),
        }
    }

    /// The pose of a 4x4 matrix as it is in a file, and how far its rotation was off (see [`Pose::from_matrix`]).
    pub(super) fn resolve(self, m: &[[f64; 4]; 4]) -> Result<(Pose<3>, f64), PoseFault> {
        if !m.iter().flatten().all(|v| v.is_finite()) {
            return Err(PoseFault::NotFinite);
        }
        let m = if self == Self::ColumnMajor { transposed(m) } else { *m };
        if (0..3).any(|k| m[3][k].abs() > 1e-4) || (m[3][3] - 1.0).abs() > CORNER_OFF {
            return Err(PoseFault::LastRow(m[3]));
        }
        let translation: [f64; 3] = std::array::from_fn(|k| m[k][3]);
        let farthest = translation.iter().fold(0.0, |far: f64, v| far.max(v.abs()));
        if farthest > FARTHEST {
            return Err(PoseFault::TooFar(farthest));
        }
        let rotation = std::array::from_fn(|i| {
            std::array::from_fn(|k| match (self, k) {
                (Self::TransposedRotation, _) => m[k][i],
                (Self::OpenGlCamera, 1 | 2) => -m[i][k],
                _ => m[i][k],
            })
        });
        let (pose, off) = Pose::from_matrix(rotation, translation).map_err(PoseFault::from)?;
        Ok(if self == Self::SensorFromWorld { (pose.inverse(), off) } else { (pose, off) })
    }
}

/// No place on Earth has a translation beyond this (meters).
const FARTHEST: f64 = 1e9;

/// How far the last element may be from 1: it was written with few digits.
pub(super) const CORNER_OFF: f64 = 1e-4;

fn transposed(m: &[[f64; 4]; 4]) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|k| m[k][i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poses3::RawPose;
    use portolan::geom::vector::distance;

    fn matrix(pose: &Pose<3>) -> [[f64; 4]; 4] {
        RawPose::new(pose.rotation, pose.translation, 1).matrix
    }

    #[test]
    fn every_convention_finds_the_same_pose_in_its_own_numbers() {
        let pose = Pose::<3>::from_quaternion([1.0, -2.0, 3.0], [0.1, 0.2, -0.3, 0.9]).unwrap();
        let m = matrix(&pose);
        let mut turned = m;
        let mut flipped = m;
        for i in 0..3 {
            for k in 0..3 {
                turned[i][k] = m[k][i];
            }
            flipped[i][1] = -m[i][1];
            flipped[i][2] = -m[i][2];
        }
        for (convention, numbers) in [
            (PoseConvention::WorldFromSensor, m),
            (PoseConvention::SensorFromWorld, matrix(&pose.inverse())),
            (PoseConvention::TransposedRotation, turned),
            (PoseConvention::ColumnMajor, transposed(&m)),
            (PoseConvention::OpenGlCamera, flipped),
        ] {
            let (found, off) = convention.resolve(&numbers).unwrap();
            assert!(off < 1e-12);
            for p in [[0.0; 3], [1.0, 0.0, 0.0], [0.3, -0.7, 2.0]] {
                assert!(
                    distance(found.transform_point(p), pose.transform_point(p)) < 1e-12,
                    "{convention:?}"
                );
            }
            assert_eq!(PoseConvention::from_word(convention.word()), Some(convention));
        }
        assert_eq!(PoseConvention::from_word("sideways"), None);
        assert!(matches!(PoseConvention::ColumnMajor.resolve(&m), Err(PoseFault::LastRow(_))));
    }
}
