//! Scans into maps, different maps on different threads.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Mutex;
use std::time::Instant;

use portolan::geom::Pose;
use portolan::map::{OccupancyGrid, Quadtree, Tsdf};
use portolan::scan::{Scan, ScanStats};

use crate::progress::Progress;

/// The maps that scans are fused into.
#[derive(Default)]
pub(crate) struct Maps {
    pub(crate) grid: Option<OccupancyGrid<2>>,
    pub(crate) tree: Option<Quadtree>,
    pub(crate) tsdf: Option<Tsdf2>,
}

impl Maps {
    /// Number of maps.
    pub(crate) fn count(&self) -> usize {
        usize::from(self.grid.is_some()) + usize::from(self.tree.is_some()) + usize::from(self.tsdf.is_some())
    }

    /// Bytes of each map, measured.
    pub(crate) fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let grid = self.grid.iter().map(|m| ("grid", m.memory_bytes()));
        let tree = self.tree.iter().map(|m| ("tree", m.memory_bytes()));
        let tsdf = self.tsdf.iter().map(|m| ("tsdf", m.memory_bytes()));
        grid.chain(tree).chain(tsdf).collect()
    }
}

/// What fusing did.
#[derive(Debug, Default)]
pub(crate) struct FusionReport {
    /// Of the map that comes first among tsdf, grid, tree: scans and beams are the same for all.
    pub(crate) stats: ScanStats,
    /// Seconds of one core per map.
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    /// Cell observations per map.
    pub(crate) observations: BTreeMap<&'static str, u64>,
}

type Job<'a> = (&'static str, Box<dyn FnMut(&Pose<2>, &Scan<2>) -> ScanStats + Send + 'a>);

/// Fuses all scans into all maps in the order of the log. Every map is fused by one thread, so that the result
/// is the same for any number of them.
pub(crate) fn fuse(
    maps: &mut Maps,
    scans: &[(Pose<2>, Scan<2>)],
    carve: bool,
    threads: usize,
    progress: &Progress,
) -> FusionReport {
    let mut jobs: VecDeque<Job> = VecDeque::new();
    // The longest first.
    if let Some(tree) = &mut maps.tree {
        jobs.push_back(("tree", Box::new(|pose, scan| tree.integrate(pose, scan))));
    }
    if let Some(grid) = &mut maps.grid {
        jobs.push_back(("grid", Box::new(|pose, scan| grid.integrate(pose, scan))));
    }
    if let Some(tsdf) = &mut maps.tsdf {
        jobs.push_back(("tsdf", Box::new(move |pose, scan| tsdf.integrate(pose, scan, carve))));
    }
    let workers = threads.clamp(1, jobs.len().max(1));
    let jobs = Mutex::new(jobs);
    let done = Mutex::new(Vec::new());
    let work = || {
        // A panic in another thread ends the run anyway.
        while let Some((name, mut integrate)) = jobs.lock().ok().and_then(|mut j| j.pop_front()) {
            let start = Instant::now();
            let mut stats = ScanStats::default();
            for (pose, scan) in scans {
                stats += integrate(pose, scan);
                progress.add(1);
            }
            if let Ok(mut done) = done.lock() {
                done.push((name, stats, start.elapsed().as_secs_f64()));
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..workers {
            scope.spawn(work);
        }
        work();
    });
    let mut report = FusionReport::default();
    let done = done.into_inner().unwrap_or_default();
    for name in ["tree", "grid", "tsdf"] {
        for (_, stats, seconds) in done.iter().filter(|d| d.0 == name) {
            report.stats = *stats;
            report.seconds.insert(name, *seconds);
            report.observations.insert(name, stats.cells);
        }
    }
    report
}
