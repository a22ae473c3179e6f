//! Positions and labels of the ticks of an axis.

/// Ticks within `[low, high]` at steps of 1, 2 or 5 times a power of ten, about `count` of them. Empty when
/// the limits are not finite or not in order.
pub fn linear_ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return Vec::new();
    }
    let step = nice_step(span / count.max(1) as f64);
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    // Beyond 2^53 steps from zero neighboring ticks are the same number.
    if !(last - first >= 0.0 && last - first < 1e4 && first.abs() < 9e15) {
        return Vec::new();
    }
    (0..=(last - first) as usize).map(|i| (first + i as f64) * step).collect()
}

/// Powers of ten within `[low, high]`, thinned to about `count`; with less than three of them also their 2-
/// and 5-fold. Empty when the limits are not positive, finite and in order.
pub fn log_ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
    if !(low > 0.0 && high.is_finite() && high > low) {
        return Vec::new();
    }
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let within = |t: &f64| *t >= low * (1.0 - 1e-9) && *t <= high * (1.0 + 1e-9);
    let decades: Vec<f64> = (first..=last).map(|e| 10_f64.powi(e)).filter(within).collect();
    if decades.len() < 3 {
        let fine = (first..=last).flat_map(|e| [1.0, 2.0, 5.0].map(|m| m * 10_f64.powi(e)));
        return fine.filter(within).collect();
    }
    let every = decades.len().div_ceil(count.max(1));
    decades.into_iter().step_by(every).collect()
}

/// The label of a tick, given the distance to its neighbor: with as many decimals as the step needs; powers of ten as
/// `1e-6` where plain digits would be long.
pub fn tick_label(value: f64, step: f64) -> String {
    if value == 0.0 || value.abs() < 1e-9 * step.abs() {
        return "0".to_owned();
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&magnitude) {
        let mantissa = value / 10_f64.powf(magnitude);
        let digits = if (mantissa - mantissa.round()).abs() < 1e-6 { 0 } else { 1 };
        return format!("{value:.digits$e}");
    }
    let decimals = if step > 0.0 { (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize } else { 3 };
    format!("{value:.decimals$}")
}

/// The least of 1, 2, 5 times a power of ten that is not below `raw` (up to rounding).
fn nice_step(raw: f64) -> f64 {
    let power = 10_f64.powf(raw.log10().floor());
    let factor = raw / power;
    let nice = [1.0, 2.0, 5.0].into_iter().find(|n| factor <= n * (1.0 + 1e-9)).unwrap_or(10.0);
    nice * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, count: usize) -> Vec<String> {
        let ticks = linear_ticks(low, high, count);
        let step = ticks[1] - ticks[0];
        ticks.iter().map(|t| tick_label(*t, step)).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(labels(0.0, 10.0, 5), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(labels(-0.3, 0.3, 6), ["-0.3", "-0.2", "-0.1", "0.0", "0.1", "0.2", "0.3"].map(zero));
        assert_eq!(labels(0.0, 1.0, 4), ["0", "0.5", "1.0"]);
        assert_eq!(labels(4_000_000.0, 4_000_040.0, 4).len(), 5);
    }

    fn zero(label: &str) -> String {
        if label == "0.0" { "0".to_owned() } else { label.to_owned() }
    }

    #[test]
    fn log_ticks_are_powers_of_ten() {
        assert_eq!(log_ticks(0.01, 100.0, 10), [0.01, 0.1, 1.0, 10.0, 100.0]);
        assert_eq!(log_ticks(1e-12, 1.0, 4).len(), 4);
        assert_eq!(log_ticks(1.0, 6.0, 5), [1.0, 2.0, 5.0]);
        assert_eq!(tick_label(1e-6, 1e-6), "1e-6");
        assert_eq!(tick_label(0.001, 0.001), "0.001");
        assert_eq!(tick_label(2.5e7, 5e6), "2.5e7");
    }

    #[test]
    fn nonsense_has_no_ticks() {
        for (low, high) in [(0.0, 0.0), (1.0, 0.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            assert!(linear_ticks(low, high, 5).is_empty());
            assert!(log_ticks(low, high, 5).is_empty());
        }
        assert!(log_ticks(-1.0, 1.0, 5).is_empty());
        assert!(linear_ticks(1e300, 1e300 * (1.0 + 1e-15), 5).len() < 20);
    }
}
