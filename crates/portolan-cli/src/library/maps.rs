//! A mapper in `map.portolan`, and out of it.

use std::path::Path;

use anyhow::{bail, ensure};
use portolan::Ledger;
use portolan::geom::{BLOCK_EDGE, Grid, Pose};
use portolan::mapper::Mapper;
use portolan::store::Store;
use portolan_io::{MapFile, MapHeader};

use crate::dimension::Dimension;
use crate::json;
use crate::mapping::{self, Limits, MapKind, OccupancyKinds, Settings, available_memory};
use crate::saved::SavedMap;

/// A saved map of either dimension, to go on with.
pub enum MapperOfFile {
    /// 2-D, and what else the file holds.
    Two(Box<Mapper<2>>, Box<MapFile<2>>),
    /// 3-D, and what else the file holds.
    Three(Box<Mapper<3>>, Box<MapFile<3>>),
}

/// Reads a `map.portolan`, or the one in a folder, that may take `memory` bytes.
///
/// # Errors
/// A file that holds no such map, or needs more memory.
pub fn read_mapper(path: &Path, memory: usize) -> anyhow::Result<MapperOfFile> {
    let inside = path.join("map.portolan");
    let path = if path.is_dir() { inside.as_path() } else { path };
    let shown = path.display().to_string();
    let limits = Limits { memory, log: &shown, map: &shown };
    let file = SavedMap::read(path, memory as u64)?;
    let saved = Settings::of_saved(&file.header().settings);
    Ok(match file {
        SavedMap::Two(mut file) => {
            let mut settings = saved.resolved(Dimension::Two);
            settings.keep(&[
                (MapKind::Grid, file.grid.is_some()),
                (MapKind::Tree, file.tree.is_some()),
                (MapKind::Tsdf, file.tsdf.is_some()),
                (MapKind::Attenuation, file.attenuation.is_some()),
            ]);
            let Some(grid) = mapping::grid_of(&file) else { bail!("{shown}: the map has no cells") };
            let mapper = mapping::unbounded_mapper_2d(&mut file, &settings, &grid, &limits)?;
            MapperOfFile::Two(Box::new(mapper), file)
        }
        SavedMap::Three(mut file) => {
            let mut settings = saved.resolved(Dimension::Three);
            settings.keep(&[
                (MapKind::Tree, file.occupancy_bricks.is_some()),
                (MapKind::Tsdf, file.tsdf_bricks.is_some()),
                (MapKind::Attenuation, file.attenuation.is_some()),
            ]);
            let mapper = mapping::mapper_3d(&mut file, &settings, &Pose::IDENTITY, &limits)?;
            MapperOfFile::Three(Box::new(mapper), file)
        }
    })
}

/// Notes in the header what is to be said of a mapper.
fn describe<const D: usize>(mapper: &Mapper<D>, settings: &Settings, header: &mut MapHeader) {
    header.scans += mapper.stats().scans;
    header.settings = settings.to_json();
    json::add_counts(&mut header.statistics, &json::object(json::stats(mapper.stats())));
}

/// Writes a 2-D mapper as `portolan map` does: arrays over all that was seen. `rest` is what else goes into the file: poses,
/// and what it said of scans that were fused before.
///
/// # Errors
/// A map without scans, or one that spans too much for arrays; a file that cannot be written.
pub fn save_2d(mapper: Mapper<2>, rest: MapFile<2>, path: &Path) -> anyhow::Result<()> {
    Ok(in_file_2d(mapper, rest, path)?.write(path)?)
}

/// The maps put into the rest of a file.
pub(super) fn in_file_2d(mapper: Mapper<2>, mut rest: MapFile<2>, path: &Path) -> anyhow::Result<MapFile<2>> {
    let before = Settings::of_saved(&rest.header.settings);
    let settings = Settings::of_mapper(mapper.settings(), Dimension::Two, before);
    describe(&mapper, &settings, &mut rest.header);
    let grid = grid(&mapper, &path.display().to_string())?;
    // A clamped map from here on.
    rest.ledger = None;
    let kinds = OccupancyKinds::of(&settings, &rest);
    mapping::store_2d(mapper, kinds, &grid, &mut rest)?;
    Ok(rest)
}

/// [`save_2d`] in 3-D, in bricks.
///
/// # Errors
/// A map without scans; a file that cannot be written.
pub fn save_3d(mapper: Mapper<3>, mut rest: MapFile<3>, path: &Path) -> anyhow::Result<()> {
    let before = Settings::of_saved(&rest.header.settings);
    let settings = Settings::of_mapper(mapper.settings(), Dimension::Three, before);
    describe(&mapper, &settings, &mut rest.header);
    ensure!(!bricks(&mapper).is_empty(), "{}: nothing was fused, there is no map to write", path.display());
    mapping::store_3d(mapper, &mut rest);
    // A clamped map from here on.
    rest.ledger = None;
    Ok(rest.write(path)?)
}

/// The file of a ledger, as `portolan map --ledger` would describe it; without counts of beams.
pub fn ledger_file<const D: usize>(ledger: Ledger<D>) -> MapFile<D> {
    let dimension = if D == 2 { Dimension::Two } else { Dimension::Three };
    let mut file = MapFile::default();
    let mut settings = Settings::of_mapper(ledger.settings(), dimension, Settings::default());
    settings.shape.ledger = true;
    file.header.settings = settings.to_json();
    file.header.logs = ledger.scans().logs().map(str::to_owned).collect();
    file.header.scans = ledger.scans().len() as u64;
    file.ledger = Some(ledger);
    file
}

/// The first cells of all bricks.
fn bricks<const D: usize>(mapper: &Mapper<D>) -> Vec<[i32; D]> {
    let occupancy = mapper.occupancy().map(|map| map.store().keys());
    let distances = mapper.tsdf().map(|map| map.store().keys());
    let attenuation = mapper.attenuation().map(|map| map.store().keys());
    let keys = [occupancy, distances, attenuation].into_iter().flatten().flatten();
    keys.map(|key| key.first_cell()).collect()
}

/// The array for all bricks, on the lattice of the maps.
pub(crate) fn grid(mapper: &Mapper<2>, shown: &str) -> anyhow::Result<Grid<2>> {
    let bricks = bricks(mapper);
    let lattice = mapper.tsdf().map(|map| *map.lattice());
    let lattice = lattice.or_else(|| mapper.occupancy().map(|map| *map.store().lattice()));
    let lattice = lattice.or_else(|| mapper.attenuation().map(|map| *map.store().lattice()));
    let first = [0, 1].map(|k| bricks.iter().map(|cell| cell[k]).min());
    let last = [0, 1].map(|k| bricks.iter().map(|cell| cell[k]).max());
    let ([Some(x), Some(y)], [Some(right), Some(top)], Some(lattice)) = (first, last, lattice) else {
        bail!("{shown}: nothing was fused, there is no map to write");
    };
    let shape = [(x, right), (y, top)].map(|(a, b)| (i64::from(b) - i64::from(a)) as usize + BLOCK_EDGE);
    // Arrays of all maps, and what writing them takes.
    let memory = available_memory().unwrap_or(u64::MAX) as f64;
    if shape[0] as f64 * shape[1] as f64 * 60.0 > memory {
        let [w, h] = shape.map(|n| n as f64 * lattice.resolution);
        bail!(
            "{shown}: the map spans {w:.1} x {h:.1} m, too much for arrays of cells of {} m; limit the range of scans, or give \
             the mapper bounds",
            lattice.resolution
        );
    }
    Ok(Grid::new(lattice.corner([x, y]), lattice.resolution, shape))
}
