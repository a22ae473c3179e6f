//! Gradients on a raster, for arrows.

use serde_json::json;

use super::ask::Which;
use super::fields::Fields;
use crate::engine::{Refusal, Reply};

/// Arrows, at most.
const MOST: f64 = 20_000.0;

/// Gradients at the middles of squares of `spacing` that lie within `bounds` and the map. The squares are no smaller than
/// cells, and doubled until they are few enough; they stay where they are when the view moves.
pub(super) fn arrows(
    fields: &Fields,
    which: Which,
    bounds: [[f64; 2]; 2],
    spacing: f64,
) -> Result<Reply, Refusal> {
    if !(spacing > 0.0 && spacing.is_finite()) {
        return Err(Refusal::new(format!("arrows are a positive length apart, not {spacing}")));
    }
    let (map, lattice) = (fields.bounds(), fields.grid().lattice);
    let low = [0, 1].map(|k| bounds[0][k].max(map.min[k]));
    let high = [0, 1].map(|k| bounds[1][k].min(map.max[k]));
    let mut spacing = spacing.max(lattice.resolution);
    let count = |spacing: f64| [0, 1].map(|k| ((high[k] - low[k]) / spacing).ceil().max(0.0) + 1.0);
    while count(spacing).iter().product::<f64>() > MOST {
        spacing *= 2.0;
    }
    let range = |k: usize| {
        let of = |v: f64| (v - map.min[k]) / spacing - 0.5;
        // NaN has no arrows.
        of(low[k]).ceil() as i64..of(high[k]).floor() as i64 + 1
    };
    let at = |k: usize, i: i64| map.min[k] + (i as f64 + 0.5) * spacing;
    let raster = range(1).flat_map(|y| range(0).map(move |x| [at(0, x), at(1, y)]));
    let points: Vec<[f64; 2]> = raster.take(MOST as usize).collect();
    let (mut places, mut slopes) = (Vec::new(), Vec::new());
    for (p, gradient) in points.iter().zip(fields.gradients(which, &points)) {
        if let Some(gradient) = gradient {
            places.extend(p.map(|v| v as f32));
            slopes.extend(gradient.map(|v| v as f32));
        }
    }
    Ok(Reply::of(json!({ "spacing": spacing }))?.with("points", places).with("gradients", slopes))
}
