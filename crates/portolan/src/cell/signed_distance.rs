//! Truncated signed distance: a scalar information filter per cell.

use super::{Cell, DistanceBrick, DistanceObservation, Distances, Planes};
use multiversion::multiversion;

/// Settings of the fusion filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TsdfRule {
    /// Truncation tau (meters): observations are clamped to +-tau.
    pub truncation: f32,
    /// Clamp of the accumulated weight. Infinity: the batch weighted mean, which never forgets.
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

    /// The weight clamp under which a stale estimate loses half its error in `observations` observations of
    /// weight `weight`: `W_max = w / (2^(1/n) - 1)`, the inverse of [`TsdfRule::half_life`].
    pub fn w_max_for_half_life(observations: f64, weight: f64) -> f64 {
        weight / ((2f64).powf(1.0 / observations) - 1.0)
    }

    /// Number of observations of weight `weight` after which a saturated cell has lost half the error of a
    /// stale estimate: `ln 2 / ln(1 + w / W_max)`. Infinite where nothing is forgotten.
    pub fn half_life(&self, weight: f64) -> f64 {
        std::f64::consts::LN_2 / (weight / f64::from(self.w_max)).ln_1p()
    }

    /// The filter itself on `f64` numbers (Curless & Levoy 1996, read as a scalar information filter):
    /// `K = w / (W + w)`, `D <- D + K (clamp(d, -tau, tau) - D)`, `W <- min(W + w, W_max)`. `W = 0` gives
    /// `K = 1`, so an unobserved cell adopts its first observation without a special case.
    #[inline(always)]
    pub fn step(&self, before: f64, weight_before: f64, observation: f64, weight: f64) -> FusionEvent {
        let truncation = f64::from(self.truncation);
        // max/min instead of clamp: the compiler turns them into two vector instructions.
        let observation = observation.max(-truncation).min(truncation);
        let total = weight_before + weight;
        let gain = weight / total;
        let after = before + gain * (observation - before);
        FusionEvent {
            before,
            weight_before,
            observation,
            after,
            weight_after: total.min(f64::from(self.w_max)),
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
    /// Posterior distance (meters).
    pub after: f64,
    /// Posterior weight, clamped to `W_max`.
    pub weight_after: f64,
    /// The gain `K`: the scalar Kalman gain.
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
            let back = TsdfRule::w_max_for_half_life(rule.half_life(1.0), 1.0);
            assert!((back - f64::from(w_max)).abs() < 1e-9 * f64::from(w_max));
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

    #[test]
    fn nonsense_settings_are_refused() {
        for (truncation, w_max) in
            [(0.0, 1.0), (f32::NAN, 1.0), (0.1, 0.0), (0.1, f32::NAN), (f32::INFINITY, 1.0)]
        {
            assert!(TsdfRule { truncation, w_max }.validate().is_err());
        }
    }

    proptest! {
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
