//! The samples around a point, of dense fields and of fields in bricks.

use super::cubic::{Neighbourhood, Smooth, complete, cubic};
use crate::answer::Answer;
use crate::field::{Esdf, EsdfGrid};
use crate::geom::{BLOCK_EDGE, BlockKey, vector};

impl<const D: usize> EsdfGrid<D> {
    /// Signed distance with continuous gradient, and its second derivatives, from the `4^D` centers around a point, for
    /// optimisers that take the jumps of [`EsdfGrid::gradient`] ill. O(1).
    ///
    /// Cubic through the samples; linear and quadratic fields are reproduced, and between samples it may pass them by an
    /// eighth of their second difference. Unknown where [`EsdfGrid::distance`] is: where one of the `2^D` centers next to the
    /// point is. Others that are missing, at the border of the map or of what is known, are replaced by the straight line
    /// through the two next to them: within a cell of what is unknown, and only there, value and gradient may jump, by
    /// less than the second difference of the samples.
    pub fn smooth(&self, p_world: impl Into<[f64; D]>) -> Answer<Smooth<D>> {
        let p = p_world.into();
        let Some((base, fraction)) = self.grid().interpolation(p) else { return self.nothing_at(p) };
        self.cubic::<true>(base, &fraction).unwrap_or(Answer::Unknown)
    }

    /// The answer in a cell; `None`: unknown.
    #[inline(always)]
    pub(super) fn cubic<const HESSIAN: bool>(
        &self,
        base: [i32; D],
        fraction: &[f64; D],
    ) -> Option<Answer<Smooth<D>>> {
        let answer = self.cubic_of_samples::<HESSIAN>(base, fraction)?;
        match answer {
            Answer::Known(smooth) if self.has_status() => {
                // Any of the 4^D that stands for more.
                let saturated = (0..1usize << D).any(|c| {
                    self.saturated_beside(std::array::from_fn(|k| base[k] - 1 + 2 * (c >> k & 1) as i32))
                });
                Some(if saturated { Answer::Saturated(smooth) } else { answer })
            }
            _ => Some(answer),
        }
    }

    #[inline(always)]
    fn cubic_of_samples<const HESSIAN: bool>(
        &self,
        base: [i32; D],
        fraction: &[f64; D],
    ) -> Option<Answer<Smooth<D>>> {
        let (shape, strides) = (self.grid().shape, self.grid().strides());
        let resolution = self.grid().lattice.resolution;
        if !(0..D).all(|k| base[k] >= 1 && base[k] as usize + 2 < shape[k]) {
            return smooth::<D, HESSIAN>(&self.border(base), fraction, None, resolution);
        }
        let first: usize = (0..D).map(|k| (base[k] as usize - 1) * strides[k]).sum();
        let mut samples = [[0.0; 4]; 16];
        for row in 0..1 << (2 * (D - 1)) {
            let at = first + (1..D).map(|k| (row >> (2 * (k - 1)) & 3) * strides[k]).sum::<usize>();
            samples[row] = *self.samples().get(at..)?.first_chunk()?;
        }
        smooth::<D, HESSIAN>(samples.as_flattened().first_chunk()?, fraction, None, resolution)
    }

    /// Samples where some of them lie outside.
    #[cold]
    #[inline(never)]
    fn border(&self, base: [i32; D]) -> Neighbourhood {
        let mut samples = [f32::NAN; 64];
        for (i, to) in samples.iter_mut().enumerate().take(1 << (2 * D)) {
            let cell = std::array::from_fn(|k| base[k] - 1 + (i >> (2 * k) & 3) as i32);
            *to = self.grid().index(cell).and_then(|at| self.samples().get(at)).map_or(f32::NAN, |v| *v);
        }
        samples
    }
}

impl<const D: usize> Esdf<D> {
    /// Signed distance with continuous gradient, and its second derivatives, from the `4^D` centers around a point, for
    /// optimisers that take the jumps of [`Esdf::gradient`] ill. O(1): a look into up to `2^D` bricks.
    ///
    /// As [`EsdfGrid::smooth`]. Saturated where one of the `4^D` is beyond the largest distance, which it then stands for.
    pub fn smooth(&self, p_world: impl Into<[f64; D]>) -> Answer<Smooth<D>> {
        let p = p_world.into();
        let Some((base, fraction)) = self.place(p) else { return Answer::Outside };
        self.cubic::<true>(base, &fraction).unwrap_or_else(|| self.nothing(p))
    }

