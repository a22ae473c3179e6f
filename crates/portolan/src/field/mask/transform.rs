//! What is asked for, and the choice of the numbers to compute it with.

use super::cell::MaskCell;
use super::integer::Integer;
use super::panel::PLAIN;
use super::passes::Plan;

/// Why a mask has no transform.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaskError {
    /// The shape's squared diagonal or its cells do not fit into the numbers that are computed with.
    #[error("a mask can have a diagonal of 46340 cells and 2^32 - 2 cells at most")]
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
    #[error("distances cannot be bounded by {0} cells")]
    Bound(f64),
}

/// Squares up to this one's stay below 2^31.
const LARGEST_DIAGONAL: usize = 46_340;

/// The exact Euclidean distance transform of masks of one shape, in cells: from the center of every cell to the
/// nearest center of a cell that is set.
///
/// Cells are x fastest. Computed in whole numbers: squared distances are exact, up to 2^24 as they are returned, and
/// correctly rounded to `f32` beyond. Where no cell is set, or none within the bound, distances are infinite. In parallel
/// with the feature `parallel`; the result is the same bytes.
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
/// # Ok::<(), portolan::field::MaskError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskTransform<const D: usize> {
    shape: [usize; D],
    cells: usize,
    /// The longest squared distance in the shape.
    diagonal: u32,
    /// Squared distances up to this are wanted, and the rows that can hold them.
    limit: u32,
    reach: usize,
}

impl<const D: usize> MaskTransform<D> {
    /// For masks with `shape` cells along each axis, without a bound.
    ///
    /// # Errors
    /// Where the diagonal is longer than 46 340 cells, or cells cannot be counted in `u32`.
    pub fn new(shape: [usize; D]) -> Result<Self, MaskError> {
        const { assert!(D >= 1 && D <= 3) }
        let mut cells = 1usize;
        let mut diagonal = 0usize;
        for n in shape {
            cells = cells.checked_mul(n).ok_or(MaskError::TooLarge)?;
            let length = n.saturating_sub(1);
            diagonal = length
                .checked_mul(length)
                .and_then(|sq| diagonal.checked_add(sq))
                .ok_or(MaskError::TooLarge)?;
        }
        if cells >= u32::MAX as usize || diagonal > LARGEST_DIAGONAL * LARGEST_DIAGONAL {
            return Err(MaskError::TooLarge);
        }
        Ok(Self { shape, cells, diagonal: diagonal as u32, limit: u32::FAR - 1, reach: usize::MAX })
    }

    /// Only distances up to `cells` are wanted: others are infinite. Exact within it, and the faster the less is asked.
    ///
    /// # Errors
    /// Where `cells` is NaN or negative. Infinity asks for all.
    pub fn within(self, cells: f64) -> Result<Self, MaskError> {
        if !(cells >= 0.0) {
            return Err(MaskError::Bound(cells));
        }
        let limit = (cells * cells).min(f64::from(u32::FAR - 1)) as u32;
        Ok(Self { limit, reach: cells as usize, ..self })
    }

    /// Squared distances (cells), x fastest.
    ///
    /// # Errors
    /// Where the mask does not have the shape's cells.
    pub fn squared_distances<M: MaskCell>(&self, mask: &[M]) -> Result<Vec<f32>, MaskError> {
        let mut squared = vec![0.0; self.cells];
        self.run(mask, &mut squared, &mut [], |sq| sq)?;
        Ok(squared)
    }

    /// Distances (cells), x fastest.
    ///
    /// # Errors
    /// Where the mask does not have the shape's cells.
    pub fn distances<M: MaskCell>(&self, mask: &[M]) -> Result<Vec<f32>, MaskError> {
        let mut distance = vec![0.0; self.cells];
        self.run(mask, &mut distance, &mut [], f32::sqrt)?;
        Ok(distance)
    }

    /// Squared distances (cells) and the index of the nearest cell that is set, x fastest; of several that are equally
    /// near, the lowest index. [`MaskTransform::NONE`] where the distance is infinite.
    ///
    /// # Errors
    /// Where the mask does not have the shape's cells.
    pub fn nearest<M: MaskCell>(&self, mask: &[M]) -> Result<(Vec<f32>, Vec<u32>), MaskError> {
        let (mut squared, mut nearest) = (vec![0.0; self.cells], vec![0; self.cells]);
        self.run(mask, &mut squared, &mut nearest, |sq| sq)?;
        Ok((squared, nearest))
    }

    /// No cell is set within the bound.
    pub const NONE: u32 = u32::MAX;

    fn run<M: MaskCell>(
        &self,
        mask: &[M],
        distance: &mut [f32],
        nearest: &mut [u32],
        last: impl Fn(f32) -> f32 + Sync + Send,
    ) -> Result<(), MaskError> {
        if mask.len() != self.cells {
            return Err(MaskError::Length { cells: self.cells, given: mask.len() });
        }
        if mask.is_empty() {
            return Ok(());
        }
        // Half the bytes wherever nothing that is wanted is lost.
        let plain = self.reach <= PLAIN;
        if plain || self.diagonal < u32::from(u16::FAR) {
            self.plan::<u16>().run::<M, 32>(mask, distance, nearest, last);
        } else {
            self.plan::<u32>().run::<M, 16>(mask, distance, nearest, last);
        }
        Ok(())
    }

    fn plan<L: Integer>(&self) -> Plan<L, D> {
        let longest = self.shape.iter().copied().max().unwrap_or(0);
        Plan {
            shape: self.shape,
            reach: self.reach,
            limit: self.limit.min(L::FAR.wide() - 1),
            squares: (0..=longest).map(L::square).collect(),
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
        assert_eq!(MaskTransform::new([50_000, 1]), Err(MaskError::TooLarge));
        assert_eq!(MaskTransform::new([usize::MAX; 3]), Err(MaskError::TooLarge));
        assert!(MaskTransform::new([46_341]).is_ok());
        let transform = MaskTransform::new([3, 4]).unwrap();
        assert_eq!(transform.distances(&[true; 11]), Err(MaskError::Length { cells: 12, given: 11 }));
        assert!(matches!(transform.within(f64::NAN), Err(MaskError::Bound(_))));
        assert_eq!(transform.within(-1.0), Err(MaskError::Bound(-1.0)));
        assert_eq!(
            transform.within(f64::INFINITY).unwrap().squared_distances(&[false; 12]).unwrap(),
            [f32::INFINITY; 12]
        );
        assert_eq!(MaskTransform::new([0, 7]).unwrap().distances::<bool>(&[]), Ok(vec![]));
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
    }
}
