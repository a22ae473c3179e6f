//! What a check of a path says.

use portolan::plan::Cause;
use pyo3::prelude::*;

/// Whether a path is certified, and if not, where and why.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct PathCheck(portolan::plan::PathCheck);

impl PathCheck {
    pub(crate) fn of(check: portolan::plan::PathCheck) -> Self {
        Self(check)
    }

    fn violation(&self) -> Option<&portolan::plan::PathViolation> {
        match &self.0 {
            portolan::plan::PathCheck::Violated(violation) => Some(violation),
            portolan::plan::PathCheck::Certified(_) => None,
        }
    }

    fn certificate(&self) -> Option<&portolan::plan::PathClearance> {
        match &self.0 {
            portolan::plan::PathCheck::Certified(clearance) => Some(clearance),
            portolan::plan::PathCheck::Violated(_) => None,
        }
    }
}

#[pymethods]
impl PathCheck {
    /// Whether every point of the path has the clearance demanded.
    #[getter]
    fn certified(&self) -> bool {
        self.0.is_certified()
    }

    /// Bounds of the least clearance along a certified path (meters); else `None`.
    #[getter]
    fn clearance(&self) -> Option<(f64, f64)> {
        self.certificate().map(|c| (c.lower, c.upper))
    }

    /// Where a certified path is narrowest (meters along it); else `None`.
    #[getter]
    fn narrowest(&self) -> Option<f64> {
        self.certificate().map(|c| c.at)
    }

    /// The first part that is not certified, from and to (meters along the path); `None` where all is.
    #[getter]
    fn violation_span(&self) -> Option<(f64, f64)> {
        self.violation().map(|v| (v.from, v.to))
    }

    /// Why it is not: `too near`, `unknown`, `outside` or `undecided`; `None` where all is certified.
    #[getter]
    fn cause(&self) -> Option<&'static str> {
        self.violation().map(|v| match v.cause {
            Cause::TooNear => "too near",
            Cause::Unknown => "unknown",
            Cause::Outside => "outside",
            Cause::Undecided => "undecided",
        })
    }

    fn __bool__(&self) -> bool {
        self.0.is_certified()
    }

    fn __repr__(&self) -> String {
        match (self.certificate(), self.violation()) {
            (Some(c), _) => format!("PathCheck(certified, at least {:.3} m at {:.3} m)", c.lower, c.at),
            (_, Some(v)) => {
                format!("PathCheck({} from {:.3} to {:.3} m)", self.cause().unwrap_or(""), v.from, v.to)
            }
            _ => String::new(),
        }
    }
}
