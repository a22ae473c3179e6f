//! From a log to fused maps: what of a run differs by dimension.

use std::collections::BTreeMap;

use anyhow::bail;
use portolan::geom::{Grid, Pose};
use portolan::map::{Occupancy, Tsdf3};
use portolan::scan::Scan;
use portolan::store::Store;
use portolan_io::scan_log::ScanLog;
use portolan_io::{Container, map_dimension, CarmenLog, ColorBricks, MapFile, OccupancyBricks, TsdfBricks};
use serde_json::Map;

use super::extent::{Extent, check_memory, grid_over, seen, with_outlier};
use super::fuse::{Frames, FusionReport, fuse_2d, fuse_3d};
use super::grow::grown;
use super::map_server::grid_of;
use super::{MapKind, Maps, Maps2, Maps3, Settings, recipe};
use crate::log::{self, Log};
use crate::progress::Progress;
use crate::saved;

/// What a run may use, and the names that its errors give.
pub(crate) struct Limits<'a> {
    /// Bytes.
    pub(crate) memory: usize,
    /// The log.
    pub(crate) log: &'a str,
    /// The map to go on with.
    pub(crate) map: &'a str,
}

/// Scans that are to be fused, and the maps for them.
pub(crate) enum Mapper<'a> {
    Two { scans: Vec<(Pose<2>, Scan<2>)>, grid: Grid<2>, maps: Maps2, file: Box<MapFile<2>> },
    Three { frames: Frames<'a>, maps: Maps3, file: Box<MapFile<3>> },
}

impl<'a> Mapper<'a> {
    /// Prepares to fuse these scans of a log into new maps, or into those of a file.
    pub(crate) fn new(
        log: &'a Log,
        indices: &'a [usize],
        settings: &Settings,
        before: Option<AnyMapFile>,
        limits: &Limits,
    ) -> anyhow::Result<Self> {
        match log {
            Log::Two(log) => Self::new_2d(log, indices, settings, before.and_then(saved::in_2d), limits),
            Log::Three(log) => Self::new_3d(log, indices, settings, before.and_then(saved::in_3d), limits),
        }
    }

    /// Dense maps over the box of all that the scans see: these are read first.
    fn new_2d(
        log: &CarmenLog,
        indices: &[usize],
        settings: &Settings,
        before: Option<Box<MapFile<2>>>,
        limits: &Limits,
    ) -> anyhow::Result<Self> {
        let scans = log::scans(log, indices, &settings.limits().limits(log));
        let saved_grid = before.as_deref().and_then(grid_of);
        let grid = grid_over(seen(&scans), settings, saved_grid, limits.log)
            .and_then(|grid| {
                check_memory(&grid, settings, &scans, limits.memory as u64, limits.log).map(|()| grid)
            })
            .map_err(|error| with_outlier(error, &scans))?;
        let Some(mut file) = before else {
            let maps = Maps2::new(settings, &grid)?;
            return Ok(Self::Two { scans, grid, maps, file: Box::default() });
        };
        let carve = settings.shape.carve;
        let saved = Maps2 { grid: file.grid.take(), tree: file.tree.take(), tsdf: file.tsdf.take(), carve };
        let held = [
            (MapKind::Grid, saved.grid.is_some()),
            (MapKind::Tree, saved.tree.is_some()),
            (MapKind::Tsdf, saved.tsdf.is_some()),
        ];
        check_held(settings, &held, limits.map)?;
        Ok(Self::Two { scans, grid, maps: grown(saved, &grid)?, file })
    }

    /// Maps in bricks, which grow with what is seen: frames are read while they are fused.
    fn new_3d(
        log: &'a ScanLog,
        indices: &'a [usize],
        settings: &Settings,
        before: Option<Box<MapFile<3>>>,
        limits: &Limits,
    ) -> anyhow::Result<Self> {
        let bounds = settings.bounds.map(|bounds| bounds.in_3d("the log")).transpose()?;
        let filter = settings.shape.range.filter(settings.shape.self_filter.clone())?;
        let frames = Frames { log, indices, filter };
        let (mut maps, file) = match before {
            Some(mut file) => (saved_3d(&mut file, settings, limits)?, file),
            None => {
                let origin = recipe::origin(log.pose(0).translation, settings.resolution());
                (Maps3::new(settings, origin, limits.memory)?, Box::default())
            }
        };
        if let Some(map) = &mut maps.occupancy {
            map.set_bounds(bounds);
        }
        if let Some(map) = &mut maps.tsdf {
            map.set_bounds(bounds);
        }
        Ok(Self::Three { frames, maps, file })
    }

