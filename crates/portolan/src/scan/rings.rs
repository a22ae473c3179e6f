//! Finding the rings and the columns of a turning lidar in a bag of points.

use std::f64::consts::TAU;

/// Rings that a lidar may have.
const RINGS: std::ops::RangeInclusive<usize> = 4..=1024;
/// Bins of the histogram of elevations.
const BINS: usize = 8192;

/// Elevations of the rings (radians), descending; `None` where elevations do not gather in rings.
///
/// Rings are runs of well filled bins of a fine histogram, so that single points between them (returns that were moved when
/// the sensor's motion was taken out) do not matter. They must hold nine tenths of the points and be narrow
/// against their distance.
pub(super) fn rings(elevations: &[f32]) -> Option<Vec<f32>> {
    let (low, high) = extent(elevations)?;
    let scale = BINS as f32 / (high - low).max(1e-3);
    let bin = |e: f32| (((e - low) * scale) as usize).min(BINS - 1);
    let mut counts = vec![0u32; BINS];
    elevations.iter().for_each(|&e| counts[bin(e)] += 1);
    let mut filled: Vec<u32> = counts.iter().copied().filter(|&c| c > 0).collect();
    filled.sort_unstable();
    let sparse = (filled[filled.len() * 9 / 10] / 20).max(1);
    let mut runs: Vec<Run> = Vec::new();
    for (b, &count) in counts.iter().enumerate().filter(|(_, c)| **c > sparse) {
        let one = Run { first: b, last: b, points: u64::from(count), weight: f64::from(count) * b as f64 };
        match runs.last_mut() {
            Some(run) if b <= run.last + 2 => *run = run.with(&one),
            _ => runs.push(one),
        }
    }
    let held: u64 = runs.iter().map(|r| r.points).sum();
    if runs.len() < *RINGS.start() || (held as f64) < 0.9 * elevations.len() as f64 {
        return None;
    }
    let width: f64 =
        runs.iter().map(|r| (r.last - r.first + 1) as f64 * r.points as f64).sum::<f64>() / held as f64;
    let runs = whole(runs);
    if !RINGS.contains(&runs.len()) || width > 0.4 * spacing(&runs) {
        return None;
    }
    // Exactly: the mean of each ring's own points, not of its bins.
    let mut sums = vec![(0.0f64, 0u64); runs.len()];
    for &e in elevations {
        let after = runs.partition_point(|r| r.first <= bin(e));
        if after > 0 && bin(e) <= runs[after - 1].last {
            sums[after - 1].0 += f64::from(e);
            sums[after - 1].1 += 1;
        }
    }
    Some(sums.iter().rev().map(|(sum, n)| (sum / *n as f64) as f32).collect())
}

/// Neighboring bins that are well filled.
#[derive(Clone, Copy, Debug)]
struct Run {
    first: usize,
    last: usize,
    points: u64,
    /// Sum of the points' bins.
    weight: f64,
}

impl Run {
    fn with(&self, above: &Self) -> Self {
        Self {
            first: self.first,
            last: above.last,
            points: self.points + above.points,
            weight: self.weight + above.weight,
        }
    }

    fn middle(&self) -> f64 {
        self.weight / self.points as f64
    }

    fn distance(&self, other: &Self) -> f64 {
        (self.middle() - other.middle()).abs()
    }
}

/// Median distance of neighbors (bins); 0 for fewer than two.
fn spacing(runs: &[Run]) -> f64 {
    let mut all: Vec<f64> = runs.windows(2).map(|w| w[0].distance(&w[1])).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

/// One run a ring. Taking the sensor's motion out moves parts of a turn up or down: a ring then shows as several runs.
///
/// Runs with a quarter of the points that rings typically have are rings; two much closer than rings are, which
/// together have no more points than one, are the same; others are rings only where they stand alone, as those of a ring that
/// mostly looks at the sky.
fn whole(runs: Vec<Run>) -> Vec<Run> {
    let held: u64 = runs.iter().map(|r| r.points).sum();
    let mut by_points: Vec<u64> = runs.iter().map(|r| r.points).collect();
    by_points.sort_unstable();
    // Half of all points are in runs of at least so many.
    let mut below = 0;
    let typical = by_points.into_iter().find(|points| {
        below += points;
        2 * below >= held
    });
    let typical = typical.unwrap_or(0);
    let is_strong = |r: &&Run| 4 * r.points >= typical;
    let apart = spacing(&runs.iter().copied().filter(|r| is_strong(&r)).collect::<Vec<_>>());
    let mut rings: Vec<Run> = Vec::new();
    for run in runs.iter().filter(is_strong) {
        match rings.last_mut() {
            Some(ring)
                if ring.distance(run) < 0.4 * apart && 4 * (ring.points + run.points) <= 5 * typical =>
            {
                *ring = ring.with(run);
            }
            _ => rings.push(*run),
        }
    }
    let strong = rings.len();
    for run in runs.iter().filter(|r| !is_strong(r)) {
        // Rings on both sides: among the strong ones by order, among those added since at the end.
        let at = rings[..strong].partition_point(|r| r.first < run.first);
        let near = rings[at.saturating_sub(1)..strong.min(at + 1)].iter().chain(rings[strong..].last());
        if near.map(|r| r.distance(run)).all(|d| d > 0.75 * apart) {
            rings.push(*run);
        }
    }
    rings.sort_unstable_by_key(|r| r.first);
    rings
}

/// Number of columns of a full turn and the azimuth of one of them (radians), from points of known rings.
///
/// The step is the lower quartile of the differences of neighbors on a ring; the number of columns next to it with the
/// most agreement in phase is taken.
pub(super) fn columns(azimuths: &[f32], ring_of: &[u32]) -> Option<(usize, f64)> {
    let mut order: Vec<(u32, f32)> = ring_of.iter().copied().zip(azimuths.iter().copied()).collect();
    order.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut steps: Vec<f32> = order
        .windows(2)
        .filter(|w| w[0].0 == w[1].0)
        .map(|w| w[1].1 - w[0].1)
        .filter(|&d| d > 1e-4)
        .collect();
    if steps.len() < 64 {
        return None;
    }
    let quarter = steps.len() / 4;
    let step = f64::from(*steps.select_nth_unstable_by(quarter, f32::total_cmp).1);
    let guess = (TAU / step).round() as usize;
    let candidates = guess.saturating_sub(guess / 50 + 1)..=guess + guess / 50 + 1;
    let sample = (azimuths.len() / 4096).max(1);
    let coherence = |n: usize| {
        let (mut re, mut im, mut count) = (0.0, 0.0, 0.0);
        for &a in azimuths.iter().step_by(sample) {
            let (sin, cos) = (f64::from(a) * n as f64).sin_cos();
            (re, im, count) = (re + cos, im + sin, count + 1.0);
        }
        (f64::hypot(re, im) / count, im.atan2(re) / n as f64)
    };
    let best = candidates.map(|n| (n, coherence(n))).max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    match best {
        (n, (agreement, phase)) if agreement > 0.5 => Some((n, phase)),
        // Rings that start at azimuths of their own: the step is the same, the phase is nobody's.
        _ => Some((guess, 0.0)),
    }
}

/// Smallest and largest; `None` for fewer than two different values.
pub(super) fn extent(values: &[f32]) -> Option<(f32, f32)> {
    let low = values.iter().copied().fold(f32::INFINITY, f32::min);
    let high = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    (low < high).then_some((low, high))
}
