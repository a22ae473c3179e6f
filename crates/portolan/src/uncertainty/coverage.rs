//! What a standard deviation is worth: how many displacements lie where it says that 95 % do.

use super::fit::DEVIATIONS_95;
use super::{Displacement, SurfaceSigma};

/// A quarter of the displacements, by what was predicted for them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quarter {
    /// Median of the predicted standard deviations of displacements (meters).
    pub sigma: f64,
    /// Median of the displacements (meters).
    pub median: f64,
    /// Share of the displacements within 1.96 standard deviations; 0.95 if they are right.
    pub within_95: f64,
}

/// The displacements that were not fitted to, against what was predicted for them.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverage {
    /// Number of displacements.
    pub count: usize,
    /// Share within 1.96 standard deviations.
    pub within_95: f64,
    /// By quarters, from the smallest predicted deviation to the largest.
    pub quarters: [Quarter; 4],
}

impl Coverage {
    /// Checks a standard deviation by displacements that it was not fitted to. `None`: there are fewer than four.
    pub fn of(sigma: &SurfaceSigma, displacements: &[Displacement]) -> Option<Self> {
        let held_out = displacements.iter().filter(|d| !d.fitted);
        let mut all: Vec<[f64; 2]> = held_out.map(|d| [sigma.between(d.weights), d.meters.abs()]).collect();
        if all.len() < 4 {
            return None;
        }
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let within = |part: &[[f64; 2]]| {
            let inside = part.iter().filter(|[sigma, meters]| *meters <= DEVIATIONS_95 * sigma).count();
            inside as f64 / part.len() as f64
        };
        let quarters = std::array::from_fn(|k| {
            let part = &all[all.len() * k / 4..all.len() * (k + 1) / 4];
            let mut meters: Vec<f64> = part.iter().map(|[_, meters]| *meters).collect();
            let middle = meters.len() / 2;
            let median = *meters.select_nth_unstable_by(middle, f64::total_cmp).1;
            Quarter { sigma: part[middle][0], median, within_95: within(part) }
        });
        Some(Self { count: all.len(), within_95: within(&all), quarters })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_are_counted_by_what_was_predicted() {
        let sigma = SurfaceSigma::through([[1.0, 1.0], [100.0, 0.1]]).unwrap();
        // Weights 1 to 8: the larger the weight, the smaller the prediction; each is off by half of what is allowed, every
        // second of the least certain ones by twice.
        let one = |i: usize| {
            let weight = 1.0 + (i / 8) as f64;
            let allowed = DEVIATIONS_95 * (2.0 / weight).sqrt();
            let meters = if i < 16 && i.is_multiple_of(2) { -2.0 * allowed } else { 0.5 * allowed };
            Displacement { meters, weights: [weight; 2], fitted: false }
        };
        let all: Vec<_> = (0..64).map(one).collect();
        let coverage = Coverage::of(&sigma, &all).unwrap();
        assert_eq!((coverage.count, coverage.within_95), (64, 56.0 / 64.0));
        assert_eq!(coverage.quarters.map(|q| q.within_95), [1.0, 1.0, 1.0, 0.5]);
        assert!(coverage.quarters.windows(2).all(|w| w[0].sigma < w[1].sigma));
        let fitted: Vec<_> = all.iter().map(|d| Displacement { fitted: true, ..*d }).collect();
        assert_eq!(Coverage::of(&sigma, &fitted), None);
    }
}
