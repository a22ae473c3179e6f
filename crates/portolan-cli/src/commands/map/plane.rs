//! Mapping a planar log.

use std::io::Write;

use anyhow::{Context, bail};
use portolan::geom::{Aabb, Grid, Pose};
use portolan::map::BeamSweep;
use portolan::scan::RangeLimits;
use portolan_io::{CarmenLog, MapFile, sweep_of, weights_of, write_atomic};

use super::common::{CARVE_WEIGHT, Watch, start_threads, three_cells, title};
use super::{Args, SweepArg};
use crate::arguments::Bounds;
use crate::error::bad_call;
use crate::esdf::EsdfArg;
use crate::json;
use crate::log::{self, Selection};
use crate::mapping::{
    Artefacts, Derived, MapKind, Maps, Settings, Summary, check_memory, fuse, grid_over, grown, report, seen,
    seen_by_tree, with_outlier,
};
use crate::progress::Progress;
use crate::saved::Saved;

/// The maps that a planar log can make; all of them where the call names none.
const PLANE: [MapKind; 5] = [MapKind::Grid, MapKind::Tree, MapKind::Tsdf, MapKind::Esdf, MapKind::Contour];

/// Fuses the log.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let bounds = args.check_plane()?;
    let mut watch = Watch::start();
    let threads = start_threads(args.threads)?;
    let before = args.saved_map()?;
    let log = log::read(&args.log, &args.source)?;
    watch.stage("read");

    let name = args.log.display().to_string();
    let settings = args.settings(&log, before.as_ref(), bounds);
    if let Some(before) = &before {
        settings.check_agree(before, &args.map_path().display().to_string())?;
    }
    let selection = Selection { every: settings.every, hold_out: settings.hold_out };
    let (fused, held_out) = selection.split(log.len());
    let scans = log::scans(&log, &fused, &settings.limits);
    let saved_grid = before.as_ref().and_then(grid_of);
    let grid = grid_over(seen(&scans), &settings, saved_grid, &name)
        .and_then(|grid| check_memory(&grid, &settings, &scans, args.memory, &name).map(|()| grid))
        .map_err(|error| with_outlier(error, &scans))?;
    watch.stage("prepare");

    let mut file = before.unwrap_or_default();
    let mut maps = args.maps_to_fuse_into(&mut file, &settings, &grid)?;
    watch.stage("allocate");
    let progress = Progress::new(scans.len() * maps.count(), "fusing", args.output);
    let fusion = fuse(&mut maps, &scans, settings.carve, threads, &progress);
    drop(progress);
    watch.stage("fuse");
    let mut bytes = maps.bytes();
    Maps { grid: file.grid, tree: file.tree, tsdf: file.tsdf } = maps;

    // The others were refused: the maps have no index for them.
    let held = |pose: &Pose<2>| pose.is_rigid() && grid.lattice.cell_of(pose.translation).is_some();
    file.poses.extend(scans.iter().map(|(pose, _)| *pose).filter(held));
    drop(scans);
    describe(&mut file, &settings, &log, &fusion.stats);
    let derived = Derived::of(&file, &settings);
    bytes.extend(derived.bytes());

    std::fs::create_dir_all(&args.out).with_context(|| {
        format!("{}: cannot make the folder; name one that can be written to", args.out.display())
    })?;
    let title = title(&file.header.logs, settings.resolution, file.header.scans);
    let (mut files, written) = Artefacts { file: &file, derived: &derived, title }.write(&args.out)?;
    files.push("summary.json");
    let mut seconds = watch.total();
    seconds.extend(fusion.seconds.iter().chain(&derived.seconds).chain(&written));
    let summary = Summary {
        log: &log,
        settings: &settings,
        grid,
        held_out: held_out.len(),
        fusion: &fusion,
        file: &file,
        derived: &derived,
        bytes,
        seconds,
        files,
    };
    let document = summary.to_json();
    let text = format!("{document:#}\n");
    write_atomic(args.out.join("summary.json"), |w| w.write_all(text.as_bytes()))?;
    args.output.print(&document, report(&summary, &args.out.display().to_string()))
}

impl Args {
    /// Refuses what a planar log cannot have; gives the box.
    fn check_plane(&self) -> anyhow::Result<Option<Aabb<2>>> {
        let refused = |what: &str| Err(bad_call(format!("{what} is for scans of space; the log is planar")));
        match self.sweep {
            Some(SweepArg::Auto | SweepArg::Exact | SweepArg::Projective) => {
                return refused("this --sweep");
            }
            _ if self.no_color => return refused("--no-color"),
            _ if self.max_distance.is_some() => return refused("--max-distance"),
            _ if self.source.is_about_space() => {
                return refused("--pose-convention, --intrinsics or another option");
            }
            _ if !self.self_filter.is_empty() => return refused("--self-filter"),
            _ if self.dense.is_some() => return refused("--dense"),
            _ if self.maps.iter().flatten().any(|m| *m == MapKind::Mesh) => return refused("--maps mesh"),
            _ => {}
        }
        match self.bounds {
            Some(Bounds::Space(_)) => Err(bad_call("--bounds of a planar log has four numbers x0,y0,x1,y1")),
            Some(Bounds::Plane(bounds)) => Ok(Some(bounds)),
            None => Ok(None),
        }
    }

