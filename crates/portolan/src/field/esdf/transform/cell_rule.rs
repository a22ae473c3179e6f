//! Loops over the cells of one brick.

use multiversion::multiversion;

/// What makes a cell a seed, and what becomes of a squared distance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellRule {
    /// Cells of smaller weight count as never observed.
    min_weight: f32,
    /// Cells whose estimate is so many cells from zero are seeds: at least, at most.
    offsets: [f32; 2],
    /// The most that `f` of a seed is.
    most: f32,
    /// Edge of a cell (meters).
    resolution: f32,
    /// Squared distances (cells) beyond this are saturated.
    pub(crate) limit: f32,
}

impl CellRule {
    /// Every cell within `band_cells` of zero is a seed with its own estimate.
    pub(crate) fn band(min_weight: f32, band_cells: f32, resolution: f32, limit: f32) -> Self {
        Self { min_weight, offsets: [-band_cells, band_cells], most: f32::INFINITY, resolution, limit }
    }

    /// Every cell inside of the surface is a seed, every cell outside.
    pub(crate) fn sides(min_weight: f32, resolution: f32, limit: f32) -> [Self; 2] {
        let below_zero = -f32::from_bits(1);
        [[f32::NEG_INFINITY, below_zero], [0.0, f32::INFINITY]].map(|offsets| Self {
            min_weight,
            offsets,
            most: 0.0,
            resolution,
            limit,
        })
    }

    #[inline(always)]
    fn observed(&self, weight: f32) -> bool {
        (weight > 0.0) & (weight >= self.min_weight)
    }

    /// `(D / r)^2` of a seed, infinity for any other cell.
    #[inline(always)]
    fn seed(&self, inverse: f32, distance: f32, weight: f32) -> f32 {
        let offset = distance * inverse;
        let is_seed = self.observed(weight) & (offset >= self.offsets[0]) & (offset <= self.offsets[1]);
        if is_seed { (offset * offset).min(self.most) } else { f32::INFINITY }
    }

    #[inline(always)]
    fn inverse(&self) -> f32 {
        1.0 / self.resolution
    }
}

/// Whether any cell was observed, and the least of `f + farthest` of the seeds (infinity: no seed).
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn survey(distances: &[f32], weights: &[f32], farthest: &[f32], rule: &CellRule) -> (bool, f32) {
    const LANES: usize = 16;
    let inverse = rule.inverse();
    let mut best = [f32::INFINITY; LANES];
    let mut observed = [0u32; LANES];
    let chunks = distances.chunks_exact(LANES).zip(weights.chunks_exact(LANES));
    for ((d, w), far) in chunks.zip(farthest.chunks_exact(LANES)) {
        for i in 0..LANES {
            observed[i] |= u32::from(rule.observed(w[i]));
            let bound = rule.seed(inverse, d[i], w[i]) + far[i];
            best[i] = if bound < best[i] { bound } else { best[i] };
        }
    }
    (observed.iter().any(|&o| o != 0), best.into_iter().fold(f32::INFINITY, f32::min))
}

/// The seeds of a brick, in its order.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn seeds(distances: &[f32], weights: &[f32], rule: &CellRule, out: &mut [f32]) {
    let inverse = rule.inverse();
    for (out, (&d, &w)) in out.iter_mut().zip(distances.iter().zip(weights)) {
        *out = rule.seed(inverse, d, w);
    }
}

/// Squared distances (cells) become signed ones (meters): infinite, with the side's sign, beyond the limit; NaN where
/// nothing was observed. Zero counts as free, whatever its sign.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn sign(values: &mut [f32], distances: &[f32], weights: &[f32], rule: &CellRule) {
    for (value, (&d, &w)) in values.iter_mut().zip(distances.iter().zip(weights)) {
        let length = if *value <= rule.limit { value.sqrt() * rule.resolution } else { f32::INFINITY };
        let signed = if d < 0.0 { -length } else { length };
        *value = if rule.observed(w) { signed } else { f32::NAN };
    }
}

/// The squared distances of both sides become signed ones (meters), from the center to half a cell before that of the
/// nearest cell of the other side; as [`sign`] does where there is none.
pub(crate) fn mask(
    to_free: &mut [f32],
    to_occupied: &[f32],
    distances: &[f32],
    weights: &[f32],
    rule: &CellRule,
) {
    let cells = to_occupied.iter().zip(distances.iter().zip(weights));
    for (value, (&to_occupied, (&d, &w))) in to_free.iter_mut().zip(cells) {
        let (sq, side) = if d < 0.0 { (*value, -1.0) } else { (to_occupied, 1.0) };
        let length = if sq <= rule.limit { (sq.sqrt() - 0.5) * rule.resolution } else { f32::INFINITY };
        *value = if rule.observed(w) { side * length } else { f32::NAN };
    }
}
