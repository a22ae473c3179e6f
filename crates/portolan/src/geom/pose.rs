//! Rigid transforms.

use super::vector::{add, dot, norm, scale, sub, unit};

/// A rigid transform `target_from_source`: `p_target = rotation * p_source + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<const D: usize> {
    /// Rotation matrix, rows first.
    pub rotation: [[f64; D]; D],
    /// Position of the origin of the source frame in the target frame (meters).
    pub translation: [f64; D],
}

/// Why a matrix was refused as a pose.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// An entry is NaN or infinite.
    #[error("a pose has an entry that is not finite")]
    NotFinite,
    /// The rows are not orthonormal to 1e-2, or the determinant is negative.
    #[error("a pose is not rigid: its rotation is off by {0:.3e} (1e-2 is tolerated)")]
    NotRigid(f64),
}

impl<const D: usize> Pose<D> {
    /// The identity.
    pub const IDENTITY: Self = {
        let mut rotation = [[0.0; D]; D];
        let mut k = 0;
        while k < D {
            rotation[k][k] = 1.0;
            k += 1;
        }
        Self { rotation, translation: [0.0; D] }
    };

    /// A pose from a matrix that is nearly rigid, as in files. Rows that are orthonormal to 1e-2 are made orthonormal (by
    /// Gram-Schmidt); the second value returned is their error before.
    ///
    /// # Errors
    /// [`PoseError`] where an entry is not finite, the error is larger or the determinant is negative.
    pub fn from_matrix(rotation: [[f64; D]; D], translation: [f64; D]) -> Result<(Self, f64), PoseError> {
        let finite = rotation.iter().flatten().chain(&translation).all(|v| v.is_finite());
        if !finite {
            return Err(PoseError::NotFinite);
        }
        let mut off: f64 = 0.0;
        for i in 0..D {
            for j in 0..D {
                off = off.max((dot(rotation[i], rotation[j]) - f64::from(i == j)).abs());
            }
        }
        if off > 1e-2 {
            return Err(PoseError::NotRigid(off));
        }
        let mut rows = rotation;
        for i in 0..D {
            for j in 0..i {
                rows[i] = sub(rows[i], scale(rows[j], dot(rows[i], rows[j])));
            }
            rows[i] = unit(rows[i]).ok_or(PoseError::NotRigid(off))?;
        }
        if determinant(&rows) < 0.0 {
            return Err(PoseError::NotRigid(2.0));
        }
        Ok((Self { rotation: rows, translation }, off))
    }

    /// The point in the target frame.
    #[inline(always)]
    pub fn transform_point(&self, p_source: [f64; D]) -> [f64; D] {
        add(self.rotate(p_source), self.translation)
    }

    /// The displacement in the target frame: rotated, not moved.
    #[inline(always)]
    pub fn rotate(&self, v_source: [f64; D]) -> [f64; D] {
        std::array::from_fn(|k| dot(self.rotation[k], v_source))
    }

    /// `source_from_target`.
    pub fn inverse(&self) -> Self {
        let rotation: [[f64; D]; D] = std::array::from_fn(|i| std::array::from_fn(|j| self.rotation[j][i]));
        let back = Self { rotation, translation: [0.0; D] };
        Self { translation: back.rotate(self.translation).map(|v| -v), ..back }
    }

    /// Whether every entry is finite and the rotation orthonormal to 1e-6.
    pub fn is_rigid(&self) -> bool {
        matches!(Self::from_matrix(self.rotation, self.translation), Ok((_, off)) if off < 1e-6)
    }

    /// Distance between the two translations (meters).
    pub fn translation_to(&self, other: &Self) -> f64 {
        norm(sub(self.translation, other.translation))
    }
}

fn determinant<const D: usize>(m: &[[f64; D]; D]) -> f64 {
    match D {
        2 => m[0][0] * m[1][1] - m[0][1] * m[1][0],
        3 => (0..3)
            .map(|k| {
                m[0][k] * (m[1][(k + 1) % 3] * m[2][(k + 2) % 3] - m[1][(k + 2) % 3] * m[2][(k + 1) % 3])
            })
            .sum(),
        _ => unreachable!("poses have two or three dimensions"),
    }
}

/// `a_from_b * b_from_c = a_from_c`.
impl<const D: usize> std::ops::Mul for Pose<D> {
    type Output = Self;
    fn mul(self, b_from_c: Self) -> Self {
        Self {
            rotation: std::array::from_fn(|i| {
                std::array::from_fn(|j| (0..D).map(|k| self.rotation[i][k] * b_from_c.rotation[k][j]).sum())
            }),
            translation: self.transform_point(b_from_c.translation),
        }
    }
}

