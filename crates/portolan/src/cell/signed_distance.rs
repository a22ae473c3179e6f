//! Truncated signed distance: a scalar information filter per cell.

use super::{Cell, DistanceBrick, DistanceObservation, Distances, Planes};
use multiversion::multiversion;

/// Settings of the fusion filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TsdfRule {
    /// Truncation tau (meters): observations are clamped to +-tau.
    pub truncation: f32,
    /// Clamp of the accumulated weight, in observations of the weight that a cell receives, where that is at most 1: what
    /// was there before never counts for more than so many of them. Infinity: the batch weighted mean, which never forgets.
    pub w_max: f32,
}

/// What is wrong with a [`TsdfRule`].
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TsdfRuleError {
    /// The truncation is not a positive length.
    #[error("truncation must be a positive, finite length in meters, got {0}")]
    Truncation(f32),
    /// The weight clamp is not positive.
    #[error("w_max must be positive (infinity: never forget), got {0}")]
    WeightClamp(f32),
}

impl TsdfRule {
    /// Checks the settings; the constructors of maps call it.
    ///
    /// # Errors
    /// Says which setting is wrong.
    pub fn validate(&self) -> Result<(), TsdfRuleError> {
        if !(self.truncation > 0.0 && self.truncation.is_finite()) {
            return Err(TsdfRuleError::Truncation(self.truncation));
        }
        if !(self.w_max > 0.0) {
            return Err(TsdfRuleError::WeightClamp(self.w_max));
        }
        Ok(())
    }

    /// The weight clamp under which a stale estimate loses half its error in `observations` observations of weight
    /// `weight`: `W_max = max(w, 1) / (2^(1/n) - 1)`, the inverse of [`TsdfRule::half_life`].
    pub fn w_max_for_half_life(observations: f64, weight: f64) -> f64 {
        weight.max(1.0) / ((2f64).powf(1.0 / observations) - 1.0)
    }

    /// Number of observations of weight `weight` after which a saturated cell has lost half the error of a
    /// stale estimate: `ln 2 / ln(1 + max(w, 1) / W_max)`, the same for every weight up to 1. It holds for observations
    /// in front of a surface; behind it the weight falls to 0 at the truncation, and so does the gain. Infinite where
    /// nothing is forgotten.
    pub fn half_life(&self, weight: f64) -> f64 {
        std::f64::consts::LN_2 / (weight.max(1.0) / f64::from(self.w_max)).ln_1p()
    }

    /// The filter itself on `f64` numbers (Curless & Levoy 1996, read as a scalar information filter):
    /// `K = w / (W + w)`, `D <- D + K (clamp(d, -tau, tau) - D)`, `W <- min(W + w, W_max)`. `W = 0` gives
    /// `K = 1`, so an unobserved cell adopts its first observation without a special case.
    ///
    /// Weights below 1 (of free space, of far or grazing beams) would reach a clamp in units of weight late or never, and
    /// a surface that has gone would stay for thousands of them. So the clamp is in units of what the cell receives:
    ///
    /// - `K` is never below `1 / (1 + W_max)`, the gain of an observation of weight 1 at the clamp. Behind a surface, where
    ///   sweeps taper weights, this bound falls to 0 at `-tau` as they do: else the far side of a thin wall would wear
    ///   away what the near side says of itself.
    /// - In front of a surface `W` is clamped to `w W_max`, so that heavier observations regain what they outweigh the
    ///   lighter ones by; but never below 1, so that no far look makes a cell unknown.
    ///
    /// Where weights are 1, tapered or not, both do nothing, and the filter is the textbook's.
    #[inline(always)]
    pub fn step(&self, before: f64, weight_before: f64, observation: f64, weight: f64) -> FusionEvent {
        let (truncation, w_max) = (f64::from(self.truncation), f64::from(self.w_max));
        // max/min instead of clamp: the compiler turns them into two vector instructions.
        let observation = observation.max(-truncation).min(truncation);
        // Divided by settings alone, and so outside of the loop over cells.
        let (least, per_tau) = (1.0 / (1.0 + w_max), 1.0 / truncation);
        let taper = (1.0 + observation * per_tau).min(1.0);
        let total = weight_before + weight;
        let gain = (weight / total).max(least * taper);
        let after = before + gain * (observation - before);
        let clamp = if observation >= 0.0 { (weight * w_max).max(1.0).min(w_max) } else { w_max };
        FusionEvent {
            before,
            weight_before,
            observation,
            weight,
            after,
            weight_after: total.min(clamp),
            gain,
        }
    }
}

