//! portolan as a Python package: the library's maps, questions and files over NumPy arrays, and the command line.
//!
//! Every class holds a map of either dimension ([`dimension::Either`]); which one follows from the shape of what comes in.
//! Work is done with the interpreter released (`fault::work`), arrays are used in place where they are contiguous, and
//! nothing panics across the border.

mod arrays;
mod attenuation;
mod cloud;
mod command;
mod dimension;
mod esdf;
mod events;
mod fault;
mod indices;
mod isosurface;
mod ledger;
mod log;
mod mapper;
mod movers;
mod occupancy;
mod options;
mod path;
mod pose;
mod readings;
mod stats;
mod surface;
mod transform;
mod tsdf;

use pyo3::prelude::*;

#[pymodule]
mod _portolan {
    #[pymodule_export]
    use crate::attenuation::Attenuation;
    #[pymodule_export]
    use crate::cloud::Cloud;
    #[pymodule_export]
    use crate::command::{call, run};
    #[pymodule_export]
    use crate::esdf::Esdf;
    #[pymodule_export]
    use crate::fault::MapFull;
    #[pymodule_export]
    use crate::isosurface::marching_cubes;
    #[pymodule_export]
    use crate::ledger::Ledger;
    #[pymodule_export]
    use crate::log::{Log, Scan, open};
    #[pymodule_export]
    use crate::mapper::{Mapper, load};
    #[pymodule_export]
    use crate::movers::Movers;
    #[pymodule_export]
    use crate::occupancy::Occupancy;
    #[pymodule_export]
    use crate::path::PathCheck;
    #[pymodule_export]
    use crate::surface::{Contour, Mesh};
    #[pymodule_export]
    use crate::transform::{edt, sdf};
    #[pymodule_export]
    use crate::tsdf::{Frontier, Tsdf};

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
