//! The level set of a dense array.

use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use portolan::surface::{Inside, Isosurface, IsosurfaceSettings, isosurface};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::arrays::{array, dense, rows, shown};
use crate::fault::{value_error, work};
use crate::transform::threads;

/// Fewer vertices or triangles are not shared out.
const SHARED: usize = 1 << 15;

/// The same array with this type of values, in the order of memory that is wanted; in place where it is so already.
fn ordered<'py, T: numpy::Element>(
    given: &Bound<'py, PyUntypedArray>,
    dtype: &str,
    fortran: bool,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let fits = if fortran { given.is_fortran_contiguous() } else { given.is_c_contiguous() };
    if fits && let Ok(array) = given.cast::<PyArrayDyn<T>>() {
        return Ok(array.try_readonly()?);
    }
    let options = PyDict::new(given.py());
    options.set_item("dtype", dtype)?;
    options.set_item("order", if fortran { "F" } else { "C" })?;
    let copy = given.py().import("numpy")?.call_method("asarray", (given,), Some(&options))?;
    Ok(copy.cast_into::<PyArrayDyn<T>>()?.try_readonly()?)
}

/// Smallest and largest of the finite samples.
fn extent(samples: &[f32]) -> Option<(f32, f32)> {
    let mut extent = [(f32::INFINITY, f32::NEG_INFINITY); 16];
    let (chunks, rest) = samples.as_chunks::<16>();
    for chunk in chunks {
        for (extent, v) in extent.iter_mut().zip(chunk) {
            extent.0 = if v.is_finite() && *v < extent.0 { *v } else { extent.0 };
            extent.1 = if v.is_finite() && *v > extent.1 { *v } else { extent.1 };
        }
    }
    let rest = rest.iter().filter(|v| v.is_finite()).map(|v| (*v, *v));
    extent.into_iter().chain(rest).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).filter(|e| e.0 <= e.1)
}

/// Axes in the order of the array, lengths in its unit, triangles turned if that mirrors them or if it is asked for.
fn place(found: &mut Isosurface, spacing: [f64; 3], fortran: bool, turned: bool, threads: usize) {
    let scale = spacing.map(|s| s as f32);
    if !fortran || spacing != [1.0; 3] {
        each(&mut found.mesh.vertices, threads, |v| {
            if !fortran {
                v.swap(0, 2);
            }
            for k in 0..3 {
                v[k] *= scale[k];
            }
        });
    }
    let inverse = spacing.map(|s| (1.0 / s) as f32);
    let equal = spacing[0] == spacing[1] && spacing[1] == spacing[2];
    if !fortran || !equal {
        each(&mut found.mesh.normals, threads, |n| {
            if !fortran {
                n.swap(0, 2);
            }
            if !equal {
                let there = [0, 1, 2].map(|k| n[k] * inverse[k]);
                let length = there.iter().map(|v| v * v).sum::<f32>().sqrt();
                *n = if length > 0.0 { there.map(|v| v / length) } else { *n };
            }
        });
    }
    if turned {
        each(&mut found.mesh.triangles, threads, |t| t.swap(0, 2));
    }
}

/// Changes all, many on so many threads at most.
fn each<T: Send>(all: &mut [T], threads: usize, change: impl Fn(&mut T) + Sync) {
    if threads == 1 || all.len() < SHARED {
        all.iter_mut().for_each(change);
    } else {
        // No more chunks than threads, so that no more take part.
        let together = SHARED.max(all.len().div_ceil(threads));
        all.par_chunks_mut(together).for_each(|some| some.iter_mut().for_each(&change));
    }
}

/// Vertices, triangles, and where they are asked for normals and ranges.
type Surface<'py> = (
    Bound<'py, PyArrayDyn<f32>>,
    Bound<'py, PyArrayDyn<i32>>,
    Option<Bound<'py, PyArrayDyn<f32>>>,
    Option<Bound<'py, PyArrayDyn<f32>>>,
);