/// One step of the filter of a cell, made visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusionEvent {
    /// Prior distance `D` (meters); meaningless where `weight_before` is 0.
    pub before: f64,
    /// Prior weight `W`.
    pub weight_before: f64,
    /// The observation, clamped to the truncation (meters).
    pub observation: f64,
    /// Its weight `w`.
    pub weight: f64,
    /// Posterior distance (meters).
    pub after: f64,
    /// Posterior weight, clamped.
    pub weight_after: f64,
    /// The gain `K`: the scalar Kalman gain, `w / (W + w)`, or the least that forgetting asks for.
    pub gain: f64,
}

/// An estimated truncated signed distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedDistance {
    /// `D` (meters), within +-tau, positive in free space.
    pub distance: f32,
    /// `W`: accumulated inverse variance, up to a common factor. Positive.
    pub weight: f32,
}

/// Distances and weights of many cells. Weight 0 means never observed; the distance is then +tau's
/// stand-in 0 and must not be read.
#[derive(Clone, Debug, PartialEq)]
pub struct DistancePlanes {
    distance: Vec<f32>,
    weight: Vec<f32>,
}

impl DistancePlanes {
    /// Planes from their parts. `None` where the lengths differ or a pair is no state of the filter (weight
    /// negative or NaN, distance not finite).
    pub fn from_parts(distance: Vec<f32>, weight: Vec<f32>) -> Option<Self> {
        let sane = |(&d, &w): (&f32, &f32)| d.is_finite() && w >= 0.0;
        (distance.len() == weight.len() && distance.iter().zip(&weight).all(sane))
            .then_some(Self { distance, weight })
    }

    /// `D` of every cell (meters); meaningless where the weight is 0.
    pub fn distances(&self) -> &[f32] {
        &self.distance
    }

    /// `W` of every cell; 0: never observed.
    pub fn weights(&self) -> &[f32] {
        &self.weight
    }
}

impl Planes<SignedDistance> for DistancePlanes {
    fn unobserved(n: usize) -> Self {
        Self { distance: vec![0.0; n], weight: vec![0.0; n] }
    }

    fn len(&self) -> usize {
        self.weight.len()
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<SignedDistance> {
        let weight = self.weight[i];
        (weight > 0.0).then(|| SignedDistance { distance: self.distance[i], weight })
    }

    fn set(&mut self, i: usize, cell: Option<SignedDistance>) {
        let cell = cell.unwrap_or(SignedDistance { distance: 0.0, weight: 0.0 });
        self.distance[i] = cell.distance;
        self.weight[i] = cell.weight;
    }

    fn bytes(&self) -> usize {
        (self.distance.capacity() + self.weight.capacity()) * size_of::<f32>()
    }
}

impl Cell for SignedDistance {
    type Rule = TsdfRule;
    type Planes = DistancePlanes;
    type Brick = DistanceBrick;
    type Evidence = Distances;
    type Event = FusionEvent;

    #[inline]
    fn fuse(cell: Option<Self>, o: DistanceObservation, rule: &TsdfRule) -> (Self, FusionEvent) {
        let prior = cell.unwrap_or(Self { distance: 0.0, weight: 0.0 });
        let event = rule.step(prior.distance.into(), prior.weight.into(), o.distance.into(), o.weight.into());
        (Self { distance: event.after as f32, weight: event.weight_after as f32 }, event)
    }

    #[inline]
    fn fuse_run(
        planes: &mut DistancePlanes,
        start: usize,
        evidence: &Distances,
        from: usize,
        len: usize,
        rule: &TsdfRule,
    ) {
        let (distance, weight) =
            (&mut planes.distance[start..start + len], &mut planes.weight[start..start + len]);
        let (observed, gained) =
            (&evidence.distances()[from..from + len], &evidence.weights()[from..from + len]);
        fuse_widest(distance, weight, observed, gained, rule);
    }

