//! Counts of scans that hit a cell or passed it.

use super::brick::{Number, planes_of_sums, with_planes};
use super::{Sign, SumBrick, SumCell, SumWidth};
use crate::cell::{Cell, Endpoint, Evidence, HitMiss, LogOdds8, LogOddsBrick, LogOddsRule, Planes as _};

/// Scans that hit a cell, and scans that passed it without a hit.
///
/// The log odds of independent looks add up; clamped once, when they are read, they do not depend on the order of scans.
/// They differ from those of the filter that clamps after every look where a cell changed: what was hit a hundred times has
/// to be passed some two hundred times, and not twelve. A brick holds 16-bit numbers up to 32,767 scans, then 32-bit ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HitMissSum {
    /// Scans of which a beam ended here.
    pub hits: i64,
    /// Scans of which beams passed and none ended here.
    pub misses: i64,
}

impl HitMissSum {
    pub(super) fn of_sums([hits, misses]: [i64; 2]) -> Option<Self> {
        (hits != 0 || misses != 0).then_some(Self { hits, misses })
    }

    pub(super) fn sums(self) -> [i64; 2] {
        [self.hits, self.misses]
    }
}

impl Cell for HitMissSum {
    type Rule = Sign;
    type Planes = SumBrick<2>;
    type Brick = SumBrick<2>;
    type Evidence = HitMiss;
    type Event = ();

    #[inline]
    fn fuse(cell: Option<Self>, o: Endpoint, rule: &Sign) -> (Self, ()) {
        let Self { hits, misses } = cell.unwrap_or(Self { hits: 0, misses: 0 });
        let one = i64::from(rule.factor());
        let cell = match o {
            Endpoint::Hit => Self { hits: hits + one, misses },
            Endpoint::Miss => Self { hits, misses: misses + one },
        };
        (cell, ())
    }

    fn fuse_run(
        planes: &mut SumBrick<2>,
        start: usize,
        evidence: &HitMiss,
        from: usize,
        len: usize,
        rule: &Sign,
    ) {
        let (cells, factor) = (planes.cells(), i64::from(rule.factor()));
        with_planes!(planes.planes_mut(1, SumWidth::W16), planes => for i in 0..len {
            match evidence.one(from + i) {
                Some(Endpoint::Hit) => planes[start + i].raise(factor),
                Some(Endpoint::Miss) => planes[cells + start + i].raise(factor),
                None => {}
            }
        });
    }

    fn fuse_brick(brick: &mut SumBrick<2>, evidence: &HitMiss, rule: &Sign) {
        let cells = brick.cells();
        let factor = i64::from(rule.factor());
        with_planes!(brick.planes_mut(1, SumWidth::W16), planes => {
            let (hits, misses) = planes.split_at_mut(cells);
            for (word, (hits, misses)) in hits.chunks_mut(64).zip(misses.chunks_mut(64)).enumerate() {
                let (hit, miss) = evidence.word(word);
                if hit != 0 {
                    add_bits(hits, hit, factor);
                }
                if miss != 0 {
                    add_bits(misses, miss, factor);
                }
            }
        });
    }
}

/// Adds to the numbers whose bit is set.
#[inline(always)]
fn add_bits<T: Number>(numbers: &mut [T], bits: u64, factor: i64) {
    for (i, number) in numbers.iter_mut().enumerate() {
        number.raise(factor * (bits >> i & 1) as i64);
    }
}

impl SumCell for HitMissSum {
    type Estimate = LogOdds8;

    fn rule(_: &LogOddsRule<i8>, sign: Sign) -> Sign {
        sign
    }

    #[inline]
    fn estimate(self, rule: &LogOddsRule<i8>) -> LogOdds8 {
        let sum = i128::from(rule.prior)
            + i128::from(self.hits) * i128::from(rule.hit)
            + i128::from(self.misses) * i128::from(rule.miss);
        LogOdds8(sum.clamp(rule.min.into(), rule.max.into()) as i8)
    }

    fn estimates(sums: &SumBrick<2>, rule: &LogOddsRule<i8>) -> LogOddsBrick<LogOdds8> {
        let mut made = LogOddsBrick::unobserved(sums.cells());
        for (i, value) in made.cells_mut().iter_mut().enumerate() {
            if let Some(cell) = Self::of_sums(sums.at(i)) {
                *value = cell.estimate(rule);
            }
        }
        made
    }

    fn is_possible(sums: &[i64]) -> bool {
        sums.iter().all(|&count| count >= 0)
    }
}

planes_of_sums!(HitMissSum, 2, SumWidth::W16);
