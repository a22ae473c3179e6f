//! Euclidean distances: a snapshot of a mapper's field.

use std::sync::Arc;

use numpy::PyArrayDyn;
use portolan::Answer;
use portolan::field::{Clearance, ClearanceField, UnknownSpace};
use portolan::geom::Aabb;
use portolan::plan::{Demand, Waypoints, check_path};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Answers, Numbers, Points, answers, array, at_points, each, rows};
use crate::dimension::{Either, either};
use crate::fault::{value_error, work};
use crate::path::PathCheck;

/// Euclidean distances to the nearest obstacle. A snapshot: later scans do not change it, and any thread may read it.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Esdf(Arc<Either<portolan::field::Esdf<2>, portolan::field::Esdf<3>>>);

impl Esdf {
    pub(crate) fn new(field: Either<portolan::field::Esdf<2>, portolan::field::Esdf<3>>) -> Self {
        Self(Arc::new(field))
    }
}

/// The word of `unknown`.
fn unknown_of(word: &str) -> PyResult<UnknownSpace> {
    match word {
        "pessimistic" => Ok(UnknownSpace::Pessimistic),
        "optimistic" => Ok(UnknownSpace::Optimistic),
        _ => Err(value_error(format!("unknown: must be pessimistic or optimistic, got {word:?}"))),
    }
}

/// A point's answer: status, distance, gradient.
type WithGradient<const D: usize> = Answer<(f64, [f64; D])>;

/// Distances, gradients and statuses as arrays.
type Gradients<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<u8>>);

fn gradients<'py, const D: usize>(
    py: Python<'py>,
    found: Vec<WithGradient<D>>,
    leading: &[usize],
) -> PyResult<Gradients<'py>> {
    let distances = found.iter().map(|a| a.value().map_or(f64::NAN, |(d, _)| d)).collect();
    let directions = found.iter().map(|a| a.value().map_or([f64::NAN; D], |(_, g)| g)).collect();
    let statuses = found.iter().map(|a| a.status().byte()).collect();
    Ok((array(py, distances, leading)?, rows(py, directions, leading)?, array(py, statuses, leading)?))
}

/// A box of the field: distances and statuses, x fastest.
fn dense<const D: usize>(
    py: Python<'_>,
    field: &portolan::field::Esdf<D>,
    bounds: Option<Aabb<D>>,
) -> PyResult<portolan::field::EsdfGrid<D>> {
    let grid = match &bounds {
        Some(bounds) => field.grid_within(bounds),
        None => field.grid(),
    };
    let Some(grid) = grid else { return Err(value_error("bounds: nothing was observed there")) };
    // As many as an array of a gigabyte holds; more is seldom meant.
    if grid.checked_len().is_none_or(|n| n > 1 << 28) {
        return Err(value_error(format!(
            "bounds: an array of {:?} cells is more than 2^28; ask for a part of it",
            grid.shape
        )));
    }
    work(py, || field.dense(&grid))
}

fn dense_dict<'py, const D: usize>(
    py: Python<'py>,
    cells: &portolan::field::EsdfGrid<D>,
) -> PyResult<Bound<'py, PyDict>> {
    let grid = cells.grid();
    let shape: Vec<_> = grid.shape.iter().rev().copied().collect();
    let all = PyDict::new(py);
    all.set_item("distance", array(py, cells.samples().to_vec(), &shape)?)?;
    all.set_item("status", array(py, cells.status_bytes(), &shape)?)?;
    all.set_item("origin", array(py, grid.lattice.origin.to_vec(), &[D])?)?;
    all.set_item("resolution", grid.lattice.resolution)?;
    Ok(all)
}

