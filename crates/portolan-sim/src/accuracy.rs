//! How true the answers are.

use serde::Serialize;

/// The world as it is. The simulator knows it.
pub trait Truth<const D: usize> {
    /// Signed distance to the nearest true surface (meters), positive in free space.
    fn signed_distance(&self, p_world: [f64; D]) -> f64;
}

/// Order statistics of signed errors (meters): answer minus truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorSummary {
    /// Number of answers compared.
    pub count: usize,
    /// Median of the absolute error.
    pub median: f64,
    /// 95th percentile of the absolute error.
    pub p95: f64,
    /// 99th percentile of the absolute error.
    pub p99: f64,
    /// Median of the signed error.
    pub bias: f64,
    /// The most by which an answer was too large; at least 0.
    pub worst_over: f64,
    /// The most by which an answer was too small; at least 0.
    pub worst_under: f64,
}

impl ErrorSummary {
    /// Summarises signed errors; `None` without any.
    pub fn of(mut errors: Vec<f64>) -> Option<Self> {
        if errors.is_empty() {
            return None;
        }
        errors.sort_by(f64::total_cmp);
        let (low, high) = (errors[0], errors[errors.len() - 1]);
        let bias = errors[errors.len() / 2];
        let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let quantile = |q: f64| sizes[((sizes.len() - 1) as f64 * q).round() as usize];
        Some(Self {
            count: sizes.len(),
            median: quantile(0.5),
            p95: quantile(0.95),
            p99: quantile(0.99),
            bias,
            worst_over: high.max(0.0),
            worst_under: (-low).max(0.0),
        })
    }
}

impl ErrorSummary {
    /// The median over several summaries, number by number: of medians the median, of the worst errors the median. With an
    /// even number of them the lower one of the two in the middle. `None` without any.
    pub fn median_of(summaries: &[Self]) -> Option<Self> {
        let middle = summaries.len().checked_sub(1)? / 2;
        let of = |part: fn(&Self) -> f64| {
            let mut values: Vec<f64> = summaries.iter().map(part).collect();
            values.sort_by(f64::total_cmp);
            values[middle]
        };
        let mut counts: Vec<usize> = summaries.iter().map(|s| s.count).collect();
        counts.sort_unstable();
        Some(Self {
            count: counts[middle],
            median: of(|s| s.median),
            p95: of(|s| s.p95),
            p99: of(|s| s.p99),
            bias: of(|s| s.bias),
            worst_over: of(|s| s.worst_over),
            worst_under: of(|s| s.worst_under),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summaries_of_known_errors() {
        let s = ErrorSummary::of((-50..=50).map(f64::from).collect()).unwrap();
        assert_eq!((s.count, s.bias, s.worst_over, s.worst_under), (101, 0.0, 50.0, 50.0));
        assert_eq!((s.median, s.p99), (25.0, 50.0));
        assert_eq!(ErrorSummary::of(vec![]), None);
        let others = [1.0, 9.0, 5.0].map(|e| ErrorSummary::of(vec![e, -2.0 * e]).unwrap());
        let middle = ErrorSummary::median_of(&others).unwrap();
        assert_eq!((middle.worst_over, middle.worst_under, middle.count), (5.0, 10.0, 2));
        assert_eq!(ErrorSummary::median_of(&[]), None);
        assert_eq!(ErrorSummary::of(vec![2.0]).unwrap().worst_under, 0.0);
    }
}
