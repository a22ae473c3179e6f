//! The minimum for one row of a panel, searched outwards from it.

use super::number::Number;

/// Offsets between two looks at whether anything can still be found.
const STEPS: usize = 4;

/// What the lanes of one row have found: the least value, and at which offset.
#[derive(Clone, Copy)]
pub(super) struct Found<L, const N: usize> {
    pub(super) best: [L; N],
    /// Meaningful where it was asked for and `best` is not far.
    pub(super) offset: [L; N],
}

/// The rows that may hold a minimum, both ends included, about the row that looks.
#[derive(Clone, Copy)]
pub(super) struct Window {
    pub(super) row: usize,
    pub(super) first: usize,
    pub(super) last: usize,
}

impl Window {
    /// Offsets on both sides, on the lower, on the upper: whole steps from 1 on.
    #[inline(always)]
    fn sides(&self) -> (usize, usize) {
        (self.row.saturating_sub(self.first), self.last.saturating_sub(self.row))
    }

    /// The last offset that may be needed.
    #[inline(always)]
    pub(super) fn farthest(&self) -> usize {
        let (below, above) = self.sides();
        below.max(above)
    }
}

impl<L: Number, const N: usize> Found<L, N> {
    /// The row itself, where it may hold the minimum.
    #[inline(always)]
    pub(super) fn at(f: &[[L; N]], window: Window) -> Self {
        let inside = window.first <= window.row && window.row <= window.last;
        Self { best: if inside { f[window.row] } else { [L::FAR; N] }, offset: [L::of_offset(0); N] }
    }

    /// Looks at offsets from `k` to `end` (excluded) on both sides, as long as some lane can find less; with `OFFSET`,
    /// as long as some lane can find as little at a lower row, which is where ties go. Returns the first offset that was
    /// not looked at, and whether it stopped because nothing more can be found.
    #[inline(always)]
    pub(super) fn look<const OFFSET: bool>(
        &mut self,
        f: &[[L; N]],
        window: Window,
        squares: &[L],
        k: usize,
        end: usize,
    ) -> (usize, bool) {
        let Window { row, first, last } = window;
        let (below, above) = window.sides();
        // Where the window begins beside the row, the offsets before it are skipped.
        let mut k = k.max(row.saturating_sub(last)).max(first.saturating_sub(row));
        let joint = (below.min(above) + 1).min(end);
        while k < joint {
            if !self.exceeds::<OFFSET>(squares[k]) {
                return (k, true);
            }
            let stop = (k + STEPS).min(joint);
            for (j, &cost) in (k..stop).zip(&squares[k..stop]) {
                self.relax::<OFFSET, true>(&f[row - j], cost, j);
                self.relax::<OFFSET, false>(&f[row + j], cost, j);
            }
            k = stop;
        }
        let single = (below.max(above) + 1).min(end);
        while k < single {
            if !self.exceeds::<OFFSET>(squares[k]) {
                return (k, true);
            }
            let stop = (k + STEPS).min(single);
            for (j, &cost) in (k..stop).zip(&squares[k..stop]) {
                if below > above {
                    self.relax::<OFFSET, true>(&f[row - j], cost, j);
                } else {
                    self.relax::<OFFSET, false>(&f[row + j], cost, j);
                }
            }
            k = stop;
        }
        (k, k > window.farthest())
    }

    /// Whether a sample at this cost can be less than what some lane has.
    #[inline(always)]
    fn exceeds<const OFFSET: bool>(&self, cost: L) -> bool {
        let mut any = false;
        for &best in &self.best {
            any |= if OFFSET { best >= cost } else { best > cost };
        }
        any
    }

    #[inline(always)]
    fn relax<const OFFSET: bool, const BELOW: bool>(&mut self, row: &[L; N], cost: L, j: usize) {
        let step = L::of_offset(if BELOW { -(j as isize) } else { j as isize });
        // Lanes of one operation after the other, without a branch: else only `f32` becomes vectors.
        let (mut sum, mut least) = ([L::ZERO; N], [L::ZERO; N]);
        for i in 0..N {
            sum[i] = row[i].plus(cost);
        }
        for i in 0..N {
            least[i] = if sum[i] < self.best[i] { sum[i] } else { self.best[i] };
        }
        if OFFSET {
            for i in 0..N {
                let less = if BELOW { least[i] == sum[i] } else { least[i] != self.best[i] };
                self.offset[i] = L::choose(less, step, self.offset[i]);
            }
        }
        self.best = least;
    }
}
