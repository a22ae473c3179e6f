//! One cell: everything that the maps know of it, and which one a ray meets.

use portolan::field::{ClearanceField, UnknownSpace};
use portolan::geom::vector::{along, norm, scale};
use portolan::store::Store;
use portolan::surface::{RayCast, RayCastSettings, RayCaster};
use serde_json::{Value, json};

use super::ask::Slice;
use super::maps::Maps;
use super::slice::{AXES, Extent, layer_index, value_of};
use super::source::Source;
use crate::engine::Refusal;

/// Rays are followed so far (meters).
const FARTHEST: f64 = 10_000.0;

/// What a ray meets first, and where.
pub(super) struct Met {
    pub(super) cell: [i32; 3],
    /// World (meters).
    pub(super) point: [f64; 3],
    pub(super) on_slice: bool,
}

/// Follows a ray (world) to the surface, seen from its free side, or to what is known of a slice.
pub(super) fn pick(
    maps: &Maps,
    origin: [f64; 3],
    direction: [f64; 3],
    slice: Option<&Slice>,
) -> Result<Option<Met>, Refusal> {
    let length = norm(direction);
    if !(origin.iter().all(|v| v.abs() < 1e9) && length.is_finite() && length > 1e-12) {
        return Err(Refusal::new("a ray needs a finite origin and a direction"));
    }
    let direction = scale(direction, 1.0 / length);
    let settings = RayCastSettings {
        min_weight: Some(maps.tsdf().min_weight()),
        max_range: FARTHEST,
        // The eye is outside of the map: whatever lies between was not observed.
        unknown_tolerance: FARTHEST,
        blind: FARTHEST,
    };
    let lattice = maps.tsdf().lattice();
    let mut met = match RayCaster::new(maps.tsdf().store(), settings).cast(origin, direction) {
        RayCast::Hit(range) => Some((range, false)),
        RayCast::Unknown(_) | RayCast::Outside(_) | RayCast::Free => None,
    };
    if let (Some(slice), Some(extent)) = (slice, Extent::of(maps.tsdf())) {
        let cell = layer_index(slice, slice.at, &extent, lattice)?;
        let k = slice.axis;
        let mut first = extent.first;
        first[k] = cell;
        let range = (lattice.center(first)[k] - origin[k]) / direction[k];
        let value = value_of(slice.field, maps.tsdf(), maps.occupancy(), maps.esdf.as_ref());
        let there = lattice.cell_of(along(origin, direction, range)).map(|mut c| {
            c[k] = cell;
            c
        });
        let inside =
            there.filter(|c| AXES[k].iter().all(|&a| (extent.first[a]..extent.end[a]).contains(&c[a])));
        let shown = inside.is_some_and(|c| !value(c).is_nan());
        if shown && range > 0.0 && met.is_none_or(|(hit, _)| range < hit) {
            met = Some((range, true));
        }
    }
    Ok(met.and_then(|(range, on_slice)| {
        let point = along(origin, direction, range);
        let mut cell = lattice.cell_of(point)?;
        if let (true, Some(slice), Some(extent)) = (on_slice, slice, Extent::of(maps.tsdf())) {
            cell[slice.axis] = layer_index(slice, slice.at, &extent, lattice).ok()?;
        }
        Some(Met { cell, point, on_slice })
    }))
}

/// What is known of a cell; its distance in the Euclidean field only where that was made of the map as it is now.
pub(super) fn describe(maps: &Maps, source: &Source, cell: [i32; 3], origin: [f64; 3]) -> Value {
    let lattice = maps.tsdf().lattice();
    let center = lattice.center(cell);
    let state = maps.tsdf().store().cell(cell);
    let occupancy = maps.occupancy().map(|map| {
        let p = map.probability(center).known();
        json!({ "probability": p, "occupied": map.is_occupied(cell) })
    });
    let esdf = maps.esdf_now().map(|esdf| {
        let distance = esdf.cell(cell);
        let interval = esdf.clearance(center, UnknownSpace::Optimistic);
        let bounds = interval.value().map(|c| [c.lower, c.upper]);
        json!({
            "status": distance.status().word(),
            "distance": distance.value(),
            "lower": bounds.map(|b| b[0]),
            "upper": bounds.map(|b| b[1]),
            "interval": interval.status().word(),
        })
    });
    let color = maps.tsdf().color(center).filter(|c| c.weight > 0);
    json!({
        "cell": cell,
        "center": center,
        "corner": std::array::from_fn::<_, 3, _>(|k| lattice.corner(cell)[k] - origin[k]),
        "distance": state.map(|s| s.distance),
        "weight": state.map(|s| s.weight),
        "status": maps.tsdf().signed_distance(center).status().word(),
        "occupancy": occupancy,
        "esdf": esdf,
        "color": color.map(|c| json!({ "rgb": c.rgb8(), "weight": c.weight() })),
        "truth": source.world().map(|world| world.signed_distance(center)),
    })
}
