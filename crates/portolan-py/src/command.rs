//! The command line, inside of the package.

use std::ffi::OsString;

use pyo3::prelude::*;

use crate::fault::{of_command, work};

/// Runs the command line on these words, the name of the program first, as the process that this is; gives the exit status.
#[pyfunction]
pub(crate) fn run(py: Python<'_>, words: Vec<OsString>) -> PyResult<u8> {
    work(py, || portolan_cli::run_as_program(words))
}

/// Runs a command, and raises what it would have printed on stderr.
#[pyfunction]
pub(crate) fn call(py: Python<'_>, words: Vec<OsString>) -> PyResult<()> {
    work(py, || portolan_cli::call(words))?.map_err(|error| of_command(&error))
}
