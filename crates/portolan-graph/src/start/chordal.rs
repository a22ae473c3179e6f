//! Chordal initialization (Carlone et al. 2015, section III-B): rotations first, as a *linear* least-squares
//! problem over matrices that need not be rotations, then positions, which are linear once rotations are known.

use portolan::geom::Pose;
use portolan::geom::vector::sub;

use crate::components::anchors;
use crate::error::GraphError;
use crate::graph::PoseGraph;
use crate::sparse::{Block, Cholesky, SymmetricBlocks, transposed};
use crate::system::Numbering;

impl<const D: usize> PoseGraph<D> {
    /// Places every free vertex at the chordal solution, from which large loops converge; its previous pose has no
    /// influence. All edges have the same trust: for graphs with false closures use
    /// [`Chain::Odometry`](crate::Chain::Odometry). Cost: two sparse factorizations.
    ///
    /// # Errors
    /// [`GraphError::Singular`] where information spans too many orders of magnitude, [`GraphError::NotFinite`]
    /// where measurements are too large. The graph is then unchanged.
    pub fn start_from_chordal(&mut self) -> Result<(), GraphError> {
        let held = anchors(self).held;
        let numbering = Numbering::new(self, &held);
        let mut poses: Vec<Pose<D>> = self.vertices.iter().map(|v| v.world_from_vertex).collect();
        self.chordal_rotations(&numbering, &mut poses)?;
        self.linear_positions(&numbering, &mut poses)?;
        for &vertex in &numbering.free {
            (poses[vertex], _) = Pose::from_matrix(poses[vertex].rotation, poses[vertex].translation)
                .map_err(|_| GraphError::NotFinite)?;
        }
        for (vertex, pose) in self.vertices.iter_mut().zip(poses) {
            vertex.world_from_vertex = pose;
        }
        Ok(())
    }

    /// `min sum kappa |R_j - R_i Z|^2`: each row of the matrices by itself is an unknown of `D` numbers, so that
    /// one factor serves all `D` rows.
    fn chordal_rotations(&self, at: &Numbering, poses: &mut [Pose<D>]) -> Result<(), GraphError> {
        let mut h = SymmetricBlocks::<D>::zero(&at.pattern);
        let mut rows = vec![vec![[0.0; D]; at.free.len()]; D];
        for (number, (edge, ends)) in self.edges.iter().zip(&self.ends).enumerate() {
            let kappa = edge.information.weights()[1];
            let z = edge.i_from_j.rotation.map(|row| row.map(|v| kappa * v));
            let [i, j] = ends.map(|vertex| at.variable[vertex]);
            for variable in [i, j].into_iter().flatten() {
                for k in 0..D {
                    h.diagonal_mut(&at.pattern, variable)[k][k] += kappa;
                }
            }
            match (i, j) {
                (Some(a), Some(b)) => {
                    h.add_pair(&at.pattern, at.pair[number], [a, b], &z.map(|row| row.map(|v| -v)));
                }
                (None, Some(b)) => {
                    // kappa Z^T r_i
                    pull(&mut rows, b, &transposed(&z), &poses[ends[0]].rotation);
                }
                (Some(a), None) => pull(&mut rows, a, &z, &poses[ends[1]].rotation),
                (None, None) => {}
            }
        }
        let mut factor = Cholesky::new(&at.pattern);
        factor.factor(&at.pattern, &h, 0.0).ok_or(GraphError::Singular { iteration: 0 })?;
        let rows: Vec<Vec<[f64; D]>> = rows.iter().map(|b| factor.solve(&at.pattern, b)).collect();
        for (variable, &vertex) in at.free.iter().enumerate() {
            let relaxed = std::array::from_fn(|row| rows[row][variable]);
            // Without a nearest rotation the vertex keeps the one it has.
            if let Some(rotation) = nearest_rotation(relaxed) {
                poses[vertex].rotation = rotation;
            }
        }
        Ok(())
    }

