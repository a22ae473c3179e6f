//! Where one representation overtakes another.

use super::probes::{Clock, seconds_per_probe};
use crate::memory::{crossover_resolution, inner_only_node_bytes, memory_ratio};
use portolan::cell::OccupancyModel;
use portolan::geom::{Aabb, Grid, Pose};
use portolan::map::{Cloud, MapError, Quadtree};
use portolan::scan::Scan;
use serde::Serialize;

/// What the textbook's tree stores a node.
pub(super) const CHAPTER_NODE: &str = "chapter's node, 20 B";
/// What ours does.
pub(super) const OUR_NODE: &str = "our node, 9 B an inner one";

/// The memory of a tree against a dense byte array: the formula beside the measurement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TreeCrossover {
    /// What the node is.
    pub name: String,
    /// Bytes a node as the formula counts them.
    pub node_bytes: f64,
    /// Edge of a leaf (meters).
    pub resolution: f64,
    /// Resolution at which the tree breaks even (meters), by the formula.
    pub predicted_resolution: f64,
    /// Tree bytes over dense bytes, both at the tree's own resolution, by the formula.
    pub predicted_ratio: f64,
    /// Bytes measured of the tree over those of the dense array, which keeps its own resolution.
    pub measured_ratio: f64,
}

/// The box that a tree is compared over.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    /// Surface in it (meters).
    pub(super) surface: f64,
    /// Its area (square meters).
    pub(super) area: f64,
    /// Cells of the dense array over it, one byte each.
    pub(super) dense_cells: usize,
}

impl Plane {
    /// Predicts what a tree of leaves of `resolution` (meters) takes, `node_bytes` a node, and compares it with the bytes
    /// that one takes.
    pub(super) fn against(
        &self,
        name: &str,
        node_bytes: f64,
        resolution: f64,
        tree_bytes: usize,
    ) -> TreeCrossover {
        let Self { surface, area, dense_cells } = *self;
        TreeCrossover {
            name: name.into(),
            node_bytes,
            resolution,
            predicted_resolution: crossover_resolution::<2>(node_bytes, surface, area),
            predicted_ratio: memory_ratio::<2>(node_bytes, surface, area, resolution),
            measured_ratio: tree_bytes as f64 / dense_cells as f64,
        }
    }
}

/// Fuses a log into a tree of leaves of each of these sizes (meters) over a box that holds `surface` meters of surface:
/// what the textbook's node and ours take of a dense array over the same cells, by the formula and measured.
///
/// # Errors
/// Where a size or the model is not possible.
pub fn tree_crossovers_at(
    log: &[(Pose<2>, Scan<2>)],
    model: OccupancyModel,
    bounds: &Aabb<2>,
    surface: f64,
    resolutions: &[f64],
) -> Result<Vec<[TreeCrossover; 2]>, MapError> {
    let extent = bounds.extent();
    let of = |&resolution: &f64| {
        // The small number keeps a rounded-up quotient from making one more column.
        let shape = extent.map(|metres| (metres / resolution - 1e-9).ceil().max(1.0) as usize);
        let grid = Grid::new(bounds.min, resolution, shape);
        let mut tree = Quadtree::covering(&grid, model)?;
        for (pose, scan) in log {
            tree.integrate(pose, scan)?;
        }
        let plane = Plane { surface, area: extent[0] * extent[1], dense_cells: grid.len() };
        Ok([
            plane.against(CHAPTER_NODE, 20.0, resolution, 20 * tree.store().nodes()),
            plane.against(OUR_NODE, inner_only_node_bytes::<2>(9.0), resolution, tree.memory_bytes()),
        ])
    };
    resolutions.iter().map(of).collect()
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
    // From one point on is from the first on.
    let crossing = crossing.map(|n| if n == 1 { 0 } else { n });
    CloudCrossover { measured, points: crossing }
}
