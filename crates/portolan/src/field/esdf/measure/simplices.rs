//! Distances to simplices, as loops that compilers make vectors of.
//!
//! Each loop runs over the numbers of fixed arrays that nothing else refers to, and its body is long: it is neither
//! unrolled nor guarded against overlap before it becomes one or two steps of whole vectors.

/// Simplices of a block.
pub(super) const LANES: usize = 8;

/// A number per simplex of a block.
pub(super) type Lane = [f32; LANES];

/// Eight simplices side by side, and what the distance to each needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<const D: usize> {
    corners: [[Lane; D]; D],
    /// For each side, from a corner to the next: what the product with it is divided by; 0 for a side without length.
    inverse_sq: [Lane; D],
    /// Of triangles, for each side, the direction out of the triangle; zero where the triangle has (nearly) no area and
    /// is the nearest of its sides.
    outward: [[Lane; D]; D],
    /// Of triangles: the unit normal.
    normal: [Lane; D],
}

/// One simplex of a block.
struct One<const D: usize> {
    corners: [[f32; D]; D],
    sides: [[f32; D]; D],
    inverse_sq: [f32; D],
    outward: [[f32; D]; D],
    normal: [f32; D],
}

/// Sides of a segment or a triangle.
const fn sides<const D: usize>() -> usize {
    if D == 2 { 1 } else { 3 }
}

#[inline(always)]
fn dot<const D: usize>(a: &[f32; D], b: &[f32; D]) -> f32 {
    let mut sum = 0.0;
    for k in 0..D {
        sum += a[k] * b[k];
    }
    sum
}

/// In space.
#[inline(always)]
fn cross<const D: usize>(a: &[f32; D], b: &[f32; D]) -> [f32; D] {
    std::array::from_fn(|k| a[(k + 1) % D] * b[(k + 2) % D] - a[(k + 2) % D] * b[(k + 1) % D])
}

impl<const D: usize> Block<D> {
    /// Of simplices whose corners are given lane by lane.
    #[inline(always)]
    pub(super) fn of(corners: [[Lane; D]; D]) -> Self {
        let mut block = Self {
            corners,
            inverse_sq: [[0.0; LANES]; D],
            outward: [[[0.0; LANES]; D]; D],
            normal: [[0.0; LANES]; D],
        };
        for l in 0..LANES {
            let mut side = [[0.0; D]; D];
            for s in 0..D {
                for k in 0..D {
                    side[s][k] = corners[(s + 1) % D][k][l] - corners[s][k][l];
                }
                let length_sq = dot(&side[s], &side[s]);
                // So short that the inverse of its square is infinite, and of no length: its points are one.
                let inverse = 1.0 / length_sq;
                block.inverse_sq[s][l] = if inverse.is_finite() { inverse } else { 0.0 };
            }
            if D == 3 {
                let normal = cross(&side[0], &side[1]);
                let area_sq = dot(&normal, &normal);
                // A narrower triangle lies within a thousandth of its length of its sides.
                let wide = area_sq > 1e-6 * dot(&side[0], &side[0]) * dot(&side[1], &side[1]);
                let scale = if wide { 1.0 / area_sq.sqrt() } else { 0.0 };
                let normal = normal.map(|n| n * scale);
                for k in 0..D {
                    block.normal[k][l] = normal[k];
                }
                for s in 0..D {
                    let outward = cross(&side[s], &normal);
                    for k in 0..D {
                        block.outward[s][k][l] = outward[k];
                    }
                }
            }
        }
        block
    }

    #[inline(always)]
    fn one(&self, l: usize) -> One<D> {
        let corners: [[f32; D]; D] = std::array::from_fn(|s| std::array::from_fn(|k| self.corners[s][k][l]));
        One {
            corners,
            sides: std::array::from_fn(|s| std::array::from_fn(|k| corners[(s + 1) % D][k] - corners[s][k])),
            inverse_sq: std::array::from_fn(|s| self.inverse_sq[s][l]),
            outward: std::array::from_fn(|s| std::array::from_fn(|k| self.outward[s][k][l])),
            normal: std::array::from_fn(|k| self.normal[k][l]),
        }
    }

