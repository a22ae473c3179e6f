//! Exercise 1: what a clamped weight does to a cell's variance.

use crate::page::{check, mm};
use portolan::cell::TsdfRule;
use portolan_sim::Random;

/// Sample variance of what a filter believes after `n` observations of variance `sigma^2 / w` of a zero, over
/// `runs` runs.
fn variance_after(w_max: f32, (sigma, w): (f64, f64), n: usize, runs: u64) -> f64 {
    let rule = TsdfRule { truncation: 1.0, w_max };
    let (mut sum, mut sum_sq) = (0.0, 0.0);
    for run in 0..runs {
        let mut random = Random::stream(41, run);
        let (mut d, mut weight) = (0.0, 0.0);
        for _ in 0..n {
            let event = rule.step(d, weight, sigma / w.sqrt() * random.normal(), w);
            (d, weight) = (event.after, event.weight_after);
        }
        (sum, sum_sq) = (sum + d, sum_sq + d * d);
    }
    let mean = sum / runs as f64;
    sum_sq / runs as f64 - mean * mean
}

/// The variance of a clamped cell at rest, `n` long enough for the beginning to be forgotten to a part in 10,000, and
/// the prediction: `K sigma^2 / (w (2 - K))` with the gain at the clamp, where weights below 1 are taken for 1.
fn settled(w_max: f32, (sigma, w): (f64, f64)) -> [f64; 2] {
    let n = (10.0 * (f64::from(w_max) / w + 1.0)) as usize;
    let unit = f64::max(w, 1.0);
    let predicted = sigma * sigma * unit / w / (2.0 * f64::from(w_max) + unit);
    [variance_after(w_max, (sigma, w), n, 8000), predicted]
}

/// Exercise 1 (a): a clamped cell never comes to rest, and its variance is `sigma^2 / (2 W_max + w)` for weights of 1 and more.
#[test]
fn exercise_1_steady_state_variance() {
    for (w_max, w) in [(4.0f32, 1.0), (24.0, 1.0), (64.0, 1.0), (16.0, 2.0), (8.0, 0.5)] {
        let [measured, predicted] = settled(w_max, (0.02, w));
        println!("W_max {w_max}, w {w}: {} predicted {}", mm(measured.sqrt()), mm(predicted.sqrt()));
        // The variance of 8000 runs is known to 1.6 %: three of those.
        assert!((measured / predicted - 1.0).abs() < 0.05);
    }
}

/// Exercise 1 (c): at `W_max = 24.5` a cell is as sure as an unclamped one after 50 scans: `2 * 24.5 + 1 = 50`.
#[test]
fn exercise_1_w_max_of_24_5_equals_50_unclamped_scans() {
    let sigma = 0.02;
    let clamped = variance_after(24.5, (sigma, 1.0), 400, 8000);
    let unclamped = variance_after(f32::INFINITY, (sigma, 1.0), 50, 8000);
    println!("standard deviation: clamped {}, 50 scans {}", mm(clamped.sqrt()), mm(unclamped.sqrt()));
    assert!((clamped / unclamped - 1.0).abs() < 0.07);
    assert!((unclamped / (sigma * sigma / 50.0) - 1.0).abs() < 0.05);
}

#[test]
fn exercise_1_on_the_page() {
    let sigma = 0.02;
    let settled = |w_max: f32, w: f64| {
        let [measured, predicted] = settled(w_max, (sigma, w)).map(f64::sqrt);
        format!("{} measured, {} predicted", mm(measured), mm(predicted))
    };
    let unclamped = variance_after(f32::INFINITY, (sigma, 1.0), 50, 8000).sqrt();
    // 2 W_max + w = 50 for w = 1.
    let w_max = (50.0 - 1.0) / 2.0;
    let rows = [
        ("standard deviation at rest, `W_max` 4, `w` 1", settled(4.0, 1.0)),
        ("standard deviation at rest, `W_max` 24, `w` 1", settled(24.0, 1.0)),
        ("standard deviation at rest, `W_max` 64, `w` 1", settled(64.0, 1.0)),
        ("standard deviation at rest, `W_max` 16, `w` 2", settled(16.0, 2.0)),
        ("standard deviation at rest, `W_max` 8, `w` 0.5", settled(8.0, 0.5)),
        ("`W_max` that equals 50 unclamped scans", format!("{w_max}")),
        ("standard deviation there", settled(w_max as f32, 1.0)),
        (
            "standard deviation after 50 unclamped scans",
            format!("{} measured, {} predicted", mm(unclamped), mm(sigma / 50f64.sqrt())),
        ),
    ];
    check(1, &rows);
}
