//! The mapper: scans in, maps and what follows from them out.

use std::path::PathBuf;
use std::sync::Mutex;

use numpy::PyArrayDyn;
use portolan::geom::Pose;
use portolan::map::MapError;
use portolan::scan::{Frame, Origin, Projection, RangeImage, ScanStats};
use portolan_cli::library::{MapperOfFile, picture_2d, picture_of_mesh, read_mapper, save_2d, save_3d};
use portolan_io::MapFile;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::attenuation::Attenuation;
use crate::dimension::{Either, either};
use crate::esdf::Esdf;
use crate::events::{cells_of, event_dict};
use crate::fault::{of_command, of_map, value_error, work};
use crate::log::{Log, Scan};
use crate::occupancy::Occupancy;
use crate::options::{Options, sweep_of, weights_of};
use crate::pose::{matrices, pose_of};
use crate::readings::{AnyScan, Readings};
use crate::stats::counts;
use crate::surface::{Contour, Mesh};
use crate::tsdf::Tsdf;

/// A mapper and what else its file holds.
struct Held<const D: usize> {
    mapper: portolan::Mapper<D>,
    rest: MapFile<D>,
    /// Whether depth images were fused: their sensor looks along z.
    camera: bool,
}

/// Fuses scans into an occupancy map, signed distances and hits per meter of one lattice. See the stubs for its arguments.
#[pyclass(frozen, module = "portolan")]
pub(crate) struct Mapper {
    options: Options,
    /// `None` until the first scan says which dimension it is.
    held: Mutex<Option<Either<Box<Held<2>>, Box<Held<3>>>>>,
}

type Maps = Option<Either<Box<Held<2>>, Box<Held<3>>>>;

/// A scan reached a mapper of the other dimension.
fn other_dimension(scan: usize, map: usize) -> PyErr {
    value_error(format!("the scan is {scan}-D and the map {map}-D"))
}

impl Mapper {
    /// A mapper that goes on with these maps.
    pub(crate) fn of_maps(
        options: Options,
        maps: Either<portolan::Mapper<2>, portolan::Mapper<3>>,
        poses: Either<Vec<Pose<2>>, Vec<Pose<3>>>,
    ) -> Self {
        let mut held = match maps {
            Either::Two(mapper) => {
                Either::Two(Box::new(Held { mapper, rest: MapFile::default(), camera: false }))
            }
            Either::Three(mapper) => {
                Either::Three(Box::new(Held { mapper, rest: MapFile::default(), camera: false }))
            }
        };
        match (&mut held, poses) {
            (Either::Two(held), Either::Two(poses)) => held.rest.poses = poses,
            (Either::Three(held), Either::Three(poses)) => held.rest.poses = poses,
            _ => {}
        }
        Self { options, held: Mutex::new(Some(held)) }
    }

    /// Works on the maps with the interpreter released.
    fn with<T: Send>(&self, py: Python<'_>, f: impl FnOnce(&mut Maps) -> T + Send) -> PyResult<T> {
        let done = work(py, || {
            let mut held = self.held.lock().ok()?;
            Some(f(&mut held))
        })?;
        done.ok_or_else(|| {
            PyRuntimeError::new_err("the mapper was left half done by a fault; make a new one")
        })
    }

