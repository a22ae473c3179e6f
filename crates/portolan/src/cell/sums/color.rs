//! Sums for colors.

use super::brick::{PlanesMut, planes_of_sums};
use super::distance::weight_units;
use super::{Sign, SumBrick, SumCell, SumWidth, WEIGHT_UNITS};
use crate::cell::{Cell, Color, ColorBrick, ColorObservation, ColorRule, Colors, Evidence};

/// A channel of a look is no more than this.
const FULL: i64 = 255;

/// What was seen of a cell's color: the sums of weight times red, green and blue, and the sum of weights.
///
/// Channels are bytes, weights are rounded as those of distances ([`WEIGHT_UNITS`](super::WEIGHT_UNITS)); the sums are exact. A brick
/// holds 32-bit numbers up to some 32,000 observations of weight 1, then 64-bit ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColorSum {
    /// Sums of weight (units) times red, green, blue (bytes).
    pub rgb: [i64; 3],
    /// Sum of weights (units); positive.
    pub weight: i64,
}

impl ColorSum {
    pub(super) fn of_sums([r, g, b, weight]: [i64; 4]) -> Option<Self> {
        (weight != 0 || r != 0 || g != 0 || b != 0).then_some(Self { rgb: [r, g, b], weight })
    }

    pub(super) fn sums(self) -> [i64; 4] {
        let [r, g, b] = self.rgb;
        [r, g, b, self.weight]
    }
}

/// What an observation adds.
#[inline(always)]
fn added(o: ColorObservation, sign: Sign) -> [i64; 4] {
    let units = i64::from(sign.factor()) * i64::from(weight_units(o.weight));
    let [r, g, b] = o.rgb.map(|v| i64::from(v) * units);
    [r, g, b, units]
}

impl Cell for ColorSum {
    type Rule = Sign;
    type Planes = SumBrick<4>;
    type Brick = SumBrick<4>;
    type Evidence = Colors;
    type Event = ();

    #[inline]
    fn fuse(cell: Option<Self>, o: ColorObservation, sign: &Sign) -> (Self, ()) {
        let sums = cell.map_or([0; 4], Self::sums);
        let more = added(o, *sign);
        let [r, g, b, weight] = std::array::from_fn(|k| sums[k] + more[k]);
        (Self { rgb: [r, g, b], weight }, ())
    }

    fn fuse_run(
        planes: &mut SumBrick<4>,
        start: usize,
        evidence: &Colors,
        from: usize,
        len: usize,
        sign: &Sign,
    ) {
        let seen = || (0..len).filter_map(|i| evidence.one(from + i).map(|o| (start + i, o)));
        // Few cells of few bricks have colors: those of a surface.
        let Some(heaviest) = seen().map(|(_, o)| weight_units(o.weight)).max() else { return };
        let cells = planes.cells();
        match planes.planes_mut(FULL * i64::from(heaviest), SumWidth::W32) {
            PlanesMut::W32(planes) => seen().for_each(|(i, o)| {
                added(o, *sign).into_iter().enumerate().for_each(|(k, v)| planes[k * cells + i] += v as i32);
            }),
            PlanesMut::W64(planes) => seen().for_each(|(i, o)| {
                added(o, *sign).into_iter().enumerate().for_each(|(k, v)| planes[k * cells + i] += v);
            }),
            PlanesMut::W16(_) => unreachable!("planes of colors have 32 bits at least"),
        }
    }

    fn fuse_brick(brick: &mut SumBrick<4>, evidence: &Colors, sign: &Sign) {
        let cells = brick.cells();
        Self::fuse_run(brick, 0, evidence, 0, cells, sign);
    }
}

impl SumCell for ColorSum {
    type Estimate = Color;

    fn rule(_: &ColorRule, sign: Sign) -> Sign {
        sign
    }

    /// The mean, rounded to nearest; the weight is clamped once, here.
    #[inline]
    fn estimate(self, rule: &ColorRule) -> Color {
        let weight = i128::from(self.weight.max(1));
        let channel = |sum: i64| (2 * 257 * i128::from(sum) + weight).div_euclid(2 * weight);
        let weight = (self.weight as f64 / f64::from(WEIGHT_UNITS)) as f32;
        let rgb = self.rgb.map(|sum| channel(sum).clamp(0, i128::from(u16::MAX)) as u16);
        Color { rgb, weight: Color::word(weight.min(rule.w_max).min(255.0)) }
    }

