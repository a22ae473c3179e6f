//! The information matrix of an edge.

use crate::error::GraphError;
use crate::sparse::{Block, cholesky};
use crate::tangent::tangent_dimension;

/// The information matrix of an edge: the inverse of the covariance of its residual, symmetric and positive
/// definite. 3 x 3 in 2-D over `[x, y, theta]`; 6 x 6 in 3-D over `[x, y, z, qx, qy, qz]` (meters, and
/// the vector part of the quaternion, which is *half* the rotation vector: 1 rad² of variance is 0.25 there).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Information<const D: usize> {
    /// The first `tangent_dimension(D)` rows and columns are used, the rest is zero.
    matrix: [[f64; 6]; 6],
}

impl<const D: usize> Information<D> {
    /// From the upper triangle, row by row, as in g2o files: 6 numbers in 2-D, 21 in 3-D.
    ///
    /// # Errors
    /// [`GraphError::InformationLength`], [`GraphError::InformationNotFinite`],
    /// [`GraphError::InformationNotPositive`].
    pub fn from_upper(upper: &[f64]) -> Result<Self, GraphError> {
        const { assert!(D == 2 || D == 3, "graphs have two or three dimensions") };
        let n = tangent_dimension(D);
        let expected = n * (n + 1) / 2;
        if upper.len() != expected {
            return Err(GraphError::InformationLength { expected, found: upper.len() });
        }
        let mut matrix = [[0.0; 6]; 6];
        let mut values = upper.iter();
        for r in 0..n {
            for c in r..n {
                let value = values.next().copied().unwrap_or(f64::NAN);
                (matrix[r][c], matrix[c][r]) = (value, value);
            }
        }
        let information = Self { matrix };
        information.check()?;
        Ok(information)
    }

    /// From the standard deviations of position (meters) and rotation (radians), the same along every axis.
    ///
    /// # Errors
    /// As [`Information::from_upper`], where a deviation is not a positive number.
    pub fn from_sigmas(translation: f64, rotation: f64) -> Result<Self, GraphError> {
        let per_radian = if D == 2 { 1.0 } else { 4.0 };
        let n = tangent_dimension(D);
        let diagonal = |k: usize| {
            let (sigma, scale) = if k < D { (translation, 1.0) } else { (rotation, per_radian) };
            if sigma > 0.0 { scale / (sigma * sigma) } else { f64::NAN }
        };
        let upper: Vec<f64> =
            (0..n).flat_map(|r| (r..n).map(move |c| if r == c { diagonal(r) } else { 0.0 })).collect();
        Self::from_upper(&upper)
    }

    /// The upper triangle, row by row, as [`Information::from_upper`] takes it.
    pub fn upper(&self) -> Vec<f64> {
        let n = tangent_dimension(D);
        (0..n).flat_map(|r| (r..n).map(move |c| self.matrix[r][c])).collect()
    }

    /// `[translation, rotation]`: the mean of the diagonal over either part.
    pub(crate) fn weights(&self) -> [f64; 2] {
        let n = tangent_dimension(D);
        let mean =
            |from: usize, to: usize| (from..to).map(|k| self.matrix[k][k]).sum::<f64>() / (to - from) as f64;
        [mean(0, D), mean(D, n)]
    }

    pub(crate) fn block<const B: usize>(&self) -> Block<B> {
        std::array::from_fn(|r| std::array::from_fn(|c| self.matrix[r][c]))
    }

    fn check(&self) -> Result<(), GraphError> {
        if !self.matrix.iter().flatten().all(|v| v.is_finite()) {
            return Err(GraphError::InformationNotFinite);
        }
        match D {
            2 => self.positive::<3>(),
            _ => self.positive::<6>(),
        }
    }

    fn positive<const B: usize>(&self) -> Result<(), GraphError> {
        let diagonal = std::array::from_fn(|k| self.matrix[k][k]);
        let factor = cholesky::<B>(&self.block(), &diagonal, 1e-13);
        factor.map(|_| ()).map_err(|(row, pivot)| GraphError::InformationNotPositive { row, pivot })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_positive_definite_is_refused() {
        let not_positive = |upper: &[f64]| match Information::<2>::from_upper(upper) {
            Err(GraphError::InformationNotPositive { row, .. }) => Some(row),
            _ => None,
        };
        assert_eq!(not_positive(&[1.0, 0.0, 0.0, 1.0, 0.0, 1.0]), None);
        assert_eq!(not_positive(&[1.0, 0.0, 0.0, -1.0, 0.0, 1.0]), Some(1));
        assert_eq!(not_positive(&[1.0, 2.0, 0.0, 1.0, 0.0, 1.0]), Some(1));
        assert_eq!(not_positive(&[0.0; 6]), Some(0));
        assert!(matches!(
            Information::<2>::from_upper(&[1.0, f64::NAN, 0.0, 1.0, 0.0, 1.0]),
            Err(GraphError::InformationNotFinite)
        ));
        assert!(matches!(
            Information::<3>::from_upper(&[1.0; 6]),
            Err(GraphError::InformationLength { expected: 21, found: 6 })
        ));
        assert!(Information::<3>::from_sigmas(0.1, 0.0).is_err());
        assert!(Information::<3>::from_sigmas(-0.1, 1.0).is_err());
        // 0.1 squared has no exact square: the inverse overflows to infinity instead.
        assert!(Information::<3>::from_sigmas(1e-200, 1.0).is_err());
    }

    #[test]
    fn a_rotation_in_space_is_measured_in_halves() {
        assert_eq!(
            Information::<2>::from_sigmas(0.5, 0.1).unwrap().upper(),
            [4.0, 0.0, 0.0, 4.0, 0.0, 99.99999999999999]
        );
        let sharp = Information::<3>::from_sigmas(0.5, 0.5).unwrap();
        assert_eq!(sharp.weights(), [4.0, 16.0]);
    }
}