    /// The answer in a cell; `None`: unknown.
    #[inline(always)]
    pub(super) fn cubic<const HESSIAN: bool>(
        &self,
        base: [i32; D],
        fraction: &[f64; D],
    ) -> Option<Answer<Smooth<D>>> {
        let (largest, resolution) = (Some(self.max_distance()), self.lattice().resolution);
        // Indices of points keep away from the ends of what they can hold.
        let first = base.map(|b| b.saturating_sub(1));
        if !(0..D).all(|k| (first[k] & 7) <= BLOCK_EDGE as i32 - 4) {
            return smooth::<D, HESSIAN>(&self.across(first), fraction, largest, resolution);
        }
        let brick = self.brick(BlockKey::of_cell(first))?;
        let first = BlockKey::offset(first);
        let mut samples = [[0.0; 4]; 16];
        for row in 0..1 << (2 * (D - 1)) {
            let at = first + (1..D).map(|k| (row >> (2 * (k - 1)) & 3) << (3 * k)).sum::<usize>();
            samples[row] = *brick.get(at..)?.first_chunk()?;
        }
        smooth::<D, HESSIAN>(samples.as_flattened().first_chunk()?, fraction, largest, resolution)
    }

    /// Samples that lie in several bricks; NaN where there is none.
    #[inline(never)]
    fn across(&self, first: [i32; D]) -> Neighbourhood {
        let mut samples = [f32::NAN; 64];
        let key = BlockKey::of_cell(first);
        let rows = samples.as_chunks_mut::<4>().0.iter_mut().enumerate().take(1 << (2 * (D - 1)));
        let mut bricks: [Option<&[f32]>; 8] = [None; 8];
        for (n, brick) in bricks.iter_mut().enumerate().take(1 << D) {
            // Bricks that no sample lies in are not looked for.
            let needed = (0..D).all(|k| n >> k & 1 == 0 || (first[k] & 7) > BLOCK_EDGE as i32 - 4);
            if needed {
                *brick = self.brick(BlockKey(std::array::from_fn(|k| key.0[k] + (n >> k & 1) as i32)));
            }
        }
        for (row, to) in rows {
            let (mut n, mut at) = (0, 0);
            for k in 1..D {
                let cell = (first[k] & 7) as usize + (row >> (2 * (k - 1)) & 3);
                n |= (cell >> 3) << k;
                at |= (cell & 7) << (3 * k);
            }
            for (x, to) in to.iter_mut().enumerate() {
                let cell = (first[0] & 7) as usize + x;
                if let Some(brick) = bricks[n | cell >> 3] {
                    *to = brick.get(at | cell & 7).copied().unwrap_or(f32::NAN);
                }
            }
        }
        samples
    }
}

/// The answer at a place in a neighbourhood, in meters; `None`: unknown. Samples beyond `largest` stand for it.
#[inline(always)]
fn smooth<const D: usize, const HESSIAN: bool>(
    samples: &Neighbourhood,
    fraction: &[f64; D],
    largest: Option<f32>,
    resolution: f64,
) -> Option<Answer<Smooth<D>>> {
    let mut odd = false;
    samples[..1 << (2 * D)].iter().for_each(|v| odd |= !v.is_finite());
    if odd {
        let (samples, saturated) = mended::<D>(samples, largest)?;
        let answer = metric(cubic::<D, HESSIAN>(&samples, fraction), resolution);
        return Some(if saturated { Answer::Saturated(answer) } else { Answer::Known(answer) });
    }
    Some(Answer::Known(metric(cubic::<D, HESSIAN>(samples, fraction), resolution)))
}

/// All samples, and whether one of them stood for more; `None`: unknown.
#[cold]
#[inline(never)]
fn mended<const D: usize>(samples: &Neighbourhood, largest: Option<f32>) -> Option<(Neighbourhood, bool)> {
    let mut samples = *samples;
    let mut saturated = false;
    if let Some(largest) = largest {
        saturated = samples[..1 << (2 * D)].iter().any(|v| v.is_infinite());
        samples = samples.map(|v| v.clamp(-largest, largest));
    }
    complete::<D>(&mut samples).then_some((samples, saturated))
}

/// Per cell to per meter.
#[inline(always)]
fn metric<const D: usize>(cells: Smooth<D>, resolution: f64) -> Smooth<D> {
    let scale = 1.0 / resolution;
    Smooth {
        distance: cells.distance,
        gradient: vector::scale(cells.gradient, scale),
        hessian: cells.hessian.map(|row| vector::scale(row, scale * scale)),
    }
}
