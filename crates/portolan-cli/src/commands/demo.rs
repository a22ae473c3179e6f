//! `demo`: the chapter's experiment on the simulated Apartment.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::bail;
use portolan::gallery::{ErrorSummary, Gallery};
use portolan::geom::{Grid, Pose};
use portolan::map::SweepKind;
use portolan::scan::{RangeLimits, Scan, ScanStats};
use portolan::sweep::WeightModel;
use portolan_io::{MapFile, write_atomic};
use portolan_sim::{LapConfig, Lidar, SEED, World};
use serde_json::{Value, json};

use super::gallery;
use crate::json;
use crate::mapping::{Artefacts, Derived, FusionReport, MapKind, Maps, Settings, fuse};
use crate::output::Output;
use crate::pictures::Scene;
use crate::progress::Progress;
use crate::report::{self, Facts};

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
    #[command(flatten)]
    output: Output,
}

/// The chapter's: cells of 5 cm, truncation 15 cm.
const RESOLUTION: f64 = 0.05;
const TRUNCATION: f64 = 0.15;
/// Probes per direct question.
const PROBES: usize = 100_000;

fn seed(text: &str) -> Result<u64, String> {
    let parsed = match text.trim().to_ascii_lowercase().strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16),
        None => text.trim().parse(),
    };
    parsed.map_err(|_| "must be a whole number, like 7 or 0xC0FFEE".to_owned())
}

/// Simulates the lap, builds every representation, writes everything.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    if args.out.exists() && !args.out.is_dir() {
        bail!("{}: is a file, not a folder; name a folder for the results", args.out.display());
    }
    let mut run = Run::default();
    let config =
        LapConfig { scans: args.scans as usize, seed: args.seed.unwrap_or(SEED), ..Default::default() };

    let world = portolan_sim::apartment().world;
    let scans = run.timed("simulate", || portolan_sim::lap(&world, &config));
    let settings = settings(&config.lidar);
    let grid = gallery::apartment_grid(RESOLUTION);
    let (mut file, fusion, bytes) = run.timed("fuse", || fused(&settings, &grid, &scans, args.output))?;
    describe(&mut file, &settings, &config, &fusion.stats);
    let derived = run.timed("derive", || Derived::of(&file, &settings));
    let gallery =
        run.timed("gallery", || gallery::measure(&scans, &grid, TRUNCATION, PROBES, Some(&world)))?;

    gallery::make_folder(&args.out)?;
    let scene = Scene { gallery: &gallery, log: &scans, world: Some(&world) };
    let table = gallery::document(&gallery, "the simulated Apartment", scans.len());
    let title = gallery::title("the Apartment", RESOLUTION, scans.len());
    let written = run.timed("gallery_files", || gallery::write_files(&args.out, &scene, &table, &title))?;
    run.files.extend(written);
    let title = format!("The Apartment · cells of 5 cm · {} scans", scans.len());
    let artefacts = Artefacts { file: &file, derived: &derived, title };
    let (written, _) = run.timed("map_files", || artefacts.write(&args.out))?;
    run.files.extend(written);
    run.files.extend(["report.html", "summary.json"]);

    let found =
        Found { config, settings, grid, world: &world, fusion, bytes, file, derived, gallery: &gallery };
    let facts = Facts {
        scene,
        esdf_against_contour: against_contour(&gallery),
        seconds: run.total(),
        warnings: found.warnings(),
    };
    let page = run.timed("report", || report::html(&facts));
    write_atomic(args.out.join("report.html"), |w| w.write_all(page.as_bytes()))?;
    let mut summary = found.to_json(&run);
    write_atomic(args.out.join("summary.json"), |w| writeln!(w, "{summary:#}"))?;
    summary["gallery"] = table;
    args.output.print(&summary, found.report(&run, &args.out.display().to_string()))
}

/// The ESDF against the contour: distances at free points beside every eighth cell centre, off it so that the
/// interpolation is measured too.
fn against_contour(gallery: &Gallery) -> Option<ErrorSummary> {
    let (field, contour) = (&gallery.distance, &gallery.contour);
    let grid = field.grid();
    let errors = (0..grid.len()).step_by(8).filter(|&i| field.samples()[i] > 0.0).filter_map(|i| {
        let [x, y] = grid.lattice.center(grid.cell(i));
        let p = [x + 0.3 * grid.lattice.resolution, y - 0.2 * grid.lattice.resolution];
        let d = field.distance(p).known().filter(|d| *d > 0.0)?;
        Some(d - contour.nearest_distance(p)?)
    });
    ErrorSummary::of(errors.collect())
}

/// Files written and seconds spent.
#[derive(Default)]
struct Run {
    seconds: BTreeMap<&'static str, f64>,
    files: Vec<&'static str>,
}

impl Run {
    fn timed<T>(&mut self, stage: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let made = work();
        self.seconds.insert(stage, start.elapsed().as_secs_f64());
        made
    }

    fn total(&self) -> f64 {
        self.seconds.values().sum()
    }
}

fn settings(lidar: &Lidar) -> Settings {
    Settings {
        resolution: RESOLUTION,
        truncation: TRUNCATION,
        w_max: 64.0,
        weights: WeightModel::default(),
        sweep: SweepKind::default(),
        carve: true,
        carve_weight: 1.0,
        limits: RangeLimits { max: lidar.max_range, ..Default::default() },
        every: None,
        hold_out: None,
        bounds: None,
        maps: vec![MapKind::Grid, MapKind::Tree, MapKind::Tsdf, MapKind::Esdf, MapKind::Contour],
    }
}

