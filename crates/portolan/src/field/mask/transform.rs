//! What is asked for, and the choice of the numbers to compute it with.

use super::cell::{Cells, Label, Labels, Mask, MaskCell, several};
use super::number::Number;
use super::panel::PLAIN;
use super::passes::{Last, Plan};

/// Why a mask has no transform.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaskError {
    /// Cells or rows cannot be counted in the numbers that are computed with.
    #[error("a mask can have 2^32 - 2 cells at most, and 2^24 along an axis of several")]
    TooLarge,
    /// The mask's cells are not as many as the shape says.
    #[error("a mask of {cells} cells cannot have {given}")]
    Length {
        /// Cells of the shape.
        cells: usize,
        /// Cells given.
        given: usize,
    },
    /// The bound is NaN or negative.
    #[error("distances cannot be bounded by {0}")]
    Bound(f64),
    /// A spacing is no positive, finite length.
    #[error("cells cannot have a spacing of {0}")]
    Spacing(f64),
    /// Squared distances do not fit into `f32`: the spacings differ too much.
    #[error("spacings from {0} to {1} are too different for distances in f32")]
    Spacings(f64, f64),
    /// Nearest cells are asked for where there is more than one label.
    #[error("the nearest cell is that of the background, and there are several labels beside it")]
    Labels,
    /// Nearest cells are asked for where the border counts.
    #[error("the border of the array has no cells that could be nearest")]
    Border,
}

/// Squares up to this one's stay below 2^31.
pub(super) const LARGEST_DIAGONAL: usize = 46_340;
/// Offsets up to this are exact in `f32`.
const LONGEST_AXIS: usize = 1 << 24;
/// What is smaller is done before another thread is awake.
const SHARED: usize = 1 << 13;

/// The exact Euclidean distance transform of masks of one shape: from the center of every cell to the nearest center of a
/// cell that is set; or of labels, to the nearest center of a cell of another label.
///
/// Cells are x fastest, at a distance of 1 ([`MaskTransform::spaced`]). Computed in whole numbers where all axes have one
/// spacing and the diagonal is at most 46 340 cells: squared distances are exact, up to 2^24 as they are returned, and
/// correctly rounded to `f32` beyond. Else computed in `f32`, which is exact as long as all squares are whole numbers of
/// squares of the least spacing, up to 2^24 of them, and otherwise within a few units in the last place. Where no cell is
/// set, or none within the bound, distances are infinite. In parallel with the feature `parallel`; the result is the same
/// bytes.
///
/// O(cells) where things are near; at worst O(cells · log of the longest axis) along lines whose lanes agree, and
/// O(cells · longest axis) for adversarial masks.
///
/// ```
/// use portolan::field::MaskTransform;
/// let wall = [false, false, true, false, false, false];
/// let transform = MaskTransform::new([3, 2])?;
/// assert_eq!(transform.squared_distances(&wall)?, [4.0, 1.0, 0.0, 5.0, 2.0, 1.0]);
/// assert_eq!(transform.within(1.5)?.distances(&wall)?[0], f32::INFINITY);
/// let labels = [3u16, 3, 7, 3, 3, 0];
/// assert_eq!(transform.label_distances(&labels)?, [2.0, 1.0, 1.0, 2.0, 1.0, 0.0]);
/// # Ok::<(), portolan::field::MaskError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskTransform<const D: usize> {
    shape: [usize; D],
    cells: usize,
    spacing: [f64; D],
    /// Distances up to this are wanted.
    bound: f64,
    border: bool,
    threads: usize,
}

impl<const D: usize> MaskTransform<D> {
    /// For masks with `shape` cells along each axis, without a bound.
    ///
    /// # Errors
    /// Where cells cannot be counted in `u32`, or the rows of one of several axes not in 24 bits.
    pub fn new(shape: [usize; D]) -> Result<Self, MaskError> {
        const { assert!(D >= 1 && D <= 3) }
        let cells = shape.iter().try_fold(1usize, |cells, &n| cells.checked_mul(n));
        let cells = cells.filter(|cells| *cells < u32::MAX as usize).ok_or(MaskError::TooLarge)?;
        if cells > 0 && D > 1 && shape.iter().any(|n| *n > LONGEST_AXIS) {
            return Err(MaskError::TooLarge);
        }
        let threads = if cells < SHARED { 1 } else { usize::MAX };
        Ok(Self { shape, cells, spacing: [1.0; D], bound: f64::INFINITY, border: false, threads })
    }

