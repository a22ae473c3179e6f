//! Points to ask at, and the time that asking takes.

use portolan::geom::Aabb;

/// Seconds since any fixed moment.
pub type Clock<'a> = dyn FnMut() -> f64 + 'a;

/// Uniform points in a box, the same for a number in every run (additive recurrence of Roberts 2018: low
/// discrepancy without a random generator).
pub(super) fn points(bounds: &Aabb<2>, n: usize) -> Vec<[f64; 2]> {
    // Root of x^3 = x + 1.
    let phi: f64 = 1.324_717_957_244_746;
    let at = |i: usize, k: usize| {
        let u = (0.5 + (i + 1) as f64 * phi.powi(-(k as i32 + 1))).fract();
        bounds.min[k] + u * (bounds.max[k] - bounds.min[k])
    };
    (0..n).map(|i| [at(i, 0), at(i, 1)]).collect()
}

/// Median seconds a call over five rounds of asking at every point. The answers are folded into a number that
/// the optimizer cannot drop.
pub(super) fn seconds_per_probe<P: Copy>(
    clock: &mut Clock<'_>,
    points: &[P],
    mut ask: impl FnMut(P) -> f64,
) -> f64 {
    let mut rounds = [0.0; 5];
    for round in &mut rounds {
        let start = clock();
        let mut sum = 0.0;
        for &p in points {
            sum += ask(p);
        }
        std::hint::black_box(sum);
        *round = (clock() - start) / points.len().max(1) as f64;
    }
    rounds.sort_by(f64::total_cmp);
    rounds[2]
}

/// Median seconds of three calls, and the last result.
pub(super) fn seconds_of<T>(clock: &mut Clock<'_>, mut make: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let start = clock();
        let made = std::hint::black_box(make());
        (clock() - start, made)
    };
    let (a, b, (c, made)) = (timed().0, timed().0, timed());
    let mut rounds = [a, b, c];
    rounds.sort_by(f64::total_cmp);
    (rounds[1], made)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_fill_the_box_evenly() {
        let b = Aabb::new([1.0, 2.0], [3.0, 6.0]);
        let points = points(&b, 4000);
        assert!(points.iter().all(|&p| b.contains(p)));
        let quarter = points.iter().filter(|p| p[0] < 2.0 && p[1] < 4.0).count();
        assert!((quarter as f64 - 1000.0).abs() < 20.0);
    }
}
