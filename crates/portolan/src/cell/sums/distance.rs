//! Sums for signed distances.

use super::brick::{PlanesMut, planes_of_sums};
use super::{Sign, SumBrick, SumCell, SumWidth};
use crate::cell::{
    Cell, DistanceBrick, DistanceObservation, Distances, Planes as _, SignedDistance, TsdfRule,
};
use multiversion::multiversion;

/// Distances are counted in this part of the truncation: 0.07 mm at 15 cm.
pub const DISTANCE_STEPS: i32 = 2047;

/// Weights are counted in this part of an observation of weight 1.
pub const WEIGHT_UNITS: i32 = 256;

/// A single observation weighs no more than so many units, 256 times weight 1.
pub const MOST_WEIGHT_UNITS: i32 = 65_535;

/// What was observed of a cell's distance: the sum of weight times distance, and the sum of weights.
///
/// Their quotient is the weighted mean that the filter without a clamp computes *(Curless & Levoy 1996)*. An observation is
/// rounded to the nearest [`DISTANCE_STEPS`]th of the truncation and the nearest [`WEIGHT_UNITS`]th of a weight, at least
/// one; the sums are exact. A brick holds 32-bit numbers up to some 4,000 observations of weight 1, then 64-bit ones, which
/// last for 10^10.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DistanceSum {
    /// Sum of weight (units) times distance (steps).
    pub moment: i64,
    /// Sum of weights (units); positive.
    pub weight: i64,
}

/// How observations of distances are rounded, and whether they are added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SumTsdfRule {
    /// Truncation (meters).
    pub truncation: f32,
    /// Added or taken away.
    pub sign: Sign,
}

impl DistanceSum {
    pub(super) fn of_sums([moment, weight]: [i64; 2]) -> Option<Self> {
        (weight != 0 || moment != 0).then_some(Self { moment, weight })
    }

    pub(super) fn sums(self) -> [i64; 2] {
        [self.moment, self.weight]
    }
}

/// Adding this makes a small number's lowest bits its nearest whole number, ties to even: no call, and the same in any vector.
const ROUND: f32 = 12_582_912.0;

