//! Many points at once.

use super::cubic::Smooth;
use crate::answer::Answer;
use crate::field::{Esdf, SparseEsdf};
use crate::geom::{BlockKey, vector};
use crate::parallel;
use multiversion::multiversion;

/// Which interpolant a batch of points is answered from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// From the `2^D` centres around a point: the gradient jumps where a point crosses a plane of centres.
    #[default]
    Linear,
    /// From `4^D` centres, as [`Esdf::smooth`]: the gradient is continuous.
    Cubic,
}

/// What an answer of a batch is, in a byte; what [`Answer`] says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// Inside the map, where nothing was observed.
    #[default]
    Unknown = 0,
    /// The map knows.
    Known = 1,
    /// Beyond what the map maintains: at least so far.
    Saturated = 2,
    /// Outside of the map.
    Outside = 3,
}

/// Where the answers of a batch go, one slot for each point. Where a point is unknown or outside its distance and
/// gradient are NaN.
#[derive(Debug)]
pub struct FieldSlots<'a, const D: usize> {
    /// Signed distances (metres).
    pub distance: &'a mut [f64],
    /// Exact derivatives of the interpolant that the distances come from (per metre).
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

    /// The lower one of the two centres beside a point and its place between them; `None`: nowhere near.
    fn place(&self, p_world: [f64; D]) -> Option<([i32; D], [f64; D])>;

    /// The `2^D` centres from `base` on, and whether one stands for more; `None` where one is unknown. `last` is the brick
    /// that was looked into last.
    fn corners<'s>(&'s self, base: [i32; D], last: &mut Brick<'s, D>) -> Option<([f32; 8], bool)>;

    fn cubic_slope(&self, base: [i32; D], fraction: &[f64; D]) -> Option<Answer<Smooth<D>>>;

    /// Why a point has no answer.
    fn nothing(&self, p_world: [f64; D]) -> Status;
}

type Brick<'s, const D: usize> = Option<(BlockKey<D>, &'s [f32])>;

impl<const D: usize> Samples<D> for Esdf<D> {
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
        (!unknown).then_some((corners, false))
    }

    #[inline(always)]
    fn cubic_slope(&self, base: [i32; D], fraction: &[f64; D]) -> Option<Answer<Smooth<D>>> {
        self.cubic::<false>(base, fraction)
    }

    fn nothing(&self, p_world: [f64; D]) -> Status {
        if self.grid().aabb().contains(p_world) { Status::Unknown } else { Status::Outside }
    }
}

impl<const D: usize> Samples<D> for SparseEsdf<D> {
    #[inline(always)]
    fn resolution(&self) -> f64 {
        self.lattice().resolution
    }

    #[inline(always)]
    fn place(&self, p_world: [f64; D]) -> Option<([i32; D], [f64; D])> {
        SparseEsdf::place(self, p_world).known()
    }

    #[inline(always)]
    fn corners<'s>(&'s self, base: [i32; D], last: &mut Brick<'s, D>) -> Option<([f32; 8], bool)> {
        if (0..D).any(|k| base[k] & 7 == 7) {
            return SparseEsdf::corners(self, base);
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
        match SparseEsdf::nothing::<()>(self, p_world) {
            Answer::Outside => Status::Outside,
            _ => Status::Unknown,
        }
    }
}

