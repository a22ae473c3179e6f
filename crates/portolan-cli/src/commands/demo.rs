//! `demo`: the textbook's experiment on the simulated Apartment.

mod found;

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use portolan::geom::{Grid, Pose};
use portolan::map::TsdfConfig;
use portolan::scan::{Scan, ScanStats};
use portolan_chapter::experiment::{Drift, Forgetting, PoseSet};
use portolan_chapter::pictures::{self, Scene};
use portolan_chapter::report::{self, Facts};
use portolan_io::{Manifest, MapFile, write_atomic};
use portolan_sim::{LapConfig, Lidar, SEED};

use self::found::Found;
use super::gallery;
use crate::arguments::ForgettingArgs;
use crate::dimension::Dimension;
use crate::folder::Results;
use crate::json;
use crate::log::RangeArgs;
use crate::mapping::{
    ARTIFACTS, Artifacts, Derived, FusionReport, Limits, OccupancyKinds, Settings, fuse_2d, mapper_2d,
    store_2d,
};
use crate::output::Output;
use crate::progress::Progress;
use crate::saved::SavedMap;

#[derive(clap::Args)]
#[command(after_help = "Example:\n  portolan demo --out out")]
pub(crate) struct Args {
    /// Folder for the results; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seed of the sensor's noise, decimal or hexadecimal; default 0xC0FFEE
    #[arg(long, value_name = "SEED", value_parser = seed)]
    seed: Option<u64>,
    /// Scans in the lap
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    #[arg(default_value = "200")]
    scans: u32,
    /// Poses that the maps are made with
    #[arg(long, value_enum, default_value = "optimised")]
    poses: PosesArg,
    #[command(flatten)]
    forgetting: ForgettingArgs,
    /// Accuracy is the median over worlds turned by these angles against the lattice, and shifted by parts of a cell
    /// (degrees, separated by commas) [default: 0,10,17,30,45; a second or so for each]
    #[arg(long, value_name = "DEGREES", value_delimiter = ',', allow_negative_numbers = true, value_parser = gallery::degrees)]
    turn: Vec<f64>,
    /// Leave out the experiment with the moved chair
    #[arg(long)]
    no_ghost: bool,
    #[command(flatten)]
    output: Output,
}

/// The textbook's: cells of 5 cm, truncation 15 cm.
const RESOLUTION: f64 = 0.05;
const TRUNCATION: f64 = 0.15;
/// What is written beside the files of a map.
const FILES: [&str; 8] = [
    "gallery.json",
    "gallery.png",
    "gallery.txt",
    "ghost.json",
    "ghost.png",
    "pose_graph.g2o",
    "pose_graph.png",
    "report.html",
];
/// Probes per direct question.
const PROBES: usize = 100_000;

/// Which poses the maps are made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum PosesArg {
    /// Those of the simulator
    True,
    /// Those that the wheels lead to
    Odometry,
    /// Those of the pose graph
    Optimised,
}

impl From<PosesArg> for PoseSet {
    fn from(arg: PosesArg) -> Self {
        match arg {
            PosesArg::True => Self::True,
            PosesArg::Odometry => Self::Odometry,
            PosesArg::Optimised => Self::Optimised,
        }
    }
}

fn seed(text: &str) -> Result<u64, String> {
    let parsed = match text.trim().to_ascii_lowercase().strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16),
        None => text.trim().parse(),
    };
    parsed.map_err(|_| "must be a whole number, like 7 or 0xC0FFEE".to_owned())
}

