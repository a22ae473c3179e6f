//! Signed distances: a snapshot of a mapper's.

use std::sync::Arc;

use numpy::PyArrayDyn;
use portolan::explore::{FrontierMap, FrontierSettings};
use portolan::geom::vector::unit;
use portolan::surface::{RayCast, RayCastSettings, RayCaster};
use portolan::{Answer, Status};
use pyo3::prelude::*;

use crate::arrays::{Answers, Points, answers, array, at_points, each, rows, shown};
use crate::dimension::{Either, either};
use crate::fault::{value_error, work};

/// Signed distances along rays, up to the truncation. A snapshot: later scans do not change it, and any thread may read it.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Tsdf(Arc<Either<portolan::map::Tsdf<2>, portolan::map::Tsdf<3>>>);

/// Free cells that border on unknown space.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Frontier(Either<portolan::explore::Frontier<2>, portolan::explore::Frontier<3>>);

impl Tsdf {
    pub(crate) fn new(map: Either<portolan::map::Tsdf<2>, portolan::map::Tsdf<3>>) -> Self {
        Self(Arc::new(map))
    }
}

/// Origins and directions of rays: one origin for all, or one each.
fn rays<const D: usize>(origins: &[[f64; D]], directions: &[[f64; D]]) -> Vec<([f64; D], [f64; D])> {
    let origin = |i: usize| if origins.len() == 1 { origins[0] } else { origins[i] };
    directions.iter().enumerate().map(|(i, d)| (origin(i), *d)).collect()
}

/// Refuses origins that are neither one nor as many as directions.
pub(crate) fn check_rays(origins: &Points<'_>, directions: &Points<'_>) -> PyResult<()> {
    if origins.len() == 1 || origins.len() == directions.len() {
        return Ok(());
    }
    Err(value_error(format!(
        "origins: an array of shape {} was given; one point, or one for each of the directions of shape {}, is wanted",
        shown(origins.shape()),
        shown(directions.shape())
    )))
}

/// Refuses a range that is no length.
pub(crate) fn check_range(max_range: f64) -> PyResult<()> {
    match max_range > 0.0 && max_range.is_finite() {
        true => Ok(()),
        false => Err(value_error(format!(
            "max_range: must be a positive, finite length in meters, got {max_range}"
        ))),
    }
}

fn cast<const D: usize>(
    py: Python<'_>,
    map: &portolan::map::Tsdf<D>,
    rays: &[([f64; D], [f64; D])],
    settings: RayCastSettings,
) -> PyResult<Vec<Answer<f64>>> {
    let caster = RayCaster::new(map.store(), settings);
    each(py, rays, |(origin, direction)| {
        let Some(direction) = unit(*direction) else { return Answer::Outside };
        match caster.cast(*origin, direction) {
            RayCast::Hit(range) => Answer::Known(range),
            RayCast::Free => Answer::Saturated(settings.max_range),
            RayCast::Unknown(_) => Answer::Unknown,
            RayCast::Outside(_) => Answer::Outside,
        }
    })
}

fn frontiers_of<const D: usize>(
    map: &portolan::map::Tsdf<D>,
    min_cells: usize,
) -> Vec<portolan::explore::Frontier<D>> {
    let mut frontiers = FrontierMap::new(FrontierSettings { min_cells, ..FrontierSettings::of(map) });
    frontiers.update(map.store());
    frontiers.frontiers()
}

