//! Maps of sums: scans in, out and elsewhere, merged and taken apart.

use std::path::PathBuf;
use std::sync::Mutex;

use portolan::geom::Pose;
use portolan::ledger::LedgerError;
use portolan::map::ScanKind;
use portolan::scan::ScanStats;
use portolan_cli::library::ledger_file;
use portolan_io::{Container, MapFile, map_dimension};
use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::dimension::{Either, either};
use crate::fault::{of_command, of_map, value_error, work};
use crate::log::{Log, Scan};
use crate::mapper::Mapper;
use crate::options::{Options, sweep_of, weights_of};
use crate::pose::{AnyPose, pose_of};
use crate::readings::{AnyScan, Readings};
use crate::stats::counts;

type Sums = Either<Box<portolan::Ledger<2>>, Box<portolan::Ledger<3>>>;

/// Whole-number sums of scans, and the list of these scans. See the stubs for its arguments.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Ledger {
    options: Options,
    /// `None` until the first scan says which dimension it is.
    held: Mutex<Option<Sums>>,
}

/// Why a ledger refused.
fn of_ledger(error: &LedgerError) -> PyErr {
    match error {
        LedgerError::Map(error) => of_map(error),
        error => value_error(error.to_string()),
    }
}

fn made<const D: usize>(options: &Options) -> PyResult<Box<portolan::Ledger<D>>> {
    let settings = options.settings::<D>()?;
    // What shapes sums is part of their map: no colors are promised where no sensor sees any.
    let settings = portolan::MapperSettings { color: settings.color && D == 3, ..settings };
    portolan::Ledger::new(settings).map(Box::new).map_err(|error| of_ledger(&error))
}

/// The readings of a scan, and its pose where it has one.
pub(crate) fn scan_of(
    scan: Option<&Bound<'_, PyAny>>,
    readings: Option<&Bound<'_, PyDict>>,
) -> PyResult<(AnyScan, Option<AnyPose>)> {
    if let Some(scan) = scan.and_then(|given| given.cast::<Scan>().ok()) {
        let scan = scan.get();
        return Ok((scan.readings.clone(), Some(scan.pose.clone())));
    }
    let get = |name: &str| match readings {
        Some(readings) => readings.get_item(name).map(|v| v.filter(|v| !v.is_none())),
        None => Ok(None),
    };
    const ARRAYS: [&str; 7] = ["ranges", "bearings", "elevations", "depth", "intrinsics", "colors", "origin"];
    const NUMBERS: [&str; 5] = ["depth_scale", "min_range", "max_range", "no_return", "no_return_free"];
    for key in readings.into_iter().flat_map(|r| r.keys()) {
        let name: String = key.extract()?;
        if !ARRAYS.contains(&&*name) && !NUMBERS.contains(&&*name) {
            return Err(PyTypeError::new_err(format!("{name}: there is no such argument")));
        }
    }
    let mut arrays = Vec::new();
    for name in ARRAYS {
        arrays.push(get(name)?);
    }
    let mut numbers = Vec::new();
    for name in NUMBERS {
        numbers.push(get(name)?.map(|v| v.extract::<f64>()).transpose()?);
    }
    let readings = Readings {
        points: scan,
        ranges: arrays[0].as_ref(),
        bearings: arrays[1].as_ref(),
        elevations: arrays[2].as_ref(),
        depth: arrays[3].as_ref(),
        intrinsics: arrays[4].as_ref(),
        colors: arrays[5].as_ref(),
        origin: arrays[6].as_ref(),
        depth_scale: numbers[0],
        min_range: numbers[1],
        max_range: numbers[2],
        no_return: numbers[3],
        no_return_free: numbers[4],
    };
    Ok((readings.scan()?, None))
}

pub(crate) fn given_pose(pose: Option<&Bound<'_, PyAny>>, own: Option<AnyPose>) -> PyResult<AnyPose> {
    match (pose, own) {
        (Some(pose), _) => pose_of(pose),
        (None, Some(own)) => Ok(own),
        (None, None) => Err(value_error("pose: must be given: where the sensor was, world from sensor")),
    }
}

impl Ledger {
    fn of(options: Options, held: Option<Sums>) -> Self {
        Self { options, held: Mutex::new(held) }
    }

    /// Works on the sums with the interpreter released.
    fn with<T: Send>(&self, py: Python<'_>, f: impl FnOnce(&mut Option<Sums>) -> T + Send) -> PyResult<T> {
        let done = work(py, || {
            let mut held = self.held.lock().ok()?;
            Some(f(&mut held))
        })?;
        done.ok_or_else(|| {
            PyRuntimeError::new_err("the ledger was left half done by a fault; make a new one")
        })
    }

