//! `gallery`: one log, every representation, what each costs and how true its answers are.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, anyhow};
use portolan::cell::OccupancyModel;
use portolan::field::EsdfSettings;
use portolan::geom::{Grid, Pose};
use portolan::map::TsdfConfig;
use portolan::scan::Scan;
use portolan::surface::ContourSettings;
use portolan_chapter::gallery::{Gallery, GallerySettings, Turn, Turned, document};
use portolan_chapter::pictures::{Scene, sheet};
use portolan_io::write_atomic;
use portolan_sim::{LapConfig, World};
use serde_json::Value;

use crate::arguments::{Bounds, ForgettingArgs, bounds, bytes, length};
use crate::dimension::Dimension;
use crate::error::bad_call;
use crate::log::{self, LimitArgs, LogArgs, Selection};
use crate::mapping::{Settings, check_memory, grid_over, seen, with_outlier};
use crate::output::Output;

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  portolan gallery demo\n  portolan gallery intel-corrected.log.gz --out intel"
)]
pub(crate) struct Args {
    /// Log of range scans with poses, or the word demo for the simulated Apartment
    #[arg(value_name = "LOG|demo")]
    log: PathBuf,
    /// Edge of a cell (meters)
    #[arg(long, value_name = "R", value_parser = length, default_value = "0.05")]
    resolution: f64,
    /// Distances are kept within this of a surface (meters); default three cells
    #[arg(long, value_name = "T", value_parser = length)]
    truncation: Option<f64>,
    /// Probes per question that is answered directly; searches get a fiftieth
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(100..=10_000_000))]
    #[arg(default_value = "100000")]
    probes: u32,
    /// With demo: accuracy is the median over worlds turned by these angles against the lattice, and shifted by parts of a
    /// cell (degrees, separated by commas) [default: 0,10,17,30,45; a second or so for each]
    #[arg(long, value_name = "DEGREES", value_delimiter = ',', allow_negative_numbers = true, value_parser = degrees)]
    turn: Vec<f64>,
    /// Folder for gallery.png, gallery.json and gallery.txt; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Use every N-th scan of the log only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<u64>,
    /// Map this box only: x0,y0,x1,y1 (meters)
    #[arg(long, value_name = "BOX", value_parser = bounds, allow_hyphen_values = true)]
    bounds: Option<Bounds>,
    /// Memory that may be used, with suffix K, M or G
    #[arg(long, value_name = "BYTES", value_parser = bytes, default_value = "4G")]
    memory: u64,
    #[command(flatten)]
    source: LogArgs,
    #[command(flatten)]
    limits: LimitArgs,
    #[command(flatten)]
    output: Output,
}

/// A gallery holds about so many times what the maps of one run hold.
const COPIES: u64 = 4;

/// Builds and measures all of them.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let simulated = args.log.as_os_str() == "demo";
    let settings = args.settings();
    let (world, scans, grid, name) = if simulated {
        let given = |it: bool, option: &str| match it {
            true => Err(bad_call(format!("{option} is for logs; leave it out with demo"))),
            false => Ok(()),
        };
        given(args.source.poses.is_some(), "--poses")?;
        given(args.source.format.is_some(), "--format")?;
        let world = portolan_sim::apartment().world;
        let scans = every(portolan_sim::lap(&world, &LapConfig::default()), args.every);
        let grid = apartment_grid(args.resolution);
        (Some(world), scans, grid, "the simulated Apartment".to_owned())
    } else {
        let log = log::read_2d(&args.log, &args.source, true)?;
        let limits = args.limits.limits(&log);
        let (fused, _) = Selection { every: args.every, hold_out: None }.split(log.len());
        let scans = log::scans(&log, &fused, &limits);
        let name = args.log.display().to_string();
        let grid =
            grid_over(seen(&scans), &settings, None, &name).map_err(|error| with_outlier(error, &scans))?;
        (None, scans, grid, name)
    };
    // Three truncated fields and two trees are built, to compare ways of fusing, and most of them again without the scans that
    // they foretell.
    check_memory(&grid, &settings, &scans, args.memory / COPIES, &name)
        .map_err(|error| with_outlier(error, &scans))
        .map_err(|error| {
            anyhow!("{error} (a gallery holds {COPIES} times that, so a {COPIES}th of --memory counts)")
        })?;
    if scans.iter().all(|(_, scan)| scan.counts().hit == 0) {
        anyhow::bail!("{name}: no beam of {} scans hit anything; there is nothing to compare", scans.len());
    }
    let mut gallery = measure(&scans, &grid, &settings, args.probes as usize, world.as_ref())?;
    if let Some(world) = &world {
        gallery.turned = Some(measure_turned(&scans, &grid, &settings, world, &args.turn)?);
    } else if !args.turn.is_empty() {
        return Err(bad_call("--turn is for demo: of a log's world nothing is known; leave it out"));
    }
    let document = document(&gallery, &name, scans.len());
    if let Some(folder) = &args.out {
        make_folder(folder)?;
        let poses = if simulated { "true poses" } else { "the log's poses" };
        let scene = Scene { gallery: &gallery, log: &scans, poses, world: world.as_ref() };
        write_files(folder, &scene, &document, &title(&name, args.resolution, scans.len()))?;
    }
    args.output.print(&document, &gallery)
}