/// The surface at which the values of an array cross a level, as triangles: marching cubes.
#[pyfunction]
#[pyo3(signature = (volume, level=None, spacing=None, gradient_direction="descent", mask=None, *, normals=true, values=true, parallel=None))]
#[expect(clippy::too_many_arguments, reason = "those of Python")]
pub(crate) fn marching_cubes<'py>(
    volume: &Bound<'py, PyAny>,
    level: Option<f64>,
    spacing: Option<[f64; 3]>,
    gradient_direction: &str,
    mask: Option<&Bound<'py, PyAny>>,
    normals: bool,
    values: bool,
    parallel: Option<usize>,
) -> PyResult<Surface<'py>> {
    let py = volume.py();
    let threads = threads(parallel);
    let descent = match gradient_direction {
        "descent" => true,
        "ascent" => false,
        other => {
            return Err(value_error(format!(
                "gradient_direction: 'descent' or 'ascent' is wanted, got {other:?}"
            )));
        }
    };
    let spacing = spacing.unwrap_or([1.0; 3]);
    if let Some(wrong) = spacing.iter().find(|s| !(**s > 0.0 && s.is_finite())) {
        return Err(value_error(format!("spacing: must be positive and finite, got {wrong}")));
    }
    let volume = dense(volume, "volume")?;
    let [a, b, c] = *volume.shape() else {
        return Err(value_error(format!(
            "volume: an array of 3 axes is wanted, got shape {}",
            shown(volume.shape())
        )));
    };
    if a.min(b).min(c) < 2 {
        return Err(value_error(format!(
            "volume: at least 2 samples are wanted along each axis, got shape {}",
            shown(volume.shape())
        )));
    }
    if a.max(b).max(c) > 1 << 30 {
        return Err(value_error(format!(
            "volume: an axis can have 2^30 samples, got shape {}",
            shown(volume.shape())
        )));
    }
    let fortran = !volume.is_c_contiguous();
    let shape = if fortran { [a, b, c] } else { [c, b, a] };
    let mask = match mask {
        None => None,
        Some(mask) => {
            let mask = dense(mask, "mask")?;
            if mask.shape() != volume.shape() {
                return Err(value_error(format!(
                    "mask: shape {} was given for a volume of shape {}",
                    shown(mask.shape()),
                    shown(volume.shape())
                )));
            }
            if mask.cast::<PyArrayDyn<bool>>().is_err() {
                return Err(value_error("mask: an array of booleans is wanted"));
            }
            Some(ordered::<bool>(&mask, "?", fortran)?)
        }
    };
    let samples = ordered::<f32>(&volume, "f4", fortran)?;
    let (samples, cubes) = (samples.as_slice()?, mask.as_ref().map(|mask| mask.as_slice()).transpose()?);
    let found = work(py, || {
        let level = match level {
            Some(level) if !level.is_finite() => return Err(format!("level: must be finite, got {level}")),
            Some(level) => level,
            None => {
                let (least, most) = extent(samples).ok_or("volume: no value is finite")?;
                f64::from(0.5 * (least + most))
            }
        };
        let inside = Inside::Above;
        let settings =
            IsosurfaceSettings { level, inside, normals, ranges: values, apart: false, cubes, threads };
        let mut found = isosurface(samples, shape, &settings);
        if found.mesh.triangles.is_empty() {
            return match extent(samples) {
                Some((least, most)) if (f64::from(least)..=f64::from(most)).contains(&level) => Ok(None),
                Some((least, most)) => {
                    Err(format!("level: {level} is not among the values of the volume, {least} to {most}"))
                }
                None => Err("volume: no value is finite".into()),
            };
        }
        // Triangles are seen from the smaller values; reversed axes mirror them, so that they are as 'descent' wants them.
        place(&mut found, spacing, fortran, fortran == descent, threads);
        Ok(Some(found))
    })?;
    let Some(Isosurface { mesh, ranges }) = found.map_err(value_error)? else {
        return Err(PyRuntimeError::new_err(
            "no surface at the level: no cube has values on both sides of it",
        ));
    };
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    if i32::try_from(vertices).is_err() {
        return Err(value_error(format!("volume: {vertices} vertices are more than an int32 can count")));
    }
    // In place: types of one size.
    let faces = mesh.triangles.into_iter().map(|t| t.map(|v| v as i32)).collect();
    Ok((
        rows(py, mesh.vertices, &[vertices])?,
        rows(py, faces, &[triangles])?,
        if normals { Some(rows(py, mesh.normals, &[vertices])?) } else { None },
        if values { Some(array(py, ranges, &[vertices])?) } else { None },
    ))
}
