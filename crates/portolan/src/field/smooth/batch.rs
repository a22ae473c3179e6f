//! Many points at once.

use super::cubic::Smooth;
use crate::answer::{Answer, Status};
use crate::field::{Esdf, EsdfGrid};
use crate::geom::{BlockKey, vector};
use crate::parallel;
use multiversion::multiversion;

/// Which interpolant a batch of points is answered from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// From the `2^D` centers around a point: the gradient jumps where a point crosses a plane of centers.
    #[default]
    Linear,
    /// From `4^D` centres, as [`EsdfGrid::smooth`]: the gradient is continuous.
    Cubic,
}

/// Where the answers of a batch go, one slot for each point. Where a point is unknown or outside its distance and
/// gradient are NaN.
#[derive(Debug)]
pub struct FieldSlots<'a, const D: usize> {
    /// Signed distances (meters).
    pub distance: &'a mut [f64],
    /// Exact derivatives of the interpolant that the distances come from (per meter).
    pub gradient: &'a mut [[f64; D]],
    /// What each answer is.
    pub status: &'a mut [Status],
}

/// Points that are interpolated side by side.
const LANES: usize = 8;

/// Points that one task answers.
const TASK: usize = 2048;

/// What a batch needs of a field.
trait Samples<const D: usize>: Sync {
    fn resolution(&self) -> f64;

    /// The lower one of the two centers beside a point and its place between them; `None`: nowhere near.
    fn place(&self, p_world: [f64; D]) -> Option<([i32; D], [f64; D])>;

    /// The `2^D` centres from `base` on, and whether one stands for more; `None` where one is unknown. `last` is the brick
    /// that was looked into last.
    fn corners<'s>(&'s self, base: [i32; D], last: &mut Brick<'s, D>) -> Option<([f32; 8], bool)>;

    fn cubic_slope(&self, base: [i32; D], fraction: &[f64; D]) -> Option<Answer<Smooth<D>>>;

    /// Why a point has no answer.
    fn nothing(&self, p_world: [f64; D]) -> Status;

    /// The answer, in cells, where one of the centers has none.
    fn on_nodes(&self, p_world: [f64; D]) -> Answer<(f64, [f64; D])>;
}

type Brick<'s, const D: usize> = Option<(BlockKey<D>, &'s [f32])>;

impl<const D: usize> Samples<D> for EsdfGrid<D> {
    #[inline(always)]
    fn resolution(&self) -> f64 {
        self.grid().lattice.resolution
    }

    #[inline(always)]
    fn place(&self, p_world: [f64; D]) -> Option<([i32; D], [f64; D])> {
        self.grid().interpolation(p_world)
    }

    #[inline(always)]
    fn corners<'s>(&'s self, base: [i32; D], _: &mut Brick<'s, D>) -> Option<([f32; 8], bool)> {
        let (at, strides) = (self.grid().index(base)?, self.grid().strides());
        let mut corners = [0.0; 8];
        for (pair, to) in corners.as_chunks_mut::<2>().0.iter_mut().enumerate().take(1 << (D - 1)) {
            let at = at + (1..D).map(|k| (pair >> (k - 1) & 1) * strides[k]).sum::<usize>();
            to.copy_from_slice(self.samples().get(at..at + 2)?);
        }
        let mut unknown = false;
        corners.iter().for_each(|v| unknown |= v.is_nan());
        (!unknown).then(|| (corners, self.saturated_beside(base)))
    }

    #[inline(always)]
    fn cubic_slope(&self, base: [i32; D], fraction: &[f64; D]) -> Option<Answer<Smooth<D>>> {
        self.cubic::<false>(base, fraction)
    }

    fn nothing(&self, p_world: [f64; D]) -> Status {
        self.nothing_at::<()>(p_world).status()
    }

    fn on_nodes(&self, p_world: [f64; D]) -> Answer<(f64, [f64; D])> {
        Self::on_nodes(self, p_world)
    }
}

