//! The standard deviation of a surface by what was seen of it.

use super::Displacement;
use crate::cell::SignedDistance;
use crate::geom::vector::along;
use crate::store::Store;

/// Fewer displacements say nothing.
pub const FEWEST_DISPLACEMENTS: usize = 1000;
/// The curve is fitted in so many places, each to the same number of displacements.
const KNOTS: usize = 8;
/// Rounds of the fit: the two surfaces of a displacement have weights of their own.
const ROUNDS: usize = 6;
/// Standard deviations within which 95 % of a normal distribution lie.
pub(super) const DEVIATIONS_95: f64 = 1.959_963_985;
/// Less than a surface can be known to (meters): what did not move at all is no proof of more.
const LEAST_SIGMA: f64 = 1e-5;

/// The standard deviation of a surface by the weight of what was seen of it: a curve, for there is no law that holds, which falls or
/// stays. Errors of single looks average out with the weight; those that looks of a visit share (poses, calibration) do not.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSigma {
    /// Weights, ascending, above zero, and the standard deviations there (meters, above zero).
    knots: Vec<[f64; 2]>,
}

impl SurfaceSigma {
    /// A curve through these weights, which ascend, and standard deviations (meters). `None` where a number is not above zero and
    /// finite, weights do not ascend, or there are none.
    pub fn through(knots: impl IntoIterator<Item = [f64; 2]>) -> Option<Self> {
        let knots: Vec<[f64; 2]> = knots.into_iter().collect();
        let possible = knots.iter().flatten().all(|v| v.is_finite() && *v > 0.0);
        let ascends = knots.windows(2).all(|w| w[0][0] < w[1][0]);
        (possible && ascends && !knots.is_empty()).then_some(Self { knots })
    }

    /// The weights and standard deviations that the curve runs through.
    pub fn knots(&self) -> &[[f64; 2]] {
        &self.knots
    }

