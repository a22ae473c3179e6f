//! Occupancy: a snapshot of a mapper's.

use std::sync::Arc;

use numpy::PyArrayDyn;
use portolan::cell::LogOddsValue;
use portolan::store::Store;
use pyo3::prelude::*;

use crate::arrays::{Answers, Points, answers, array, at_points, rows};
use crate::dimension::{Either, either};
use crate::fault::work;

/// Log odds of being occupied. A snapshot: later scans do not change it, and any thread may read it.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Occupancy(Arc<Either<portolan::map::Occupancy<2>, portolan::map::Occupancy<3>>>);

impl Occupancy {
    pub(crate) fn new(map: Either<portolan::map::Occupancy<2>, portolan::map::Occupancy<3>>) -> Self {
        Self(Arc::new(map))
    }
}

/// Centers and probabilities of the observed cells of a map.
fn cells<const D: usize>(map: &portolan::map::Occupancy<D>, least: f64) -> (Vec<[f64; D]>, Vec<f64>) {
    let lattice = map.store().lattice();
    let mut keys = map.store().keys();
    keys.sort_unstable();
    let (mut centers, mut values) = (Vec::new(), Vec::new());
    for key in keys {
        for i in 0..8usize.pow(D as u32) {
            let cell = key.cell(i);
            let Some(value) = map.store().cell(cell) else { continue };
            let p = value.probability(map.rule());
            if p >= least {
                centers.push(lattice.center(cell));
                values.push(p);
            }
        }
    }
    (centers, values)
}

#[pymethods]
impl Occupancy {
    /// Probability of being occupied of the cells that hold the points.
    fn occupancy<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Answers<'py>> {
        let points = Points::in_dimension(points, "points", self.0.dimension())?;
        let found = at_points!(py, &*self.0, points, |map, p| map.probability(p));
        answers(py, found, points.leading())
    }

    /// Centers of the cells that are occupied with at least this probability, and their probabilities.
    #[pyo3(signature = (least=0.5))]
    #[expect(clippy::type_complexity)]
    fn cells<'py>(
        &self,
        py: Python<'py>,
        least: f64,
    ) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>)> {
        match &*self.0 {
            Either::Two(map) => {
                let (centers, values) = work(py, || cells(map, least))?;
                let n = [values.len()];
                Ok((rows(py, centers, &n)?, array(py, values, &n)?))
            }
            Either::Three(map) => {
                let (centers, values) = work(py, || cells(map, least))?;
                let n = [values.len()];
                Ok((rows(py, centers, &n)?, array(py, values, &n)?))
            }
        }
    }

    #[getter]
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    #[getter]
    fn resolution(&self) -> f64 {
        either!(&*self.0, map => map.store().lattice().resolution)
    }

    #[getter]
    fn observed_cells(&self, py: Python<'_>) -> PyResult<usize> {
        work(py, || either!(&*self.0, map => map.observed_cells()))
    }

    #[getter]
    fn memory_bytes(&self) -> usize {
        either!(&*self.0, map => map.memory_bytes())
    }

    fn __repr__(&self) -> String {
        format!("Occupancy({}-D, cells of {} m)", self.0.dimension(), self.resolution())
    }
}
