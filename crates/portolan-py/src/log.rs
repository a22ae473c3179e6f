//! Logs, and their scans as arrays.

use std::ffi::OsString;
use std::path::PathBuf;

use numpy::PyArrayDyn;
use portolan::scan::{BeamKind, Frame, Projection, Scan as Beams};
use portolan_cli::library::OpenLog;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;

use crate::arrays::{array, rows};
use crate::dimension::Either;
use crate::fault::{of_command, work};
use crate::pose::{AnyPose, matrix};
use crate::readings::AnyScan;

/// A log of range scans with poses.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Log {
    pub(crate) log: OpenLog,
}

/// A scan of a log.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Scan {
    pub(crate) time: Option<f64>,
    pub(crate) pose: AnyPose,
    pub(crate) readings: AnyScan,
}

impl Log {
    /// A scan, or why it cannot be read.
    pub(crate) fn read(&self, py: Python<'_>, i: usize) -> PyResult<anyhow::Result<Scan>> {
        work(py, || {
            if let Some(stamped) = self.log.scan_2d(i) {
                return Ok(Scan {
                    time: stamped.time,
                    pose: Either::Two(stamped.world_from_sensor),
                    readings: Either::Two(stamped.scan),
                });
            }
            let Some(read) = self.log.scan_3d(i) else {
                anyhow::bail!("scan {i}: beyond the end of the log")
            };
            read.map(|stamped| Scan {
                time: stamped.time,
                pose: Either::Three(stamped.world_from_sensor),
                readings: Either::Three(stamped.frame),
            })
        })
    }
}

/// Opens any log that `portolan map` reads. `options` are words of the command line.
#[pyfunction]
pub(crate) fn open(py: Python<'_>, path: PathBuf, options: Vec<OsString>) -> PyResult<Log> {
    let log = work(py, || OpenLog::open(&path, &options))?.map_err(|error| of_command(&error))?;
    Ok(Log { log })
}

#[pymethods]
impl Log {
    fn __len__(&self) -> usize {
        self.log.len()
    }

    fn __getitem__(&self, py: Python<'_>, index: isize) -> PyResult<Scan> {
        let n = self.log.len();
        let i = if index < 0 { index.checked_add_unsigned(n).unwrap_or(-1) } else { index };
        match usize::try_from(i) {
            Ok(i) if i < n => self.read(py, i)?.map_err(|error| of_command(&error)),
            _ => Err(PyIndexError::new_err(format!("scan {index} of a log of {n}"))),
        }
    }

    #[getter]
    fn dimension(&self) -> usize {
        self.log.dimension()
    }

    #[getter]
    fn name(&self) -> String {
        self.log.name()
    }

    #[getter]
    fn format(&self) -> &'static str {
        self.log.format()
    }

    /// Whether its points are used without rays: they do not say where they were seen from, or it was asked for.
    #[getter]
    fn points_only(&self) -> bool {
        self.log.points_only()
    }

    /// What was chosen, taken for granted and noticed in reading it.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.log.remarks()
    }

    fn __repr__(&self) -> String {
        format!(
            "Log({}, {}, {}-D, {} scans)",
            self.log.name(),
            self.log.format(),
            self.log.dimension(),
            self.log.len()
        )
    }
}

/// A kind of beam as a byte: 0 hit, 1 cut at the largest range, 2 no echo, 3 no information, 4 the robot itself, 5 what
/// moved.
fn kind(kind: BeamKind) -> u8 {
    match kind {
        BeamKind::Hit => 0,
        BeamKind::MaxRange => 1,
        BeamKind::NoReturn => 2,
        BeamKind::Dropped => 3,
        BeamKind::SelfHit => 4,
        BeamKind::Mover => 5,
    }
}

fn hits(scan: &Beams<2>) -> Vec<[f64; 2]> {
    (0..scan.len())
        .filter(|&i| scan.beam(i).is_hit())
        .map(|i| {
            let (beam, origin) = (scan.beam(i), scan.origin(i));
            [0, 1].map(|k| origin[k] + beam.range * beam.direction[k])
        })
        .collect()
}

#[pymethods]
impl Scan {
    /// Seconds of the log's clock; `None` where it has none.
    #[getter]
    fn time(&self) -> Option<f64> {
        self.time
    }