    /// Where a standard deviation lies from the least of the curve (0) to the most (1), by the logarithm; below and above at its ends.
    /// For pictures.
    pub fn share(&self, sigma: f64) -> f64 {
        let [least, most] = self.ends();
        if most > least { ((sigma / least).ln() / (most / least).ln()).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The least and the most of the curve (meters).
    pub fn ends(&self) -> [f64; 2] {
        let sigmas = self.knots.iter().map(|[_, sigma]| *sigma);
        [sigmas.clone().fold(f64::INFINITY, f64::min), sigmas.fold(0.0, f64::max)]
    }

    /// The standard deviation where the filter holds a weight (meters). Below the first weight it grows as if looks erred
    /// independently, beyond the last it does not fall; infinite where there is no weight.
    pub fn of(&self, weight: f64) -> f64 {
        let above = self.knots.partition_point(|[w, _]| *w <= weight);
        match (above.checked_sub(1).map(|i| self.knots[i]), self.knots.get(above)) {
            (Some([w0, s0]), Some([w1, s1])) => {
                let share = (weight / w0).ln() / (w1 / w0).ln();
                s0 * (s1 / s0).powf(share)
            }
            (Some([_, sigma]), None) => sigma,
            (None, Some([w, sigma])) if weight > 0.0 => sigma * (w / weight).sqrt(),
            _ => f64::INFINITY,
        }
    }

    /// The standard deviation of a distance to the surface (meters): that of the piece of surface that is nearest to a point, by the
    /// point's distance and its gradient. The least certain of the cells around that piece counts. `None` where none of them was
    /// observed. O(1).
    pub fn of_distance<const D: usize>(
        &self,
        map: &impl Store<SignedDistance, D>,
        p_world: [f64; D],
        distance: f64,
        gradient: [f64; D],
    ) -> Option<f64> {
        let half = 0.5 * map.lattice().resolution;
        let nearest = along(p_world, gradient, -distance);
        let corner = map.lattice().cell_of(nearest.map(|v| v - half))?;
        let cell = |n: usize| std::array::from_fn(|k| corner[k].saturating_add((n >> k & 1) as i32));
        let sigmas = (0..1 << D).filter_map(|n| map.cell(cell(n))).map(|c| self.of(f64::from(c.weight)));
        sigmas.max_by(f64::total_cmp)
    }

    /// That of the displacement between two surfaces, of these weights.
    pub(super) fn between(&self, weights: [f64; 2]) -> f64 {
        self.of(weights[0]).hypot(self.of(weights[1]))
    }

    /// Makes the curve one that never rises, for more looks make nothing less sure: where it rises, the mean of the logarithms of what
    /// is out of order (pool adjacent violators).
    fn fall(&mut self) {
        let mut pools: Vec<(f64, usize)> = Vec::new();
        for [_, sigma] in &self.knots {
            pools.push((sigma.ln(), 1));
            while let [.., (a, n), (b, m)] = pools[..]
                && b / m as f64 > a / n as f64
            {
                pools.pop();
                pools.pop();
                pools.push((a + b, n + m));
            }
        }
        let level = pools.iter().flat_map(|(sum, n)| std::iter::repeat_n((sum / *n as f64).exp(), *n));
        self.knots.iter_mut().zip(level).for_each(|([_, sigma], level)| *sigma = level);
    }

    /// Fits the curve to displacements between the beginning and the end of a log, so that 95 % of them are within 1.96 standard
    /// deviations, for little weight and for much: tails are heavier than normal ones, and a robust 95 % is what a margin is for.
    /// `None`: too few displacements to tell. O(n log n).
    pub fn fitted(to: impl IntoIterator<Item = Displacement>) -> Option<Self> {
        // The weight that two equal halves would have that are as sure together.
        let both = |[a, b]: [f64; 2]| 2.0 / (a.recip() + b.recip());
        let mut all: Vec<Displacement> = to.into_iter().collect();
        if all.len() < FEWEST_DISPLACEMENTS {
            return None;
        }
        all.sort_by(|a, b| both(a.weights).total_cmp(&both(b.weights)));
        let parts: Vec<&[Displacement]> = all.chunks(all.len().div_ceil(KNOTS)).collect();
        let middle = |part: &[Displacement]| both(part[part.len() / 2].weights);
        // Parts of one weight are one.
        let mut merged: Vec<Vec<Displacement>> = Vec::new();
        for part in parts {
            match merged.last_mut() {
                Some(last) if middle(last) >= middle(part) * (1.0 - 1e-9) => last.extend_from_slice(part),
                _ => merged.push(part.to_vec()),
            }
        }
        let start = percentile_95(all.iter().map(|d| d.meters.abs())) / DEVIATIONS_95 / 2f64.sqrt();
        let mut curve =
            Self { knots: merged.iter().map(|part| [middle(part), start.max(LEAST_SIGMA)]).collect() };
        for _ in 0..ROUNDS {
            let ratio = |part: &Vec<Displacement>| {
                percentile_95(part.iter().map(|d| d.meters.abs() / curve.between(d.weights))) / DEVIATIONS_95
            };
            let ratios: Vec<f64> = merged.iter().map(ratio).collect();
            for ([_, sigma], ratio) in curve.knots.iter_mut().zip(ratios) {
                *sigma = (*sigma * ratio).max(LEAST_SIGMA);
            }
            curve.fall();
        }
        Some(curve)
    }
}

/// The number that 95 % of these, at least one, are not above.
fn percentile_95(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = numbers.collect();
    let at = (all.len() * 95 / 100).min(all.len().saturating_sub(1));
    *all.select_nth_unstable_by(at, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{BlockKey, Lattice};
    use crate::store::Bricks;
    use crate::testing::brick;
    use crate::uncertainty::Coverage;

    /// Displacements that are normal, with this deviation of either surface by its weight.
    fn drawn(n: usize, sigma: impl Fn(f64) -> f64) -> Vec<Displacement> {
        // Sums of twelve numbers of a simple generator are normal enough.
        let mut state = 1u64;
        let mut uniform = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..n)
            .map(|i| {
                let weights = [0, 1].map(|_| 1.0 + 99.0 * uniform().powi(2));
                let normal = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                let meters = normal * sigma(weights[0]).hypot(sigma(weights[1]));
                Displacement { meters, weights, fitted: i.is_multiple_of(2) }
            })
            .collect()
    }

    /// Laws that two terms can follow, and one that they cannot.
    #[test]
    fn whatever_the_law_it_is_found_and_holds_where_it_was_not_fitted() {
        let laws: [fn(f64) -> f64; 4] = [
            |w| (0.03 * 0.03 / w + 0.004 * 0.004).sqrt(),
            |w| 0.03 / w.sqrt(),
            |_| 0.01,
            |w| 0.002 + 0.1 / w,
        ];
        for (n, law) in laws.into_iter().enumerate() {
            let all = drawn(100_000, law);
            let found = SurfaceSigma::fitted(all.iter().filter(|d| d.fitted).copied()).unwrap();
            let coverage = Coverage::of(&found, &all).unwrap();
            assert!((0.94..0.96).contains(&coverage.within_95), "{n} {coverage:?}");
            assert!(
                coverage.quarters.iter().all(|q| (0.93..0.97).contains(&q.within_95)),
                "{n} {coverage:?}"
            );
            assert!(found.knots().windows(2).all(|w| w[0][1] >= w[1][1]), "{n} {found:?}");
            for w in [8.0, 20.0, 60.0] {
                assert!((found.of(w) / law(w) - 1.0).abs() < 0.25, "{n} {w}: {} {}", found.of(w), law(w));
            }
        }
    }

    #[test]
    fn little_says_nothing_and_what_did_not_move_is_no_proof() {
        assert_eq!(SurfaceSigma::fitted(drawn(999, |_| 0.01)), None);
        let still = SurfaceSigma::fitted(drawn(2000, |_| 0.0)).unwrap();
        assert!((still.of(10.0) / LEAST_SIGMA - 1.0).abs() < 1e-9, "{still:?}");
        // All of one weight, as counts of equal looks may be.
        let alike = drawn(4000, |_| 0.01).into_iter().map(|d| Displacement { weights: [5.0; 2], ..d });
        let alike = SurfaceSigma::fitted(alike).unwrap();
        assert!(alike.knots().len() == 1 && (alike.of(5.0) / 0.01 - 1.0).abs() < 0.1, "{alike:?}");
    }

    #[test]
    fn more_looks_make_nothing_less_sure() {
        let mut curve =
            SurfaceSigma::through([[1.0, 0.02], [2.0, 0.08], [3.0, 0.04], [4.0, 0.01], [5.0, 0.01]]).unwrap();
        curve.fall();
        let sigmas: Vec<f64> = curve.knots().iter().map(|[_, sigma]| *sigma).collect();
        for (found, expected) in sigmas.iter().zip([0.04, 0.04, 0.04, 0.01, 0.01]) {
            assert!((found / expected - 1.0).abs() < 1e-12, "{sigmas:?}");
        }
    }

    #[test]
    fn a_curve_runs_through_its_knots() {
        let curve = SurfaceSigma::through([[4.0, 0.02], [100.0, 0.004]]).unwrap();
        let near = |w: f64, sigma: f64| (curve.of(w) / sigma - 1.0).abs() < 1e-12;
        assert!(near(4.0, 0.02) && near(100.0, 0.004) && near(1e6, 0.004) && near(1.0, 0.04));
        assert!(near(20.0, (0.02f64 * 0.004).sqrt()) && curve.of(0.0) == f64::INFINITY);
        assert_eq!(curve.ends(), [0.004, 0.02]);
        assert_eq!([0.001, 0.004, 0.02, f64::INFINITY].map(|sigma| curve.share(sigma)), [0.0, 0.0, 1.0, 1.0]);
        assert!((curve.share((0.02f64 * 0.004).sqrt()) - 0.5).abs() < 1e-12);
        let flat = SurfaceSigma::through([[4.0, 0.02]]).unwrap();
        assert_eq!((flat.ends(), flat.share(0.02)), ([0.02; 2], 0.0));
        for wrong in [vec![], vec![[1.0, 0.0]], vec![[2.0, 1.0], [2.0, 1.0]], vec![[1.0, f64::NAN]]] {
            assert_eq!(SurfaceSigma::through(wrong), None);
        }
    }

    #[test]
    fn a_distance_is_as_sure_as_the_surface_that_it_is_to() {
        // A wall at x = 0.5 whose cells were seen 4 times below y = 0.4 and 100 times above.
        let lattice = Lattice::new([0.0; 2], 0.1);
        let mut map = Bricks::<SignedDistance, 2>::new(lattice);
        let key = BlockKey([0, 0]);
        let seen = |i: usize| {
            let [x, y] = lattice.center(key.cell(i));
            Some(((0.5 - x) as f32, if y < 0.4 { 4.0 } else { 100.0 }))
        };
        map.insert(key, brick::<2>(seen)).unwrap();
        let sigma = SurfaceSigma::through([[4.0, 0.02], [100.0, 0.004]]).unwrap();
        let ask = |y: f64| sigma.of_distance(&map, [-1.0, y], 1.5, [-1.0, 0.0]);
        assert_eq!(ask(0.15), Some(sigma.of(4.0)));
        assert_eq!(ask(0.6), Some(sigma.of(100.0)));
        assert_eq!(ask(0.4), Some(sigma.of(4.0)), "between both the less certain one counts");
        assert_eq!(ask(3.0), None);
    }
}
