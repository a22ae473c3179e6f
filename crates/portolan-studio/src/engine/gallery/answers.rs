//! One question to all representations: what is there?

use portolan::geom::vector::norm;
use portolan_chapter::MapRepr;
use portolan_sim::World;
use serde_json::{Value, json};

use super::built::Built;

/// What each answers at a point; `null` where it does not know.
pub(super) fn at(built: &Built, p: [f64; 2]) -> Value {
    let m = &built.measured;
    let grid = m.tsdf.grid();
    let cell = grid.index_of(p).and_then(|i| m.tsdf.store().at(i));
    let limit = norm(grid.aabb().extent());
    json!({
        "at": p,
        "grid": { "occupied": m.occupancy.occupancy(p), "searched": m.occupancy.search_distance_by_rings(p, limit) },
        "tree": { "occupied": m.tree.occupancy(p) },
        "tsdf": { "distance": cell.map(|c| c.distance), "weight": cell.map(|c| c.weight) },
        "esdf": { "distance": m.distance().distance(p).known(), "status": m.distance().distance(p).status().word() },
        "contour": {
            "distance": m.contour.nearest_distance(p),
            "inside": m.contour.is_inside(p),
        },
        "cloud": { "distance": m.cloud.nearest_distance(p) },
        "truth": built.truth.as_ref().map(|world: &World| world.signed_distance(p)),
    })
}