/// Simulates the lap, builds every representation, writes everything.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let mut results = Results::claim(&args.out, "demo", &[&ARTIFACTS[..], &FILES].concat())?;
    results.refuse_others()?;
    let mut run = Run::start();
    let config =
        LapConfig { scans: args.scans as usize, seed: args.seed.unwrap_or(SEED), ..Default::default() };

    let world = portolan_sim::apartment().world;
    let (mut drift, scans) = run.timed("simulate", || Drift::drive(&world, &config, args.poses.into()))?;
    let settings = settings(&config.lidar, args.forgetting.w_max());
    let grid = gallery::apartment_grid(RESOLUTION);
    let (mut file, fusion) = run.timed("fuse", || fused(&settings, &grid, &scans, args.output))?;
    describe(&mut file, &settings, &config, &fusion.stats);
    let derived = run.timed("derive", || Derived::of(&file, &settings, usize::MAX));
    let turns = gallery::turns(&args.turn);
    run.timed("pose_sets", || drift.measure_maps(&scans, &world, &config_of(&settings), &turns))?;
    let mut gallery =
        run.timed("gallery", || gallery::measure(&scans, &grid, &settings, PROBES, Some(&world)))?;
    let turned =
        run.timed("turned", || gallery::measure_turned(&scans, &grid, &settings, &world, &args.turn))?;
    gallery.turned = Some(turned);

    // The map first: the rest follows from it, or can be had again.
    run.timed("save", || -> anyhow::Result<()> {
        file.write(&results.map_file()?)?;
        results.publish()
    })?;
    let scene = Scene { gallery: &gallery, log: &scans, poses: drift.chosen.poses(), world: Some(&world) };
    let table = portolan_chapter::gallery::document(&gallery, "the simulated Apartment", scans.len());
    // The gallery is measured: from here on nobody minds a busy neighbour.
    let (ghost, written) = std::thread::scope(|scope| {
        let ghost = (!args.no_ghost).then(|| scope.spawn(|| seconds_of(|| Forgetting::run(config.seed))));
        let written = (|| -> anyhow::Result<()> {
            let title = gallery::title("the Apartment", RESOLUTION, scans.len());
            let files =
                run.timed("gallery_files", || gallery::write_files(&args.out, &scene, &table, &title))?;
            run.files.extend(files);
            let title = format!("The Apartment · cells of 5 cm · {} scans", scans.len());
            let edge = RESOLUTION;
            let artifacts = Artifacts {
                file: &file,
                derived: &derived,
                dense: None,
                edge,
                camera: false,
                movers: None,
                sigma: None,
                title,
            };
            let written = run.timed("map_files", || artifacts.write(&args.out))?;
            run.files.extend(written.files);
            let files = run.timed("drift_files", || write_drift(&args.out, &drift, &scene))?;
            run.files.extend(files);
            Ok(())
        })();
        (ghost.map(std::thread::ScopedJoinHandle::join), written)
    });
    written?;
    let forgetting = match ghost {
        Some(Ok((seconds, forgetting))) => {
            run.seconds.insert("ghost", seconds);
            Some(forgetting?)
        }
        Some(Err(_)) => bail!("the thread of the moved chair was lost; --no-ghost leaves it out"),
        None => None,
    };
    run.files.extend(write_ghost(&args.out, forgetting.as_ref())?);
    run.files.extend(["report.html", "summary.json", Manifest::NAME]);

    let found = Found {
        config,
        settings,
        grid,
        world: &world,
        fusion,
        file,
        derived,
        gallery: &gallery,
        drift: &drift,
        forgetting: forgetting.as_ref(),
    };
    let facts = Facts {
        scene,
        drift: &drift,
        forgetting: forgetting.as_ref(),
        seconds: run.total(),
        warnings: found.warnings(),
    };
    let page = run.timed("report", || report::html(&facts));
    write_atomic(args.out.join("report.html"), |w| w.write_all(page.as_bytes()))?;
    let mut summary = found.to_json(&run);
    write_atomic(args.out.join("summary.json"), |w| writeln!(w, "{summary:#}"))?;
    results.complete(&run.files)?;
    summary["gallery"] = table;
    args.output.print(&summary, found.report(&run, &args.out.display().to_string()))
}

/// The graph and its picture; gives their names.
fn write_drift(folder: &Path, drift: &Drift, scene: &Scene) -> anyhow::Result<[&'static str; 2]> {
    write_atomic(folder.join("pose_graph.g2o"), |w| portolan_graph::write_g2o(&drift.lap.graph, w))?;
    let png = pictures::drift(drift, scene);
    write_atomic(folder.join("pose_graph.png"), |w| w.write_all(&png))?;
    Ok(["pose_graph.g2o", "pose_graph.png"])
}

