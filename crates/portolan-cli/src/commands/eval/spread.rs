//! Mean, median and largest.

use serde_json::Value;

/// How numbers are spread; `null` in JSON of an empty list.
pub(super) struct Spread {
    pub(super) mean: Value,
    pub(super) median: Value,
    pub(super) p95: Value,
    pub(super) largest: Value,
}

impl Spread {
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len();
        // The nearest rank, which is always one of the numbers.
        let at = |q: f64| Value::from(sorted.get((q * n as f64).ceil().max(1.0) as usize - 1).copied());
        let mean = (n > 0).then(|| sorted.iter().sum::<f64>() / n as f64);
        Self { mean: mean.into(), median: at(0.5), p95: at(0.95), largest: at(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_numbers_of_the_list() {
        let s = Spread::of((1..=100).map(f64::from));
        assert_eq!((s.median, s.p95, s.largest), (50.0.into(), 95.0.into(), 100.0.into()));
        assert_eq!(s.mean, Value::from(50.5));
        assert_eq!(Spread::of(std::iter::empty()).median, Value::Null);
    }
}
