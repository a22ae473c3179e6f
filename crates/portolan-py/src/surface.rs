//! Meshes and contours.

use numpy::PyArrayDyn;
use portolan_cli::library::{picture_of_mesh, polylines};
use portolan_io::{SvgStyle, svg_text};
use pyo3::prelude::*;

use crate::arrays::rows;
use crate::fault::{value_error, work};

/// Triangles with shared vertices; normals point to free space.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Mesh(pub(crate) portolan::surface::Mesh);

/// Segments with shared vertices; free space lies on the left of every segment.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Contour(portolan::surface::Contour);

impl Mesh {
    pub(crate) fn new(mesh: portolan::surface::Mesh) -> Self {
        Self(mesh)
    }
}

impl Contour {
    pub(crate) fn new(contour: portolan::surface::Contour) -> Self {
        Self(contour)
    }
}

#[pymethods]
impl Mesh {
    /// Positions (world, meters).
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.0.vertices.len();
        rows(py, (0..n).map(|i| self.0.vertex_world(i)).collect(), &[n])
    }

    /// Triples of vertex indices.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u32>>> {
        rows(py, self.0.triangles.clone(), &[self.0.triangles.len()])
    }

    /// Unit normals of the vertices; zero where undefined. `None` where there are none.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f32>>>> {
        let there = !self.0.normals.is_empty();
        there.then(|| rows(py, self.0.normals.clone(), &[self.0.normals.len()])).transpose()
    }

    /// Red, green and blue of the vertices. `None` where there are none.
    #[getter]
    fn colors<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<u8>>>> {
        let there = !self.0.colors.is_empty();
        there.then(|| rows(py, self.0.colors.clone(), &[self.0.colors.len()])).transpose()
    }

    /// Area of all triangles (square meters).
    #[getter]
    fn area(&self) -> f64 {
        self.0.area()
    }

    /// What notebooks show: the mesh from sensible views.
    fn _repr_png_(&self, py: Python<'_>) -> PyResult<Option<Vec<u8>>> {
        work(py, || picture_of_mesh(&self.0, &[], false, "mesh"))
    }

    fn __len__(&self) -> usize {
        self.0.triangles.len()
    }

    fn __repr__(&self) -> String {
        format!("Mesh({} vertices, {} triangles)", self.0.vertices.len(), self.0.triangles.len())
    }
}

#[pymethods]
impl Contour {
    /// Positions (world, meters).
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        rows(py, self.0.vertices.clone(), &[self.0.vertices.len()])
    }

    /// Pairs of vertex indices.
    #[getter]
    fn segments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u32>>> {
        rows(py, self.0.segments.clone(), &[self.0.segments.len()])
    }

    /// The lines that the segments make, an array of points each; closed ones repeat their first point.
    #[pyo3(name = "polylines")]
    fn lines<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArrayDyn<f64>>>> {
        let array = |points: Vec<_>| {
            let n = points.len();
            rows(py, points, &[n])
        };
        polylines(&self.0).into_iter().map(array).collect()
    }

    /// Length of all segments (meters).
    #[getter]
    fn length(&self) -> f64 {
        self.0.length()
    }

    /// What notebooks show: the lines, one unit a meter.
    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        let text =
            work(py, || svg_text(&polylines(&self.0), &SvgStyle { size_px: 600.0, ..SvgStyle::default() }))?;
        text.map_err(|error| value_error(error.to_string()))
    }

    fn __len__(&self) -> usize {
        self.0.segments.len()
    }

    fn __repr__(&self) -> String {
        format!("Contour({} segments, {:.2} m)", self.0.segments.len(), self.0.length())
    }
}