impl<const D: usize> Esdf<D> {
    /// [`Esdf::distance_and_gradient`], or what [`Esdf::smooth`] has of it, of many points (world): the same bits. Allocates
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

impl<const D: usize> SparseEsdf<D> {
    /// [`SparseEsdf::distance_and_gradient`], or what [`SparseEsdf::smooth`] has of it, of many points (world): the same
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
    parallel::for_each(
        points.chunks(TASK).zip(slots),
        || (),
        |(points, slots), ()| {
            let ((distance, gradient), status) = slots;
            serial(field, points, interpolation, distance, gradient, status);
        },
    );
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
            let (is, what) = match answer {
                Some(Answer::Known(what)) => (Status::Known, Some(what)),
                Some(Answer::Saturated(what)) => (Status::Saturated, Some(what)),
                _ => (field.nothing(p), None),
            };
            *status = is;
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
        for (lane, (&p, status)) in points.iter().zip(status).enumerate() {
            let found = field.place(p).and_then(|(base, fraction)| {
                for k in 0..D {
                    fractions[k][lane] = fraction[k];
                }
                field.corners(base, &mut last)
            });
            let Some((samples, saturated)) = found else {
                *status = field.nothing(p);
                continue;
            };
            *status = if saturated { Status::Saturated } else { Status::Known };
            for c in 0..1 << D {
                corners[c][lane] = f64::from(samples[c]);
            }
        }
        let slopes = interpolate(&mut corners, &fractions);
        for (lane, (distance, gradient)) in distance.iter_mut().zip(gradient).enumerate() {
            *distance = corners[0][lane];
            *gradient = vector::scale(std::array::from_fn(|k| slopes[k][lane]), inverse);
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
mod tests {
    use super::*;
    use crate::cell::{DistanceBrick, SignedDistance};
    use crate::field::{EsdfMethod, SparseEsdfSettings};
    use crate::geom::{Grid, Lattice, block_cells};
    use crate::store::{Bricks, Store};

    const R: f64 = 0.1;

    fn answers<const D: usize>(
        points: &[[f64; D]],
        run: impl Fn(FieldSlots<'_, D>),
    ) -> Vec<(Status, f64, [f64; D])> {
        let mut distance = vec![0.0; points.len()];
        let mut gradient = vec![[0.0; D]; points.len()];
        let mut status = vec![Status::default(); points.len()];
        run(FieldSlots { distance: &mut distance, gradient: &mut gradient, status: &mut status });
        (0..points.len()).map(|i| (status[i], distance[i], gradient[i])).collect()
    }

    fn typed<T>(answer: &Answer<T>) -> Status {
        match answer {
            Answer::Known(_) => Status::Known,
            Answer::Saturated(_) => Status::Saturated,
            Answer::Unknown => Status::Unknown,
            Answer::Outside => Status::Outside,
        }
    }

    fn points<const D: usize>(n: usize, edge: f64) -> Vec<[f64; D]> {
        let at = |i: usize, k: usize| {
            (i as f64 * [0.618_034, 0.754_878, 0.569_840][k]).fract() * (edge + 4.0) - 2.0
        };
        let mut points: Vec<_> = (0..n).map(|i| std::array::from_fn(|k| at(i, k))).collect();
        points.extend([[f64::NAN; D], [1e12; D], [-1e300; D], [f64::INFINITY; D]]);
        points
    }

    /// Every answer of a batch beside the single one; `seen` counts them by status.
    fn is_what_single_points_get<const D: usize>(
        points: &[[f64; D]],
        batch: impl Fn(Interpolation, FieldSlots<'_, D>),
        linear: impl Fn([f64; D]) -> Answer<(f64, [f64; D])>,
        smooth: impl Fn([f64; D]) -> Answer<Smooth<D>>,
    ) -> [[usize; 4]; 2] {
        let mut seen = [[0; 4]; 2];
        for (n, interpolation) in [Interpolation::Linear, Interpolation::Cubic].into_iter().enumerate() {
            for (&p, got) in points.iter().zip(answers(points, |out| batch(interpolation, out))) {
                let want = match interpolation {
                    Interpolation::Linear => linear(p),
                    Interpolation::Cubic => smooth(p).map(|s| (s.distance, s.gradient)),
                };
                seen[n][got.0 as usize] += 1;
                assert_eq!(got.0, typed(&want), "{p:?} {interpolation:?}");
                match want {
                    Answer::Known(w) | Answer::Saturated(w) => assert_eq!((got.1, got.2), w, "{p:?}"),
                    _ => assert!(got.1.is_nan() && got.2.iter().all(|g| g.is_nan())),
                }
            }
        }
        seen
    }

    fn ball<const D: usize>(p: [f64; D], edge: f64) -> f64 {
        vector::distance(p, [0.5 * edge; D]) - 0.8
    }

    fn dense_batches<const D: usize>() {
        let n = 30;
        let grid = Grid::new([0.0; D], R, [n; D]);
        let value = |i: usize| {
            if i % 97 == 5 { f32::NAN } else { ball(grid.lattice.center(grid.cell(i)), 3.0) as f32 }
        };
        let esdf = Esdf::from_samples(grid, (0..grid.len()).map(value).collect()).unwrap();
        let seen = is_what_single_points_get(
            &points::<D>(6000, 3.0),
            |interpolation, out| esdf.distances_and_gradients(&points::<D>(6000, 3.0), interpolation, out),
            |p| esdf.distance_and_gradient(p),
            |p| esdf.smooth(p),
        );
        // What is unknown is so for both.
        assert_eq!(seen[0], seen[1]);
        assert!(seen[0][0] > 50 && seen[0][1] > 200 && seen[0][3] > 1000, "{seen:?}");
    }

    #[test]
    fn dense_batches_are_what_single_points_get() {
        dense_batches::<2>();
        dense_batches::<3>();
    }

    /// A ball in observed bricks, some cells of them unobserved.
    fn sparse<const D: usize>(max_distance: f64) -> SparseEsdf<D> {
        let mut store = Bricks::<SignedDistance, D>::new(Lattice::new([0.0; D], R));
        for n in 0..5usize.pow(D as u32) {
            let key = BlockKey(std::array::from_fn(|k| (n / 5usize.pow(k as u32) % 5) as i32));
            let cells: Vec<_> =
                (0..block_cells::<D>()).map(|i| store.lattice().center(key.cell(i))).collect();
            let values: Vec<f32> = cells.iter().map(|&p| ball(p, 4.0).clamp(-0.3, 0.3) as f32).collect();
            let weights: Vec<f32> =
                (0..cells.len()).map(|i| if (i + n) % 251 == 9 { 0.0 } else { 1.0 }).collect();
            store.insert(key, DistanceBrick::from_parts(&values, &weights).unwrap()).unwrap();
        }
        let method = EsdfMethod::Seeded { band_cells: 1.5 };
        SparseEsdf::of(&store, &SparseEsdfSettings { max_distance, method, ..Default::default() })
    }

    fn sparse_batches<const D: usize>() {
        let esdf = sparse::<D>(0.7);
        let seen = is_what_single_points_get(
            &points::<D>(6000, 4.0),
            |interpolation, out| esdf.distances_and_gradients(&points::<D>(6000, 4.0), interpolation, out),
            |p| esdf.distance_and_gradient(p),
            |p| esdf.smooth(p),
        );
        assert!(seen.iter().flatten().all(|&n| n > 50), "{seen:?}");
        assert_eq!((seen[0][0], seen[0][3]), (seen[1][0], seen[1][3]));
    }

    #[test]
    fn sparse_batches_are_what_single_points_get() {
        sparse_batches::<2>();
        sparse_batches::<3>();
    }

    /// Bricks and array hold the same samples: they answer alike, across the faces of bricks, too.
    fn bricks_are_the_array<const D: usize>() {
        let bricks = sparse::<D>(9.0);
        let grid = Grid::new([0.0; D], R, [40; D]);
        let value = |i: usize| bricks.cell(grid.cell(i)).known().unwrap_or(f32::NAN);
        let dense = Esdf::from_samples(grid, (0..grid.len()).map(value).collect()).unwrap();
        let mut known = 0;
        for p in points::<D>(6000, 4.0) {
            if let Answer::Known(want) = dense.smooth(p) {
                let got = bricks.smooth(p).known().unwrap();
                // They agree on the place in a cell to rounding.
                assert!((got.distance - want.distance).abs() < 1e-12);
                assert!(vector::distance(got.gradient, want.gradient) < 1e-9);
                known += 1;
            }
        }
        assert!(known > 500, "{known}");
    }

    #[test]
    fn bricks_are_the_array_2d_and_3d() {
        bricks_are_the_array::<2>();
        bricks_are_the_array::<3>();
    }

    /// Off its centre a ball's distance has a gradient of length one and curvatures of one over the radius: the spline has
    /// them to the square of the cell, and its gradient is nearer to the truth than the linear one's.
    #[test]
    fn a_ball_bends_as_it_should() {
        let n = 40;
        let grid = Grid::new([0.0; 3], R, [n; 3]);
        let value = |i: usize| ball(grid.lattice.center(grid.cell(i)), 4.0) as f32;
        let esdf = Esdf::from_samples(grid, (0..grid.len()).map(value).collect()).unwrap();
        let (mut cubic, mut linear): (f64, f64) = (0.0, 0.0);
        for p in points::<3>(4000, 4.0) {
            let offset = vector::sub(p, [2.0; 3]);
            let radius = vector::norm(offset);
            let Answer::Known(got) = esdf.smooth(p) else { continue };
            if !(0.8..1.6).contains(&radius) {
                continue;
            }
            let outward = vector::scale(offset, 1.0 / radius);
            cubic = cubic.max(vector::distance(got.gradient, outward));
            linear = linear.max(vector::distance(esdf.gradient(p).known().unwrap(), outward));
            let trace: f64 = (0..3).map(|k| got.hessian[k][k]).sum();
            // 2 / radius; second derivatives of a cubic are wrong by the cell times third derivatives.
            assert!((trace - 2.0 / radius).abs() < 1.5 * R / radius.powi(2) * 2.0, "{trace} {radius}");
        }
        assert!(cubic < 0.012 && linear > 4.0 * cubic, "{cubic} {linear}");
    }
}
