//! Whether scans fit together.

use portolan::geom::vector::{distance, dot, sub};

/// Points of a scan whose nearest neighbors are searched, and points of each other scan to search among.
const QUERIES: usize = 64;
/// See [`QUERIES`].
const TARGETS: usize = 2000;
/// Scans from places nearer than this see each other's surfaces whatever their poses mean (meters).
const APART: f64 = 0.1;

/// A scan in the world: some of its points, and where the sensor stood (meters).
pub(super) struct Placed {
    pub(super) points: Vec<[f64; 3]>,
    pub(super) position: [f64; 3],
}

impl Placed {
    /// Every n-th point, so that at most [`TARGETS`] are there.
    pub(super) fn thinned(count: usize, point: impl Fn(usize) -> [f64; 3], position: [f64; 3]) -> Self {
        let step = count.div_ceil(TARGETS).max(1);
        Self { points: (0..count).step_by(step).map(point).collect(), position }
    }
}

/// Median distance (meters) from points of each scan to the nearest point of all scans from other places. `None` where no
/// two scans are from places apart. O(scans^2) with some 10^5 distances a pair: 20 ms for twelve scans.
pub(super) fn disagreement(scans: &[Placed]) -> Option<f64> {
    let mut all = Vec::new();
    for scan in scans {
        let others = scans.iter().filter(|o| distance(o.position, scan.position) > APART);
        let targets: Vec<&[f64; 3]> = others.flat_map(|o| &o.points).collect();
        if targets.is_empty() {
            continue;
        }
        let step = scan.points.len().div_ceil(QUERIES).max(1);
        for query in scan.points.iter().step_by(step) {
            let squares = targets.iter().map(|t| sub(**t, *query)).map(|d| dot(d, d));
            all.push(squares.fold(f64::INFINITY, f64::min));
        }
    }
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).map(|d| d.sqrt())
}