    /// The map to go on with.
    fn saved_map(&self) -> anyhow::Result<Option<MapFile<2>>> {
        if !self.append {
            self.check_out()?;
            return Ok(None);
        }
        Ok(Some(MapFile::<2>::read_within(self.map_path(), self.memory)?))
    }

    /// What was given, else what the map to go on with was made with, else the defaults.
    fn settings(&self, log: &CarmenLog, before: Option<&MapFile<2>>, bounds: Option<Aabb<2>>) -> Settings {
        let saved = Saved(before.map(|f| &f.header.settings));
        let resolution = self.resolution.or(saved.number("resolution")).unwrap_or(0.05);
        let never_forget = before.map(|_| f32::INFINITY).filter(|_| saved.number("w_max").is_none());
        let saved_w_max = saved.number("w_max").map(|w| w as f32).or(never_forget);
        let mut limits = self.limits;
        limits.min_range = limits.min_range.or(saved.number("min_range"));
        limits.max_range = limits.max_range.or(saved.number("max_range"));
        limits.no_return_free = limits.no_return_free.or(saved.number("no_return_free"));
        let limits: RangeLimits = limits.limits(log);
        let mut maps = self.maps.clone().or_else(|| saved.maps()).unwrap_or_else(|| PLANE.to_vec());
        if maps.contains(&MapKind::Esdf) || maps.contains(&MapKind::Contour) {
            maps.push(MapKind::Tsdf);
        }
        maps.sort_unstable();
        maps.dedup();
        Settings {
            resolution,
            truncation: self.truncation.or(saved.number("truncation")).unwrap_or(three_cells(resolution)),
            w_max: self.forgetting.w_max().or(saved_w_max).unwrap_or(64.0),
            weights: match self.weights {
                Some(word) => word.model(),
                None => saved.word("weights").and_then(weights_of).unwrap_or_default(),
            },
            sweep: match self.sweep {
                Some(SweepArg::March) => BeamSweep::March,
                Some(_) => BeamSweep::CellCentre,
                None => saved.word("sweep").and_then(sweep_of).unwrap_or_default(),
            },
            carve: !self.no_carve && saved.flag("carve").unwrap_or(true),
            carve_weight: self
                .carve_weight
                .or(saved.number("carve_weight").map(|w| w as f32))
                .unwrap_or(CARVE_WEIGHT),
            limits,
            every: self.every.or(saved.number("every").map(|n| n as u64)),
            hold_out: self.hold_out.or(saved.number("hold_out").map(|n| n as u64)),
            bounds,
            maps,
            esdf: self.esdf.or(saved.0.and_then(EsdfArg::of_settings)).unwrap_or_default(),
        }
    }

    /// Empty maps, or the saved ones in their new grid. They are taken out of `file`.
    fn maps_to_fuse_into(
        &self,
        file: &mut MapFile<2>,
        settings: &Settings,
        grid: &Grid<2>,
    ) -> anyhow::Result<Maps> {
        if !self.append {
            return settings.empty_maps(grid);
        }
        let saved = Maps { grid: file.grid.take(), tree: file.tree.take(), tsdf: file.tsdf.take() };
        let missing = [
            (MapKind::Grid, saved.grid.is_none(), "grid"),
            (MapKind::Tree, saved.tree.is_none(), "tree"),
            (MapKind::Tsdf, saved.tsdf.is_none(), "tsdf"),
        ];
        if let Some((.., name)) = missing.iter().find(|(kind, missing, _)| settings.wants(*kind) && *missing)
        {
            bail!(
                "{}: the {name} is missing in the map; leave it out of --maps, or write to another folder",
                self.map_path().display()
            );
        }
        grown(saved, grid)
    }
}

/// The grid of a saved map.
fn grid_of(file: &MapFile<2>) -> Option<Grid<2>> {
    let dense = file.tsdf.as_ref().map(|m| *m.grid());
    dense
        .or_else(|| file.grid.as_ref().map(|m| *m.store().grid()))
        .or_else(|| file.tree.as_ref().and_then(seen_by_tree))
}

/// Writes into the file's header what it is made of.
fn describe(file: &mut MapFile<2>, settings: &Settings, log: &CarmenLog, stats: &portolan::scan::ScanStats) {
    let header = &mut file.header;
    let name = log.path().file_name().unwrap_or(log.path().as_os_str());
    header.logs.push(name.to_string_lossy().into_owned());
    header.scans += stats.scans;
    header.every = settings.every;
    header.hold_out = settings.hold_out;
    header.settings = settings.to_json();
    json::add_counts(&mut header.statistics, &json::object(json::stats(stats)));
}