    fn estimates(sums: &SumBrick<4>, rule: &ColorRule) -> ColorBrick {
        let word = |i| match Self::of_sums(sums.at(i)).map(|cell| cell.estimate(rule)) {
            Some(Color { rgb: [r, g, b], weight }) => [r, g, b, weight],
            None => [0; 4],
        };
        ColorBrick::from_words(&(0..sums.cells()).map(word).collect::<Vec<_>>())
    }

    fn is_possible(sums: &[i64]) -> bool {
        let &[r, g, b, weight] = sums else { return false };
        let most = i128::from(weight) * i128::from(FULL);
        weight >= 0 && [r, g, b].iter().all(|&sum| sum >= 0 && i128::from(sum) <= most)
    }
}

planes_of_sums!(ColorSum, 4, SumWidth::W32);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::Planes as _;
    use proptest::prelude::*;

    fn evidence(scan: &[Option<([u8; 3], f32)>]) -> Colors {
        let mut e = Colors::silent(scan.len());
        for (i, look) in scan.iter().enumerate() {
            if let Some((rgb, weight)) = *look {
                e.set(i, ColorObservation { rgb, weight });
            }
        }
        e
    }

    fn look() -> impl Strategy<Value = Option<([u8; 3], f32)>> {
        let weight = prop_oneof![4 => 0.001f32..2.0, 1 => Just(1e9), 1 => Just(1e-9)];
        prop::option::of((any::<[u8; 3]>(), weight))
    }

    proptest! {
        /// Bricks, runs and single steps are the same sums, in 32 bits and in 64; their mean is that of the looks in floating
        /// point; and taken away they are nothing.
        #[test]
        fn a_brick_is_many_single_steps(
            scans in prop::collection::vec(prop::collection::vec(look(), 64), 1..60),
        ) {
            let mut brick = SumBrick::<4>::zero(64);
            let (mut run, mut singles) = (brick.clone(), brick.clone());
            let mut means = vec![([0.0f64; 3], 0.0f64); 64];
            for scan in &scans {
                let e = evidence(scan);
                ColorSum::fuse_brick(&mut brick, &e, &Sign::Plus);
                ColorSum::fuse_run(&mut run, 0, &e, 0, 10, &Sign::Plus);
                ColorSum::fuse_run(&mut run, 10, &e, 10, 54, &Sign::Plus);
                for i in 0..64 {
                    if let Some(o) = e.one(i) {
                        singles.set(i, Some(ColorSum::fuse(singles.get(i), o, &Sign::Plus).0));
                        let units = (f64::from(o.weight) * 256.0).round_ties_even().clamp(1.0, 65_535.0);
                        means[i].1 += units;
                        (0..3).for_each(|k| means[i].0[k] += units * f64::from(o.rgb[k]));
                    }
                }
            }
            prop_assert!(brick == singles && run == singles);
            let rule = ColorRule { w_max: f32::INFINITY };
            let estimates = ColorSum::estimates(&brick, &rule);
            for (i, (sum, weight)) in means.iter().enumerate() {
                prop_assert!(ColorSum::is_possible(&brick.at(i)));
                let Some(color) = estimates.get(i) else {
                    prop_assert_eq!(*weight, 0.0);
                    continue;
                };
                for k in 0..3 {
                    prop_assert!((f64::from(color.rgb[k]) - 257.0 * sum[k] / weight).abs() <= 0.501);
                }
                prop_assert!((f64::from(color.weight()) / (weight / 256.0).min(255.0) - 1.0).abs() < 1e-3);
            }
            for scan in &scans {
                ColorSum::fuse_brick(&mut brick, &evidence(scan), &Sign::Minus);
            }
            prop_assert!(brick == SumBrick::zero(64));
        }
    }

    #[test]
    fn what_was_not_seen_cannot_be_taken_away() {
        assert!(ColorSum::is_possible(&[255, 0, 17, 1]) && ColorSum::is_possible(&[0; 4]));
        assert!(!ColorSum::is_possible(&[256, 0, 0, 1]) && !ColorSum::is_possible(&[0, 0, 0, -1]));
        assert!(!ColorSum::is_possible(&[0, -1, 0, 5]) && !ColorSum::is_possible(&[0, 0, 1, 0]));
    }
}