impl Pose<2> {
    /// Position (meters) and heading (radians, counter-clockwise from x).
    pub fn new(x: f64, y: f64, theta: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        Self::from_cos_sin(x, y, cos, sin)
    }

    /// Position and heading, given as cosine and sine, for callers with their own transcendental functions (the simulator,
    /// whose results are the same on every platform).
    pub fn from_cos_sin(x: f64, y: f64, cos: f64, sin: f64) -> Self {
        Self { rotation: [[cos, -sin], [sin, cos]], translation: [x, y] }
    }

    /// Heading in `(-pi, pi]`.
    pub fn theta(&self) -> f64 {
        self.rotation[1][0].atan2(self.rotation[0][0])
    }
}

impl Pose<3> {
    /// Position (meters) and quaternion `(x, y, z, w)`, which is normalized; `None` for a quaternion that is
    /// zero or not finite.
    pub fn from_quaternion(translation: [f64; 3], xyzw: [f64; 4]) -> Option<Self> {
        let [x, y, z, w] = unit(xyzw)?;
        let rotation = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ];
        Some(Self { rotation, translation })
    }
}

#[cfg(feature = "nalgebra")]
impl From<nalgebra::Isometry2<f64>> for Pose<2> {
    fn from(i: nalgebra::Isometry2<f64>) -> Self {
        let t = i.translation.vector;
        Self::from_cos_sin(t.x, t.y, i.rotation.re, i.rotation.im)
    }
}

#[cfg(feature = "nalgebra")]
impl From<nalgebra::Isometry3<f64>> for Pose<3> {
    fn from(i: nalgebra::Isometry3<f64>) -> Self {
        let m = i.rotation.to_rotation_matrix();
        let rotation = std::array::from_fn(|r| std::array::from_fn(|c| m[(r, c)]));
        Self { rotation, translation: i.translation.vector.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::distance;

    #[test]
    fn names_cancel() {
        let world_from_body = Pose::<2>::new(1.0, 2.0, 0.5);
        let body_from_sensor = Pose::<2>::new(0.1, -0.3, -1.25);
        let p = [0.7, -0.2];
        let whole = (world_from_body * body_from_sensor).transform_point(p);
        let steps = world_from_body.transform_point(body_from_sensor.transform_point(p));
        assert!(distance(whole, steps) < 1e-15);
        assert!(
            distance(world_from_body.inverse().transform_point(world_from_body.transform_point(p)), p)
                < 1e-15
        );
        assert!(((world_from_body * body_from_sensor).theta() + 0.75).abs() < 1e-12);
    }

    #[test]
    fn nearly_rigid_is_mended_and_counted_and_worse_is_refused() {
        let mut m = Pose::<3>::from_quaternion([1.0, 2.0, 3.0], [0.1, 0.2, 0.3, 0.9]).unwrap().rotation;
        m[0][0] += 4e-4;
        let (pose, off) = Pose::from_matrix(m, [1.0, 2.0, 3.0]).unwrap();
        assert!(off > 1e-4 && pose.is_rigid());
        m[0][0] += 0.5;
        assert!(matches!(Pose::from_matrix(m, [0.0; 3]), Err(PoseError::NotRigid(_))));
        let mirror = [[1.0, 0.0], [0.0, -1.0]];
        assert!(matches!(Pose::from_matrix(mirror, [0.0; 2]), Err(PoseError::NotRigid(_))));
        assert_eq!(Pose::from_matrix([[f64::NAN, 0.0], [0.0, 1.0]], [0.0; 2]), Err(PoseError::NotFinite));
    }

    #[cfg(feature = "nalgebra")]
    #[test]
    fn nalgebra_isometries_are_accepted() {
        let i = nalgebra::Isometry3::new([1.0, 2.0, 3.0].into(), [0.3, -0.4, 0.5].into());
        let p = [0.2, 0.5, -0.9];
        let theirs: [f64; 3] = (i * nalgebra::Point3::from(p)).into();
        assert!(distance(Pose::from(i).transform_point(p), theirs) < 1e-12);
        let i = nalgebra::Isometry2::new([1.0, 2.0].into(), 0.7);
        assert!((Pose::from(i).theta() - 0.7).abs() < 1e-12);
    }
}
