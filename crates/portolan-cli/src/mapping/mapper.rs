//! From a log to fused maps: what of a run differs by dimension.

use anyhow::{anyhow, bail};
use portolan::Mapper;
use portolan::geom::{Aabb, Grid, Pose};
use portolan::map::{Attenuation, Occupancy, OccupancyGrid, OccupancyTree, Tsdf, Tsdf2};
use portolan::mapper::MapperMaps;
use portolan::scan::{BeamCounts, Scan};
use portolan::store::{Bricks, Dense, Store, Tree};
use portolan_io::scan_log::ScanLog;
use portolan_io::{AttenuationBricks, ColorBricks, LaserLog, MapFile, OccupancyBricks, TsdfBricks};
use serde_json::Map;

use super::extent::{Extent, check_memory, grid_over, seen, with_outlier};
use super::fuse::{Frames, FusionReport, fuse_2d, fuse_3d};
use super::map_server::grid_of;
use super::movers::{FoundMovers, Looking, look_2d};
use super::{Aside, LedgerRun, MapKind, Settings, recipe};
use crate::arguments::Shift;
use crate::log::{self, Log};
use crate::progress::Progress;
use crate::saved::SavedMap;

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
pub(crate) enum Run<'a> {
    Two {
        log: String,
        scans: Vec<(Pose<2>, Scan<2>)>,
        grid: Grid<2>,
        kinds: OccupancyKinds,
        mapper: Box<Mapper<2>>,
        file: Box<MapFile<2>>,
        /// What moved and was taken out of the scans.
        movers: Option<FoundMovers>,
    },
    Three {
        frames: Frames<'a>,
        mapper: Box<Mapper<3>>,
        file: Box<MapFile<3>>,
    },
    /// Into sums.
    Sums(Box<LedgerRun<'a>>),
}

impl<'a> Run<'a> {
    /// Prepares to fuse these scans of a log into new maps, or into those of a file.
    pub(crate) fn new(
        log: &'a Log,
        indices: &'a [usize],
        settings: &Settings,
        before: Option<SavedMap>,
        limits: &Limits,
    ) -> anyhow::Result<Self> {
        if settings.shape.ledger {
            return LedgerRun::new(log, indices, settings, before, limits)
                .map(|run| Self::Sums(Box::new(run)));
        }
        match log {
            Log::Two(log) => Self::new_2d(log, indices, settings, before.and_then(SavedMap::in_2d), limits),
            Log::Three(log) => Self::new_3d(log, indices, settings, before.and_then(SavedMap::in_3d), limits),
        }
    }

    /// Maps over the box of all that the scans see, which become dense in the end: scans are read first.
    fn new_2d(
        log: &LaserLog,
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
        let mut file = before.unwrap_or_default();
        let kinds = OccupancyKinds::of(settings, &file);
        let mapper = Box::new(mapper_2d(&mut file, settings, &grid, limits)?);
        Ok(Self::Two { log: limits.log.to_owned(), scans, grid, kinds, mapper, file, movers: None })
    }

    /// Maps in bricks, which grow with what is seen: frames are read while they are fused.
    fn new_3d(
        log: &'a ScanLog,
        indices: &'a [usize],
        settings: &Settings,
        before: Option<Box<MapFile<3>>>,
        limits: &Limits,
    ) -> anyhow::Result<Self> {
        let frames = Frames::new(log, indices, settings)?;
        let mut file = before.unwrap_or_default();
        let mapper = Box::new(mapper_3d(&mut file, settings, log.pose(0), limits)?);
        Ok(Self::Three { frames, mapper, file })
    }

    /// Number of scans.
    pub(crate) fn scans(&self) -> usize {
        match self {
            Self::Two { scans, .. } => scans.len(),
            Self::Three { frames, .. } => frames.indices.len(),
            Self::Sums(run) => run.scans(),
        }
    }

    /// Fuses all scans, in order.
    pub(crate) fn fuse(&mut self, threads: usize, progress: &Progress) -> FusionReport {
        match self {
            Self::Two { log, scans, kinds, mapper, file, movers, .. } => {
                let mut report = fuse_2d(mapper, scans, log, &mut file.poses, progress);
                report.movers = movers.take();
                report.name_occupancy(*kinds);
                report
            }
            Self::Three { frames, mapper, file } => {
                fuse_3d(&mut **mapper, frames, &mut file.poses, threads, progress)
            }
            Self::Sums(run) => run.fuse(threads, progress),
        }
    }

    /// Looks for what moved, so that it is left out of the maps, which have the memory that is left.
    pub(crate) fn look(&mut self, how: &Looking) -> anyhow::Result<()> {
        match self {
            // Without sums all scans that are looked at are fused.
            Self::Two { scans, movers, .. } => {
                let judge = look_2d(scans.iter().cloned(), how)?;
                for (i, (pose, scan)) in scans.iter_mut().enumerate() {
                    *scan = judge.without_movers(i, pose, scan.clone(), &mut BeamCounts::default());
                }
                *movers = Some(judge.found());
            }
            Self::Three { frames, mapper, .. } => {
                let bytes = frames.look(how)?;
                mapper.set_memory(how.memory.saturating_sub(bytes));
            }
            Self::Sums(run) => run.look(how)?,
        }
        Ok(())
    }