impl<const D: usize> Samples<D> for Esdf<D> {
    #[inline(always)]
    fn resolution(&self) -> f64 {
        self.lattice().resolution
    }

    #[inline(always)]
    fn place(&self, p_world: [f64; D]) -> Option<([i32; D], [f64; D])> {
        Esdf::place(self, p_world)
    }

    #[inline(always)]
    fn corners<'s>(&'s self, base: [i32; D], last: &mut Brick<'s, D>) -> Option<([f32; 8], bool)> {
        if (0..D).any(|k| base[k] & 7 == 7) {
            return Esdf::corners(self, base);
        }
        let key = BlockKey::of_cell(base);
        let brick = match *last {
            Some((same, brick)) if same == key => brick,
            _ => {
                let brick = self.brick(key)?;
                *last = Some((key, brick));
                brick
            }
        };
        let at = BlockKey::offset(base);
        let mut corners = [0.0; 8];
        for (pair, to) in corners.as_chunks_mut::<2>().0.iter_mut().enumerate().take(1 << (D - 1)) {
            let at = at + (1..D).map(|k| (pair >> (k - 1) & 1) << (3 * k)).sum::<usize>();
            to.copy_from_slice(brick.get(at..at + 2)?);
        }
        let (mut unknown, mut infinite) = (false, false);
        corners.iter().for_each(|v| unknown |= v.is_nan());
        corners.iter().for_each(|v| infinite |= v.is_infinite());
        let largest = self.max_distance();
        (!unknown).then(|| (corners.map(|v| v.clamp(-largest, largest)), infinite))
    }

    #[inline(always)]
    fn cubic_slope(&self, base: [i32; D], fraction: &[f64; D]) -> Option<Answer<Smooth<D>>> {
        self.cubic::<false>(base, fraction)
    }

    fn nothing(&self, p_world: [f64; D]) -> Status {
        Esdf::nothing::<()>(self, p_world).status()
    }

    fn on_nodes(&self, p_world: [f64; D]) -> Answer<(f64, [f64; D])> {
        Esdf::on_nodes(self, p_world)
    }
}

impl<const D: usize> EsdfGrid<D> {
    /// [`EsdfGrid::distance_and_gradient`], or what [`EsdfGrid::smooth`] has of it, of many points (world): the same bits. Allocates
    /// nothing for a point; on all cores with the feature `parallel`. O(points).
    ///
    /// # Panics
    /// Where `out` does not have one slot for each point.
    pub fn distances_and_gradients(
        &self,
        points: &[[f64; D]],
        interpolation: Interpolation,
        out: FieldSlots<'_, D>,
    ) {
        batch(self, points, interpolation, out);
    }
}

impl<const D: usize> Esdf<D> {
    /// [`Esdf::distance_and_gradient`], or what [`Esdf::smooth`] has of it, of many points (world): the same
    /// bits. Faster where points that follow each other are near each other. Allocates nothing for a point; on all cores
    /// with the feature `parallel`. O(points).
    ///
    /// # Panics
    /// Where `out` does not have one slot for each point.
    pub fn distances_and_gradients(
        &self,
        points: &[[f64; D]],
        interpolation: Interpolation,
        out: FieldSlots<'_, D>,
    ) {
        batch(self, points, interpolation, out);
    }
}

