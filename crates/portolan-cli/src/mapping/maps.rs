//! The maps of a run, and one scan into all of them.

use std::collections::BTreeMap;
use std::time::Instant;

use portolan::cell::OccupancyModel;
use portolan::geom::{Grid, Lattice, Pose};
use portolan::map::{MapError, MapRepr, OccupancyGrid, Quadtree, Occupancy, Tsdf3, Tsdf};
use portolan::scan::{BeamCounts, Frame, Scan, ScanStats};

use super::recipe;
use super::{FusionReport, MapKind, Settings};

/// Maps of one dimension, which take scans one at a time.
pub(crate) trait Maps<const D: usize> {
    /// What a log of this dimension holds.
    type Scan;

    /// One scan into every map; what each did goes into the report. Gives the counts of the map that comes last: scans
    /// and beams are the same for all.
    ///
    /// # Errors
    /// A map has no memory left, or cannot use the scan.
    fn integrate(
        &mut self,
        pose: &Pose<D>,
        scan: &Self::Scan,
        report: &mut FusionReport,
    ) -> Result<ScanStats, MapError>;

    /// Bytes of each map, measured.
    fn bytes(&self) -> BTreeMap<&'static str, usize>;
}

/// The maps of 2-D scans.
#[derive(Default)]
pub(crate) struct Maps2 {
    pub(crate) grid: Option<OccupancyGrid<2>>,
    pub(crate) tree: Option<Quadtree>,
    pub(crate) tsdf: Option<Tsdf2>,
    /// Whether free space goes into the signed distances.
    pub(crate) carve: bool,
}

impl Maps2 {
    /// Empty maps over a grid.
    pub(crate) fn new(settings: &Settings, grid: &Grid<2>) -> anyhow::Result<Self> {
        let model = OccupancyModel::default();
        let made = |kind| settings.wants(kind);
        let tsdf = || Tsdf::new(recipe::tsdf_2d(settings).with_grid(grid));
        Ok(Self {
            grid: made(MapKind::Grid).then(|| OccupancyGrid::covering(*grid, model)).transpose()?,
            tree: made(MapKind::Tree).then(|| Quadtree::covering(grid, model)).transpose()?,
            tsdf: made(MapKind::Tsdf).then(tsdf).transpose()?,
            carve: settings.shape.carve,
        })
    }
}

impl Maps<2> for Maps2 {
    type Scan = Scan<2>;

    fn integrate(
        &mut self,
        pose: &Pose<2>,
        scan: &Scan<2>,
        report: &mut FusionReport,
    ) -> Result<ScanStats, MapError> {
        let Self { grid, tree, tsdf, carve } = self;
        // Every map is fused by one thread at a time, in the order of the log: the result does not depend on their number.
        let (tree, (grid, tsdf)) = rayon::join(
            || tree.as_mut().map(|map| timed(|| map.integrate(pose, scan))),
            || {
                rayon::join(
                    || grid.as_mut().map(|map| timed(|| map.integrate(pose, scan))),
                    || tsdf.as_mut().map(|map| timed(|| map.integrate(pose, scan, *carve))),
                )
            },
        );
        let mut last = ScanStats::default();
        for (name, fused) in [("tree", tree), ("grid", grid), ("tsdf", tsdf)] {
            if let Some((stats, seconds)) = fused {
                report.add(name, seconds, &stats);
                last = stats;
            }
        }
        Ok(last)
    }

    fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let grid = self.grid.iter().map(|m| ("grid", m.memory_bytes()));
        let tree = self.tree.iter().map(|m| ("tree", m.memory_bytes()));
        let tsdf = self.tsdf.iter().map(|m| ("tsdf", m.memory_bytes()));
        grid.chain(tree).chain(tsdf).collect()
    }
}

/// The maps of 3-D scans.
#[derive(Default)]
pub(crate) struct Maps3 {
    pub(crate) occupancy: Option<Occupancy>,
    pub(crate) tsdf: Option<Tsdf3>,
    /// What they may take together (bytes).
    pub(crate) memory: usize,
}

/// A frame of a log and what its filter counted.
pub(crate) struct Filtered {
    pub(crate) frame: Frame,
    pub(crate) counts: BeamCounts,
}

impl Maps3 {
    /// Empty maps on a lattice with this origin.
    pub(crate) fn new(settings: &Settings, origin: [f64; 3], memory: usize) -> anyhow::Result<Self> {
        let lattice = Lattice::new(origin, settings.resolution());
        let occupancy = || Occupancy::new(lattice, OccupancyModel::default(), settings.sweep().in_3d());
        let tsdf = || Tsdf3::new(recipe::tsdf_3d(settings, origin));
        Ok(Self {
            occupancy: settings.wants(MapKind::Tree).then(occupancy).transpose()?,
            tsdf: settings.wants(MapKind::Tsdf).then(tsdf).transpose()?,
            memory,
        })
    }
}

impl Maps<3> for Maps3 {
    type Scan = Filtered;

    fn integrate(
        &mut self,
        pose: &Pose<3>,
        Filtered { frame, counts }: &Filtered,
        report: &mut FusionReport,
    ) -> Result<ScanStats, MapError> {
        let mut last = ScanStats::default();
        if let Some(map) = &mut self.occupancy {
            let others = self.tsdf.as_ref().map_or(0, Tsdf3::memory_bytes);
            map.set_limit(self.memory.saturating_sub(others));
            let (stats, seconds) = timed(|| map.integrate(pose, frame));
            last = stats?;
            report.add("tree", seconds, &last);
        }
        if let Some(map) = &mut self.tsdf {
            let others = self.occupancy.as_ref().map_or(0, Occupancy::memory_bytes);
            map.set_limit(self.memory.saturating_sub(others));
            let (stats, seconds) = timed(|| map.integrate(pose, frame));
            last = stats?;
            report.add("tsdf", seconds, &last);
        }
        // Points that share a row and column with a nearer one, or lie outside of all.
        if matches!(frame, Frame::Points(scan) if scan.image.is_none()) {
            report.without_pixel += last.beams.dropped.saturating_sub(counts.dropped);
        }
        // What the filter left out does not reach the maps.
        Ok(ScanStats { beams: *counts, ..last })
    }

    fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let occupancy = self.occupancy.iter().map(|m| ("tree", m.memory_bytes()));
        occupancy.chain(self.tsdf.iter().map(|m| ("tsdf", m.memory_bytes()))).collect()
    }
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}
