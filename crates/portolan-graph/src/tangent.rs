//! The error of one edge, its derivatives, and the step of one pose: the only code that differs between 2-D and 3-D.
//!
//! For an edge with the measurement `i_from_j = Z` between poses `X_i`, `X_j` (world from vertex), the error pose
//! is `E = Z^-1 X_i^-1 X_j`, and the residual is that of g2o (Grisetti et al. 2010, the g2o file format):
//!
//! - 2-D: `[x, y, theta]` of `E`, theta in `(-pi, pi]`;
//! - 3-D: `[x, y, z, qx, qy, qz]` of `E`, the quaternion with `qw >= 0`: *half* the rotation vector for small
//!   angles, bounded by one for large ones.
//!
//! A step `[rho, phi]` acts on the right: `X <- (R exp(phi), t + R rho)`.

use portolan::geom::Pose;
use portolan::geom::vector::{add, dot, scale, sub};

use crate::sparse::Block;

/// Degrees of freedom of a pose: 3 in 2-D, 6 in 3-D.
pub(crate) const fn tangent_dimension(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// An edge linearized: residual and its derivatives with respect to the steps of both ends.
pub(crate) struct Linear<const B: usize> {
    pub(crate) residual: [f64; B],
    pub(crate) by_i: Block<B>,
    pub(crate) by_j: Block<B>,
}

/// `E = Z^-1 X_i^-1 X_j`.
#[inline]
pub(crate) fn error_pose<const D: usize>(j_from_i: &Pose<D>, i: &Pose<D>, j: &Pose<D>) -> Pose<D> {
    *j_from_i * (i.inverse() * *j)
}

/// The residual of an error pose. `B` is the tangent dimension of `D`.
#[inline]
pub(crate) fn residual<const D: usize, const B: usize>(error: &Pose<D>) -> [f64; B] {
    debug_assert_eq!(B, tangent_dimension(D));
    let mut r = [0.0; B];
    r[..D].copy_from_slice(&error.translation);
    match D {
        2 => r[2] = angle(error),
        _ => r[3..].copy_from_slice(&quaternion(error)[..3]),
    }
    r
}

/// The residual of an edge and its derivatives, `j_from_i` being the inverse of the measurement.
pub(crate) fn linearize<const D: usize, const B: usize>(
    j_from_i: &Pose<D>,
    i: &Pose<D>,
    j: &Pose<D>,
) -> Linear<B> {
    debug_assert_eq!(B, tangent_dimension(D));
    let i_from_j = i.inverse() * *j;
    let error = *j_from_i * i_from_j;
    let residual = residual::<D, B>(&error);
    let (mut by_i, mut by_j) = ([[0.0; B]; B], [[0.0; B]; B]);
    for r in 0..D {
        for c in 0..D {
            by_i[r][c] = -j_from_i.rotation[r][c];
            by_j[r][c] = error.rotation[r][c];
        }
    }
    // The step turns the frame of i: seen from it, j's zero moves by -phi x p.
    for k in 0..B - D {
        let moved = j_from_i.rotate(turned(k, i_from_j.translation));
        for r in 0..D {
            by_i[r][D + k] = -moved[r];
        }
    }
    match D {
        2 => {
            by_i[2][2] = -1.0;
            by_j[2][2] = 1.0;
        }
        _ => {
            // q (phi/2, 1) = q + (w phi + v x phi) / 2, and a step of i is the step -R_ji phi of j.
            let [x, y, z, w] = quaternion(&error).map(|v| 0.5 * v);
            let m = [[w, -z, y], [z, w, -x], [-y, x, w]];
            for r in 0..3 {
                for c in 0..3 {
                    by_j[3 + r][3 + c] = m[r][c];
                    by_i[3 + r][3 + c] = -(0..3).map(|k| m[r][k] * i_from_j.rotation[c][k]).sum::<f64>();
                }
            }
        }
    }
    Linear { residual, by_i, by_j }
}

/// The pose after a step `[rho, phi]`.
pub(crate) fn stepped<const D: usize, const B: usize>(pose: &Pose<D>, step: &[f64; B]) -> Pose<D> {
    let mut local = Pose::<D>::IDENTITY;
    local.translation.copy_from_slice(&step[..D]);
    match D {
        2 => {
            let (sin, cos) = (libm::sin(step[2]), libm::cos(step[2]));
            local.rotation[0][..2].copy_from_slice(&[cos, -sin]);
            local.rotation[1][..2].copy_from_slice(&[sin, cos]);
        }
        _ => {
            let phi = [step[3], step[4], step[5]];
            let turn = rotation_vector(phi);
            for r in 0..3 {
                local.rotation[r][..3].copy_from_slice(&turn[r]);
            }
        }
    }
    *pose * local
}

/// `e_k x p`; in 2-D, `p` turned by 90 degrees.
#[inline(always)]
fn turned<const D: usize>(k: usize, p: [f64; D]) -> [f64; D] {
    let mut out = [0.0; D];
    if D == 2 {
        (out[0], out[1]) = (-p[1], p[0]);
    } else {
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        (out[a], out[b]) = (-p[b], p[a]);
    }
    out
}

/// Heading in `(-pi, pi]`, the same bytes on every platform.
pub(crate) fn angle<const D: usize>(pose: &Pose<D>) -> f64 {
    libm::atan2(pose.rotation[1][0], pose.rotation[0][0])
}

/// The 2-D pose with this heading, the same bytes on every platform.
pub(crate) fn planar(x: f64, y: f64, theta: f64) -> Pose<2> {
    Pose::from_cos_sin(x, y, libm::cos(theta), libm::sin(theta))
}

/// The unit quaternion `(x, y, z, w)` of a 3-D pose, `w >= 0`. The largest of the four is computed first, so that no
/// digits are lost (Shepperd 1978).
pub(crate) fn quaternion<const D: usize>(pose: &Pose<D>) -> [f64; 4] {
    let m = &pose.rotation;
    let trace = m[0][0] + m[1][1] + m[2][2];
    let mut q = [0.0; 4];
    let big = (0..3).fold(0, |best, k| if m[k][k] > m[best][best] { k } else { best });
    if trace >= m[big][big] {
        q[3] = 1.0 + trace;
        for k in 0..3 {
            q[k] = m[(k + 2) % 3][(k + 1) % 3] - m[(k + 1) % 3][(k + 2) % 3];
        }
    } else {
        let (a, b) = ((big + 1) % 3, (big + 2) % 3);
        q[big] = 1.0 + m[big][big] - m[a][a] - m[b][b];
        q[a] = m[a][big] + m[big][a];
        q[b] = m[b][big] + m[big][b];
        q[3] = m[b][a] - m[a][b];
    }
    let length = dot(q, q).sqrt();
    let sign = if q[3] < 0.0 { -1.0 } else { 1.0 };
    scale(q, sign / length)
}

/// The rotation matrix of a rotation vector (Rodrigues), rows first.
fn rotation_vector(phi: [f64; 3]) -> [[f64; 3]; 3] {
    let angle_sq = dot(phi, phi);
    let angle = angle_sq.sqrt();
    // sin(a)/a and (1 - cos a)/a^2; their series where the quotients lose digits.
    let (s, c) = if angle < 1e-4 {
        (1.0 - angle_sq / 6.0, 0.5 - angle_sq / 24.0)
    } else {
        let half = libm::sin(0.5 * angle) / angle;
        (libm::sin(angle) / angle, 2.0 * half * half)
    };
    let cos = 1.0 - c * angle_sq;
    std::array::from_fn(|r| {
        let mut unit = [0.0; 3];
        unit[r] = 1.0;
        // Row r of I cos + c phi phi^T + s [phi]x.
        let crossed = [
            unit[1] * phi[2] - unit[2] * phi[1],
            unit[2] * phi[0] - unit[0] * phi[2],
            unit[0] * phi[1] - unit[1] * phi[0],
        ];
        sub(add(scale(unit, cos), scale(phi, c * phi[r])), scale(crossed, -s))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pose<const D: usize>(v: &[f64]) -> Pose<D> {
        let start = Pose::<D>::IDENTITY;
        match D {
            2 => stepped::<D, 3>(&start, &[v[0], v[1], v[2]]),
            _ => stepped::<D, 6>(&start, &[v[0], v[1], v[2], v[3], v[4], v[5]]),
        }
    }

    /// Central differences of the residual, step 1e-5: error of order 1e-10 by truncation, 1e-10 by rounding.
    fn derivatives_agree<const D: usize, const B: usize>(v: &[f64]) {
        let (z, i, j) = (pose::<D>(&v[..6]), pose::<D>(&v[6..12]), pose::<D>(&v[12..18]));
        let back = z.inverse();
        let linear = linearize::<D, B>(&back, &i, &j);
        // At a half turn the residual jumps: there is no derivative to compare with.
        let error = error_pose(&back, &i, &j);
        let far = match D {
            2 => angle(&error).abs() > std::f64::consts::PI - 1e-3,
            _ => quaternion(&error)[3] < 1e-3,
        };
        if far {
            return;
        }
        let h = 1e-5;
        for k in 0..B {
            let mut step = [0.0; B];
            step[k] = h;
            let (up_i, up_j) = (stepped(&i, &step), stepped(&j, &step));
            step[k] = -h;
            let (down_i, down_j) = (stepped(&i, &step), stepped(&j, &step));
            let by_i = (error_pose(&back, &up_i, &j), error_pose(&back, &down_i, &j));
            let by_j = (error_pose(&back, &i, &up_j), error_pose(&back, &i, &down_j));
            for ((up, down), analytic) in [(by_i, &linear.by_i), (by_j, &linear.by_j)] {
                let (up, down) = (residual::<D, B>(&up), residual::<D, B>(&down));
                for r in 0..B {
                    let numeric = (up[r] - down[r]) / (2.0 * h);
                    assert!((numeric - analytic[r][k]).abs() < 1e-7, "d r{r} / d x{k}: {numeric}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn jacobians_match_central_differences(v in proptest::collection::vec(-3.0..3.0f64, 18)) {
            derivatives_agree::<2, 3>(&v);
            derivatives_agree::<3, 6>(&v);
        }

        #[test]
        fn quaternions_come_back(v in proptest::collection::vec(-3.0..3.0f64, 6)) {
            let p = pose::<3>(&v);
            prop_assert!(p.is_rigid());
            let q = quaternion(&p);
            let again = Pose::<3>::from_quaternion(p.translation, q).unwrap();
            for (a, b) in p.rotation.iter().flatten().zip(again.rotation.iter().flatten()) {
                prop_assert!((a - b).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn half_turns_have_quaternions() {
        for axis in 0..3 {
            let mut phi = [0.0; 6];
            phi[3 + axis] = std::f64::consts::PI;
            let q = quaternion(&stepped::<3, 6>(&Pose::IDENTITY, &phi));
            assert!((q[axis].abs() - 1.0).abs() < 1e-15, "{q:?}");
        }
    }

    #[test]
    fn series_joins_the_closed_form() {
        let (below, above) = (rotation_vector([0.9999e-4, 0.0, 0.0]), rotation_vector([1.0001e-4, 0.0, 0.0]));
        assert!((below[2][1] / 0.9999e-4 - above[2][1] / 1.0001e-4).abs() < 1e-12);
    }
}
