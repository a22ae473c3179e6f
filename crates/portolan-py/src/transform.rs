//! The distance transform of masks and labels as one function.

use numpy::{PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use portolan::field::{Label, MaskError, MaskTransform};
use pyo3::prelude::*;

use crate::arrays::{array as array_of, dense, shown};
use crate::fault::{value_error, work};
use crate::indices::indices;

/// What is asked of one array.
#[derive(Clone, Copy)]
struct Question {
    border: bool,
    threads: usize,
    what: What,
}

#[derive(Clone, Copy, PartialEq)]
enum What {
    Distances,
    Squares,
    Signed,
    Nearest,
}

/// Distances, and of which axis the nearest cells have which index: axis by axis, in the order of the array's axes.
type Found = (Vec<f32>, Vec<i32>);

/// What `parallel` asks for: threads at most.
pub(crate) fn threads(parallel: Option<usize>) -> usize {
    match parallel {
        None | Some(0) => usize::MAX,
        Some(n) => n,
    }
}

/// Cells with one spacing for each axis, the fastest first.
fn spacing<const D: usize>(sampling: Option<&Bound<'_, PyAny>>, fortran: bool) -> PyResult<[f64; D]> {
    let Some(given) = sampling.filter(|s| !s.is_none()) else { return Ok([1.0; D]) };
    if let Ok(one) = given.extract::<f64>() {
        return Ok([one; D]);
    }
    let wanted =
        || value_error(format!("sampling: one number, or one for each of {D} axes, is wanted, got {given}"));
    let all: Vec<f64> = given.extract().map_err(|_| wanted())?;
    let mut all = <[f64; D]>::try_from(all).map_err(|_| wanted())?;
    if !fortran {
        all.reverse();
    }
    Ok(all)
}

fn refused(error: MaskError) -> PyErr {
    match error {
        MaskError::Spacing(_) | MaskError::Spacings(..) => value_error(format!("sampling: {error}")),
        MaskError::Labels => {
            value_error(format!("return_indices: {error}; pass mask != 0 to have them as one"))
        }
        MaskError::Border => value_error(format!("return_indices with black_border: {error}")),
        _ => value_error(format!("mask: {error}")),
    }
}

fn transform<T: Label, const D: usize>(
    cells: &[T],
    shape: [usize; D],
    spacing: [f64; D],
    fortran: bool,
    asked: Question,
) -> Result<Found, MaskError> {
    let transform =
        MaskTransform::new(shape)?.spaced(spacing)?.with_border(asked.border).on_threads(asked.threads);
    Ok(match asked.what {
        What::Distances => (transform.label_distances(cells)?, Vec::new()),
        What::Squares => (transform.label_squared_distances(cells)?, Vec::new()),
        What::Signed => (transform.signed_label_distances(cells)?, Vec::new()),
        What::Nearest => {
            let (distance, nearest) = transform.nearest_background(cells)?;
            (distance, indices(&nearest, shape, !fortran, asked.threads))
        }
    })
}

fn of_cells<T: Label + numpy::Element>(
    array: &Bound<'_, PyUntypedArray>,
    sampling: Option<&Bound<'_, PyAny>>,
    fortran: bool,
    asked: Question,
) -> PyResult<Found> {
    let array = array.cast::<PyArrayDyn<T>>()?.try_readonly()?;
    let cells = array.as_slice()?;
    fn run<T: Label, const D: usize>(
        py: Python<'_>,
        cells: &[T],
        shape: &[usize],
        sampling: Option<&Bound<'_, PyAny>>,
        fortran: bool,
        asked: Question,
    ) -> PyResult<Found> {
        let spacing = spacing::<D>(sampling, fortran)?;
        let mut axes = <[usize; D]>::try_from(shape).map_err(|_| value_error("mask: wrong shape"))?;
        if !fortran {
            axes.reverse();
        }
        work(py, || transform(cells, axes, spacing, fortran, asked))?.map_err(refused)
    }
    let (py, shape) = (array.py(), array.shape());
    match shape.len() {
        1 => run::<T, 1>(py, cells, shape, sampling, fortran, asked),
        2 => run::<T, 2>(py, cells, shape, sampling, fortran, asked),
        _ => run::<T, 3>(py, cells, shape, sampling, fortran, asked),
    }
}

/// Labels as they lie in memory: whole numbers without a sign, of which only equality counts.
fn labels<'py>(array: Bound<'py, PyUntypedArray>) -> PyResult<Bound<'py, PyUntypedArray>> {
    let dtype = array.dtype();
    let (kind, size) = (dtype.kind(), dtype.itemsize());
    let bits = match (kind, size) {
        (b'b', _) | (b'u', _) => return Ok(array),
        (b'i', 1) => "u1",
        (b'i' | b'f', 2) => "u2",
        (b'i' | b'f', 4) => "u4",
        (b'i' | b'f', 8) => "u8",
        _ => {
            return Err(value_error(format!("mask: booleans or numbers are wanted, got dtype {dtype}")));
        }
    };
    if kind == b'i' {
        return Ok(array.call_method1("view", (bits,))?.cast_into()?);
    }
    // NaN is not equal to itself, and there are two zeros: adding zero makes one of them.
    let numpy = array.py().import("numpy")?;
    if numpy.call_method1("isnan", (&array,))?.call_method0("any")?.extract()? {
        return Err(value_error("mask: it holds NaN, which is no label"));
    }
    Ok(numpy.call_method1("add", (&array, 0))?.call_method1("view", (bits,))?.cast_into()?)
}