#[pymethods]
impl Esdf {
    /// Distances at the points.
    fn distance<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Answers<'py>> {
        let points = Points::in_dimension(points, "points", self.0.dimension())?;
        let found = at_points!(py, &*self.0, points, |field, p| field.distance(p));
        answers(py, found, points.leading())
    }

    /// Distances, and the directions away from the nearest obstacle.
    fn distance_and_gradient<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Gradients<'py>> {
        let points = Points::in_dimension(points, "points", self.0.dimension())?;
        match (&*self.0, points.chunks()?) {
            (Either::Two(field), Either::Two(p)) => {
                gradients(py, each(py, p, |p| field.distance_and_gradient(*p))?, points.leading())
            }
            (Either::Three(field), Either::Three(p)) => {
                gradients(py, each(py, p, |p| field.distance_and_gradient(*p))?, points.leading())
            }
            _ => Err(value_error("points and map are of different dimensions")),
        }
    }

    /// Certified bounds of the distance to the nearest obstacle.
    #[pyo3(signature = (points, *, unknown="pessimistic"))]
    #[expect(clippy::type_complexity)]
    fn clearance<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        unknown: &str,
    ) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<u8>>)>
    {
        let unknown = unknown_of(unknown)?;
        let points = Points::in_dimension(points, "points", self.0.dimension())?;
        let found: Vec<Answer<Clearance>> =
            at_points!(py, &*self.0, points, |field, p| field.clearance(p, unknown));
        // The side is in the sign, as that of distances is: inside of an obstacle the bounds change places.
        let bounds = |a: &Answer<Clearance>| match a.value() {
            Some(c) if c.inside => [-c.upper, -c.lower],
            Some(c) => [c.lower, c.upper],
            None => [f64::NAN; 2],
        };
        let lower = found.iter().map(|a| bounds(a)[0]).collect();
        let upper = found.iter().map(|a| bounds(a)[1]).collect();
        let statuses = found.iter().map(|a| a.status().byte()).collect();
        let leading = points.leading();
        Ok((array(py, lower, leading)?, array(py, upper, leading)?, array(py, statuses, leading)?))
    }

    /// Whether every point of a path has the clearance demanded.
    #[pyo3(signature = (waypoints, clearance, *, unknown="pessimistic", tolerance=1e-3))]
    fn check_path(
        &self,
        py: Python<'_>,
        waypoints: &Bound<'_, PyAny>,
        clearance: f64,
        unknown: &str,
        tolerance: f64,
    ) -> PyResult<PathCheck> {
        let demand = Demand { unknown: unknown_of(unknown)?, tolerance, ..Demand::new(clearance) };
        if !(clearance >= 0.0 && clearance.is_finite()) {
            return Err(value_error(format!(
                "clearance: must be a length in meters, not negative, got {clearance}"
            )));
        }
        if !(tolerance > 0.0) {
            return Err(value_error(format!(
                "tolerance: must be a positive length in meters, got {tolerance}"
            )));
        }
        let points = Points::in_dimension(waypoints, "waypoints", self.0.dimension())?;
        if points.leading().len() != 1 {
            return Err(value_error("waypoints: an array of shape (N, D) is wanted"));
        }
        let bad = |error: portolan::plan::PlanError| value_error(format!("waypoints: {error}"));
        let check = match (&*self.0, points.chunks()?) {
            (Either::Two(field), Either::Two(points)) => {
                let path = Waypoints::new(points.to_vec()).map_err(bad)?;
                work(py, || check_path(field, &path, &demand))?
            }
            (Either::Three(field), Either::Three(points)) => {
                let path = Waypoints::new(points.to_vec()).map_err(bad)?;
                work(py, || check_path(field, &path, &demand))?
            }
            _ => return Err(value_error("waypoints and map are of different dimensions")),
        };
        Ok(PathCheck::of(check))
    }

    /// The field, or a box of it, as an array with x along the last axis.
    #[pyo3(signature = (bounds=None))]
    fn to_array<'py>(
        &self,
        py: Python<'py>,
        bounds: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let bounds = bounds.map(|bounds| Numbers::of(bounds, "bounds")).transpose()?;
        match &*self.0 {
            Either::Two(field) => {
                let corners = bounds.map(|b| b.exactly::<4>()).transpose()?;
                let bounds = corners.map(|[a, b, c, d]| Aabb::new([a, b], [c, d]));
                dense_dict(py, &dense(py, field, bounds)?)
            }
            Either::Three(field) => {
                let corners = bounds.map(|b| b.exactly::<6>()).transpose()?;
                let bounds = corners.map(|[a, b, c, d, e, f]| Aabb::new([a, b, c], [d, e, f]));
                dense_dict(py, &dense(py, field, bounds)?)
            }
        }
    }

    #[getter]
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    #[getter]
    fn resolution(&self) -> f64 {
        either!(&*self.0, field => field.lattice().resolution)
    }

    /// Distances are kept up to here (meters).
    #[getter]
    fn max_distance(&self) -> f32 {
        either!(&*self.0, field => field.max_distance())
    }

    #[getter]
    fn memory_bytes(&self) -> usize {
        either!(&*self.0, field => field.memory_bytes())
    }

    fn __repr__(&self) -> String {
        format!(
            "Esdf({}-D, cells of {} m, up to {} m)",
            self.0.dimension(),
            self.resolution(),
            self.max_distance()
        )
    }
}