    /// Distances between the centers of neighboring cells along each axis; distances and bounds are in their unit.
    ///
    /// # Errors
    /// Where one is not positive and finite, or the squared diagonal does not fit into `f32` in units of the least.
    pub fn spaced(self, spacing: [f64; D]) -> Result<Self, MaskError> {
        if let Some(wrong) = spacing.iter().find(|s| !(**s > 0.0 && s.is_finite())) {
            return Err(MaskError::Spacing(*wrong));
        }
        let (least, most) = spacing.iter().fold((f64::INFINITY, 0.0f64), |(l, m), &s| (l.min(s), m.max(s)));
        let diagonal = |scale: f64| -> f64 {
            (0..D).map(|k| (spacing[k] / scale * (self.shape[k] + 1) as f64).powi(2)).sum()
        };
        let fits = |squared: f64| squared < f64::from(f32::MAX);
        if !fits(diagonal(least)) || !fits(diagonal(1.0)) || least < f64::from(f32::MIN_POSITIVE).sqrt() {
            return Err(MaskError::Spacings(least, most));
        }
        Ok(Self { spacing, ..self })
    }

    /// What lies around the array is set, or of another label: at a distance of 1 cell from the outermost ones. Only labels
    /// heed it.
    pub fn with_border(self, border: bool) -> Self {
        Self { border, ..self }
    }

    /// On so many threads at most; 1 is the caller's. Small arrays take no more than that in any case.
    pub fn on_threads(self, most: usize) -> Self {
        Self { threads: self.threads.min(most.max(1)), ..self }
    }

    /// Only distances up to `bound` (in the unit of the spacing; cells, if it is 1) are wanted: others are infinite. Exact
    /// within it, and the faster the less is asked.
    ///
    /// # Errors
    /// Where it is NaN or negative. Infinity asks for all.
    pub fn within(self, bound: f64) -> Result<Self, MaskError> {
        if !(bound >= 0.0) {
            return Err(MaskError::Bound(bound));
        }
        Ok(Self { bound, ..self })
    }

    /// Squared distances, x fastest.
    ///
    /// # Errors
    /// Where the mask does not have the shape's cells.
    pub fn squared_distances<M: MaskCell>(&self, mask: &[M]) -> Result<Vec<f32>, MaskError> {
        self.all(Mask(mask), false)
    }

    /// Distances, x fastest.
    ///
    /// # Errors
    /// Where the mask does not have the shape's cells.
    pub fn distances<M: MaskCell>(&self, mask: &[M]) -> Result<Vec<f32>, MaskError> {
        self.all(Mask(mask), true)
    }

    /// Squared distances and the index of the nearest cell that is set, x fastest; of several that are equally near, the
    /// lowest index where distances are exact. [`MaskTransform::NONE`] where the distance is infinite.
    ///
    /// # Errors
    /// Where the mask does not have the shape's cells.
    pub fn nearest<M: MaskCell>(&self, mask: &[M]) -> Result<(Vec<f32>, Vec<u32>), MaskError> {
        self.with_nearest(Mask(mask), false)
    }

    /// Squared distances of all cells with a label to the nearest cell with another one, the background's (0) included; 0
    /// for the background itself. x fastest.
    ///
    /// # Errors
    /// Where the labels are not as many as the shape's cells.
    pub fn label_squared_distances<T: Label>(&self, labels: &[T]) -> Result<Vec<f32>, MaskError> {
        self.all(self.labels(labels), false)
    }

    /// Distances of all cells with a label to the nearest cell with another one, the background's (0) included; 0 for the
    /// background itself. x fastest.
    ///
    /// # Errors
    /// Where the labels are not as many as the shape's cells.
    pub fn label_distances<T: Label>(&self, labels: &[T]) -> Result<Vec<f32>, MaskError> {
        self.all(self.labels(labels), true)
    }