/// Distances, and indices where they are asked for.
type Answer<'py> = (Bound<'py, PyArrayDyn<f32>>, Option<Bound<'py, PyArrayDyn<i32>>>);

fn answer<'py>(
    mask: &Bound<'py, PyAny>,
    sampling: Option<&Bound<'py, PyAny>>,
    asked: Question,
) -> PyResult<Answer<'py>> {
    let py = mask.py();
    let array = dense(mask, "mask")?;
    if !(1..=3).contains(&array.ndim()) {
        let shape = shown(array.shape());
        return Err(value_error(format!("mask: an array of 1, 2 or 3 axes is wanted, got shape {shape}")));
    }
    let array = labels(array)?;
    let shape = array.shape();
    let fortran = !array.is_c_contiguous();
    let dtype = array.dtype();
    let (distance, nearest) = match (dtype.kind(), dtype.itemsize()) {
        (b'b', _) => of_cells::<bool>(&array, sampling, fortran, asked)?,
        (_, 1) => of_cells::<u8>(&array, sampling, fortran, asked)?,
        (_, 2) => of_cells::<u16>(&array, sampling, fortran, asked)?,
        (_, 4) => of_cells::<u32>(&array, sampling, fortran, asked)?,
        _ => of_cells::<u64>(&array, sampling, fortran, asked)?,
    };
    let given =
        |shape: &[usize]| if fortran { shape.iter().rev().copied().collect() } else { shape.to_vec() };
    // As it lies in memory; the axes are turned round after that.
    let distance = array_of(py, distance, &given(shape))?;
    let distance = if fortran { distance.permute(None::<Vec<usize>>)? } else { distance };
    if asked.what != What::Nearest {
        return Ok((distance, None));
    }
    let axes = shape.len();
    let nearest = array_of(py, nearest, &[&[axes], &given(shape)[..]].concat())?;
    let turned = std::iter::once(0).chain((1..=axes).rev()).collect::<Vec<_>>();
    let nearest = if fortran { nearest.permute(Some(turned))? } else { nearest };
    Ok((distance, Some(nearest)))
}

/// Distances of all cells to the nearest cell of another label: the exact Euclidean distance transform.
#[pyfunction]
#[pyo3(signature = (mask, sampling=None, black_border=false, *, return_indices=false, squared=false, parallel=None))]
pub(crate) fn edt<'py>(
    mask: &Bound<'py, PyAny>,
    sampling: Option<&Bound<'py, PyAny>>,
    black_border: bool,
    return_indices: bool,
    squared: bool,
    parallel: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let what = match (return_indices, squared) {
        (false, false) => What::Distances,
        (false, true) => What::Squares,
        (true, false) => What::Nearest,
        (true, true) => return Err(value_error("squared: not with return_indices; square the distances")),
    };
    let asked = Question { border: black_border, threads: threads(parallel), what };
    let (distance, nearest) = answer(mask, sampling, asked)?;
    match nearest {
        None => Ok(distance.into_any()),
        Some(nearest) => Ok((distance, nearest).into_pyobject(mask.py())?.into_any()),
    }
}

/// Distances with a sign: positive in cells with a label, negative in the background.
#[pyfunction]
#[pyo3(signature = (mask, sampling=None, black_border=false, *, parallel=None))]
pub(crate) fn sdf<'py>(
    mask: &Bound<'py, PyAny>,
    sampling: Option<&Bound<'py, PyAny>>,
    black_border: bool,
    parallel: Option<usize>,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let asked = Question { border: black_border, threads: threads(parallel), what: What::Signed };
    Ok(answer(mask, sampling, asked)?.0)
}