    /// Lowers `best` to the squared distances from some points, a list of coordinates per axis, to the simplex of a lane.
    #[inline(always)]
    pub(super) fn relax<const N: usize>(&self, l: usize, points: &[[f32; N]; D], best: &mut [f32; N]) {
        let (one, points, mut least) = (self.one(l), *points, *best);
        for i in 0..N {
            let (mut found, mut inside, mut plane) = (f32::INFINITY, f32::NEG_INFINITY, 0.0);
            for s in 0..sides::<D>() {
                let mut from = [0.0; D];
                for k in 0..D {
                    from[k] = points[k][i] - one.corners[s][k];
                }
                let t = (dot(&from, &one.sides[s]) * one.inverse_sq[s]).clamp(0.0, 1.0);
                let mut sq = 0.0;
                for k in 0..D {
                    let off = from[k] - t * one.sides[s][k];
                    sq += off * off;
                }
                found = if sq < found { sq } else { found };
                // Negative on the inner side; the largest of the three tells whether the foot is in the triangle.
                let out = dot(&from, &one.outward[s]);
                inside = if out > inside { out } else { inside };
                if s == 0 {
                    plane = dot(&from, &one.normal);
                }
            }
            if D == 3 {
                found = if inside < 0.0 { plane * plane } else { found };
            }
            least[i] = if found < least[i] { found } else { least[i] };
        }
        *best = least;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::esdf::surface::simplex_distance_sq;
    use crate::testing::Random;

    fn is_the_distance_in_f64<const D: usize>() {
        let mut random = Random(4);
        let mut worst = 0.0f64;
        for n in 0..100_000 {
            let mut corner = || -> [f32; D] { std::array::from_fn(|_| random.unit() as f32) };
            let mut simplex: [[f32; D]; D] = std::array::from_fn(|_| corner());
            // Points, segments, narrow triangles.
            match n % 8 {
                0 => simplex[1] = simplex[0],
                1 => simplex = [simplex[0]; D],
                2 => simplex[D - 1] = std::array::from_fn(|k| 0.5 * (simplex[0][k] + simplex[1][k])),
                3 => simplex[D - 1] = simplex[0].map(|v| v + 0.004 * (v - 0.5)),
                // Beside zero numbers are dense: sides whose squares are subnormal, or zero.
                4 => {
                    let tiny = [1e-19, 1e-20, 1e-22, 1e-30][n / 8 % 4];
                    simplex =
                        [[0.0; D], [tiny; D], std::array::from_fn(|k| if k == 0 { -tiny } else { tiny })]
                            [..D]
                            .try_into()
                            .unwrap();
                }
                _ => {}
            }
            let size = [1.0, 3.0, 40.0][n % 3];
            let p: [f64; D] =
                std::array::from_fn(|_| (random.unit() - 0.5) * size).map(|v: f64| f64::from(v as f32));
            let want = simplex_distance_sq(p, &simplex).sqrt();
            let lanes = simplex.map(|c| c.map(|v| [v; LANES]));
            let mut best = [f32::INFINITY; LANES];
            Block::of(lanes).relax(n % LANES, &p.map(|v| [v as f32; LANES]), &mut best);
            let got = best[0];
            let error = (f64::from(got.sqrt()) - want).abs() / (1.0 + want);
            worst = worst.max(error);
        }
        // f32 numbers of a few cells, squared and their root taken: 1e-3 where a distance near zero is the root of a
        // rounded difference does not occur, as differences are taken before squares.
        assert!(worst < 1e-6, "{worst}");
    }

    #[test]
    fn is_the_distance_in_f64_2d_and_3d() {
        is_the_distance_in_f64::<2>();
        is_the_distance_in_f64::<3>();
    }
}
