//! What moved, told from what stands still.

use std::sync::Mutex;

use numpy::PyArrayDyn;
use portolan::map::MapError;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::rows;
use crate::dimension::{Either, either};
use crate::fault::{of_map, value_error, work};
use crate::ledger::{given_pose, scan_of};
use crate::log::Scan;
use crate::readings::AnyScan;

type Looks = Either<Box<portolan::movers::Movers<2>>, Box<portolan::movers::Movers<3>>>;
/// A scan without what moved, and the points that moved.
type Parted<'py> = (Scan, Bound<'py, PyArrayDyn<f64>>);

/// How often space was seen open. See the stubs.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Movers {
    pose_sigma: f64,
    memory: usize,
    /// `None` until the first scan says which dimension it is.
    held: Mutex<Option<Looks>>,
}

fn left_half_done() -> PyErr {
    PyRuntimeError::new_err("the looks were left half done by a fault; make new ones")
}

fn of_another_dimension(scan: usize, looks: usize) -> PyErr {
    value_error(format!("scan: is {scan}-D, and the looks are {looks}-D"))
}

#[pymethods]
impl Movers {
    #[new]
    #[pyo3(signature = (pose_sigma=0.03, *, memory=None))]
    fn new(pose_sigma: f64, memory: Option<usize>) -> PyResult<Self> {
        let memory = memory.unwrap_or(usize::MAX);
        portolan::movers::Movers::<2>::new(pose_sigma, [0.0; 2], memory)
            .map_err(|_| value_error(format!("pose_sigma: must be a length above zero, got {pose_sigma}")))?;
        Ok(Self { pose_sigma, memory, held: Mutex::new(None) })
    }

    /// Looks at a scan.
    #[pyo3(signature = (scan=None, pose=None, **readings))]
    fn look(
        &self,
        py: Python<'_>,
        scan: Option<&Bound<'_, PyAny>>,
        pose: Option<&Bound<'_, PyAny>>,
        readings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let (scan, own) = scan_of(scan, readings)?;
        let pose = given_pose(pose, own)?;
        let (sigma, memory) = (self.pose_sigma, self.memory);
        work(py, || {
            let mut held = self.held.lock().map_err(|_| left_half_done())?;
            let made = match (held.take(), &pose) {
                (Some(held), _) => held,
                (None, Either::Two(pose)) => {
                    let new = portolan::movers::Movers::new(sigma, pose.translation, memory);
                    Either::Two(Box::new(new.map_err(|error| of_map(&error))?))
                }
                (None, Either::Three(pose)) => {
                    let new = portolan::movers::Movers::new(sigma, pose.translation, memory);
                    Either::Three(Box::new(new.map_err(|error| of_map(&error))?))
                }
            };
            let looks = held.insert(made);
            let done: Result<_, MapError> = match (&mut *looks, &scan, &pose) {
                (Either::Two(looks), Either::Two(scan), Either::Two(pose)) => looks.look(pose, scan),
                (Either::Three(looks), Either::Three(frame), Either::Three(pose)) => looks.look(pose, frame),
                (looks, scan, _) => return Err(of_another_dimension(scan.dimension(), looks.dimension())),
            };
            done.map(drop).map_err(|error| of_map(&error))
        })?
    }

    /// The scan without what moved, and the points that moved (world).
    #[pyo3(signature = (scan=None, pose=None, **readings))]
    fn split<'py>(
        &self,
        py: Python<'py>,
        scan: Option<&Bound<'py, PyAny>>,
        pose: Option<&Bound<'py, PyAny>>,
        readings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Parted<'py>> {
        let time = scan.and_then(|scan| scan.cast::<Scan>().ok()).and_then(|scan| scan.get().time);
        let (scan, own) = scan_of(scan, readings)?;
        let pose = given_pose(pose, own)?;
        let (readings, gone) = work(py, || {
            let held = self.held.lock().map_err(|_| left_half_done())?;
            Ok::<_, PyErr>(match (held.as_ref(), scan, &pose) {
                (None, scan, _) => (scan, Either::Three(Vec::new())),
                (Some(Either::Two(looks)), Either::Two(scan), Either::Two(pose)) => {
                    let (rest, gone) = looks.split(pose, scan);
                    (AnyScan::Two(rest), Either::Two(gone))
                }
                (Some(Either::Three(looks)), Either::Three(frame), Either::Three(pose)) => {
                    let (rest, gone) = looks.split(pose, frame);
                    (AnyScan::Three(rest), Either::Three(gone))
                }
                (Some(looks), scan, _) => {
                    return Err(of_another_dimension(scan.dimension(), looks.dimension()));
                }
            })
        })??;
        let points = either!(gone, gone => { let n = gone.len(); rows(py, gone, &[n])? });
        Ok((Scan { time, pose, readings }, points))
    }

    fn __repr__(&self) -> String {
        format!("Movers(pose_sigma={})", self.pose_sigma)
    }
}