    /// The maps, made now if they are not there.
    fn made<'a>(
        options: &Options,
        maps: &'a mut Maps,
        d: usize,
    ) -> PyResult<&'a mut Either<Box<Held<2>>, Box<Held<3>>>> {
        if maps.is_none() {
            *maps = Some(match d {
                2 => {
                    let mapper = portolan::Mapper::with(options.settings::<2>()?);
                    Either::Two(Box::new(Held { mapper, rest: MapFile::default(), camera: false }))
                }
                _ => {
                    let mapper = portolan::Mapper::with(options.settings::<3>()?);
                    Either::Three(Box::new(Held { mapper, rest: MapFile::default(), camera: false }))
                }
            });
        }
        let maps = maps.as_mut().ok_or_else(|| value_error("there are no maps"))?;
        if maps.dimension() == d { Ok(maps) } else { Err(other_dimension(d, maps.dimension())) }
    }

    pub(crate) fn fuse(
        &self,
        py: Python<'_>,
        pose: Either<Pose<2>, Pose<3>>,
        scan: &AnyScan,
    ) -> PyResult<ScanStats> {
        if pose.dimension() != scan.dimension() {
            return Err(value_error(format!(
                "the pose is {}-D and the scan {}-D",
                pose.dimension(),
                scan.dimension()
            )));
        }
        self.with(py, |maps| {
            let maps = Self::made(&self.options, maps, scan.dimension())?;
            let fused: Result<_, MapError> = match (maps, &pose, scan) {
                (Either::Two(held), Either::Two(pose), Either::Two(scan)) => fuse_one(held, pose, scan),
                (Either::Three(held), Either::Three(pose), Either::Three(frame)) => {
                    let how = held.mapper.settings();
                    if frame_without_rays(frame) && (how.distances || how.attenuation.is_some()) {
                        return Err(value_error(
                            "the points do not say where they were seen from, and so make an occupancy map alone: give the log an \
                             origin or poses, or the mapper distances=False and attenuation=False",
                        ));
                    }
                    let is_depth = |image: &RangeImage| matches!(image.projection, Projection::Pinhole(_));
                    held.camera |= matches!(frame, Frame::Image(image) if is_depth(image));
                    fuse_one(held, pose, frame)
                }
                _ => return Err(value_error("pose, scan and map are of different dimensions")),
            };
            fused.map_err(|error| of_map(&error))
        })?
    }

    /// What there is to see of a map that has no scans yet.
    fn nothing<T>() -> PyResult<T> {
        Err(value_error("nothing was fused yet"))
    }
}

/// Whether a scan is of points that nothing looked at.
fn frame_without_rays(frame: &Frame) -> bool {
    matches!(frame, Frame::Points(scan) if scan.origin == Origin::Unknown)
}

fn fuse_one<const D: usize>(
    held: &mut Held<D>,
    pose: &Pose<D>,
    scan: &(impl portolan::map::ScanKind<D> + Sync),
) -> Result<ScanStats, MapError> {
    let stats = held.mapper.integrate(pose, scan)?;
    held.rest.poses.extend((stats.scans > 0).then_some(*pose));
    Ok(stats)
}

