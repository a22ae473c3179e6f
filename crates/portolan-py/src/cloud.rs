//! Points under a k-d tree.

use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::{Points, array, at_points, rows};
use crate::dimension::{Either, either};
use crate::fault::{value_error, work};

/// Points (world, meters), searchable.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Cloud(Either<portolan::map::Cloud<2>, portolan::map::Cloud<3>>);

#[pymethods]
impl Cloud {
    #[new]
    fn new(py: Python<'_>, points: &Bound<'_, PyAny>) -> PyResult<Self> {
        let points = Points::of(points, "points")?;
        let n = points.len();
        let cloud = match points.chunks()? {
            Either::Two(p) => {
                Self(Either::Two(work(py, || portolan::map::Cloud::from_points(p.iter().copied()))?))
            }
            Either::Three(p) => {
                Self(Either::Three(work(py, || portolan::map::Cloud::from_points(p.iter().copied()))?))
            }
        };
        match n - cloud.__len__() {
            0 => Ok(cloud),
            lost => Err(value_error(format!("points: {lost} of {n} are not finite; leave them out"))),
        }
    }

    /// Distances from the points to the nearest of the cloud (meters), unsigned; NaN where the cloud is empty or a point
    /// is not finite.
    fn nearest_distance<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let points = Points::in_dimension(points, "points", self.0.dimension())?;
        let distances =
            at_points!(py, &self.0, points, |cloud, p| cloud.nearest_distance(p).unwrap_or(f64::NAN));
        array(py, distances, points.leading())
    }

    /// The points, in the order in which they came.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        either!(&self.0, cloud => rows(py, cloud.points().to_vec(), &[cloud.points().len()]))
    }

    #[getter]
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    #[getter]
    fn memory_bytes(&self) -> usize {
        either!(&self.0, cloud => cloud.memory_bytes())
    }

    fn __len__(&self) -> usize {
        either!(&self.0, cloud => cloud.points().len())
    }

    fn __repr__(&self) -> String {
        format!("Cloud({}-D, {} points)", self.0.dimension(), self.__len__())
    }
}
