//! The color of a vertex, in four bytes.

use portolan::map::Tsdf3;
use portolan::store::Store;
use portolan::surface::Mesh;
use portolan::uncertainty::SurfaceSigma;
use serde_json::{Value, json};

use super::ask::ColorBy;
use super::source::Source;

/// The error that is drawn at the end of the ramp, in cells.
const ERROR_CELLS: f64 = 1.0;

/// Four bytes per vertex: red, green, blue, 255 for colors as they were seen; else a step of a ramp, 0, 0, and 255 where
/// there is a value. Zeros for heights, which follow from the positions.
pub(super) fn shades(by: ColorBy, piece: &Mesh, tsdf: &Tsdf3, source: &Source, out: &mut Vec<u8>) {
    let known = |share: f64| [step(share), 0, 0, 255];
    for i in 0..piece.vertices.len() {
        let shade = match by {
            ColorBy::Height => None,
            ColorBy::Color => piece.colors.get(i).map(|&[r, g, b]| [r, g, b, 255]),
            ColorBy::Weight => weight_at(tsdf, piece.vertex_world(i))
                .map(|w| known(f64::from(w) / f64::from(tsdf.rule().w_max))),
            ColorBy::Sigma => source.sigma().and_then(|sigma| {
                let at = sigma.of_distance(tsdf.store(), piece.vertex_world(i), 0.0, [0.0; 3])?;
                Some(known(sigma.share(at)))
            }),
            ColorBy::Passed => source.attenuation().and_then(|map| {
                let cell = map.store().lattice().cell_of(piece.vertex_world(i))?;
                Some(known(1.0 - map.opacity(cell)?))
            }),
            ColorBy::Error => source.world().map(|world| {
                let most = ERROR_CELLS * tsdf.lattice().resolution;
                known(0.5 + 0.5 * world.signed_distance(piece.vertex_world(i)) / most)
            }),
        };
        out.extend(shade.unwrap_or([0; 4]));
    }
}

/// The weight of the cell that holds a place.
fn weight_at(tsdf: &Tsdf3, p_world: [f64; 3]) -> Option<f32> {
    Some(tsdf.store().cell(tsdf.lattice().cell_of(p_world)?)?.weight)
}

/// The step of a ramp of 256.
fn step(share: f64) -> u8 {
    (255.0 * share).round().clamp(0.0, 255.0) as u8
}

/// What the ends of the ramp mean.
pub(super) fn ramp(by: ColorBy, tsdf: &Tsdf3, source: &Source, heights: Option<[f32; 2]>) -> Value {
    match by {
        ColorBy::Height => {
            json!({ "low": heights.map(|h| h[0]), "high": heights.map(|h| h[1]), "unit": "m" })
        }
        ColorBy::Color => Value::Null,
        ColorBy::Passed => json!({ "low": 0.0, "high": 100.0, "unit": "%" }),
        ColorBy::Sigma => source
            .sigma()
            .map(SurfaceSigma::ends)
            .map_or(Value::Null, |[low, high]| json!({ "low": low, "high": high, "unit": "m" })),
        ColorBy::Weight => json!({ "low": 0.0, "high": tsdf.rule().w_max, "unit": "" }),
        ColorBy::Error => {
            let most = ERROR_CELLS * tsdf.lattice().resolution;
            json!({ "low": -most, "high": most, "unit": "m" })
        }
    }
}