/// The nearest whole number of one within 2^22 of zero.
#[inline(always)]
fn nearest(v: f32) -> i32 {
    (v + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as i32
}

/// An observation in steps and units.
#[inline(always)]
fn rounded(distance: f32, weight: f32, steps_per_meter: f32) -> (i32, i32) {
    let limit = DISTANCE_STEPS as f32;
    // max/min instead of clamp: the compiler turns them into two vector instructions.
    let steps = nearest((distance * steps_per_meter).max(-limit).min(limit));
    (steps, weight_units(weight))
}

/// A positive weight in units.
#[inline(always)]
pub(super) fn weight_units(weight: f32) -> i32 {
    nearest((weight * WEIGHT_UNITS as f32).max(1.0).min(MOST_WEIGHT_UNITS as f32))
}

impl SumTsdfRule {
    #[inline(always)]
    fn steps_per_meter(&self) -> f32 {
        DISTANCE_STEPS as f32 / self.truncation
    }
}

impl Cell for DistanceSum {
    type Rule = SumTsdfRule;
    type Planes = SumBrick<2>;
    type Brick = SumBrick<2>;
    type Evidence = Distances;
    type Event = ();

    #[inline]
    fn fuse(cell: Option<Self>, o: DistanceObservation, rule: &SumTsdfRule) -> (Self, ()) {
        let Self { moment, weight } = cell.unwrap_or(Self { moment: 0, weight: 0 });
        let (steps, units) = rounded(o.distance, o.weight, rule.steps_per_meter());
        let factor = i64::from(rule.sign.factor());
        let moment = moment + factor * i64::from(steps) * i64::from(units);
        (Self { moment, weight: weight + factor * i64::from(units) }, ())
    }

    fn fuse_run(
        planes: &mut SumBrick<2>,
        start: usize,
        evidence: &Distances,
        from: usize,
        len: usize,
        rule: &SumTsdfRule,
    ) {
        let (distances, weights) =
            (&evidence.distances()[from..from + len], &evidence.weights()[from..from + len]);
        fuse_cells(planes, start, distances, weights, rule);
    }

    #[inline]
    fn fuse_brick(brick: &mut SumBrick<2>, evidence: &Distances, rule: &SumTsdfRule) {
        fuse_cells(brick, 0, evidence.distances(), evidence.weights(), rule);
    }
}

fn fuse_cells(brick: &mut SumBrick<2>, start: usize, observed: &[f32], gained: &[f32], rule: &SumTsdfRule) {
    let heaviest = gained.iter().fold(0.0, |most: f32, &g| most.max(g));
    if heaviest <= 0.0 {
        return;
    }
    let units = weight_units(heaviest);
    let cells = brick.cells();
    let run = start..start + observed.len();
    let per_meter = rule.steps_per_meter();
    match brick.planes_mut(i64::from(DISTANCE_STEPS) * i64::from(units), SumWidth::W32) {
        PlanesMut::W32(planes) => {
            let (moment, weight) = planes.split_at_mut(cells);
            let (moment, weight) = (&mut moment[run.clone()], &mut weight[run]);
            add_32(moment, weight, observed, gained, per_meter, rule.sign.factor());
        }
        PlanesMut::W64(planes) => {
            let (moment, weight) = planes.split_at_mut(cells);
            let (moment, weight) = (&mut moment[run.clone()], &mut weight[run]);
            add_64(moment, weight, observed, gained, per_meter, rule.sign.factor());
        }
        PlanesMut::W16(_) => unreachable!("planes of distances have 32 bits at least"),
    }
}

/// What an observation adds: nothing where the cell was not seen.
#[inline(always)]
fn added(observed: f32, gained: f32, steps_per_meter: f32, factor: i32) -> (i32, i32) {
    let (steps, units) = rounded(observed, gained, steps_per_meter);
    let units = if gained > 0.0 { factor * units } else { 0 };
    (steps * units, units)
}

/// Layers of blocks are so long: a fixed length lets the compiler use whole vectors, and near surfaces many say nothing.
const LAYER: usize = 64;

#[multiversion(targets = "simd")]
fn add_32(moment: &mut [i32], weight: &mut [i32], o: &[f32], g: &[f32], per_meter: f32, factor: i32) {
    let states = moment.chunks_mut(LAYER).zip(weight.chunks_mut(LAYER));
    for ((m, w), (o, g)) in states.zip(o.chunks(LAYER).zip(g.chunks(LAYER))) {
        if g.iter().fold(0.0, |most: f32, &g| most.max(g)) <= 0.0 {
            continue;
        }
        for i in 0..m.len().min(w.len()).min(o.len()).min(g.len()) {
            let (dm, dw) = added(o[i], g[i], per_meter, factor);
            m[i] = m[i].wrapping_add(dm);
            w[i] = w[i].wrapping_add(dw);
        }
    }
}

#[multiversion(targets = "simd")]
fn add_64(moment: &mut [i64], weight: &mut [i64], o: &[f32], g: &[f32], per_meter: f32, factor: i32) {
    for i in 0..moment.len().min(weight.len()).min(o.len()).min(g.len()) {
        let (dm, dw) = added(o[i], g[i], per_meter, factor);
        moment[i] = moment[i].wrapping_add(i64::from(dm));
        weight[i] = weight[i].wrapping_add(i64::from(dw));
    }
}

impl SumCell for DistanceSum {
    type Estimate = SignedDistance;

    fn rule(of: &TsdfRule, sign: Sign) -> SumTsdfRule {
        SumTsdfRule { truncation: of.truncation, sign }
    }

    #[inline]
    fn estimate(self, rule: &TsdfRule) -> SignedDistance {
        let step = f64::from(rule.truncation) / f64::from(DISTANCE_STEPS);
        let distance = (self.moment as f64 / self.weight.max(1) as f64 * step) as f32;
        SignedDistance {
            distance: distance.max(-rule.truncation).min(rule.truncation),
            weight: (self.weight as f64 / f64::from(WEIGHT_UNITS)) as f32,
        }
    }

    fn estimates(sums: &SumBrick<2>, rule: &TsdfRule) -> DistanceBrick {
        let mut made = DistanceBrick::unobserved(sums.cells());
        let (distances, weights) = made.planes_mut();
        for (i, (distance, weight)) in distances.iter_mut().zip(weights).enumerate() {
            if let Some(cell) = Self::of_sums(sums.at(i)).map(|cell| cell.estimate(rule)) {
                (*distance, *weight) = (cell.distance, cell.weight);
            }
        }
        made
    }

    fn is_possible(sums: &[i64]) -> bool {
        let &[moment, weight] = sums else { return false };
        weight >= 0 && i128::from(moment).abs() <= i128::from(weight) * i128::from(DISTANCE_STEPS)
    }
}

planes_of_sums!(DistanceSum, 2, SumWidth::W32);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::Evidence;
    use proptest::prelude::*;

    fn evidence(scan: &[(f32, f32, bool)]) -> Distances {
        let mut e = Distances::silent(scan.len());
        for (i, &(distance, weight, said)) in scan.iter().enumerate() {
            e.set(i, DistanceObservation { distance, weight: if said { weight } else { 0.0 } });
        }
        e
    }

    proptest! {
        /// Bricks, runs and single steps are the same sums; in 32 bits and in 64; and taken away they are nothing.
        #[test]
        fn a_brick_is_many_single_steps(
            scans in prop::collection::vec(
                prop::collection::vec((-0.4f32..0.4, prop_oneof![0.0f32..2.0, Just(1e9), Just(1e-9)], any::<bool>()), 512),
                1..40,
            ),
        ) {
            let rule = |sign| SumTsdfRule { truncation: 0.15, sign };
            let mut brick = SumBrick::<2>::zero(512);
            let (mut run, mut singles) = (brick.clone(), brick.clone());
            for scan in &scans {
                let e = evidence(scan);
                DistanceSum::fuse_brick(&mut brick, &e, &rule(Sign::Plus));
                DistanceSum::fuse_run(&mut run, 0, &e, 0, 100, &rule(Sign::Plus));
                DistanceSum::fuse_run(&mut run, 100, &e, 100, 412, &rule(Sign::Plus));
                for i in 0..512 {
                    if let Some(o) = e.one(i) {
                        singles.set(i, Some(DistanceSum::fuse(singles.get(i), o, &rule(Sign::Plus)).0));
                    }
                }
            }
            prop_assert!(brick == singles && run == singles);
            prop_assert!((0..512).all(|i| DistanceSum::is_possible(&brick.at(i))));
            // The heaviest looks pass 32 bits after sixteen.
            let heaviest = (0..512).map(|i| brick.at(i)[1]).max().unwrap_or(0);
            prop_assert!(brick.width() == SumWidth::W64 || heaviest < 2 * 1_049_088);
            for scan in &scans {
                DistanceSum::fuse_brick(&mut brick, &evidence(scan), &rule(Sign::Minus));
            }
            prop_assert!(brick == SumBrick::zero(512));
        }
    }

    #[test]
    fn numbers_are_rounded_to_the_nearest() {
        for v in [0.0f32, 0.4, 0.6, -0.6, 2046.7, -2047.0, 65_535.0, 1.5, 2.5] {
            assert_eq!(nearest(v), v.round_ties_even() as i32, "{v}");
        }
        let per_meter = 2047.0 / 0.15;
        assert_eq!(rounded(0.15, 1.0, per_meter), (2047, 256));
        assert_eq!(rounded(-9.0, 1e-6, per_meter), (-2047, 1));
        assert_eq!(rounded(f32::INFINITY, f32::INFINITY, per_meter), (2047, MOST_WEIGHT_UNITS));
    }

    #[test]
    fn what_was_not_there_cannot_be_taken_away() {
        assert!(DistanceSum::is_possible(&[2047, 1]) && DistanceSum::is_possible(&[0, 0]));
        assert!(!DistanceSum::is_possible(&[2048, 1]) && !DistanceSum::is_possible(&[0, -1]));
        assert!(!DistanceSum::is_possible(&[1, 0]));
    }
}