    /// `min sum tau |t_j - t_i - R_i z|^2`: one number per vertex and axis.
    fn linear_positions(&self, at: &Numbering, poses: &mut [Pose<D>]) -> Result<(), GraphError> {
        let mut h = SymmetricBlocks::<1>::zero(&at.pattern);
        let mut axes = vec![vec![[0.0; 1]; at.free.len()]; D];
        for (number, (edge, ends)) in self.edges.iter().zip(&self.ends).enumerate() {
            let tau = edge.information.weights()[0];
            let offset_world = poses[ends[0]].rotate(edge.i_from_j.translation);
            let [i, j] = ends.map(|vertex| at.variable[vertex]);
            for (side, sign, other) in [(i, -1.0, ends[1]), (j, 1.0, ends[0])] {
                let Some(variable) = side else { continue };
                h.diagonal_mut(&at.pattern, variable)[0][0] += tau;
                let free = at.variable[other].is_some();
                for k in 0..D {
                    let known = if free { 0.0 } else { poses[other].translation[k] };
                    axes[k][variable][0] += tau * (sign * offset_world[k] + known);
                }
            }
            if let (Some(a), Some(b)) = (i, j) {
                h.add_pair(&at.pattern, at.pair[number], [a, b], &[[-tau]]);
            }
        }
        let mut factor = Cholesky::new(&at.pattern);
        factor.factor(&at.pattern, &h, 0.0).ok_or(GraphError::Singular { iteration: 0 })?;
        for (k, b) in axes.iter().enumerate() {
            for (&vertex, value) in at.free.iter().zip(factor.solve(&at.pattern, b)) {
                poses[vertex].translation[k] = value[0];
            }
        }
        Ok(())
    }
}

/// Adds `m` times each row of the known rotation to the right-hand sides of `variable`.
fn pull<const D: usize>(rows: &mut [Vec<[f64; D]>], variable: usize, m: &Block<D>, known: &[[f64; D]; D]) {
    for (row, rhs) in rows.iter_mut().enumerate() {
        for r in 0..D {
            for c in 0..D {
                rhs[variable][r] += m[r][c] * known[row][c];
            }
        }
    }
}

/// The rotation nearest to a matrix of positive determinant, by Newton's iteration for the polar factor
/// (Higham 1986): `X <- (g X + (g X)^-T) / 2` with `g` chosen by norms; `None` for other matrices.
fn nearest_rotation<const D: usize>(m: [[f64; D]; D]) -> Option<[[f64; D]; D]> {
    let norm = |a: &[[f64; D]; D]| a.iter().flatten().map(|v| v * v).sum::<f64>().sqrt();
    let mut x = m;
    for _ in 0..50 {
        let (cofactors, determinant) = cofactors(&x);
        if !(determinant > 1e-12 * norm(&x).powi(D as i32) && determinant.is_finite()) {
            return None;
        }
        let inverse_transposed = cofactors.map(|row| row.map(|v| v / determinant));
        let g = (norm(&inverse_transposed) / norm(&x)).sqrt();
        let next: [[f64; D]; D] = std::array::from_fn(|r| {
            std::array::from_fn(|c| 0.5 * (g * x[r][c] + inverse_transposed[r][c] / g))
        });
        let moved: [[f64; D]; D] = std::array::from_fn(|r| sub(next[r], x[r]));
        x = next;
        if norm(&moved) < 1e-14 {
            break;
        }
    }
    Some(x)
}

/// The matrix of cofactors, which is the determinant times the inverse transposed, and the determinant.
fn cofactors<const D: usize>(m: &[[f64; D]; D]) -> ([[f64; D]; D], f64) {
    let cofactors: [[f64; D]; D] = std::array::from_fn(|r| {
        std::array::from_fn(|c| match D {
            2 => {
                let sign = if r == c { 1.0 } else { -1.0 };
                sign * m[1 - r][1 - c]
            }
            _ => {
                let ([a, b], [p, q]) = ([(r + 1) % 3, (r + 2) % 3], [(c + 1) % 3, (c + 2) % 3]);
                m[a][p] * m[b][q] - m[a][q] * m[b][p]
            }
        })
    });
    let determinant = (0..D).map(|c| m[0][c] * cofactors[0][c]).sum();
    (cofactors, determinant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tangent::stepped;

    #[test]
    fn the_nearest_rotation_of_a_stretched_one() {
        let turn = stepped::<3, 6>(&Pose::IDENTITY, &[0.0, 0.0, 0.0, 0.4, -1.1, 2.0]).rotation;
        // A symmetric positive stretch S: the polar factor of R S is R.
        let s = [[2.0, 0.1, 0.0], [0.1, 0.5, 0.2], [0.0, 0.2, 0.9]];
        let m: [[f64; 3]; 3] = std::array::from_fn(|r| {
            std::array::from_fn(|c| (0..3).map(|k| turn[r][k] * s[k][c]).sum::<f64>())
        });
        let found = nearest_rotation(m).unwrap();
        for (a, b) in found.iter().flatten().zip(turn.iter().flatten()) {
            assert!((a - b).abs() < 1e-13);
        }
        assert!(nearest_rotation([[1.0, 0.0], [0.0, -1.0]]).is_none());
        assert!(nearest_rotation([[0.0; 3]; 3]).is_none());
        assert!(nearest_rotation([[f64::NAN; 2]; 2]).is_none());
        let turned = nearest_rotation([[0.0, -3.0], [3.0, 0.0]]).unwrap();
        assert!((turned[1][0] - 1.0).abs() < 1e-15);
    }
}