    /// The sums, made now if they are not there.
    fn made<'a>(options: &Options, held: &'a mut Option<Sums>, d: usize) -> PyResult<&'a mut Sums> {
        if held.is_none() {
            *held = Some(if d == 2 { Either::Two(made(options)?) } else { Either::Three(made(options)?) });
        }
        held.as_mut().ok_or_else(|| value_error("there are no sums"))
    }

    /// What a scan does to the sums of its dimension.
    fn change<T: Send>(
        &self,
        py: Python<'_>,
        scan: &AnyScan,
        two: impl FnOnce(&mut portolan::Ledger<2>, &portolan::scan::Scan<2>) -> Result<T, LedgerError> + Send,
        three: impl FnOnce(&mut portolan::Ledger<3>, &portolan::scan::Frame) -> Result<T, LedgerError> + Send,
    ) -> PyResult<T> {
        self.with(py, |held| {
            let done = match (Self::made(&self.options, held, scan.dimension())?, scan) {
                (Either::Two(ledger), Either::Two(scan)) => two(ledger, scan),
                (Either::Three(ledger), Either::Three(frame)) => three(ledger, frame),
                (held, _) => {
                    let (scan, map) = (scan.dimension(), held.dimension());
                    return Err(value_error(format!("the scan is {scan}-D and the map {map}-D")));
                }
            };
            done.map_err(|error| of_ledger(&error))
        })?
    }

    /// Adds or moves a scan: both take a pose.
    fn place(
        &self,
        py: Python<'_>,
        (log, index): (&str, u64),
        scan: &AnyScan,
        pose: AnyPose,
        moves: bool,
    ) -> PyResult<ScanStats> {
        fn one<const D: usize>(
            ledger: &mut portolan::Ledger<D>,
            (log, index): (&str, u64),
            pose: &Pose<D>,
            scan: &(impl ScanKind<D> + Sync),
            moves: bool,
        ) -> Result<ScanStats, LedgerError> {
            match moves {
                true => ledger.repose(log, index, pose, scan).map(|[_, added]| added),
                false => ledger.add(log, index, pose, scan),
            }
        }
        match (pose, scan) {
            (Either::Two(pose), Either::Two(_)) => self.change(
                py,
                scan,
                |ledger, scan| one(ledger, (log, index), &pose, scan, moves),
                |_, _| Err(LedgerError::Without("scan of this dimension")),
            ),
            (Either::Three(pose), Either::Three(_)) => self.change(
                py,
                scan,
                |_, _| Err(LedgerError::Without("scan of this dimension")),
                |ledger, frame| one(ledger, (log, index), &pose, frame, moves),
            ),
            (pose, scan) => Err(value_error(format!(
                "the pose is {}-D and the scan {}-D",
                pose.dimension(),
                scan.dimension()
            ))),
        }
    }

    /// A snapshot, so that two ledgers are never held at once.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Option<Sums>> {
        self.with(py, |held| held.clone())
    }

    /// Adds another one up, or takes it out.
    fn combine(&self, py: Python<'_>, other: &Self, out: bool) -> PyResult<()> {
        fn one<const D: usize>(
            ours: &mut portolan::Ledger<D>,
            theirs: &portolan::Ledger<D>,
            out: bool,
        ) -> Result<(), LedgerError> {
            if out { ours.take_out(theirs) } else { ours.merge(theirs) }
        }
        let Some(theirs) = other.snapshot(py)? else { return Ok(()) };
        self.with(py, |held| {
            let done = match (Self::made(&self.options, held, theirs.dimension())?, &theirs) {
                (Either::Two(ours), Either::Two(theirs)) => one(ours, theirs, out),
                (Either::Three(ours), Either::Three(theirs)) => one(ours, theirs, out),
                _ => return Err(value_error("the two maps are of different dimensions")),
            };
            done.map_err(|error| of_ledger(&error))
        })?
    }

    fn bytes(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        let held = self.snapshot(py)?;
        let Some(held) = held else {
            return Err(value_error("nothing was added yet: an empty ledger has no dimension, and no file"));
        };
        let done = work(py, || match held {
            Either::Two(ledger) => ledger_file(*ledger).to_bytes(),
            Either::Three(ledger) => ledger_file(*ledger).to_bytes(),
        })?;
        done.map_err(|error| of_command(&error.into()))
    }
}

