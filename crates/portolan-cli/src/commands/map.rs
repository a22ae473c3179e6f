//! `map`: fuse a log into maps.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use clap::ValueEnum;
use portolan::geom::{Aabb, Grid, Pose};
use portolan::map::SweepKind;
use portolan::scan::RangeLimits;
use portolan::sweep::WeightModel;
use portolan_io::{CarmenLog, MapFile, sweep_of, weights_of, write_atomic};
use serde_json::{Map, Value};

use crate::arguments::{ForgettingArgs, bounds, bytes, length, share};
use crate::json;
use crate::log::{self, LimitArgs, LogArgs, Selection};
use crate::mapping::{
    Artefacts, Derived, MapKind, Maps, Settings, Summary, check_memory, fuse, grid_over, grown, report, seen,
    seen_by_tree, with_outlier,
};
use crate::output::Output;
use crate::progress::Progress;

/// Sweeps for distances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum SweepArg {
    /// At cell centres, with the range interpolated between beams
    CellCentre,
    /// The textbook's march along beams
    March,
}

/// Weights of beams.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum WeightsArg {
    /// Every beam 1
    Constant,
    /// One over the range squared
    Range,
    /// Cosine of the incidence angle
    Incidence,
    /// Both
    RangeIncidence,
}

#[derive(clap::Args)]
#[command(after_help = "Example:\n  portolan map intel-corrected.log.gz --resolution 0.05 --out intel")]
pub(crate) struct Args {
    /// Log of range scans with poses; its kind is recognised
    log: PathBuf,
    /// Folder for the results; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Edge of a cell (metres); with --append the map's
    #[arg(long, value_name = "R", value_parser = length, allow_negative_numbers = true)]
    #[arg(required_unless_present = "append")]
    resolution: Option<f64>,
    /// Distances are kept within this of a surface (metres); default three cells
    #[arg(long, value_name = "T", value_parser = length, allow_negative_numbers = true)]
    truncation: Option<f64>,
    #[command(flatten)]
    forgetting: ForgettingArgs,
    /// How much each beam is trusted; default constant
    #[arg(long, value_enum)]
    weights: Option<WeightsArg>,
    /// How scans become distances; default cell-centre
    #[arg(long, value_enum)]
    sweep: Option<SweepArg>,
    /// Maps to make, separated by commas; esdf and contour need tsdf, which is then made too
    /// [default: grid,tree,tsdf,esdf,contour]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    maps: Option<Vec<MapKind>>,
    #[command(flatten)]
    source: LogArgs,
    #[command(flatten)]
    limits: LimitArgs,
    /// Do not fuse the free space in front of surfaces into the distances: faster, but free is then unknown
    #[arg(long)]
    no_carve: bool,
    /// Weight of free space against that of a surface, above 0 and at most 1; with less, thin things survive and
    /// what has gone fades more slowly; default 0.3 (the chapter's is 1)
    #[arg(long, value_name = "W", value_parser = share, allow_negative_numbers = true, conflicts_with = "no_carve")]
    carve_weight: Option<f32>,
    /// Map this box only: x0,y0,x1,y1 (metres)
    #[arg(long, value_name = "BOX", value_parser = bounds, allow_hyphen_values = true)]
    bounds: Option<Aabb<2>>,
    /// Use every N-th scan of the log only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    every: Option<u64>,
    /// Leave every N-th scan out of fusion, for `eval --scans`
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..), allow_negative_numbers = true)]
    hold_out: Option<u64>,
    /// Go on with the map in DIR; settings not given are the map's
    #[arg(long)]
    append: bool,
    /// Threads; default: one per core. The result does not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), allow_negative_numbers = true)]
    threads: Option<u16>,
    /// Memory that may be used, with suffix K, M or G
    #[arg(long, value_name = "BYTES", value_parser = bytes, default_value = "4G")]
    memory: u64,
    #[command(flatten)]
    output: Output,
}

/// Fuses the log.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let mut watch = Watch::start();
    let threads = start_threads(args.threads)?;
    let before = args.saved_map()?;
    let log = log::read(&args.log, &args.source)?;
    watch.stage("read");

    let name = args.log.display().to_string();
    let settings = args.settings(&log, before.as_ref());
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
    let title = title(&file, settings.resolution);
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

/// Seconds per stage.
struct Watch {
    start: Instant,
    last: Instant,
    seconds: BTreeMap<&'static str, f64>,
}

impl Watch {
    fn start() -> Self {
        let start = Instant::now();
        Self { start, last: start, seconds: BTreeMap::new() }
    }

    /// The stage that ends here.
    fn stage(&mut self, name: &'static str) {
        let now = Instant::now();
        self.seconds.insert(name, (now - self.last).as_secs_f64());
        self.last = now;
    }

    /// All stages, and everything since the start.
    fn total(mut self) -> BTreeMap<&'static str, f64> {
        self.seconds.insert("total", self.start.elapsed().as_secs_f64());
        self.seconds
    }
}

