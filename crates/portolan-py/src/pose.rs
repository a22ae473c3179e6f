//! Poses: matrices or numbers in, matrices out.

use numpy::PyArrayDyn;
use portolan::geom::Pose;
use pyo3::prelude::*;

use crate::arrays::{Numbers, rows};
use crate::dimension::Either;
use crate::fault::value_error;

/// A pose of either dimension, `world_from_sensor`.
pub(crate) type AnyPose = Either<Pose<2>, Pose<3>>;

/// Reads a pose: 4 x 4 or `(x, y, z, qx, qy, qz, qw)` in 3-D, 3 x 3 or `(x, y, theta)` in 2-D.
pub(crate) fn pose_of(given: &Bound<'_, PyAny>) -> PyResult<AnyPose> {
    let numbers = Numbers::of(given, "pose")?;
    let v = numbers.values()?;
    let bad = |error: &dyn std::fmt::Display| value_error(format!("pose: {error}"));
    match numbers.shape() {
        [3] => {
            let pose = Pose::<2>::new(v[0], v[1], v[2]);
            if pose.is_rigid() { Ok(Either::Two(pose)) } else { Err(bad(&"a number is not finite")) }
        }
        [7] => {
            let pose = Pose::<3>::from_quaternion([v[0], v[1], v[2]], [v[3], v[4], v[5], v[6]]);
            let pose = pose.filter(|pose| pose.is_rigid());
            Ok(Either::Three(pose.ok_or_else(|| {
                bad(&"(x, y, z, qx, qy, qz, qw) must be finite and the quaternion not zero")
            })?))
        }
        [3, 3] => Ok(Either::Two(of_matrix::<2>(v)?)),
        [4, 4] => Ok(Either::Three(of_matrix::<3>(v)?)),
        shape => Err(numbers.wrong(
            shape,
            "4 x 4 numbers or (x, y, z, qx, qy, qz, qw) in 3-D, 3 x 3 numbers or (x, y, theta) in 2-D,",
        )),
    }
}

fn of_matrix<const D: usize>(v: &[f64]) -> PyResult<Pose<D>> {
    let at = |i: usize, j: usize| v[i * (D + 1) + j];
    if !(0..=D).all(|j| (at(D, j) - f64::from(u8::from(j == D))).abs() < 1e-6) {
        let last: Vec<_> = (0..=D).map(|j| at(D, j)).collect();
        return Err(value_error(format!(
            "pose: the last row must be 0 .. 0 1, got {last:?}; is the matrix transposed?"
        )));
    }
    let rotation = std::array::from_fn(|i| std::array::from_fn(|j| at(i, j)));
    let translation = std::array::from_fn(|i| at(i, D));
    Ok(Pose::from_matrix(rotation, translation).map_err(|error| value_error(format!("pose: {error}")))?.0)
}

/// A pose as a matrix.
pub(crate) fn matrix<'py, const D: usize, const N: usize>(
    py: Python<'py>,
    pose: &Pose<D>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    rows(py, entries::<D, N>(pose).to_vec(), &[N])
}

/// Poses as matrices.
pub(crate) fn matrices<'py, const D: usize, const N: usize>(
    py: Python<'py>,
    poses: &[Pose<D>],
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    rows(py, poses.iter().flat_map(entries::<D, N>).collect(), &[poses.len(), N])
}

fn entries<const D: usize, const N: usize>(pose: &Pose<D>) -> [[f64; N]; N] {
    let mut all = [[0.0; N]; N];
    for i in 0..D {
        all[i][..D].copy_from_slice(&pose.rotation[i]);
        all[i][D] = pose.translation[i];
    }
    all[D][D] = 1.0;
    all
}
