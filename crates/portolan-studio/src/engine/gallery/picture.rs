//! What the six panels draw.

use portolan::cell::LogOddsValue;
use portolan::geom::Grid;
use portolan::store::Store;
use portolan::surface::{Ambiguity, level_set};
use portolan_chapter::MapRepr;
use serde_json::json;

use super::built::Built;
use super::report;
use crate::engine::fusion::frame::{self, Lines};
use crate::engine::{Refusal, Reply};

/// Points of the cloud that are drawn, at most; it may hold millions.
const MOST_POINTS: usize = 200_000;
/// Level rings of the Euclidean field that are drawn, at most.
const MOST_RINGS: f64 = 24.0;
/// Spacing of the rings (meters) where that many are enough.
const RING: f64 = 0.25;
/// Where the chance of being occupied would be, of what was never observed.
const UNOBSERVED: u8 = 255;

/// All numbers and all pictures.
pub(super) fn everything(built: &Built) -> Result<Reply, Refusal> {
    let m = &built.measured;
    let (rings, spacing) = rings(built);
    let leaves = leaves(built);
    let points = m.cloud.points();
    let every = points.len().div_ceil(MOST_POINTS).max(1);
    let drawn: Vec<f32> = points.iter().step_by(every).flatten().map(|&v| v as f32).collect();
    let body = json!({
        "revision": built.revision,
        "of": built.of,
        "seconds": built.seconds,
        "costs": report::costs(built),
        "truth_and_trees": report::constants(built),
        "picture": {
            "grid": frame::grid(m.tsdf.grid()),
            "tree": { "origin": m.tree.store().lattice().origin, "resolution": m.tree.store().lattice().resolution },
            "truncation": m.tsdf.config().truncation,
            "ring": spacing,
            "truth": built.truth.as_ref().map(|w| w.boundary().iter().map(|s| [s.a, s.b]).collect::<Vec<_>>()),
            "every": every,
        },
    });
    let contour = Lines::of(&m.contour.polylines());
    Ok(Reply::of(body)?
        .with("occupancy", occupancy(built))
        .with("leaves", leaves.squares)
        .with("leaf_occupancy", leaves.occupancy)
        .with("tsdf", tsdf(built))
        .with("esdf", m.distance().samples().to_vec())
        .with("rings", rings.points)
        .with("ring_starts", rings.starts)
        .with("contour", contour.points)
        .with("contour_starts", contour.starts)
        .with("cloud", drawn))
}

/// P(occupied) as 0 to 254.
fn byte(probability: Option<f64>) -> u8 {
    probability.map_or(UNOBSERVED, |p| (254.0 * p).round() as u8)
}

fn occupancy(built: &Built) -> Vec<u8> {
    let map = &built.measured.occupancy;
    let grid: &Grid<2> = map.store().grid();
    (0..grid.len()).map(|i| byte(map.store().at(i).map(|v| v.probability(map.rule())))).collect()
}

/// The leaves that were observed.
struct Leaves {
    /// Lowest cell x, y and cells along the edge of each.
    squares: Vec<u32>,
    occupancy: Vec<u8>,
}

fn leaves(built: &Built) -> Leaves {
    let map = &built.measured.tree;
    let lattice = *map.store().lattice();
    let mut leaves = Leaves { squares: Vec::new(), occupancy: Vec::new() };
    map.store().for_each_leaf(|leaf| {
        leaves.squares.extend([leaf.cell[0] as u32, leaf.cell[1] as u32, 1 << leaf.height]);
        leaves.occupancy.push(byte(map.occupancy(lattice.center(leaf.cell))));
    });
    leaves
}

/// Signed distances, NaN where nothing was observed.
fn tsdf(built: &Built) -> Vec<f32> {
    let map = &built.measured.tsdf;
    (0..map.grid().len()).map(|i| map.store().at(i).map_or(f32::NAN, |cell| cell.distance)).collect()
}

/// Lines of equal distance in free space, and their spacing (meters).
fn rings(built: &Built) -> (Lines, f64) {
    let field = built.measured.distance();
    let samples = field.samples();
    let most = samples.iter().filter(|d| !d.is_nan()).fold(0.0f32, |a, &d| a.max(d));
    let spacing = RING * (f64::from(most) / (RING * MOST_RINGS)).ceil().max(1.0);
    let mut lines = Vec::new();
    for n in 1..=(f64::from(most) / spacing) as usize {
        let level = (n as f64 * spacing) as f32;
        let lifted: Vec<f32> = samples.iter().map(|d| d - level).collect();
        lines
            .extend(level_set(field.grid(), &lifted, |i| !lifted[i].is_nan(), Ambiguity::Decide).polylines());
    }
    (Lines::of(&lines), spacing)
}