/// The maps of all scans, as `map` makes them.
fn fused(
    settings: &Settings,
    grid: &Grid<2>,
    scans: &[(Pose<2>, Scan<2>)],
    output: Output,
) -> anyhow::Result<(MapFile, FusionReport, BTreeMap<&'static str, usize>)> {
    let mut maps = settings.empty_maps(grid)?;
    let progress = Progress::new(scans.len() * maps.count(), "fusing", output);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let fusion = fuse(&mut maps, scans, settings.carve, threads, &progress);
    let bytes = maps.bytes();
    let Maps { grid, tree, tsdf } = maps;
    let poses = scans.iter().map(|(pose, _)| *pose).collect();
    let mut file = MapFile::default();
    (file.grid, file.tree, file.tsdf, file.poses) = (grid, tree, tsdf, poses);
    Ok((file, fusion, bytes))
}

/// Writes into the file's header what it is made of.
fn describe(file: &mut MapFile, settings: &Settings, config: &LapConfig, stats: &ScanStats) {
    file.header.logs.push(format!("simulated Apartment, seed {:#x}", config.seed));
    file.header.scans = stats.scans;
    file.header.settings = settings.to_json();
    file.header.statistics = json::object(json::stats(stats));
}

/// Everything that a run found out.
struct Found<'a> {
    config: LapConfig,
    settings: Settings,
    grid: Grid<2>,
    world: &'a World,
    fusion: FusionReport,
    /// Bytes of each map, measured.
    bytes: BTreeMap<&'static str, usize>,
    file: MapFile,
    derived: Derived,
    gallery: &'a Gallery,
}

impl Found<'_> {
    /// `summary.json`, with the fields that `map` writes.
    fn to_json(&self, run: &Run) -> Value {
        let stats = json::stats(&self.fusion.stats);
        let lidar = &self.config.lidar;
        let mut bytes = self.bytes.clone();
        bytes.extend(self.derived.bytes());
        let contour = self.derived.contour.as_ref().map(|c| {
            json!({
                "segments": c.segments.len(),
                "length": c.length(),
                "doubled_share": self.derived.doubled.share(),
                "thin_length": self.derived.thin.thin,
            })
        });
        let mut seconds = run.seconds.clone();
        seconds.extend(self.fusion.seconds.iter());
        seconds.extend(self.derived.seconds.iter());
        seconds.insert("total", run.total());
        json!({
            "program": concat!("portolan ", env!("CARGO_PKG_VERSION")),
            "input": {
                "simulated": "apartment",
                "seed": self.config.seed,
                "scans": self.config.scans,
                "poses": "true",
                "lidar": {
                    "beams": lidar.beams, "noise": lidar.noise, "max_range": lidar.max_range,
                    "no_return_rate": lidar.no_return_rate, "dropped_rate": lidar.dropped_rate,
                },
                "wall_length": self.world.wall_length(),
            },
            "settings": self.settings.to_json(),
            "scans": {
                "in_log": self.config.scans, "held_out": 0, "fused": self.fusion.stats.scans,
                "refused_poses": self.fusion.stats.refused_poses, "in_map": self.file.header.scans,
            },
            "beams": stats["beams"],
            "refused_beams": stats["refused_beams"],
            "observations": self.fusion.observations,
            "extent": json::grid(&self.grid),
            "contour": contour,
            "bytes": bytes,
            "seconds": seconds,
            "logs": self.file.header.logs,
            "warnings": self.warnings(),
            "files": run.files,
        })
    }

    /// What should be known before the maps are trusted.
    fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let thin = &self.derived.thin;
        if thin.thin > 0.0 {
            warnings.push(format!(
                "{:.1} m of contour ({:.1} %) belong to things thinner than twice the truncation, seen from both \
                 sides: they are eroded",
                thin.thin,
                100.0 * thin.thin / thin.total
            ));
        }
        let esdf = self.gallery.rows.iter().find(|r| r.name.starts_with("ESDF"));
        if let Some(e) = esdf.and_then(|r| r.distance_error).filter(|e| e.worst_over > 0.0) {
            warnings.push(format!(
                "the ESDF's distances are up to {:.0} mm too large (and {:.0} mm too small); median error {:.1} mm, \
                 p99 {:.1} mm: keep that much margin",
                1e3 * e.worst_over,
                1e3 * e.worst_under,
                1e3 * e.median,
                1e3 * e.p99
            ));
        }
        warnings
    }

    /// The summary for people: the table first.
    fn report(&self, run: &Run, folder: &str) -> String {
        let stats = &self.fusion.stats;
        let mut text = format!("{}\n", self.gallery);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "simulated lap of the Apartment, seed {:#x}: {} scans at their true poses, {} hits, {} without echo, {} lost",
            self.config.seed, stats.scans, stats.beams.hit, stats.beams.no_return, stats.beams.dropped
        );
        for warning in self.warnings() {
            let _ = writeln!(text, "warning: {warning}");
        }
        let s = |name: &str| run.seconds.get(name).copied().unwrap_or(0.0);
        let _ = writeln!(
            text,
            "simulated {:.2} s, fused {:.2} s, measured {:.2} s, written {:.2} s",
            s("simulate"),
            s("fuse") + s("derive"),
            s("gallery"),
            s("gallery_files") + s("map_files") + s("report")
        );
        let _ = writeln!(text, "wrote {} to {folder}", run.files.join(", "));
        text
    }
}
