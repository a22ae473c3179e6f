//! What both fields say of one point: of the Euclidean one exactly what `query` prints.

use portolan::Answer;
use portolan::field::{Clearance, ClearanceField, SparseEsdf, UnknownSpace};
use portolan::map::{MapRepr, Tsdf2};
use portolan_io::{AnswerRow, AnswerStatus, write_answer};
use serde_json::{Value, json};

use super::fields::{Fields, Sample, length};
use crate::engine::Refusal;

/// Cells that a field is maintained beyond what is said of it; as in `query`, so that a saturated answer is a certified
/// one.
const BEYOND: f64 = 2.0;

/// The answer for the page: numbers of both fields, and the row of `query`.
pub(super) fn tell(
    tsdf: &Tsdf2,
    fields: &Fields,
    p: [f64; 2],
    unknown: UnknownSpace,
) -> Result<Value, Refusal> {
    let row = row(tsdf, &fields.euclidean, p, unknown);
    let mut line = Vec::new();
    write_answer(&mut line, &row).map_err(Refusal::new)?;
    let kept = fields.truncated(p);
    let sample = match kept {
        Answer::Known(s) | Answer::Saturated(s) => Some(s),
        Answer::Unknown | Answer::Outside => None,
    };
    Ok(json!({
        "at": p,
        "cell": tsdf.grid().lattice.cell_of(p),
        "row": String::from_utf8_lossy(&line).trim_end(),
        "euclidean": {
            "status": row.status.word(),
            "distance": row.distance,
            "gradient": row.gradient,
            "norm": length(row.gradient),
            "lower": row.lower,
            "upper": row.upper,
            "occupancy": row.occupancy,
        },
        // It certifies nothing: what it keeps is measured along beams, not to the nearest surface.
        "truncated": {
            "status": kept.status(),
            "distance": sample.map(|s| s.0),
            "gradient": sample.map(|s| s.1),
            "norm": length(sample.map(|s| s.1)),
        },
    }))
}

/// The row that `query` prints for a `map.portolan` of this map, with `--unknown` as given.
pub(super) fn row(tsdf: &Tsdf2, field: &SparseEsdf<2>, p: [f64; 2], unknown: UnknownSpace) -> AnswerRow<2> {
    let mut row = AnswerRow {
        point: p,
        status: AnswerStatus::Unknown,
        occupancy: tsdf.occupancy(p),
        distance: None,
        lower: None,
        upper: None,
        gradient: None,
    };
    match in_box(tsdf, field, p) {
        Answer::Known((d, gradient)) => {
            row.status = AnswerStatus::Known;
            (row.distance, row.gradient) = (Some(d), Some(gradient));
        }
        Answer::Saturated((d, _)) => {
            row.status = AnswerStatus::Saturated;
            (row.distance, row.lower) = (Some(d), Some(d.abs()));
        }
        Answer::Unknown => return row,
        Answer::Outside => {
            row.status = AnswerStatus::Outside;
            return row;
        }
    }
    certify(field, unknown, &mut row);
    row
}

/// A map of the plane is a box: what lies outside does not depend on where something was seen.
fn in_box(tsdf: &Tsdf2, field: &SparseEsdf<2>, p: [f64; 2]) -> Answer<Sample> {
    match field.distance_and_gradient(p) {
        _ if !tsdf.grid().aabb().contains(p) => Answer::Outside,
        Answer::Outside => Answer::Unknown,
        answer => answer,
    }
}

/// Fills in the bounds, and what nothing is nearer than.
fn certify(field: &SparseEsdf<2>, unknown: UnknownSpace, row: &mut AnswerRow<2>) {
    let limit = f64::from(field.max_distance()) - BEYOND * field.lattice().resolution;
    let surface = bounds(field, row.point, UnknownSpace::Optimistic);
    let far = surface.is_some_and(|c| c.lower >= limit);
    if far {
        row.status = AnswerStatus::Saturated;
        row.distance = row.distance.map(|d| limit.copysign(d));
        row.gradient = None;
    }
    let surface_only = unknown == UnknownSpace::Optimistic;
    let asked = if surface_only { surface } else { bounds(field, row.point, unknown) };
    row.lower = asked.map(|c| if far { c.lower.min(limit) } else { c.lower });
    row.upper = asked.map(|c| c.upper).filter(|u| u.is_finite() && !(far && surface_only));
}

fn bounds(field: &SparseEsdf<2>, p: [f64; 2], unknown: UnknownSpace) -> Option<Clearance> {
    match field.clearance(p, unknown) {
        Answer::Known(c) | Answer::Saturated(c) => Some(c),
        Answer::Unknown | Answer::Outside => None,
    }
}