impl Args {
    /// As `demo` has them: the textbook's weights.
    fn settings(&self) -> Settings {
        let mut settings = Settings::default();
        settings.shape.resolution = self.resolution;
        settings.shape.truncation = Some(self.truncation.unwrap_or(3.0 * self.resolution));
        settings.shape.carve_weight = 1.0;
        settings.shape.forgetting = ForgettingArgs::of(TsdfConfig::<2>::textbook().w_max);
        settings.every = self.every;
        settings.bounds = self.bounds;
        settings.resolved(Dimension::Two)
    }
}

fn every<T>(items: Vec<T>, n: Option<u64>) -> Vec<T> {
    items.into_iter().step_by(n.unwrap_or(1) as usize).collect()
}

/// The box of the Apartment, 12 m x 9 m from zero: at 5 cm the textbook's 240 x 180 cells.
pub(crate) fn apartment_grid(resolution: f64) -> Grid<2> {
    // The small number keeps a rounded-up quotient from making one more column.
    let cells = |metres: f64| (metres / resolution - 1e-9).ceil().max(1.0) as usize;
    Grid::new([0.0; 2], resolution, [cells(12.0), cells(9.0)])
}

/// Runs the comparison with the wall clock; truncation and clamp are those of the settings.
pub(crate) fn measure(
    scans: &[(Pose<2>, Scan<2>)],
    grid: &Grid<2>,
    made_with: &Settings,
    probes: usize,
    world: Option<&World>,
) -> anyhow::Result<Gallery> {
    let settings = gallery_settings(grid, made_with, probes, world);
    let start = Instant::now();
    let mut clock = || start.elapsed().as_secs_f64();
    let truth = world.map(|w| w as &dyn portolan_sim::Truth<2>);
    Ok(portolan_chapter::gallery::run(scans, &settings, truth, &mut clock)?)
}

/// How true the answers are in worlds that are turned by these angles (degrees); none given: the usual ones.
pub(crate) fn measure_turned(
    scans: &[(Pose<2>, Scan<2>)],
    grid: &Grid<2>,
    made_with: &Settings,
    world: &World,
    degrees: &[f64],
) -> anyhow::Result<Turned> {
    // Of the probes everywhere no more are held against the truth.
    let settings = gallery_settings(grid, made_with, 20_000, Some(world));
    Ok(portolan_chapter::gallery::turned(scans, &settings, world, &turns(degrees))?)
}

/// The poses of the world that these angles stand for (degrees); none given: the usual ones.
pub(crate) fn turns(degrees: &[f64]) -> Vec<Turn> {
    Turn::all(if degrees.is_empty() { &Turn::USUAL } else { degrees })
}

/// An angle.
pub(crate) fn degrees(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|d: &f64| d.is_finite())
        .ok_or_else(|| "must be an angle in degrees".to_owned())
}

fn gallery_settings(
    grid: &Grid<2>,
    made_with: &Settings,
    probes: usize,
    world: Option<&World>,
) -> GallerySettings {
    GallerySettings {
        grid: *grid,
        tsdf: TsdfConfig {
            truncation: made_with.truncation(),
            w_max: made_with.w_max(),
            ..TsdfConfig::textbook()
        },
        model: OccupancyModel::default(),
        contour: ContourSettings::default(),
        esdf: EsdfSettings::default(),
        probes,
        surface_length: world.map(World::wall_length),
    }
}

/// What heads the picture.
pub(crate) fn title(name: &str, resolution: f64, scans: usize) -> String {
    let name = Path::new(name).file_name().map_or(name.into(), |n| n.to_string_lossy());
    let cells = (resolution * 1000.0).round() / 10.0;
    format!("One log, ten views: {name}, {scans} scans, cells of {cells} cm")
}

/// Makes the folder for results.
pub(crate) fn make_folder(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| {
        format!("{}: cannot make the folder; name one that can be written to", folder.display())
    })
}

/// Writes the picture, the document and the table; gives their names.
pub(crate) fn write_files(
    folder: &Path,
    scene: &Scene,
    document: &Value,
    title: &str,
) -> anyhow::Result<[&'static str; 3]> {
    const SUBTITLE: &str = "The same scans at the same poses in every representation. Each panel names its memory, \
        what a scan (or a rebuild, for what is derived from the TSDF) costs, and what an answer costs or how true it is.";
    let png = sheet(scene, title, SUBTITLE);
    write_atomic(folder.join("gallery.png"), |w| w.write_all(&png))?;
    write_atomic(folder.join("gallery.json"), |w| writeln!(w, "{document:#}"))?;
    write_atomic(folder.join("gallery.txt"), |w| write!(w, "{}", scene.gallery))?;
    Ok(["gallery.png", "gallery.json", "gallery.txt"])
}
