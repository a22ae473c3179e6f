//! Where one representation overtakes another.

use super::probes::{Clock, seconds_per_probe};
use crate::map::{Cloud, crossover_resolution, memory_ratio};

/// The memory of a tree against a dense byte array: the formula beside the measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeCrossover {
    /// What the node is.
    pub name: String,
    /// Bytes a node as the formula counts them.
    pub node_bytes: f64,
    /// Edge of a leaf (metres).
    pub resolution: f64,
    /// Resolution at which the tree breaks even (metres), by the formula.
    pub predicted_resolution: f64,
    /// Tree bytes over dense bytes, both at the tree's own resolution, by the formula.
    pub predicted_ratio: f64,
    /// Bytes measured of the tree over those of the dense array, which keeps its own resolution.
    pub measured_ratio: f64,
}

impl TreeCrossover {
    /// Predicts for a plane of `area` square metres with `surface` metres of surface, and measures.
    pub(super) fn new(
        name: &str,
        (node_bytes, resolution): (f64, f64),
        (surface, area): (f64, f64),
        (tree_bytes, dense_bytes): (usize, usize),
    ) -> Self {
        Self {
            name: name.into(),
            node_bytes,
            resolution,
            predicted_resolution: crossover_resolution::<2>(node_bytes, surface, area),
            predicted_ratio: memory_ratio::<2>(node_bytes, surface, area, resolution),
            measured_ratio: tree_bytes as f64 / dense_bytes as f64,
        }
    }
}

/// How many points a cloud may have before its distance query is slower than the ESDF's.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudCrossover {
    /// Points and seconds a query, ascending.
    pub measured: Vec<(usize, f64)>,
    /// Number of points at which the query costs what the ESDF's costs, interpolated between measurements;
    /// `None` where the ESDF is never overtaken: `Some(0)` where it always wins.
    pub points: Option<usize>,
}

/// Measures clouds of growing parts of `points` against `esdf_seconds` a query.
pub(super) fn cloud_crossover(
    clock: &mut Clock<'_>,
    points: &[[f64; 2]],
    probes: &[[f64; 2]],
    esdf_seconds: f64,
) -> CloudCrossover {
    let mut measured = Vec::new();
    let mut n = 1;
    while n <= points.len() {
        let cloud = Cloud::from_points(points.iter().copied().step_by(points.len() / n).take(n));
        let seconds = seconds_per_probe(clock, probes, |p| cloud.nearest_distance(p).unwrap_or(0.0));
        measured.push((n, seconds));
        n *= 4;
    }
    let above = measured.iter().position(|m| m.1 > esdf_seconds);
    let crossing = above.map(|i| match i {
        0 => 0,
        _ => {
            let ((n0, t0), (n1, t1)) = (measured[i - 1], measured[i]);
            // Linear in the logarithm of the number, as the tree's depth is.
            let t = (esdf_seconds - t0) / (t1 - t0);
            ((n0 as f64).ln() * (1.0 - t) + (n1 as f64).ln() * t).exp().round() as usize
        }
    });
    CloudCrossover { measured, points: crossing }
}
