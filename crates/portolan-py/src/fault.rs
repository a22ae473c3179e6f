//! What goes wrong, as Python's exceptions.

use std::panic::{AssertUnwindSafe, catch_unwind};

use portolan::map::MapError;
use portolan_io::IoError;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

pyo3::create_exception!(
    portolan,
    MapFull,
    pyo3::exceptions::PyMemoryError,
    "A map would need more memory than it may have. What was fused before stays."
);

/// A value that cannot be used. `what` names the argument.
pub(crate) fn value_error(text: impl Into<String>) -> PyErr {
    PyValueError::new_err(text.into())
}

/// Why a map did not take a scan.
pub(crate) fn of_map(error: &MapError) -> PyErr {
    match error {
        MapError::Full(_) => MapFull::new_err(error.to_string()),
        _ => value_error(error.to_string()),
    }
}

/// What the command line would have said: `OSError` where the system refused, else `ValueError`.
pub(crate) fn of_command(error: &anyhow::Error) -> PyErr {
    let text = format!("{error:#}");
    let of_system = error.chain().find_map(|cause| match cause.downcast_ref::<IoError>() {
        Some(IoError::Os { cause, .. }) => Some(cause),
        _ => cause.downcast_ref::<std::io::Error>(),
    });
    match of_system.map(std::io::Error::kind) {
        Some(std::io::ErrorKind::NotFound) => pyo3::exceptions::PyFileNotFoundError::new_err(text),
        Some(std::io::ErrorKind::PermissionDenied) => pyo3::exceptions::PyPermissionError::new_err(text),
        Some(_) => PyOSError::new_err(text),
        None => value_error(text),
    }
}

/// Works with the interpreter released. A panic is a fault of portolan's: it becomes a `RuntimeError`.
pub(crate) fn work<T: Send>(py: Python<'_>, f: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(f))).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("unknown");
        PyRuntimeError::new_err(format!("a fault in portolan, please report it: {text}"))
    })
}