/// Number of threads; those of the distance transform are started.
fn start_threads(threads: Option<u16>) -> anyhow::Result<usize> {
    let threads = match threads {
        Some(n) => usize::from(n),
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().context("cannot start threads")?;
    Ok(threads)
}

impl Args {
    fn map_path(&self) -> PathBuf {
        self.out.join("map.portolan")
    }

    /// The map to go on with.
    fn saved_map(&self) -> anyhow::Result<Option<MapFile>> {
        if !self.append {
            // A file in place of the folder is found out before the work, not after it.
            if self.out.exists() && !self.out.is_dir() {
                bail!("{}: is a file, not a folder; name a folder for the results", self.out.display());
            }
            return Ok(None);
        }
        Ok(Some(MapFile::read_within(self.map_path(), self.memory)?))
    }

    /// What was given, else what the map to go on with was made with, else the defaults.
    fn settings(&self, log: &CarmenLog, before: Option<&MapFile>) -> Settings {
        let saved = Saved(before.map(|f| &f.header.settings));
        let resolution = self.resolution.or(saved.number("resolution")).unwrap_or(0.05);
        let never_forget = before.map(|_| f32::INFINITY).filter(|_| saved.number("w_max").is_none());
        let saved_w_max = saved.number("w_max").map(|w| w as f32).or(never_forget);
        let mut limits = self.limits;
        limits.min_range = limits.min_range.or(saved.number("min_range"));
        limits.max_range = limits.max_range.or(saved.number("max_range"));
        limits.no_return_free = limits.no_return_free.or(saved.number("no_return_free"));
        let limits: RangeLimits = limits.limits(log);
        let mut maps =
            self.maps.clone().or_else(|| saved.maps()).unwrap_or_else(|| MapKind::value_variants().to_vec());
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
                Some(WeightsArg::Constant) => WeightModel::Constant,
                Some(WeightsArg::Range) => WeightModel::InverseSquare,
                Some(WeightsArg::Incidence) => WeightModel::CosIncidence,
                Some(WeightsArg::RangeIncidence) => WeightModel::InverseSquareCosIncidence,
                None => saved.word("weights").and_then(weights_of).unwrap_or_default(),
            },
            sweep: match self.sweep {
                Some(SweepArg::CellCentre) => SweepKind::CellCentre,
                Some(SweepArg::March) => SweepKind::March,
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
            bounds: self.bounds,
            maps,
        }
    }

    /// Empty maps, or the saved ones in their new grid. They are taken out of `file`.
    fn maps_to_fuse_into(
        &self,
        file: &mut MapFile,
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

/// Settings of a saved map.
struct Saved<'a>(Option<&'a Map<String, Value>>);

impl Saved<'_> {
    fn number(&self, key: &str) -> Option<f64> {
        self.0?.get(key)?.as_f64()
    }

    fn word(&self, key: &str) -> Option<&str> {
        self.0?.get(key)?.as_str()
    }

    fn maps(&self) -> Option<Vec<MapKind>> {
        let words = self.0?.get("maps")?.as_array()?;
        words.iter().map(|word| MapKind::from_str(word.as_str()?, false).ok()).collect()
    }

    fn flag(&self, key: &str) -> Option<bool> {
        self.0?.get(key)?.as_bool()
    }
}

/// Free space weighs less than a surface: on real logs, full of table legs, surfaces that weigh as much as the beams
/// that pass beside them are carved away (Intel at 5 cm: 85.0 % of held-out ranges within two cells, 82.1 with 1).
const CARVE_WEIGHT: f32 = 0.3;

/// Three times the resolution, without the rounding error that would show in every file (0.15000000000000002).
fn three_cells(resolution: f64) -> f64 {
    let exact = 3.0 * resolution;
    format!("{exact:.9e}").parse().unwrap_or(exact)
}

/// The grid of a saved map.
fn grid_of(file: &MapFile) -> Option<Grid<2>> {
    let dense = file.tsdf.as_ref().map(|m| *m.grid());
    dense
        .or_else(|| file.grid.as_ref().map(|m| *m.store().grid()))
        .or_else(|| file.tree.as_ref().and_then(seen_by_tree))
}

/// Writes into the file's header what it is made of.
fn describe(file: &mut MapFile, settings: &Settings, log: &CarmenLog, stats: &portolan::scan::ScanStats) {
    let header = &mut file.header;
    let name = log.path().file_name().unwrap_or(log.path().as_os_str());
    header.logs.push(name.to_string_lossy().into_owned());
    header.scans += stats.scans;
    header.every = settings.every;
    header.hold_out = settings.hold_out;
    header.settings = settings.to_json();
    json::add_counts(&mut header.statistics, &json::object(json::stats(stats)));
}

fn title(file: &MapFile, resolution: f64) -> String {
    let names: Vec<_> = file.header.logs.iter().map(|n| stem(Path::new(n))).collect();
    let cells = if resolution < 1.0 {
        format!("{} cm", (resolution * 1000.0).round() / 10.0)
    } else {
        format!("{resolution} m")
    };
    format!("{} · cells of {cells} · {} scans", names.join(" + "), file.header.scans)
}

/// A file name without folders, packing and kind.
fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut name: &str = &name;
    for end in [".gz", ".bz2", ".log", ".clf", ".gfs"] {
        name = name.strip_suffix(end).unwrap_or(name);
    }
    name.to_owned()
}