#[pymethods]
impl Tsdf {
    /// The estimates of the cells that hold the points.
    fn distance<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Answers<'py>> {
        let points = Points::in_dimension(points, "points", self.0.dimension())?;
        let found = at_points!(py, &*self.0, points, |map, p| map.signed_distance(p));
        answers(py, found, points.leading())
    }

    /// Ranges at which rays meet the surface.
    #[pyo3(signature = (origins, directions, *, max_range=100.0, unknown_tolerance=0.0, blind=0.0))]
    fn raycast<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        max_range: f64,
        unknown_tolerance: f64,
        blind: f64,
    ) -> PyResult<Answers<'py>> {
        check_range(max_range)?;
        let d = self.0.dimension();
        let origins = Points::in_dimension(origins, "origins", d)?;
        let directions = Points::in_dimension(directions, "directions", d)?;
        check_rays(&origins, &directions)?;
        let how = RayCastSettings { min_weight: None, max_range, unknown_tolerance, blind };
        let found = match (&*self.0, origins.chunks()?, directions.chunks()?) {
            (Either::Two(map), Either::Two(o), Either::Two(d)) => {
                cast(py, map, &rays(o, d), RayCastSettings { min_weight: Some(map.min_weight()), ..how })?
            }
            (Either::Three(map), Either::Three(o), Either::Three(d)) => {
                cast(py, map, &rays(o, d), RayCastSettings { min_weight: Some(map.min_weight()), ..how })?
            }
            _ => Vec::new(),
        };
        answers(py, found, directions.leading())
    }

    /// Colors of the cells that hold the points (red, green, blue), and whether there are any.
    #[expect(clippy::type_complexity)]
    fn color<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyArrayDyn<u8>>, Bound<'py, PyArrayDyn<u8>>)> {
        let points = Points::in_dimension(points, "points", self.0.dimension())?;
        let found = at_points!(py, &*self.0, points, |map, p| map.color(p));
        let status = |there: bool| (if there { Status::Known } else { Status::Unknown }).byte();
        let statuses = found.iter().map(|color| status(color.is_some())).collect();
        let colors: Vec<_> = found.iter().map(|color| color.map_or([0; 3], |color| color.rgb8())).collect();
        Ok((rows(py, colors, points.leading())?, array(py, statuses, points.leading())?))
    }

    /// The borders of the unknown, largest first.
    #[pyo3(signature = (min_cells=10))]
    fn frontiers(&self, py: Python<'_>, min_cells: usize) -> PyResult<Vec<Frontier>> {
        work(py, || match &*self.0 {
            Either::Two(map) => {
                frontiers_of(map, min_cells).into_iter().map(|f| Frontier(Either::Two(f))).collect()
            }
            Either::Three(map) => {
                frontiers_of(map, min_cells).into_iter().map(|f| Frontier(Either::Three(f))).collect()
            }
        })
    }

    #[getter]
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    #[getter]
    fn resolution(&self) -> f64 {
        either!(&*self.0, map => map.lattice().resolution)
    }

    #[getter]
    fn truncation(&self) -> f64 {
        either!(&*self.0, map => map.config().truncation)
    }

    #[getter]
    fn observed_cells(&self, py: Python<'_>) -> PyResult<usize> {
        work(py, || either!(&*self.0, map => map.observed_cells(map.min_weight())))
    }

    #[getter]
    fn memory_bytes(&self) -> usize {
        either!(&*self.0, map => map.memory_bytes())
    }

    fn __repr__(&self) -> String {
        format!(
            "Tsdf({}-D, cells of {} m, truncation {} m)",
            self.0.dimension(),
            self.resolution(),
            self.truncation()
        )
    }
}

#[pymethods]
impl Frontier {
    /// Indices of its free cells.
    #[getter]
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i32>>> {
        either!(&self.0, f => rows(py, f.cells.clone(), &[f.cells.len()]))
    }

    /// Center of the cell nearest to the mean: a goal for a robot.
    #[getter]
    fn middle<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        either!(&self.0, f => array(py, f.middle.to_vec(), &[f.middle.len()]))
    }

    /// Mean of the cell centers.
    #[getter]
    fn centroid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        either!(&self.0, f => array(py, f.centroid.to_vec(), &[f.centroid.len()]))
    }

    /// Unit direction from free to unknown space; `None` where its faces cancel out.
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        either!(&self.0, f => f.normal.map(|n| array(py, n.to_vec(), &[n.len()])).transpose())
    }

    fn __len__(&self) -> usize {
        either!(&self.0, f => f.cells.len())
    }

    fn __repr__(&self) -> String {
        either!(&self.0, f => format!("Frontier({} cells around {:?})", f.cells.len(), f.middle))
    }
}
