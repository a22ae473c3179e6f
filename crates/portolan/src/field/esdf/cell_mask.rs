//! A bit for every cell of a brick.

use crate::geom::block_cells;

/// Cells of a brick of at most 512, a bit each, x fastest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct CellMask(pub(super) [u64; 8]);

impl CellMask {
    /// The cells that `is` accepts, of a brick of dimension `D`.
    pub(crate) fn of<const D: usize>(is: impl Fn(usize) -> bool) -> Self {
        let mut mask = Self::default();
        (0..block_cells::<D>()).filter(|&i| is(i)).for_each(|i| mask.set(i));
        mask
    }

    /// The other cells of a brick of dimension `D`.
    pub(crate) fn others<const D: usize>(self) -> Self {
        let all = |word: usize| if 64 * word < block_cells::<D>() { u64::MAX } else { 0 };
        Self(std::array::from_fn(|word| !self.0[word] & all(word)))
    }

    #[inline(always)]
    pub(crate) fn has(&self, i: usize) -> bool {
        self.0[i >> 6] >> (i & 63) & 1 == 1
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, i: usize) {
        self.0[i >> 6] |= 1 << (i & 63);
    }

    pub(crate) fn any(&self) -> bool {
        self.0 != [0; 8]
    }

    pub(crate) fn count(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    pub(crate) fn or(self, other: Self) -> Self {
        Self(std::array::from_fn(|word| self.0[word] | other.0[word]))
    }

    pub(crate) fn and(self, other: Self) -> Self {
        Self(std::array::from_fn(|word| self.0[word] & other.0[word]))
    }

    pub(crate) fn and_not(self, other: Self) -> Self {
        Self(std::array::from_fn(|word| self.0[word] & !other.0[word]))
    }

    /// Its cells, ascending.
    pub(crate) fn cells(self) -> impl Iterator<Item = usize> {
        self.0.into_iter().enumerate().flat_map(|(word, mut bits)| {
            std::iter::from_fn(move || {
                let bit = bits.trailing_zeros() as usize;
                bits &= bits.wrapping_sub(1);
                (bit < 64).then_some(word << 6 | bit)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_of_cells() {
        let third = CellMask::of::<3>(|i| i % 3 == 0);
        assert_eq!(third.cells().collect::<Vec<_>>(), (0..512).step_by(3).collect::<Vec<_>>());
        assert_eq!(third.count() + third.others::<3>().count(), 512);
        assert_eq!(third.and_not(third.others::<3>()), third);
        assert_eq!(CellMask::of::<2>(|_| true).others::<2>(), CellMask::default());
        assert!(third.or(third.others::<3>()).cells().eq(0..512));
        assert!(third.has(3) && !third.has(4) && third.any() && !CellMask::default().any());
    }
}