    #[inline]
    fn fuse_brick(brick: &mut DistanceBrick, evidence: &Distances, rule: &TsdfRule) {
        let (distance, weight) = brick.planes_mut();
        fuse_widest(distance, weight, evidence.distances(), evidence.weights(), rule);
    }
}

/// The filter over slices of the same length, states against observations. In the widest vectors that the
/// processor has: every width gives the same bits.
#[multiversion(targets = "simd")]
fn fuse_widest(distance: &mut [f32], weight: &mut [f32], observed: &[f32], gained: &[f32], rule: &TsdfRule) {
    if distance.len().is_multiple_of(LAYER) {
        fuse_chunks::<LAYER>(distance, weight, observed, gained, rule);
    } else if distance.len().is_multiple_of(ROW) {
        fuse_chunks::<ROW>(distance, weight, observed, gained, rule);
    } else {
        for i in 0..distance.len() {
            let (mut d, mut w) = ([distance[i]], [weight[i]]);
            fuse_lanes::<1>(&mut d, &mut w, &[observed[i]], &[gained[i]], rule);
            (distance[i], weight[i]) = (d[0], w[0]);
        }
    }
}

/// Rows of blocks inside a map are so long, and layers of blocks: a fixed length lets the compiler use whole vectors.
const ROW: usize = 8;
const LAYER: usize = 64;

#[inline(always)]
fn fuse_chunks<const N: usize>(
    distance: &mut [f32],
    weight: &mut [f32],
    observed: &[f32],
    gained: &[f32],
    rule: &TsdfRule,
) {
    let states = distance.chunks_exact_mut(N).zip(weight.chunks_exact_mut(N));
    for ((d, w), (o, g)) in states.zip(observed.chunks_exact(N).zip(gained.chunks_exact(N))) {
        // Near surfaces many parts of a block say nothing.
        if g.iter().fold(0.0, |most: f32, &g| most.max(g)) <= 0.0 {
            continue;
        }
        if let (Ok(d), Ok(w), Ok(o), Ok(g)) = (d.try_into(), w.try_into(), o.try_into(), g.try_into()) {
            fuse_lanes::<N>(d, w, o, g, rule);
        }
    }
}

#[inline(always)]
fn fuse_lanes<const N: usize>(
    d: &mut [f32; N],
    w: &mut [f32; N],
    o: &[f32; N],
    g: &[f32; N],
    rule: &TsdfRule,
) {
    for i in 0..N {
        // A lane without observation is computed with weight 1 and thrown away: no 0/0, no branch.
        let said = g[i] > 0.0;
        let event = rule.step(d[i].into(), w[i].into(), o[i].into(), if said { g[i].into() } else { 1.0 });
        d[i] = if said { event.after as f32 } else { d[i] };
        w[i] = if said { event.weight_after as f32 } else { w[i] };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::Evidence;
    use proptest::prelude::*;

    #[test]
    fn half_lives_invert() {
        for w_max in [4.0f32, 16.0, 24.0, 64.0, 128.0] {
            let rule = TsdfRule { truncation: 0.2, w_max };
            for weight in [0.001, 0.3, 1.0, 2.0] {
                let back = TsdfRule::w_max_for_half_life(rule.half_life(weight), weight);
                assert!((back - f64::from(w_max)).abs() < 1e-9 * f64::from(w_max));
            }
        }
        let rule = TsdfRule { truncation: 0.2, w_max: 16.0 };
        assert!((rule.half_life(1.0) - 11.4).abs() < 0.1);
        assert!(TsdfRule { truncation: 0.2, w_max: f32::INFINITY }.half_life(1.0).is_infinite());
    }

    #[test]
    fn without_a_clamp_the_filter_is_the_weighted_mean() {
        let rule = TsdfRule { truncation: 1.0, w_max: f32::INFINITY };
        let (mut d, mut w, mut sum) = (0.0, 0.0, 0.0);
        for k in 0..1000 {
            let (o, g) = ((f64::from(k) * 0.37).sin() * 0.9, 0.1 + f64::from(k % 7));
            let event = rule.step(d, w, o, g);
            (d, w, sum) = (event.after, event.weight_after, sum + g * o);
            assert!((d - sum / w).abs() < 1e-12);
        }
    }

    /// Looks of weight `weight` at +tau until a cell that `stale` looks of weight `before` had put to -0.1 m has lost half
    /// of its error, and its weight then.
    fn looks_until_half(w_max: f32, (before, stale): (f64, u32), weight: f64) -> (u32, f64) {
        let rule = TsdfRule { truncation: 0.15, w_max };
        let (mut d, mut w) = (-0.1, before);
        for _ in 1..stale {
            let event = rule.step(d, w, -0.1, before);
            (d, w) = (event.after, event.weight_after);
        }
        let half = 0.5 * (0.15 + 0.1);
        for n in 1..10_000 {
            let event = rule.step(d, w, 0.3, weight);
            (d, w) = (event.after, event.weight_after);
            if 0.15 - d <= half + 1e-6 {
                return (n, w);
            }
        }
        (u32::MAX, w)
    }

    #[test]
    fn what_is_stale_halves_in_as_many_looks_whatever_they_weigh() {
        let w_max = TsdfRule::w_max_for_half_life(10.0, 1.0) as f32;
        for weight in [1.0, 0.3, 0.05, 1.0 / 81.0, 1e-5] {
            let (looks, left) = looks_until_half(w_max, (1.0, 1500), weight);
            assert_eq!(looks, 10, "{weight}");
            // No look makes a cell unknown: what counts as observed weighs 0.5 at most.
            assert!(left >= 1.0, "{weight}: {left}");
        }
        // A heavier look counts for more, and so does any look at what was hardly seen.
        assert!(looks_until_half(w_max, (1.0, 1500), 2.0).0 < 7);
        assert_eq!(looks_until_half(w_max, (1.0, 2), 1.0).0, 2);
    }

    #[test]
    fn looks_in_front_of_a_surface_keep_the_ratio_of_their_weights() {
        let rule = TsdfRule { truncation: 0.15, w_max: 64.0 };
        let light = rule.step(0.0, 64.0, 0.15, 0.25);
        assert_eq!((light.gain, light.weight_after), (1.0 / 65.0, 16.0));
        let heavy = rule.step(0.0, light.weight_after, 0.0, 1.0);
        assert!((heavy.gain / light.gain - 65.0 / 17.0).abs() < 1e-12);
        // Behind a surface neither holds: a thin wall's far side would be worn away.
        let behind = rule.step(0.0, 64.0, -0.12, 0.01);
        assert_eq!(behind.weight_after, 64.0);
        assert!((behind.gain - 0.2 / 65.0).abs() < 1e-6);
    }

    #[test]
    fn nonsense_settings_are_refused() {
        for (truncation, w_max) in
            [(0.0, 1.0), (f32::NAN, 1.0), (0.1, 0.0), (0.1, f32::NAN), (f32::INFINITY, 1.0)]
        {
            assert!(TsdfRule { truncation, w_max }.validate().is_err());
        }
    }

    proptest! {
        /// With the textbook's weights, 1 and tapered behind the surface, the filter is the textbook's.
        #[test]
        fn weights_of_1_know_no_other_clamp(
            looks in prop::collection::vec(-0.15f32..0.3, 1..200),
            w_max in prop_oneof![Just(f32::INFINITY), 1f32..64.0],
        ) {
            let rule = TsdfRule { truncation: 0.15, w_max };
            let (mut d, mut w) = (0.0, 0.0);
            for look in looks.into_iter().map(f64::from) {
                let weight = (1.0 + look / f64::from(0.15f32)).min(1.0);
                let event = rule.step(d, w, look, weight);
                let observation = look.min(f64::from(0.15f32));
                let gain = weight / (w + weight);
                prop_assert!((event.gain - gain).abs() < 1e-15, "{} {}", event.gain, gain);
                prop_assert!((event.after - (d + gain * (observation - d))).abs() < 1e-15);
                prop_assert_eq!(event.weight_after, (w + weight).min(f64::from(w_max)));
                (d, w) = (event.after, event.weight_after);
            }
        }

        #[test]
        fn a_run_is_many_single_steps(
            scans in prop::collection::vec(prop::collection::vec((-0.4f32..0.4, 0.0f32..2.0, any::<bool>()), 64), 1..20),
            w_max in prop_oneof![Just(f32::INFINITY), 0.5f32..64.0],
            len in prop_oneof![Just(64usize), 1usize..64],
        ) {
            let rule = TsdfRule { truncation: 0.15, w_max };
            let mut planes = DistancePlanes::unobserved(64);
            let mut singles = planes.clone();
            for scan in &scans {
                let mut e = Distances::silent(64);
                for (i, &(distance, weight, said)) in scan.iter().enumerate() {
                    e.set(i, DistanceObservation { distance, weight: if said { weight } else { 0.0 } });
                }
                SignedDistance::fuse_run(&mut planes, 64 - len, &e, 64 - len, len, &rule);
                for i in 64 - len..64 {
                    if let Some(o) = e.one(i) {
                        singles.set(i, Some(SignedDistance::fuse(singles.get(i), o, &rule).0));
                    }
                }
            }
            prop_assert_eq!(planes, singles);
        }
    }
}
