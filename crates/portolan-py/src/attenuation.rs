//! Hits per meter: a snapshot of a mapper's.

use std::sync::Arc;

use numpy::PyArrayDyn;
use portolan::beam_model::RangeDistribution;
use portolan::geom::vector::unit;
use portolan::store::Store;
use pyo3::prelude::*;

use crate::arrays::{Answers, Points, answers, array, at_points, each};
use crate::dimension::{Either, either};
use crate::fault::value_error;
use crate::tsdf::{check_range, check_rays};

/// Hits of beams over the length of all. A snapshot: later scans do not change it, and any thread may read it.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Attenuation(Arc<Either<portolan::map::Attenuation<2>, portolan::map::Attenuation<3>>>);

impl Attenuation {
    pub(crate) fn new(map: Either<portolan::map::Attenuation<2>, portolan::map::Attenuation<3>>) -> Self {
        Self(Arc::new(map))
    }
}

/// The share of beams that get through all, and the quantiles of the ranges of one ray; NaN where fewer end.
fn predict<const D: usize>(
    py: Python<'_>,
    map: &portolan::map::Attenuation<D>,
    origins: &[[f64; D]],
    directions: &[[f64; D]],
    max_range: f64,
    shares: &[f64],
) -> PyResult<Vec<(f64, Vec<f64>)>> {
    let numbers: Vec<usize> = (0..directions.len()).collect();
    each(py, &numbers, |&i| {
        let origin = if origins.len() == 1 { origins[0] } else { origins[i] };
        let along = unit(directions[i]).and_then(|d| RangeDistribution::along(map, origin, d, max_range));
        match along {
            Some(ranges) => {
                let quantiles = shares.iter().map(|q| ranges.quantile(*q).unwrap_or(f64::NAN)).collect();
                (ranges.passing(), quantiles)
            }
            None => (f64::NAN, vec![f64::NAN; shares.len()]),
        }
    })
}

#[pymethods]
impl Attenuation {
    /// Hits per meter of the cells that hold the points (1/m).
    fn attenuation<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Answers<'py>> {
        let points = Points::in_dimension(points, "points", self.0.dimension())?;
        let found = at_points!(py, &*self.0, points, |map, p| map.attenuation(p));
        answers(py, found, points.leading())
    }

    /// Quantiles of the range that a sensor would read along rays, and the share of beams that read nothing.
    #[pyo3(signature = (origins, directions, *, max_range=100.0, quantiles=vec![0.5]))]
    #[expect(clippy::type_complexity)]
    fn predict_ranges<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        max_range: f64,
        quantiles: Vec<f64>,
    ) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>)> {
        check_range(max_range)?;
        if let Some(q) = quantiles.iter().find(|q| !(0.0..=1.0).contains(*q)) {
            return Err(value_error(format!("quantiles: must be between 0 and 1, got {q}")));
        }
        let d = self.0.dimension();
        let origins = Points::in_dimension(origins, "origins", d)?;
        let directions = Points::in_dimension(directions, "directions", d)?;
        check_rays(&origins, &directions)?;
        let found = match (&*self.0, origins.chunks()?, directions.chunks()?) {
            (Either::Two(map), Either::Two(o), Either::Two(d)) => {
                predict(py, map, o, d, max_range, &quantiles)?
            }
            (Either::Three(map), Either::Three(o), Either::Three(d)) => {
                predict(py, map, o, d, max_range, &quantiles)?
            }
            _ => Vec::new(),
        };
        let passing = found.iter().map(|(passing, _)| *passing).collect();
        let ranges = found.into_iter().flat_map(|(_, ranges)| ranges).collect();
        let leading = directions.leading();
        Ok((array(py, ranges, &[leading, &[quantiles.len()]].concat())?, array(py, passing, leading)?))
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
    fn memory_bytes(&self) -> usize {
        either!(&*self.0, map => map.memory_bytes())
    }

    fn __repr__(&self) -> String {
        format!("Attenuation({}-D, cells of {} m)", self.0.dimension(), self.resolution())
    }
}
