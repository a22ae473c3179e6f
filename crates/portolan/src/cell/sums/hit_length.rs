//! Sums of hits and lengths.

use super::brick::{Number, planes_of_sums, with_planes};
use super::{Sign, SumBrick, SumCell, SumWidth};
use crate::cell::{
    AttenuationRule, Cell, Evidence, HitLength, HitLengthBrick, HitLengthObservation, HitLengthPlanes,
    HitLengths, Planes as _,
};

/// How many beams ended in a cell, the length of all beams inside of it, and the number of scans that looked.
///
/// [`HitLength`] without its two limits: no sum is halved when it is large, and scans are counted beyond 65,535. A brick
/// holds 32-bit numbers until one does not fit, then 64-bit ones; where no beam ended it may be one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HitLengthSum {
    /// Beams that ended here.
    pub hits: i64,
    /// Length of all beams inside of the cell ([`LENGTH_UNITS`](crate::cell::LENGTH_UNITS) to a cell's edge).
    pub length: i64,
    /// Scans that looked here.
    pub looks: i64,
}

impl HitLengthSum {
    pub(super) fn of_sums([hits, length, looks]: [i64; 3]) -> Option<Self> {
        (looks != 0 || hits != 0 || length != 0).then_some(Self { hits, length, looks })
    }

    pub(super) fn sums(self) -> [i64; 3] {
        [self.hits, self.length, self.looks]
    }
}

impl Cell for HitLengthSum {
    type Rule = Sign;
    type Planes = SumBrick<3>;
    type Brick = SumBrick<3>;
    type Evidence = HitLengths;
    type Event = ();

    #[inline]
    fn fuse(cell: Option<Self>, o: HitLengthObservation, rule: &Sign) -> (Self, ()) {
        let cell = cell.unwrap_or(Self { hits: 0, length: 0, looks: 0 });
        let factor = i64::from(rule.factor());
        let cell = Self {
            hits: cell.hits + factor * i64::from(o.hits),
            length: cell.length + factor * i64::from(o.length),
            looks: cell.looks + factor,
        };
        (cell, ())
    }

    fn fuse_run(
        planes: &mut SumBrick<3>,
        start: usize,
        evidence: &HitLengths,
        from: usize,
        len: usize,
        rule: &Sign,
    ) {
        let (cells, step) = (planes.cells(), largest(evidence));
        let factor = i64::from(rule.factor());
        with_planes!(planes.planes_mut(step, SumWidth::W32), planes => for i in 0..len {
            if let Some(o) = evidence.one(from + i) {
                let (at, [hits, length]) = (start + i, [o.hits, o.length].map(|v| factor * i64::from(v)));
                planes[at].raise(hits);
                planes[cells + at].raise(length);
                planes[2 * cells + at].raise(factor);
            }
        });
    }

    fn fuse_brick(brick: &mut SumBrick<3>, evidence: &HitLengths, rule: &Sign) {
        let factor = i64::from(rule.factor());
        match evidence.even() {
            Some(0) => {}
            Some(length) if brick.add_alike([0, factor * i64::from(length), factor]) => {}
            _ => Self::fuse_run(brick, 0, evidence, 0, brick.cells(), rule),
        }
    }
}

/// The largest number that a scan says of a cell; 1 at least.
fn largest(evidence: &HitLengths) -> i64 {
    match (evidence.even(), evidence.planes()) {
        (Some(length), _) => i64::from(length).max(1),
        (None, Some((hits, length))) => hits.iter().chain(length).fold(1, |most, &v| most.max(v)).into(),
        (None, None) => 1,
    }
}

impl SumCell for HitLengthSum {
    type Estimate = HitLength;

    fn rule(_: &AttenuationRule, sign: Sign) -> Sign {
        sign
    }

    /// Sums that pass 32 bits are halved together until they fit: their ratio stays.
    #[inline]
    fn estimate(self, _: &AttenuationRule) -> HitLength {
        let too_long = 64 - (self.hits.max(self.length) as u64 >> 32).leading_zeros();
        let fit = |sum: i64| u32::try_from(sum >> too_long).unwrap_or(u32::MAX);
        HitLength {
            hits: fit(self.hits),
            length: fit(self.length),
            looks: self.looks.clamp(1, 65_535) as u16,
        }
    }

    fn estimates(sums: &SumBrick<3>, rule: &AttenuationRule) -> HitLengthBrick {
        let n = sums.cells();
        if let (Some([0, ..]), Some(cell)) = (sums.all_alike(), sums.all_alike().and_then(Self::of_sums)) {
            return HitLengthBrick::alike(cell.estimate(rule), n);
        }
        let mut planes = HitLengthPlanes::unobserved(n);
        for i in 0..n {
            planes.set(i, Self::of_sums(sums.at(i)).map(|cell| cell.estimate(rule)));
        }
        HitLengthBrick::of(planes)
    }

    fn is_possible(sums: &[i64]) -> bool {
        let &[hits, length, looks] = sums else { return false };
        hits >= 0 && length >= 0 && looks >= 0 && (looks > 0 || hits == 0 && length == 0)
    }
}

planes_of_sums!(HitLengthSum, 3, SumWidth::W32);