#[pymethods]
impl Mapper {
    #[new]
    #[pyo3(signature = (resolution, *, truncation=None, w_max=None, carve=true, carve_weight=None, weights="constant",
                        sweep=None, occupancy=true, attenuation=true, distances=true, color=true, max_distance=1.0,
                        thin=None, bounds=None, origin=None, memory=None))]
    #[expect(clippy::too_many_arguments)]
    fn new(
        resolution: f64,
        truncation: Option<f64>,
        w_max: Option<f32>,
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
        let (weights, sweep) = (weights_of(weights)?, sweep.map(sweep_of).transpose()?);
        let memory = memory.unwrap_or(usize::MAX);
        let options = Options {
            resolution,
            truncation,
            w_max,
            carve,
            carve_weight,
            weights,
            sweep,
            occupancy,
            attenuation,
            distances,
            color,
            max_distance,
            thin,
            bounds,
            origin,
            memory,
        };
        options.check()?;
        let mut held = None;
        if let Some(d) = options.dimension()? {
            Self::made(&options, &mut held, d)?;
        }
        Ok(Self { options, held: Mutex::new(held) })
    }

    #[pyo3(signature = (points=None, pose=None, *, ranges=None, bearings=None, elevations=None, depth=None, intrinsics=None,
                        depth_scale=None, colors=None, origin=None, min_range=None, max_range=None, no_return=None,
                        no_return_free=None))]
    #[expect(clippy::too_many_arguments)]
    fn integrate<'py>(
        &self,
        py: Python<'py>,
        points: Option<&Bound<'py, PyAny>>,
        pose: Option<&Bound<'py, PyAny>>,
        ranges: Option<&Bound<'py, PyAny>>,
        bearings: Option<&Bound<'py, PyAny>>,
        elevations: Option<&Bound<'py, PyAny>>,
        depth: Option<&Bound<'py, PyAny>>,
        intrinsics: Option<&Bound<'py, PyAny>>,
        depth_scale: Option<f64>,
        colors: Option<&Bound<'py, PyAny>>,
        origin: Option<&Bound<'py, PyAny>>,
        min_range: Option<f64>,
        max_range: Option<f64>,
        no_return: Option<f64>,
        no_return_free: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if let Some(scan) = points.and_then(|given| given.cast::<Scan>().ok()) {
            let scan = scan.get();
            let pose = pose.map_or_else(|| Ok(scan.pose.clone()), pose_of)?;
            return counts(py, &self.fuse(py, pose, &scan.readings)?);
        }
        let Some(pose) = pose else {
            return Err(value_error("pose: must be given: where the sensor was, world from sensor"));
        };
        let pose = pose_of(pose)?;
        let readings = Readings {
            points,
            ranges,
            bearings,
            elevations,
            depth,
            intrinsics,
            depth_scale,
            colors,
            origin,
            min_range,
            max_range,
            no_return,
            no_return_free,
        };
        let scan = readings.scan()?;
        counts(py, &self.fuse(py, pose, &scan)?)
    }

    /// Fuses all scans of a log.
    #[pyo3(signature = (log, *, every=1, progress=None))]
    fn map<'py>(
        &self,
        py: Python<'py>,
        log: &Bound<'py, Log>,
        every: usize,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if every == 0 {
            return Err(value_error("every: must be 1 or more"));
        }
        let log = log.get();
        let mut all = ScanStats::default();
        let (mut unreadable, mut first) = (0u64, None);
        let indices: Vec<_> = (0..log.log.len()).step_by(every).collect();
        for (done, &i) in indices.iter().enumerate() {
            match log.read(py, i)? {
                Ok(scan) => all += self.fuse(py, scan.pose, &scan.readings)?,
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
        let name = log.log.name();
        self.with(py, |maps| {
            if let Some(maps) = maps {
                either!(maps, held => held.rest.header.logs.push(name));
            }
        })?;
        let stats = counts(py, &all)?;
        stats.set_item("unreadable", unreadable)?;
        stats.set_item("first_unreadable", first)?;
        Ok(stats)
    }

    /// The log odds of being occupied, as they are now.
    #[getter]
    fn occupancy(&self, py: Python<'_>) -> PyResult<Option<Occupancy>> {
        self.with(py, |maps| match maps {
            Some(Either::Two(held)) => {
                held.mapper.occupancy().cloned().map(|m| Occupancy::new(Either::Two(m)))
            }
            Some(Either::Three(held)) => {
                held.mapper.occupancy().cloned().map(|m| Occupancy::new(Either::Three(m)))
            }
            None => None,
        })
    }

    /// The signed distances, as they are now.
    #[getter]
    fn tsdf(&self, py: Python<'_>) -> PyResult<Option<Tsdf>> {
        self.with(py, |maps| match maps {
            Some(Either::Two(held)) => held.mapper.tsdf().cloned().map(|m| Tsdf::new(Either::Two(m))),
            Some(Either::Three(held)) => held.mapper.tsdf().cloned().map(|m| Tsdf::new(Either::Three(m))),
            None => None,
        })
    }

    /// Hits per meter, as they are now.
    #[getter]
    fn attenuation(&self, py: Python<'_>) -> PyResult<Option<Attenuation>> {
        self.with(py, |maps| match maps {
            Some(Either::Two(held)) => {
                held.mapper.attenuation().cloned().map(|m| Attenuation::new(Either::Two(m)))
            }
            Some(Either::Three(held)) => {
                held.mapper.attenuation().cloned().map(|m| Attenuation::new(Either::Three(m)))
            }
            None => None,
        })
    }

    /// Euclidean distances to the nearest obstacle, brought up to date with the map.
    fn esdf(&self, py: Python<'_>) -> PyResult<Esdf> {
        let field = self.with(py, |maps| match maps {
            Some(Either::Two(held)) => held.mapper.esdf().cloned().map(|f| Esdf::new(Either::Two(f))),
            Some(Either::Three(held)) => held.mapper.esdf().cloned().map(|f| Esdf::new(Either::Three(f))),
            None => None,
        })?;
        field.map_or_else(
            || {
                Err(value_error(
                    "esdf: there are no signed distances: nothing was fused yet, or distances=False",
                ))
            },
            Ok,
        )
    }

    /// The surface as triangles, of a 3-D map.
    fn mesh(&self, py: Python<'_>) -> PyResult<Mesh> {
        self.with(py, |maps| match maps {
            Some(Either::Three(held)) => Ok(Mesh::new(held.mapper.mesh())),
            Some(Either::Two(_)) => Err(value_error("mesh: the map is 2-D; its surface is contour()")),
            None => Self::nothing(),
        })?
    }

    /// The surface as lines, of a 2-D map.
    fn contour(&self, py: Python<'_>) -> PyResult<Contour> {
        self.with(py, |maps| match maps {
            Some(Either::Two(held)) => Ok(Contour::new(held.mapper.contour())),
            Some(Either::Three(_)) => Err(value_error("contour: the map is 3-D; its surface is mesh()")),
            None => Self::nothing(),
        })?
    }

    /// Watches these cells from now on, and no others.
    fn watch(&self, py: Python<'_>, cells: &Bound<'_, PyAny>) -> PyResult<()> {
        let cells = cells_of(cells)?;
        self.with(py, |maps| {
            let maps = Self::made(&self.options, maps, cells.dimension())?;
            match (maps, cells) {
                (Either::Two(held), Either::Two(cells)) => {
                    held.mapper.prepare([0.0; 2]).map_err(|error| of_map(&error))?;
                    held.mapper.tsdf_mut().map(|tsdf| tsdf.watch(cells))
                }
                (Either::Three(held), Either::Three(cells)) => {
                    held.mapper.prepare([0.0; 3]).map_err(|error| of_map(&error))?;
                    held.mapper.tsdf_mut().map(|tsdf| tsdf.watch(cells))
                }
                _ => None,
            }
            .ok_or_else(|| value_error("watch: there are no signed distances (distances=False)"))
        })?
    }

    /// What the last scan did to the watched cells that it observed.
    #[pyo3(signature = (cell=None))]
    fn fuse_events<'py>(
        &self,
        py: Python<'py>,
        cell: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let wanted = match cell {
            Some(cell) => {
                let array = py.import("numpy")?.call_method1("atleast_2d", (cell,))?;
                Some(cells_of(&array)?)
            }
            None => None,
        };
        let events: Vec<(Vec<i32>, portolan::cell::FusionEvent)> = self.with(py, |maps| match maps {
            Some(maps) => either!(maps, held => held.mapper.tsdf().map_or(Vec::new(), |tsdf| {
                tsdf.events().iter().map(|(cell, event)| (cell.to_vec(), *event)).collect()
            })),
            None => Vec::new(),
        })?;
        let is_wanted = |cell: &[i32]| match &wanted {
            None => true,
            Some(wanted) => either!(wanted, all => all.iter().any(|w| w.as_slice() == cell)),
        };
        events
            .iter()
            .filter(|(cell, _)| is_wanted(cell))
            .map(|(cell, event)| event_dict(py, cell, event))
            .collect()
    }

    /// A copy that goes its own way; cells are shared until one of the two changes them.
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        let held = self.with(py, |maps| {
            maps.as_ref().map(|maps| match maps {
                Either::Two(h) => Either::Two(Box::new(Held {
                    mapper: h.mapper.clone(),
                    rest: h.rest.clone(),
                    camera: h.camera,
                })),
                Either::Three(h) => Either::Three(Box::new(Held {
                    mapper: h.mapper.clone(),
                    rest: h.rest.clone(),
                    camera: h.camera,
                })),
            })
        })?;
        Ok(Self { options: self.options.clone(), held: Mutex::new(held) })
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        self.copy(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.copy(py)
    }

    /// Writes a `map.portolan`.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.with(py, |maps| match maps {
            Some(Either::Two(held)) => save_2d(held.mapper.clone(), held.rest.clone(), &path),
            Some(Either::Three(held)) => save_3d(held.mapper.clone(), held.rest.clone(), &path),
            None => Err(anyhow::anyhow!("{}: nothing was fused, there is no map to write", path.display())),
        })?
        .map_err(|error| of_command(&error))
    }

    /// What notebooks show: cells, contour and path in 2-D, the mesh from sensible views in 3-D.
    fn _repr_png_(&self, py: Python<'_>) -> PyResult<Option<Vec<u8>>> {
        self.with(py, |maps| match maps {
            Some(Either::Two(held)) => picture_2d(held.mapper.clone(), held.rest.clone()),
            Some(Either::Three(held)) => {
                let title =
                    format!("cells of {} m, {} scans", self.options.resolution, held.mapper.stats().scans);
                Ok(picture_of_mesh(&held.mapper.mesh(), &held.rest.poses, held.camera, &title))
            }
            None => Ok(None),
        })?
        .map_err(|error| of_command(&error))
    }

    /// Poses of the fused scans, world from sensor: `(N, 3, 3)` or `(N, 4, 4)`.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let poses = self.with(py, |maps| match maps {
            Some(Either::Two(held)) => Some(Either::Two(held.rest.poses.clone())),
            Some(Either::Three(held)) => Some(Either::Three(held.rest.poses.clone())),
            None => None,
        })?;
        Ok(match poses {
            Some(Either::Two(poses)) => Some(matrices::<2, 3>(py, &poses)?),
            Some(Either::Three(poses)) => Some(matrices::<3, 4>(py, &poses)?),
            None => None,
        })
    }

    /// 2 or 3; `None` until the first scan.
    #[getter]
    fn dimension(&self, py: Python<'_>) -> PyResult<Option<usize>> {
        self.with(py, |maps| maps.as_ref().map(Either::dimension))
    }

    /// Edge of a cell (meters).
    #[getter]
    fn resolution(&self) -> f64 {
        self.options.resolution
    }

    /// What all scans did so far.
    #[getter]
    fn stats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let stats = self.with(py, |maps| match maps {
            Some(maps) => either!(maps, held => *held.mapper.stats()),
            None => ScanStats::default(),
        })?;
        counts(py, &stats)
    }

    /// Bytes that the maps hold: measured.
    #[getter]
    fn memory_bytes(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |maps| match maps {
            Some(maps) => either!(maps, held => held.mapper.memory_bytes()),
            None => 0,
        })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let r = self.options.resolution;
        self.with(py, |maps| match maps {
            Some(maps) => {
                let d = maps.dimension();
                let scans = either!(maps, held => held.rest.header.scans + held.mapper.stats().scans);
                format!("Mapper({d}-D, cells of {r} m, {scans} scans)")
            }
            None => format!("Mapper(cells of {r} m, no scans)"),
        })
    }
}

/// Reads a `map.portolan` as a mapper that goes on with it.
#[pyfunction]
#[pyo3(signature = (path, *, memory=None))]
pub(crate) fn load(py: Python<'_>, path: PathBuf, memory: Option<usize>) -> PyResult<Mapper> {
    let memory = memory.unwrap_or(usize::MAX);
    let read = work(py, || read_mapper(&path, memory))?.map_err(|error| of_command(&error))?;
    let (held, resolution) = match read {
        MapperOfFile::Two(mapper, rest) => {
            let resolution = mapper.settings().resolution;
            (Either::Two(Box::new(Held { mapper: *mapper, rest: *rest, camera: false })), resolution)
        }
        MapperOfFile::Three(mapper, rest) => {
            let resolution = mapper.settings().resolution;
            (Either::Three(Box::new(Held { mapper: *mapper, rest: *rest, camera: false })), resolution)
        }
    };
    let options = Options { memory, ..Options::usual(resolution) };
    Ok(Mapper { options, held: Mutex::new(Some(held)) })
}