    /// The maps as a file, the box that they cover, and what is larger than memory.
    ///
    /// # Errors
    /// Where 2-D maps do not fit the grid that they were made for.
    pub(crate) fn finish(self, settings: &Settings) -> anyhow::Result<(SavedMap, Extent, Option<Aside>)> {
        match self {
            Self::Two { grid, kinds, mapper, mut file, .. } => {
                store_2d(*mapper, kinds, &grid, &mut file)?;
                Ok((SavedMap::Two(file), Extent::Two(grid), None))
            }
            Self::Three { mapper, mut file, .. } => {
                store_3d(*mapper, &mut file);
                let extent = Extent::of_bricks(&file);
                Ok((SavedMap::Three(file), extent, None))
            }
            Self::Sums(run) => run.finish(settings),
        }
    }
}

/// What the occupancy of a 2-D run becomes in the file: what is asked for, and what the file held before.
#[derive(Clone, Copy)]
pub(crate) struct OccupancyKinds {
    pub(super) grid: bool,
    pub(super) tree: bool,
}

impl OccupancyKinds {
    /// Before maps are taken out of the file.
    pub(crate) fn of(settings: &Settings, file: &MapFile<2>) -> Self {
        Self {
            grid: settings.wants(MapKind::Grid) || file.grid.is_some(),
            tree: settings.wants(MapKind::Tree) || file.tree.is_some(),
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

/// New maps on the lattice of a grid, or those of a file, which are taken out of it.
pub(crate) fn mapper_2d(
    file: &mut MapFile<2>,
    settings: &Settings,
    grid: &Grid<2>,
    limits: &Limits,
) -> anyhow::Result<Mapper<2>> {
    // A box that ends at a face of cells touches the next ones, too.
    let mut bounds = grid.aabb();
    bounds.max = bounds.max.map(|v| v - 1e-6 * grid.lattice.resolution);
    mapper_within(file, settings, grid, Some(bounds), limits)
}

/// The maps of a file, which are taken out of it and may grow beyond its grid.
pub(crate) fn unbounded_mapper_2d(
    file: &mut MapFile<2>,
    settings: &Settings,
    grid: &Grid<2>,
    limits: &Limits,
) -> anyhow::Result<Mapper<2>> {
    mapper_within(file, settings, grid, None, limits)
}

fn mapper_within(
    file: &mut MapFile<2>,
    settings: &Settings,
    grid: &Grid<2>,
    bounds: Option<Aabb<2>>,
    limits: &Limits,
) -> anyhow::Result<Mapper<2>> {
    let how = recipe::mapper_settings(settings, Some(grid.lattice.origin), bounds, limits.memory);
    let held = [
        (MapKind::Grid, file.grid.is_some()),
        (MapKind::Tree, file.tree.is_some()),
        (MapKind::Tsdf, file.tsdf.is_some()),
        (MapKind::Attenuation, file.attenuation.is_some()),
    ];
    if held.iter().all(|(_, held)| !held) {
        let mut mapper = Mapper::with(how);
        mapper.prepare(grid.lattice.origin)?;
        return Ok(mapper);
    }
    check_held(settings, &held, limits.map)?;
    let lost = || anyhow!("the saved map does not fit the lattice of the new grid; write to another folder");
    let occupancy = match (file.grid.take(), file.tree.take()) {
        (Some(map), _) => {
            let store = Bricks::of_dense(map.store(), grid.lattice).ok_or_else(lost)?;
            Some(Occupancy::<2>::from_store(store, *map.model())?)
        }
        (None, Some(map)) => {
            let own = map.store().to_bricks(*map.store().lattice(), limits.memory)?;
            let dense = Dense::of_bricks(&own, *grid).ok_or_else(lost)?;
            let store = Bricks::of_dense(&dense, grid.lattice).ok_or_else(lost)?;
            Some(Occupancy::<2>::from_store(store, *map.model())?)
        }
        (None, None) => None,
    };
    let tsdf = file.tsdf.take().map(|map| {
        let store = Bricks::of_dense(map.store(), grid.lattice).ok_or_else(lost)?;
        anyhow::Ok(Tsdf::<2>::from_stores(store, None, *map.config())?)
    });
    let attenuation = file.attenuation.take().map(|map| {
        let dense = Dense::of_bricks(&map.store, *grid).ok_or_else(lost)?;
        let store = Bricks::of_dense(&dense, grid.lattice).ok_or_else(lost)?;
        anyhow::Ok(Attenuation::<2>::from_store(store, how.attenuation.unwrap_or(map.rule))?)
    });
    let attenuation = attenuation.transpose()?;
    Ok(Mapper::of_maps(how, MapperMaps { occupancy, tsdf: tsdf.transpose()?, attenuation })?)
}

/// Puts the maps into a file, as arrays over the grid and as a tree over it.
pub(crate) fn store_2d(
    mapper: Mapper<2>,
    kinds: OccupancyKinds,
    grid: &Grid<2>,
    file: &mut MapFile<2>,
) -> anyhow::Result<()> {
    let lost = || anyhow!("the maps do not fit their grid");
    let MapperMaps { occupancy, tsdf, attenuation } = mapper.into_maps();
    let attenuation = attenuation.map(|map| {
        if *map.store().lattice() == grid.lattice {
            return Ok(map);
        }
        let rule = *map.rule();
        let dense = Dense::of_bricks(map.store(), *grid).ok_or_else(lost)?;
        let store = Bricks::of_dense(&dense, grid.lattice).ok_or_else(lost)?;
        anyhow::Ok(Attenuation::<2>::from_store(store, rule)?)
    });
    file.attenuation = attenuation.transpose()?.map(attenuation_bricks);
    if let Some(map) = occupancy {
        let model = *map.model();
        let store = map.into_store();
        let dense = Dense::of_bricks(&store, *grid).ok_or_else(lost)?;
        if kinds.tree {
            // A tree takes bricks of its own lattice.
            let store = match *store.lattice() == grid.lattice {
                true => store,
                false => Bricks::of_dense(&dense, grid.lattice).ok_or_else(lost)?,
            };
            let tree = Tree::covering(grid).and_then(|tree| tree.with_bricks(&store)).ok_or_else(lost)?;
            file.tree = Some(OccupancyTree::from_store(tree, model)?);
        }
        if kinds.grid {
            file.grid = Some(OccupancyGrid::from_store(dense, model)?);
        }
    }
    if let Some(map) = tsdf {
        let config = *map.config();
        let (store, _) = map.into_stores();
        let dense = Dense::of_bricks(&store, *grid).ok_or_else(lost)?;
        file.tsdf = Some(Tsdf2::from_stores(dense, None, config)?);
    }
    Ok(())
}

/// New maps on a lattice that fits the first pose, or those of a file, which are taken out of it.
pub(crate) fn mapper_3d(
    file: &mut MapFile<3>,
    settings: &Settings,
    first: &Pose<3>,
    limits: &Limits,
) -> anyhow::Result<Mapper<3>> {
    let bounds = settings.bounds.map(|bounds| bounds.in_3d("the log")).transpose()?;
    let origin = match settings.shift {
        Some(Shift::At(origin)) => Some(origin),
        Some(Shift::Auto) | None => None,
    };
    let how = recipe::mapper_settings(settings, origin, bounds, limits.memory);
    let held = [
        (MapKind::Tree, file.occupancy_bricks.is_some()),
        (MapKind::Tsdf, file.tsdf_bricks.is_some()),
        (MapKind::Attenuation, file.attenuation.is_some()),
    ];
    if held.iter().all(|(_, held)| !held) {
        let mut mapper = Mapper::with(how);
        mapper.prepare(first.translation)?;
        return Ok(mapper);
    }
    check_held(settings, &held, limits.map)?;
    let occupancy = file.occupancy_bricks.take().map(|o| Occupancy::<3>::from_store(o.store, o.model));
    let tsdf = file.tsdf_bricks.take().map(|t| {
        let config = how.tsdf(t.store.lattice().origin);
        Tsdf::<3>::from_stores(t.store, file.color_bricks.take().map(|c| c.store), config)
    });
    let attenuation = file
        .attenuation
        .take()
        .map(|map| Attenuation::<3>::from_store(map.store, how.attenuation.unwrap_or(map.rule)))
        .transpose()?;
    Ok(Mapper::of_maps(
        how,
        MapperMaps { occupancy: occupancy.transpose()?, tsdf: tsdf.transpose()?, attenuation },
    )?)
}

fn attenuation_bricks<const D: usize>(map: Attenuation<D>) -> AttenuationBricks<D> {
    let rule = *map.rule();
    AttenuationBricks { store: map.into_store(), rule, more: Map::new() }
}

/// Puts the maps into a file.
pub(crate) fn store_3d(mapper: Mapper<3>, file: &mut MapFile<3>) {
    let MapperMaps { occupancy, tsdf, attenuation } = mapper.into_maps();
    file.attenuation = attenuation.map(attenuation_bricks);
    file.occupancy_bricks = occupancy.map(|map| {
        let model = *map.model();
        OccupancyBricks { store: map.into_store(), model, more: Map::new() }
    });
    if let Some(map) = tsdf {
        let config = *map.config();
        let (store, colors) = map.into_stores();
        file.color_bricks =
            colors.map(|store| ColorBricks { store, w_max: config.color_w_max, more: Map::new() });
        file.tsdf_bricks = Some(TsdfBricks {
            store,
            truncation: config.truncation,
            w_max: config.w_max,
            carve_weight: config.carve_weight,
            weights: config.weights,
            more: Map::new(),
        });
    }
}
