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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summaries_of_known_errors() {
        let s = ErrorSummary::of((-50..=50).map(f64::from).collect()).unwrap();
        assert_eq!((s.count, s.bias, s.worst_over, s.worst_under), (101, 0.0, 50.0, 50.0));
        assert_eq!((s.median, s.p99), (25.0, 50.0));
        assert_eq!(ErrorSummary::of(vec![]), None);
        assert_eq!(ErrorSummary::of(vec![2.0]).unwrap().worst_under, 0.0);
    }
}