/// The ghost's numbers and picture; gives their names. Without a ghost those of an earlier run are removed.
fn write_ghost(folder: &Path, forgetting: Option<&Forgetting>) -> anyhow::Result<&'static [&'static str]> {
    const NAMES: [&str; 2] = ["ghost.json", "ghost.png"];
    let Some(forgetting) = forgetting else {
        for path in NAMES.map(|name| folder.join(name)).iter().filter(|path| path.exists()) {
            let remove = std::fs::remove_file(path);
            remove.with_context(|| format!("{}: cannot remove what an earlier run left", path.display()))?;
        }
        return Ok(&[]);
    };
    let [document, png] = NAMES.map(|name| folder.join(name));
    let numbers = forgetting.to_json();
    write_atomic(document, |w| writeln!(w, "{numbers:#}"))?;
    let picture = pictures::ghost(forgetting);
    write_atomic(png, |w| w.write_all(&picture))?;
    Ok(&NAMES)
}

/// Files written and seconds spent.
struct Run {
    start: Instant,
    seconds: BTreeMap<&'static str, f64>,
    files: Vec<&'static str>,
}

impl Run {
    fn start() -> Self {
        Self { start: Instant::now(), seconds: BTreeMap::new(), files: Vec::new() }
    }

    fn timed<T>(&mut self, stage: &'static str, work: impl FnOnce() -> T) -> T {
        let (seconds, made) = seconds_of(work);
        self.seconds.insert(stage, seconds);
        made
    }

    fn total(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}

fn seconds_of<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let made = work();
    (start.elapsed().as_secs_f64(), made)
}

/// The textbook's weights: free space weighs as much as a surface and the clamp is 64 (`map` has others).
fn settings(lidar: &Lidar, w_max: Option<f32>) -> Settings {
    let mut settings = Settings::default();
    settings.shape.resolution = RESOLUTION;
    settings.shape.truncation = Some(TRUNCATION);
    settings.shape.carve_weight = 1.0;
    settings.shape.forgetting = ForgettingArgs::of(TsdfConfig::<2>::textbook().w_max);
    settings.shape.range = RangeArgs { max_range: Some(lidar.max_range), ..RangeArgs::default() };
    if let Some(w_max) = w_max {
        settings.shape.forgetting = ForgettingArgs::of(w_max);
    }
    settings.resolved(Dimension::Two)
}

/// What the contours of the three sets of poses are made with.
fn config_of(settings: &Settings) -> TsdfConfig<2> {
    TsdfConfig {
        resolution: settings.resolution(),
        truncation: settings.truncation(),
        w_max: settings.w_max(),
        ..TsdfConfig::textbook()
    }
}

/// The maps of all scans, as `map` makes them.
fn fused(
    settings: &Settings,
    grid: &Grid<2>,
    scans: &[(Pose<2>, Scan<2>)],
    output: Output,
) -> anyhow::Result<(SavedMap, FusionReport)> {
    let limits = Limits { memory: usize::MAX, log: "the Apartment", map: "" };
    let mut file = MapFile::<2>::default();
    let kinds = OccupancyKinds::of(settings, &file);
    let mut mapper = mapper_2d(&mut file, settings, grid, &limits)?;
    let progress = Progress::new(scans.len(), "fusing", output);
    let mut fusion = fuse_2d(&mut mapper, scans, limits.log, &mut file.poses, &progress);
    fusion.name_occupancy(kinds);
    file.poses = scans.iter().map(|(pose, _)| *pose).collect();
    store_2d(mapper, kinds, grid, &mut file)?;
    Ok((SavedMap::Two(Box::new(file)), fusion))
}

/// Writes into the file's header what it is made of.
fn describe(file: &mut SavedMap, settings: &Settings, config: &LapConfig, stats: &ScanStats) {
    let header = file.header_mut();
    header.logs.push(format!("simulated Apartment, seed {:#x}", config.seed));
    header.scans = stats.scans;
    header.settings = settings.to_json();
    header.statistics = json::object(json::stats(stats));
}
