//! Watched cells of signed distances.

use portolan::cell::FusionEvent;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::Points;
use crate::dimension::Either;
use crate::fault::value_error;

/// Indices of cells of either dimension.
pub(crate) type Cells = Either<Vec<[i32; 2]>, Vec<[i32; 3]>>;

/// Indices of cells: an array of shape `(N, D)` of whole numbers.
pub(crate) fn cells_of(given: &Bound<'_, PyAny>) -> PyResult<Cells> {
    fn whole<const D: usize>(points: &[[f64; D]]) -> PyResult<Vec<[i32; D]>> {
        let fits = |v: &f64| v.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(v);
        match points.iter().find(|p| !p.iter().all(fits)) {
            Some(p) => Err(value_error(format!("cells: indices must be whole numbers, got {p:?}"))),
            None => Ok(points.iter().map(|p| p.map(|v| v as i32)).collect()),
        }
    }
    let points = Points::of(given, "cells")?;
    Ok(match points.chunks()? {
        Either::Two(points) => Either::Two(whole(points)?),
        Either::Three(points) => Either::Three(whole(points)?),
    })
}

/// One step of a cell's filter.
pub(crate) fn event_dict<'py>(
    py: Python<'py>,
    cell: &[i32],
    event: &FusionEvent,
) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("cell", cell.to_vec())?;
    for (name, value) in [
        ("before", event.before),
        ("weight_before", event.weight_before),
        ("observation", event.observation),
        ("weight", event.weight),
        ("after", event.after),
        ("weight_after", event.weight_after),
        ("gain", event.gain),
    ] {
        all.set_item(name, value)?;
    }
    Ok(all)
}