fn batch<S: Samples<D>, const D: usize>(
    field: &S,
    points: &[[f64; D]],
    interpolation: Interpolation,
    out: FieldSlots<'_, D>,
) {
    let FieldSlots { distance, gradient, status } = out;
    let slots = [distance.len(), gradient.len(), status.len()];
    assert_eq!(slots, [points.len(); 3], "one slot for each point");
    let slots = distance.chunks_mut(TASK).zip(gradient.chunks_mut(TASK)).zip(status.chunks_mut(TASK));
    parallel::each(points.chunks(TASK).zip(slots), |(points, ((distance, gradient), status))| {
        serial(field, points, interpolation, distance, gradient, status);
    });
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn serial<S: Samples<D>, const D: usize>(
    field: &S,
    points: &[[f64; D]],
    interpolation: Interpolation,
    distance: &mut [f64],
    gradient: &mut [[f64; D]],
    status: &mut [Status],
) {
    if interpolation == Interpolation::Cubic {
        let slots = distance.iter_mut().zip(gradient).zip(status);
        for (&p, ((distance, gradient), status)) in points.iter().zip(slots) {
            let answer = field.place(p).and_then(|(base, fraction)| field.cubic_slope(base, &fraction));
            let what = answer.and_then(Answer::value);
            *status =
                answer.filter(|a| a.status().has_value()).map_or_else(|| field.nothing(p), |a| a.status());
            (*distance, *gradient) = what.map_or((f64::NAN, [f64::NAN; D]), |w| (w.distance, w.gradient));
        }
        return;
    }
    let inverse = 1.0 / field.resolution();
    let mut last = None;
    let slots = distance.chunks_mut(LANES).zip(gradient.chunks_mut(LANES)).zip(status.chunks_mut(LANES));
    for (points, ((distance, gradient), status)) in points.chunks(LANES).zip(slots) {
        let mut corners = [[f64::NAN; LANES]; 8];
        let mut fractions = [[0.0; LANES]; D];
        let mut missing = false;
        for (lane, (&p, status)) in points.iter().zip(&mut *status).enumerate() {
            let found = field.place(p).and_then(|(base, fraction)| {
                for k in 0..D {
                    fractions[k][lane] = fraction[k];
                }
                field.corners(base, &mut last)
            });
            let Some((samples, saturated)) = found else {
                missing = true;
                continue;
            };
            *status = if saturated { Status::Saturated } else { Status::Known };
            for c in 0..1 << D {
                corners[c][lane] = f64::from(samples[c]);
            }
        }
        let slopes = interpolate(&mut corners, &fractions);
        for (lane, (distance, gradient)) in distance.iter_mut().zip(&mut *gradient).enumerate() {
            *distance = corners[0][lane];
            *gradient = vector::scale(std::array::from_fn(|k| slopes[k][lane]), inverse);
        }
        if missing {
            let slots = distance.iter_mut().zip(gradient).zip(status);
            for (&p, ((distance, gradient), status)) in
                points.iter().zip(slots).filter(|(_, ((d, _), _))| d.is_nan())
            {
                let answer = field.on_nodes(p);
                *status = answer.status();
                if let Some((value, slope)) = answer.value() {
                    (*distance, *gradient) = (value, vector::scale(slope, inverse));
                }
            }
        }
    }
}

/// [`crate::geom::interpolate`] for lanes side by side, term by term. Leaves the values in the first corner and returns
/// the slopes.
#[inline(always)]
fn interpolate<const D: usize>(
    corners: &mut [[f64; LANES]; 8],
    fractions: &[[f64; LANES]; D],
) -> [[f64; LANES]; D] {
    let mut slopes = [[[0.0; LANES]; 4]; D];
    for k in (0..D).rev() {
        let half = 1usize << k;
        for c in 0..half {
            for lane in 0..LANES {
                let (low, high, t) = (corners[c][lane], corners[c + half][lane], fractions[k][lane]);
                slopes[k][c][lane] = high - low;
                corners[c][lane] = low + t * (high - low);
            }
            for above in k + 1..D {
                for lane in 0..LANES {
                    let (low, high) = (slopes[above][c][lane], slopes[above][c + half][lane]);
                    slopes[above][c][lane] = low + fractions[k][lane] * (high - low);
                }
            }
        }
    }
    slopes.map(|s| s[0])
}

#[cfg(test)]
#[path = "batch_tests.rs"]
mod tests;