    /// World from sensor, 3 x 3 or 4 x 4.
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        match &self.pose {
            Either::Two(pose) => matrix::<2, 3>(py, pose),
            Either::Three(pose) => matrix::<3, 4>(py, pose),
        }
    }

    /// The surfaces that were hit, in the sensor's frame (meters).
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        match &self.readings {
            Either::Two(scan) => {
                let points = hits(scan);
                let n = points.len();
                rows(py, points, &[n])
            }
            Either::Three(frame) => {
                let points: Vec<[f64; 3]> = match frame {
                    Frame::Points(scan) => scan.points.iter().map(|p| p.map(f64::from)).collect(),
                    Frame::Image(image) => image.points().map(|(_, p)| p).collect(),
                };
                let n = points.len();
                rows(py, points, &[n])
            }
        }
    }

    /// Range of each beam of a planar laser, of each pixel of a lidar's rings (meters); `None` for depth images and points.
    #[getter]
    fn ranges<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        match &self.readings {
            Either::Two(scan) => {
                let ranges = scan.beams().map(|b| b.range).collect();
                array(py, ranges, &[scan.len()]).map(Some)
            }
            Either::Three(Frame::Image(image)) if matches!(image.projection, Projection::Spherical(_)) => {
                let values = image.values.iter().map(|v| f64::from(*v)).collect();
                array(py, values, &[image.rows, image.columns]).map(Some)
            }
            Either::Three(_) => Ok(None),
        }
    }

    /// Bearing of each beam of a planar laser (radians); `None` in 3-D.
    #[getter]
    fn bearings<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        match &self.readings {
            Either::Two(scan) => {
                let bearings = scan.beams().map(|b| b.direction[1].atan2(b.direction[0])).collect();
                array(py, bearings, &[scan.len()]).map(Some)
            }
            Either::Three(_) => Ok(None),
        }
    }

    /// Kind of each beam of a planar laser: 0 hit, 1 cut at the largest range, 2 no echo, 3 no information, 4 the robot
    /// itself, 5 what moved; `None` in 3-D.
    #[getter]
    fn kinds<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<u8>>>> {
        match &self.readings {
            Either::Two(scan) => {
                let kinds = scan.beams().map(|b| kind(b.kind)).collect();
                array(py, kinds, &[scan.len()]).map(Some)
            }
            Either::Three(_) => Ok(None),
        }
    }

    /// Depth of each pixel of a camera (meters); 0 where nothing is known. `None` for other sensors.
    #[getter]
    fn depth<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f32>>>> {
        match &self.readings {
            Either::Three(Frame::Image(image)) if matches!(image.projection, Projection::Pinhole(_)) => {
                array(py, image.values.clone(), &[image.rows, image.columns]).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// `(fx, fy, cx, cy)` of the camera (pixels); `None` for other sensors.
    #[getter]
    fn intrinsics(&self) -> Option<(f64, f64, f64, f64)> {
        match &self.readings {
            Either::Three(Frame::Image(image)) => match &image.projection {
                Projection::Pinhole(c) => Some((c.fx, c.fy, c.cx, c.cy)),
                _ => None,
            },
            _ => None,
        }
    }

    /// Red, green and blue: of each pixel, or of each point. `None` where there are none.
    #[getter]
    fn colors<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<u8>>>> {
        match &self.readings {
            Either::Three(Frame::Image(image)) if !image.colors.is_empty() => {
                rows(py, image.colors.clone(), &[image.rows, image.columns]).map(Some)
            }
            Either::Three(Frame::Points(scan)) if !scan.colors.is_empty() => {
                rows(py, scan.colors.clone(), &[scan.colors.len()]).map(Some)
            }
            _ => Ok(None),
        }
    }

    #[getter]
    fn dimension(&self) -> usize {
        self.readings.dimension()
    }

    fn __repr__(&self) -> String {
        let hits = match &self.readings {
            Either::Two(scan) => scan.beams().filter(|b| b.is_hit()).count(),
            Either::Three(frame) => frame.hits(),
        };
        format!("Scan({}-D, {hits} hits)", self.readings.dimension())
    }
}