    /// As [`MaskTransform::label_distances`] where there is a label; in the background less the distance to the nearest cell
    /// with one. Positive inside, negative outside, nowhere 0.
    ///
    /// # Errors
    /// Where the labels are not as many as the shape's cells.
    pub fn signed_label_distances<T: Label>(&self, labels: &[T]) -> Result<Vec<f32>, MaskError> {
        let mut signed = self.label_distances(labels)?;
        let background: Vec<bool> = labels.iter().map(|cell| *cell == T::default()).collect();
        let outside = self.label_distances(&background)?;
        signed.iter_mut().zip(outside).for_each(|(inside, outside)| *inside -= outside);
        Ok(signed)
    }

    /// Distances of all cells with a label to the nearest cell of the background (0), and the index of that one, as
    /// [`MaskTransform::nearest`].
    ///
    /// # Errors
    /// Where the labels are not as many as the shape's cells, there is more than one beside the background's, or the border
    /// counts.
    pub fn nearest_background<T: Label>(&self, labels: &[T]) -> Result<(Vec<f32>, Vec<u32>), MaskError> {
        let labels = self.labels(labels);
        if labels.border {
            return Err(MaskError::Border);
        }
        if labels.several {
            return Err(MaskError::Labels);
        }
        self.with_nearest(labels, true)
    }

    /// No cell is set within the bound.
    pub const NONE: u32 = u32::MAX;

