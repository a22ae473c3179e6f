//! Whether a cell stops enough of the beams that come to it.

use super::{HitLength, LENGTH_UNITS};

/// The mean length of a straight line through a square (2-D) or a cube (3-D) of edge 1, over all lines: volume times
/// `π` over the perimeter, times 4 over the surface *(Cauchy)*.
pub const fn mean_chord<const D: usize>() -> f64 {
    if D == 2 { std::f64::consts::FRAC_PI_4 } else { 2.0 / 3.0 }
}

/// Which cells count as standing in the way of beams: those with hits enough that stop more than a share of what comes.
///
/// Compared in whole numbers, so that the answer is the same everywhere and for maps that hold the same counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StopRule<const D: usize> {
    least_hits: u32,
    /// Least hits per unit of length, in 2^-20.
    density: u64,
}

impl<const D: usize> StopRule<D> {
    const ONE: f64 = (1u64 << 20) as f64;

    /// Cells with at least `least_hits` hits whose opacity ([`HitLength::opacity`]) is above `share`; none for a share of 1
    /// or more, or one that is not a number.
    pub fn new(share: f64, least_hits: u32) -> Self {
        let per_cell = -(-share.max(0.0)).ln_1p() / mean_chord::<D>();
        let density = per_cell / f64::from(LENGTH_UNITS) * Self::ONE;
        let none = share.is_nan() || share >= 1.0;
        Self { least_hits: least_hits.max(1), density: if none { u64::MAX } else { density.round() as u64 } }
    }

    /// Whether a cell is one of them.
    #[inline(always)]
    pub fn stops(&self, cell: HitLength) -> bool {
        let (hits, length) = (u128::from(cell.hits) << 20, u128::from(cell.length));
        cell.hits >= self.least_hits && self.density != u64::MAX && hits > length * u128::from(self.density)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn follows_the_opacity<const D: usize>(hits: u32, length: u32, share: f64, least: u32) {
        let cell = HitLength { hits, length, looks: 1 };
        let opacity = cell.opacity::<D>();
        let stops = StopRule::<D>::new(share, least).stops(cell);
        if (opacity - share).abs() > 1e-4 {
            assert_eq!(stops, hits >= least && opacity > share, "{hits} {length} {opacity} {share}");
        }
    }

    proptest! {
        #[test]
        fn whole_numbers_follow_the_opacity_2d_and_3d(
            hits in 0u32..400, length in 0u32..400_000, share in 0.0..0.999f64, least in 1u32..4,
        ) {
            follows_the_opacity::<2>(hits, length, share, least);
            follows_the_opacity::<3>(hits, length, share, least);
        }
    }

    #[test]
    fn shares_at_the_ends() {
        let cell = |hits, length| HitLength { hits, length, looks: 9 };
        assert!(StopRule::<2>::new(0.0, 0).stops(cell(1, u32::MAX)));
        assert!(!StopRule::<2>::new(0.0, 0).stops(cell(0, 64)));
        assert!(
            StopRule::<3>::new(0.9, 2).stops(cell(2, 0)) && !StopRule::<3>::new(0.9, 2).stops(cell(1, 0))
        );
        for share in [1.0, 2.0, f64::NAN, f64::INFINITY] {
            assert!(!StopRule::<3>::new(share, 1).stops(cell(u32::MAX, 0)), "{share}");
        }
    }

    /// By lines that are spread evenly.
    #[test]
    fn mean_chords_are_those_of_lines() {
        let n = 400;
        let (mut length, mut lines) = (0.0, 0.0);
        for i in 0..n {
            let a = (f64::from(i) + 0.5) / f64::from(n) * std::f64::consts::PI;
            // All lines of one direction together have the area of the square, over its width.
            length += 1.0;
            lines += a.cos().abs() + a.sin().abs();
        }
        assert!((length / lines - mean_chord::<2>()).abs() < 1e-4);
    }
}