    /// Number of scans.
    pub(crate) fn scans(&self) -> usize {
        match self {
            Self::Two { scans, .. } => scans.len(),
            Self::Three { frames, .. } => frames.indices.len(),
        }
    }

    /// Fuses all scans, in order.
    pub(crate) fn fuse(&mut self, threads: usize, progress: &Progress) -> FusionReport {
        match self {
            Self::Two { scans, maps, file, .. } => fuse_2d(maps, scans, &mut file.poses, progress),
            Self::Three { frames, maps, file } => fuse_3d(maps, frames, &mut file.poses, threads, progress),
        }
    }

    /// Bytes of each map, measured.
    pub(crate) fn bytes(&self) -> BTreeMap<&'static str, usize> {
        match self {
            Self::Two { maps, .. } => maps.bytes(),
            Self::Three { maps, .. } => maps.bytes(),
        }
    }

    /// The maps as a file, and the box that they cover.
    pub(crate) fn finish(self) -> (AnyMapFile, Extent) {
        match self {
            Self::Two { grid, maps, mut file, .. } => {
                (file.grid, file.tree, file.tsdf) = (maps.grid, maps.tree, maps.tsdf);
                (AnyMapFile::Plane(file), Extent::Two(grid))
            }
            Self::Three { maps, mut file, .. } => {
                store_3d(maps, &mut file);
                let extent = Extent::of_bricks(&file);
                (AnyMapFile::Space(file), extent)
            }
        }
    }
}

/// Refuses to go on with maps that the file does not hold.
fn check_held(settings: &Settings, held: &[(MapKind, bool)], map: &str) -> anyhow::Result<()> {
    match held.iter().find(|(kind, held)| settings.wants(*kind) && !held) {
        Some((kind, _)) => bail!(
            "{map}: the map holds no {}; leave it out of --maps, or write to another folder",
            kind.word()
        ),
        None => Ok(()),
    }
}

/// The maps of a file, to go on with; they are taken out of it.
fn saved_3d(file: &mut MapFile<3>, settings: &Settings, limits: &Limits) -> anyhow::Result<Maps3> {
    let held = [(MapKind::Tree, file.occupancy.is_some()), (MapKind::Tsdf, file.tsdf.is_some())];
    check_held(settings, &held, limits.map)?;
    let occupancy = file
        .occupancy
        .take()
        .map(|o| Occupancy::from_store(o.store, o.model, settings.sweep().in_3d()));
    let tsdf = file.tsdf.take().map(|t| {
        let config = recipe::tsdf_3d(settings, t.store.lattice().origin);
        Tsdf3::from_stores(t.store, file.colors.take().map(|c| c.store), config)
    });
    Ok(Maps3 { occupancy: occupancy.transpose()?, tsdf: tsdf.transpose()?, memory: limits.memory })
}

/// Puts the maps into a file.
fn store_3d(maps: Maps3, file: &mut MapFile<3>) {
    file.occupancy = maps.occupancy.map(|map| {
        let model = *map.model();
        OccupancyBricks { store: map.into_store(), model, more: Map::new() }
    });
    if let Some(map) = maps.tsdf {
        let config = *map.config();
        let (store, colors) = map.into_stores();
        file.colors = colors.map(|store| ColorBricks { store, w_max: config.color_w_max, more: Map::new() });
        file.tsdf = Some(TsdfBricks {
            store,
            truncation: config.truncation,
            w_max: config.w_max,
            carve_weight: config.carve_weight,
            weights: config.weights,
            more: Map::new(),
        });
    }
}