    fn labels<'a, T: Label>(&self, cells: &'a [T]) -> Labels<'a, T> {
        Labels { cells, several: several(cells), border: self.border }
    }

    fn all<C: Cells>(&self, cells: C, root: bool) -> Result<Vec<f32>, MaskError> {
        let mut distance = vec![0.0; self.cells];
        self.run(cells, &mut distance, &mut [], root)?;
        Ok(distance)
    }

    fn with_nearest<C: Cells>(&self, cells: C, root: bool) -> Result<(Vec<f32>, Vec<u32>), MaskError> {
        let (mut distance, mut nearest) = (vec![0.0; self.cells], vec![0; self.cells]);
        self.run(cells, &mut distance, &mut nearest, root)?;
        Ok((distance, nearest))
    }

    /// Squared distances, or with `root` distances, in the unit of the spacing.
    fn run<C: Cells>(
        &self,
        cells: C,
        distance: &mut [f32],
        nearest: &mut [u32],
        root: bool,
    ) -> Result<(), MaskError> {
        self.choose(cells, distance, nearest, Last { root, scale: self.scale() })
    }

    /// The least spacing.
    fn scale(&self) -> f64 {
        self.spacing.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The numbers to compute with: half the bytes wherever nothing that is wanted is lost.
    fn choose<C: Cells>(
        &self,
        cells: C,
        distance: &mut [f32],
        nearest: &mut [u32],
        last: Last,
    ) -> Result<(), MaskError> {
        if cells.len() != self.cells {
            return Err(MaskError::Length { cells: self.cells, given: cells.len() });
        }
        if self.cells == 0 {
            return Ok(());
        }
        let equal = self.spacing.iter().all(|s| *s == self.spacing[0]);
        // In cells, where all axes have one spacing. The border is one cell further.
        let outer = usize::from(self.border);
        let diagonal = self.shape.iter().try_fold(0usize, |sum, n| {
            let length = n - 1 + outer;
            length.checked_mul(length).and_then(|sq| sq.checked_add(sum))
        });
        let diagonal = diagonal.filter(|sq| equal && *sq <= LARGEST_DIAGONAL * LARGEST_DIAGONAL);
        let plain = self.bound / self.scale() <= PLAIN as f64;
        match diagonal {
            Some(sq) if plain || sq < usize::from(u16::FAR) => {
                self.plan::<u16>().run::<C, 32>(cells, distance, nearest, last);
            }
            Some(_) => self.plan::<u32>().run::<C, 16>(cells, distance, nearest, last),
            None => self.plan::<f32>().run::<C, 16>(cells, distance, nearest, last),
        }
        Ok(())
    }

    fn plan<L: Number>(&self) -> Plan<L, D> {
        let scale = self.scale();
        let unit = self.spacing.map(|s| s / scale);
        let bound = self.bound / scale;
        Plan {
            shape: self.shape,
            unit,
            reach: unit.map(|unit| (bound / unit) as usize),
            limit: L::limit(bound * bound),
            squares: std::array::from_fn(|k| {
                (0..=self.shape[k]).map(|n| L::count(n).squared(unit[k])).collect()
            }),
            workers: self.threads,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What every cell must find, by looking at all cells.
    fn brute_force<const D: usize>(mask: &[bool], shape: [usize; D]) -> Vec<Option<(u32, u32)>> {
        let cell = |i: usize| -> [usize; D] {
            std::array::from_fn(|k| i / shape[..k].iter().product::<usize>() % shape[k])
        };
        let set: Vec<_> = (0..mask.len()).filter(|&j| mask[j]).map(|j| (cell(j), j as u32)).collect();
        let to =
            |a: [usize; D], b: [usize; D]| (0..D).map(|k| a[k].abs_diff(b[k]).pow(2)).sum::<usize>() as u32;
        let nearest = |a| set.iter().map(|&(b, j)| (to(a, b), j)).min();
        (0..mask.len()).map(|i| nearest(cell(i))).collect()
    }

    fn matches_brute_force<const D: usize>(mask: &[bool], shape: [usize; D], bound: f64) {
        let mask = &mask[..shape.iter().product()];
        let transform = MaskTransform::new(shape).unwrap();
        let bounded = transform.within(bound).unwrap();
        let want = brute_force(mask, shape);
        for (transform, bound) in [(transform, f64::INFINITY), (bounded, bound)] {
            let (squared, nearest) = transform.nearest(mask).unwrap();
            assert_eq!(squared, transform.squared_distances(mask).unwrap());
            let distances = transform.distances(mask).unwrap();
            for (i, want) in want.iter().enumerate() {
                let within = want.filter(|w| f64::from(w.0) <= bound * bound);
                assert_eq!(squared[i], within.map_or(f32::INFINITY, |w| w.0 as f32), "{i} of {shape:?}");
                assert_eq!(distances[i], squared[i].sqrt());
                assert_eq!(nearest[i], within.map_or(MaskTransform::<D>::NONE, |w| w.1), "{i} of {shape:?}");
            }
        }
        let bytes: Vec<u8> = mask.iter().map(|&m| 3 * u8::from(m)).collect();
        assert_eq!(transform.distances(&bytes), transform.distances(mask));
    }

    #[test]
    #[cfg(feature = "parallel")]
    fn is_the_same_on_any_number_of_threads() {
        let shape = [70, 90, 40];
        let mask: Vec<bool> = (0..shape.iter().product()).map(|i: usize| i % 10_007 == 5).collect();
        let nearest = || MaskTransform::new(shape).unwrap().nearest(&mask).unwrap();
        let on = |threads| crate::testing::with_threads(threads, nearest);
        assert_eq!(on(1), on(3));
    }

    fn masks(cells: usize) -> impl Strategy<Value = Vec<bool>> {
        let seeds = |density: f64| prop::collection::vec(prop::bool::weighted(density), cells);
        prop_oneof![seeds(0.002), seeds(0.05), seeds(0.9), Just(vec![true; cells]), Just(vec![false; cells])]
    }

    fn bounds() -> impl Strategy<Value = f64> {
        prop_oneof![0.0..8.0, 0.0..100.0, Just(0.0), (0..30u32).prop_map(|sq| f64::from(sq).sqrt())]
    }

    #[test]
    fn what_cannot_be_is_refused() {
        assert_eq!(MaskTransform::new([(1 << 24) + 1, 1]), Err(MaskError::TooLarge));
        assert_eq!(MaskTransform::new([usize::MAX; 3]), Err(MaskError::TooLarge));
        assert_eq!(MaskTransform::new([1 << 16, 1 << 16]), Err(MaskError::TooLarge));
        assert!(MaskTransform::new([(1 << 24) + 1]).is_ok());
        let transform = MaskTransform::new([3, 4]).unwrap();
        assert_eq!(transform.distances(&[true; 11]), Err(MaskError::Length { cells: 12, given: 11 }));
        assert!(matches!(transform.within(f64::NAN), Err(MaskError::Bound(_))));
        assert_eq!(transform.within(-1.0), Err(MaskError::Bound(-1.0)));
        assert_eq!(
            transform.within(f64::INFINITY).unwrap().squared_distances(&[false; 12]).unwrap(),
            [f32::INFINITY; 12]
        );
        assert_eq!(MaskTransform::new([0, 7]).unwrap().distances::<bool>(&[]), Ok(vec![]));
        for wrong in [0.0, -1.0, f64::INFINITY] {
            assert_eq!(transform.spaced([1.0, wrong]), Err(MaskError::Spacing(wrong)));
        }
        assert!(matches!(transform.spaced([f64::NAN, 1.0]), Err(MaskError::Spacing(_))));
        assert_eq!(transform.spaced([1e-12, 1e12]), Err(MaskError::Spacings(1e-12, 1e12)));
        assert!(matches!(transform.spaced([1e-30; 2]), Err(MaskError::Spacings(..))));
        assert!(matches!(transform.spaced([1e30; 2]), Err(MaskError::Spacings(..))));
        assert_eq!(transform.nearest_background(&[1, 2, 0].repeat(4)), Err(MaskError::Labels));
        assert_eq!(transform.with_border(true).nearest_background(&[1; 12]), Err(MaskError::Border));
    }

    #[test]
    fn what_is_too_long_for_whole_numbers_is_computed_in_f32() {
        let n = 60_000;
        let mut mask = vec![false; 2 * n];
        (mask[0], mask[2 * n - 1]) = (true, true);
        let transform = MaskTransform::new([n, 2]).unwrap();
        let (squared, nearest) = transform.nearest(&mask).unwrap();
        for i in 0..2 * n {
            let (x, y) = ((i % n) as f64, (i / n) as f64);
            let first = x.powi(2) + y.powi(2);
            let last = ((n - 1) as f64 - x).powi(2) + (1.0 - y).powi(2);
            assert!((f64::from(squared[i]) - first.min(last)).abs() <= 2e-7 * first.min(last));
            assert_eq!(nearest[i], if first <= last { 0 } else { 2 * n as u32 - 1 });
        }
    }

    /// Distances by looking at all cells, and around them.
    fn labels_by_brute_force<const D: usize>(
        labels: &[u16],
        shape: [usize; D],
        spacing: [f64; D],
        border: bool,
    ) -> Vec<f64> {
        let cell = |i: usize| -> [usize; D] {
            std::array::from_fn(|k| i / shape[..k].iter().product::<usize>() % shape[k])
        };
        let square = |k: usize, n: usize| (n as f64 * spacing[k]).powi(2);
        let of = |i: usize| {
            if labels[i] == 0 {
                return 0.0;
            }
            let a = cell(i);
            let others = (0..labels.len()).filter(|&j| labels[j] != labels[i]).map(|j| {
                let b = cell(j);
                (0..D).map(|k| square(k, a[k].abs_diff(b[k]))).sum::<f64>()
            });
            let around = (0..D).flat_map(|k| [square(k, a[k] + 1), square(k, shape[k] - a[k])]);
            others.chain(around.filter(|_| border)).fold(f64::INFINITY, f64::min).sqrt()
        };
        (0..labels.len()).map(of).collect()
    }

    fn matches_labels<const D: usize>(labels: &[u16], shape: [usize; D], spacing: [f64; D]) {
        let labels = &labels[..shape.iter().product()];
        let plain = MaskTransform::new(shape).unwrap().spaced(spacing).unwrap();
        for border in [false, true] {
            let transform = plain.with_border(border);
            let want = labels_by_brute_force(labels, shape, spacing, border);
            let (got, squared) = (
                transform.label_distances(labels).unwrap(),
                transform.label_squared_distances(labels).unwrap(),
            );
            for i in 0..labels.len() {
                let near = |got: f32, want: f64| {
                    f64::from(got) == want || (f64::from(got) - want).abs() < 2e-6 * want
                };
                assert!(near(got[i], want[i]), "{i} of {shape:?}, {spacing:?}: {} for {}", got[i], want[i]);
                assert!(near(squared[i], want[i] * want[i]));
                if spacing == [1.0; D] {
                    assert_eq!(got[i], want[i] as f32);
                }
            }
        }
        let signed = plain.signed_label_distances(labels).unwrap();
        let outside: Vec<bool> = labels.iter().map(|l| *l == 0).collect();
        let (inside, outside) =
            (plain.label_distances(labels).unwrap(), plain.label_distances(&outside).unwrap());
        for i in 0..labels.len() {
            assert_eq!(signed[i], if labels[i] == 0 { -outside[i] } else { inside[i] });
        }
        // The same as one label: masks, with the cells that are nearest.
        let one: Vec<u16> = labels.iter().map(|l| 5 * u16::from(*l > 0)).collect();
        let set: Vec<bool> = one.iter().map(|l| *l == 0).collect();
        let (distance, nearest) = plain.nearest_background(&one).unwrap();
        assert_eq!(distance, plain.distances(&set).unwrap());
        assert_eq!((plain.squared_distances(&set).unwrap(), nearest), plain.nearest(&set).unwrap());
        let bound = 3.1 * spacing[0];
        let bounded = plain.within(bound).unwrap().label_distances(labels).unwrap();
        for (b, d) in bounded.iter().zip(plain.label_distances(labels).unwrap()) {
            let close = (f64::from(d) - bound).abs() < 1e-5 * bound;
            assert!(close || *b == if f64::from(d) <= bound { d } else { f32::INFINITY });
        }
    }

    /// Blocks of labels, or of one label and holes.
    fn labels(cells: usize) -> impl Strategy<Value = Vec<u16>> {
        let label = prop_oneof![3 => Just(1u16), 1 => Just(2), 1 => Just(900), 1 => Just(0)];
        prop::collection::vec((label, 1..40usize), cells / 10).prop_map(move |runs| {
            let all = runs.into_iter().flat_map(|(label, n)| std::iter::repeat_n(label, n));
            all.chain(std::iter::repeat(1)).take(cells).collect()
        })
    }

    fn spacings() -> impl Strategy<Value = [f64; 3]> {
        let any = prop::array::uniform3(0.05..20.0f64);
        prop_oneof![Just([1.0; 3]), Just([0.3; 3]), Just([4.0, 4.0, 40.0]), any]
    }

    proptest! {
        #[test]
        fn matches_brute_force_1d(mask in masks(500), n in 0..500usize, bound in bounds()) {
            matches_brute_force(&mask, [n], bound);
        }
        #[test]
        fn matches_brute_force_2d(mask in masks(75 * 130), nx in 1..75usize, ny in 1..130usize, bound in bounds()) {
            matches_brute_force(&mask, [nx, ny], bound);
        }
        #[test]
        fn matches_brute_force_3d(mask in masks(5000), shape in prop::array::uniform3(1..17usize), bound in bounds()) {
            matches_brute_force(&mask, shape, bound);
        }
        #[test]
        fn matches_brute_force_on_long_lines(
            seeds in prop::collection::vec(any::<prop::sample::Index>(), 0..12), axis in 0..3usize, bound in bounds(),
        ) {
            // The diagonal is beyond 16 bits, lines are longer than what is searched plainly.
            let mut shape = [2, 3, 2];
            shape[axis] = 400;
            let mut mask = vec![false; shape.iter().product()];
            seeds.iter().for_each(|i| mask[i.index(shape.iter().product())] = true);
            matches_brute_force(&mask, shape, bound);
        }
        #[test]
        fn labels_match_brute_force_1d(cells in labels(300), n in 0..300usize, s in spacings()) {
            matches_labels(&cells, [n], [s[0]]);
        }
        #[test]
        fn labels_match_brute_force_2d(cells in labels(24 * 36), nx in 1..24usize, ny in 1..36usize, s in spacings()) {
            matches_labels(&cells, [nx, ny], [s[0], s[1]]);
        }
        #[test]
        fn labels_match_brute_force_3d(cells in labels(1000), shape in prop::array::uniform3(1..10usize), s in spacings()) {
            matches_labels(&cells, shape, s);
        }
        #[test]
        fn labels_match_brute_force_on_long_lines(cells in labels(800), axis in 0..3usize, s in spacings()) {
            let mut shape = [2, 2, 1];
            shape[axis] = 200;
            matches_labels(&cells, shape, s);
        }
    }
}
