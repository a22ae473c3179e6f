//! Distances to simplices, eight at a time.

/// Simplices of a block, points of a group.
pub(super) const LANES: usize = 8;

/// A number per lane.
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

#[inline(always)]
fn each(f: impl Fn(usize) -> f32) -> Lane {
    let mut lane = [0.0; LANES];
    for l in 0..LANES {
        lane[l] = f(l);
    }
    lane
}

#[inline(always)]
fn dot<const D: usize>(a: &[Lane; D], b: &[Lane; D]) -> Lane {
    let mut sum = [0.0; LANES];
    for k in 0..D {
        for l in 0..LANES {
            sum[l] += a[k][l] * b[k][l];
        }
    }
    sum
}

#[inline(always)]
fn sub<const D: usize>(a: &[Lane; D], b: &[Lane; D]) -> [Lane; D] {
    let mut out = [[0.0; LANES]; D];
    for k in 0..D {
        for l in 0..LANES {
            out[k][l] = a[k][l] - b[k][l];
        }
    }
    out
}

/// In space.
#[inline(always)]
fn cross<const D: usize>(a: &[Lane; D], b: &[Lane; D]) -> [Lane; D] {
    let mut out = [[0.0; LANES]; D];
    for k in 0..D {
        let (i, j) = ((k + 1) % D, (k + 2) % D);
        for l in 0..LANES {
            out[k][l] = a[i][l] * b[j][l] - a[j][l] * b[i][l];
        }
    }
    out
}

/// Sides of a segment or a triangle.
const fn sides<const D: usize>() -> usize {
    if D == 2 { 1 } else { 3 }
}

impl<const D: usize> Block<D> {
    pub(super) const EMPTY: Self = Self {
        corners: [[[0.0; LANES]; D]; D],
        inverse_sq: [[0.0; LANES]; D],
        outward: [[[0.0; LANES]; D]; D],
        normal: [[0.0; LANES]; D],
    };

    /// Of simplices whose corners are given lane by lane.
    #[inline(always)]
    pub(super) fn of(corners: [[Lane; D]; D]) -> Self {
        let mut block = Self { corners, ..Self::EMPTY };
        for s in 0..sides::<D>() {
            let side = sub(&corners[(s + 1) % D], &corners[s]);
            let length_sq = dot(&side, &side);
            block.inverse_sq[s] = each(|l| if length_sq[l] > 0.0 { 1.0 / length_sq[l] } else { 0.0 });
        }
        if D == 3 {
            let (u, v) = (sub(&corners[1], &corners[0]), sub(&corners[2], &corners[0]));
            let normal = cross(&u, &v);
            let (area_sq, u_sq, v_sq) = (dot(&normal, &normal), dot(&u, &u), dot(&v, &v));
            // A narrower triangle lies within a thousandth of its length of its sides.
            let scale =
                each(|l| if area_sq[l] > 1e-6 * u_sq[l] * v_sq[l] { 1.0 / area_sq[l].sqrt() } else { 0.0 });
            for k in 0..D {
                for l in 0..LANES {
                    block.normal[k][l] = normal[k][l] * scale[l];
                }
            }
            for s in 0..D {
                block.outward[s] = cross(&sub(&corners[(s + 1) % D], &corners[s]), &block.normal);
            }
        }
        block
    }

    /// The same simplex in every lane.
    #[inline(always)]
    pub(super) fn all(simplex: &[[f32; D]; D]) -> Self {
        let mut corners = [[[0.0; LANES]; D]; D];
        for i in 0..D {
            for k in 0..D {
                corners[i][k] = [simplex[i][k]; LANES];
            }
        }
        Self::of(corners)
    }

    /// Squared distance from a point to the simplex of each lane.
    #[inline(always)]
    pub(super) fn distance_sq(&self, p: &[Lane; D]) -> Lane {
        let mut best = [f32::INFINITY; LANES];
        let mut inside = [0.0f32; LANES];
        let mut plane = [0.0; LANES];
        for s in 0..sides::<D>() {
            let from = sub(p, &self.corners[s]);
            let side = sub(&self.corners[(s + 1) % D], &self.corners[s]);
            let along = dot(&from, &side);
            let t = each(|l| (along[l] * self.inverse_sq[s][l]).max(0.0).min(1.0));
            let mut sq = [0.0; LANES];
            for k in 0..D {
                for l in 0..LANES {
                    let off = from[k][l] - t[l] * side[k][l];
                    sq[l] += off * off;
                }
            }
            best = each(|l| if sq[l] < best[l] { sq[l] } else { best[l] });
            if D == 3 {
                // Negative on the inner side; the largest of the three tells whether the foot is in the triangle.
                let out = dot(&from, &self.outward[s]);
                inside = each(|l| if s == 0 || out[l] > inside[l] { out[l] } else { inside[l] });
                if s == 0 {
                    plane = dot(&from, &self.normal);
                }
            }
        }
        if D == 3 {
            best = each(|l| if inside[l] < 0.0 { plane[l] * plane[l] } else { best[l] });
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::elements::nearest::simplex_distance_sq;
    use crate::field::elements::testing::Random;

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
                _ => {}
            }
            let size = [1.0, 3.0, 40.0][n % 3];
            let p: [f64; D] =
                std::array::from_fn(|_| (random.unit() - 0.5) * size).map(|v: f64| f64::from(v as f32));
            let want = simplex_distance_sq(p, &simplex).sqrt();
            let got = Block::all(&simplex).distance_sq(&p.map(|v| [v as f32; LANES]))[0];
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