#[pymethods]
impl Ledger {
    #[new]
    #[pyo3(signature = (resolution, *, truncation=None, carve=true, carve_weight=None, weights="constant", sweep=None,
                        occupancy=true, attenuation=true, distances=true, color=true, max_distance=1.0, thin=None,
                        bounds=None, origin=None, memory=None))]
    #[expect(clippy::too_many_arguments)]
    fn new(
        resolution: f64,
        truncation: Option<f64>,
        carve: bool,
        carve_weight: Option<f32>,
        weights: &str,
        sweep: Option<&str>,
        occupancy: bool,
        attenuation: bool,
        distances: bool,
        color: bool,
        max_distance: f64,
        thin: Option<f64>,
        bounds: Option<Vec<f64>>,
        origin: Option<Vec<f64>>,
        memory: Option<usize>,
    ) -> PyResult<Self> {
        let options = Options {
            truncation,
            carve,
            carve_weight,
            weights: weights_of(weights)?,
            sweep: sweep.map(sweep_of).transpose()?,
            occupancy,
            attenuation,
            distances,
            color,
            max_distance,
            thin,
            bounds,
            origin,
            memory: memory.unwrap_or(usize::MAX),
            ..Options::usual(resolution)
        };
        options.check()?;
        let mut held = None;
        if let Some(d) = options.dimension()? {
            Self::made(&options, &mut held, d)?;
        }
        Ok(Self::of(options, held))
    }

    /// Adds a scan.
    #[pyo3(signature = (log, index, scan=None, pose=None, **readings))]
    fn add<'py>(
        &self,
        py: Python<'py>,
        log: &str,
        index: u64,
        scan: Option<&Bound<'py, PyAny>>,
        pose: Option<&Bound<'py, PyAny>>,
        readings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (scan, own) = scan_of(scan, readings)?;
        counts(py, &self.place(py, (log, index), &scan, given_pose(pose, own)?, false)?)
    }

    /// Moves a scan to another pose.
    #[pyo3(signature = (log, index, scan=None, pose=None, **readings))]
    fn repose<'py>(
        &self,
        py: Python<'py>,
        log: &str,
        index: u64,
        scan: Option<&Bound<'py, PyAny>>,
        pose: Option<&Bound<'py, PyAny>>,
        readings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (scan, own) = scan_of(scan, readings)?;
        counts(py, &self.place(py, (log, index), &scan, given_pose(pose, own)?, true)?)
    }

    /// Takes a scan away.
    #[pyo3(signature = (log, index, scan=None, **readings))]
    fn subtract<'py>(
        &self,
        py: Python<'py>,
        log: &str,
        index: u64,
        scan: Option<&Bound<'py, PyAny>>,
        readings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (scan, _) = scan_of(scan, readings)?;
        let stats = self.change(
            py,
            &scan,
            |ledger, scan| ledger.subtract(log, index, scan),
            |ledger, frame| ledger.subtract(log, index, frame),
        )?;
        counts(py, &stats)
    }

    /// Adds scans of a log, by their numbers.
    #[pyo3(signature = (log, indices=None, *, progress=None))]
    fn map<'py>(
        &self,
        py: Python<'py>,
        log: &Bound<'py, Log>,
        indices: Option<Vec<usize>>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let log = log.get();
        let name = log.log.name();
        let indices = indices.unwrap_or_else(|| (0..log.log.len()).collect());
        if let Some(i) = indices.iter().find(|i| **i >= log.log.len()) {
            return Err(value_error(format!("indices: there is no scan {i}, the log has {}", log.log.len())));
        }
        let mut all = ScanStats::default();
        let (mut unreadable, mut first) = (0u64, None);
        for (done, &i) in indices.iter().enumerate() {
            match log.read(py, i)? {
                Ok(scan) => {
                    let number = log.log.number(i) as u64;
                    all += self.place(py, (&name, number), &scan.readings, scan.pose, false)?;
                }
                Err(error) => {
                    unreadable += 1;
                    first.get_or_insert(format!("{error:#}"));
                }
            }
            py.check_signals()?;
            if let Some(progress) = progress {
                progress.call1((done + 1, indices.len()))?;
            }
        }
        let stats = counts(py, &all)?;
        stats.set_item("unreadable", unreadable)?;
        stats.set_item("first_unreadable", first)?;
        Ok(stats)
    }

    /// Adds another ledger.
    fn merge(&self, py: Python<'_>, other: &Bound<'_, Self>) -> PyResult<()> {
        self.combine(py, other.get(), false)
    }

    /// Takes another ledger out.
    fn take_out(&self, py: Python<'_>, other: &Bound<'_, Self>) -> PyResult<()> {
        self.combine(py, other.get(), true)
    }

    /// The maps that follow from the sums.
    fn mapper(&self, py: Python<'_>) -> PyResult<Mapper> {
        let Some(held) = self.snapshot(py)? else { return Err(value_error("nothing was added yet")) };
        let maps = work(py, || match &held {
            Either::Two(ledger) => ledger.mapper().map(Either::Two),
            Either::Three(ledger) => ledger.mapper().map(Either::Three),
        })?;
        let maps = maps.map_err(|error| of_ledger(&error))?;
        let poses = match held {
            Either::Two(ledger) => {
                Either::Two(ledger.scans().iter().map(|(_, _, r)| r.world_from_sensor).collect())
            }
            Either::Three(ledger) => {
                Either::Three(ledger.scans().iter().map(|(_, _, r)| r.world_from_sensor).collect())
            }
        };
        Ok(Mapper::of_maps(self.options.clone(), maps, poses))
    }

    /// Log and number of each scan, in order.
    #[getter]
    fn scans(&self, py: Python<'_>) -> PyResult<Vec<(String, u64)>> {
        self.with(py, |held| match held {
            Some(held) => either!(held, ledger => {
                ledger.scans().iter().map(|(log, index, _)| (log.to_owned(), index)).collect()
            }),
            None => Vec::new(),
        })
    }

    /// Writes a `map.portolan` of the sums.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let bytes = self.bytes(py)?;
        let done = work(py, || {
            use std::io::Write;
            portolan_io::write_atomic(&path, |w| w.write_all(&bytes))
        })?;
        done.map_err(|error| of_command(&error.into()))
    }

    /// The content of its file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.bytes(py)?))
    }

    /// A ledger of the content of its file.
    #[staticmethod]
    #[pyo3(signature = (content, *, memory=None))]
    fn from_bytes(py: Python<'_>, content: Vec<u8>, memory: Option<usize>) -> PyResult<Self> {
        read(py, memory, || Container::parse(content, "bytes".as_ref()))
    }

    /// Reads a `map.portolan` of sums.
    #[staticmethod]
    #[pyo3(signature = (path, *, memory=None))]
    fn load(py: Python<'_>, path: PathBuf, memory: Option<usize>) -> PyResult<Self> {
        let inside = path.join("map.portolan");
        let path = if path.is_dir() { inside } else { path };
        read(py, memory, || Container::open(&path))
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let from_bytes = slf.get_type().getattr("from_bytes")?;
        Ok((from_bytes, (slf.get().to_bytes(py)?,)))
    }

    /// A copy that goes its own way; cells are shared until one of the two changes them.
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        Ok(Self::of(self.options.clone(), self.snapshot(py)?))
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        self.copy(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.copy(py)
    }

    /// Equal scans and equal sums.
    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let (ours, theirs) = (self.snapshot(py)?, other.get().snapshot(py)?);
        work(py, || match (ours, theirs) {
            (Some(Either::Two(a)), Some(Either::Two(b))) => a == b,
            (Some(Either::Three(a)), Some(Either::Three(b))) => a == b,
            (None, None) => true,
            _ => false,
        })
    }

    /// Number of scans.
    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |held| match held {
            Some(held) => either!(held, ledger => ledger.scans().len()),
            None => 0,
        })
    }

    /// 2 or 3; `None` until the first scan.
    #[getter]
    fn dimension(&self, py: Python<'_>) -> PyResult<Option<usize>> {
        self.with(py, |held| held.as_ref().map(Either::dimension))
    }

    /// Edge of a cell (meters).
    #[getter]
    fn resolution(&self) -> f64 {
        self.options.resolution
    }

    /// Bytes that the sums hold: measured.
    #[getter]
    fn memory_bytes(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |held| match held {
            Some(held) => either!(held, ledger => ledger.memory_bytes()),
            None => 0,
        })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (r, scans) = (self.options.resolution, self.__len__(py)?);
        Ok(match self.dimension(py)? {
            Some(d) => format!("Ledger({d}-D, cells of {r} m, {scans} scans)"),
            None => format!("Ledger(cells of {r} m, no scans)"),
        })
    }
}

fn read(
    py: Python<'_>,
    memory: Option<usize>,
    open: impl FnOnce() -> portolan_io::Result<Container> + Send,
) -> PyResult<Ledger> {
    let memory = memory.unwrap_or(usize::MAX);
    let found = work(py, || -> anyhow::Result<Option<Sums>> {
        let container = open()?;
        Ok(match map_dimension(&container)? {
            3 => MapFile::<3>::from_container(&container, memory as u64)?
                .ledger
                .map(|l| Either::Three(Box::new(l))),
            _ => MapFile::<2>::from_container(&container, memory as u64)?
                .ledger
                .map(|l| Either::Two(Box::new(l))),
        })
    })?;
    let Some(mut held) = found.map_err(|error| of_command(&error))? else {
        return Err(value_error(
            "a map of clamped cells, which do not add up; make it with Ledger or `portolan map --ledger`",
        ));
    };
    let resolution = either!(&mut held, ledger => {
        ledger.set_memory(memory);
        ledger.settings().resolution
    });
    Ok(Ledger::of(Options { memory, ..Options::usual(resolution) }, Some(held)))
}
