//! A loop closes, and the map follows: the map of a robot's odometry becomes that of its optimized pose graph, scan by scan,
//! without mapping again, and is the map of mapping again to the last byte.
//!
//! ```text
//! cargo run --release -p portolan-cli --example loop_closure -- [--log LOG --relations FILE] [--out loop_closure.png]
//! ```
//!
//! LOG is a CARMEN log with raw odometry, RELATIONS the poses of scans relative to others: `t1 t2 x y z roll pitch yaw` (Kümmerle et
//! al. 2009). By default those of the Intel research lab, where the real logs are there, else a lap through the simulator's
//! apartment whose closures are true poses with noise.

mod planning;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, ensure};
use clap::Parser;
use planning::intel;
use portolan::geom::vector::{distance, norm};
use portolan::geom::{Aabb, Grid, Pose};
use portolan::scan::{RangeLimits, Scan};
use portolan::store::Store;
use portolan::{Answer, Ledger, MapperSettings};
use portolan_cli::library::ledger_file;
use portolan_draw::{Anchor, Canvas, Font, Pen, PixelRect, View, color};
use portolan_graph::{Edge, EdgeKind, Information, PoseGraph, Settings};
use portolan_io::{LaserLog, detect_no_return};
use portolan_sim::{OdometryNoise, Random, dead_reckon, heading, measure_motions, planar};

/// The map of a robot's odometry and that of its optimized pose graph, as a picture.
#[derive(Parser)]
struct Args {
    /// A CARMEN log with raw odometry
    #[arg(long, requires = "relations")]
    log: Option<PathBuf>,
    /// Relative poses of its scans
    #[arg(long, requires = "log")]
    relations: Option<PathBuf>,
    #[arg(long, default_value = "loop_closure.png")]
    out: PathBuf,
    /// Edge of a cell (meters)
    #[arg(long, default_value_t = 0.05)]
    resolution: f64,
}

/// What a robot knows: scans at the poses of its wheels, and places that it recognized.
struct Drive {
    name: String,
    scans: Vec<(Pose<2>, Scan<2>)>,
    /// Two scans, the pose of the second in the frame of the first.
    closures: Vec<(usize, usize, Pose<2>)>,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let real =
        intel().map(|log| [log.with_file_name("intel.clf.bz2"), log.with_file_name("intel.relations")]);
    let given = args.log.zip(args.relations).map(|(log, relations)| [log, relations]);
    let drive = match given.or(real.filter(|files| files.iter().all(|file| file.is_file()))) {
        Some([log, relations]) => recorded(&log, &relations)?,
        None => simulated(),
    };
    let optimized = optimized(&drive)?;

    let settings = MapperSettings::<2>::new(args.resolution);
    let map = |poses: &[Pose<2>]| -> anyhow::Result<Ledger<2>> {
        let mut ledger = Ledger::new(settings)?;
        for (i, (pose, (_, scan))) in poses.iter().zip(&drive.scans).enumerate() {
            ledger.add("drive", i as u64, pose, scan)?;
        }
        Ok(ledger)
    };
    let wheels: Vec<Pose<2>> = drive.scans.iter().map(|(pose, _)| *pose).collect();
    let (before, mapping) = timed(|| map(&wheels))?;
    let (after, moving) = timed(|| {
        let mut ledger = before.clone();
        for (i, (pose, (_, scan))) in optimized.iter().zip(&drive.scans).enumerate() {
            ledger.repose("drive", i as u64, pose, scan)?;
        }
        Ok(ledger)
    })?;
    let again = map(&optimized)?;
    ensure!(ledger_file(after.clone()).to_bytes()? == ledger_file(again).to_bytes()?, "the maps differ");

    let [off, left] = [&wheels, &optimized].map(|poses| median_error(&drive.closures, poses));
    let [smeared, sharp] =
        [share_on_surfaces(&before, &wheels, &drive)?, share_on_surfaces(&after, &optimized, &drive)?];
    let words = format!(
        "{}: {} scans, {} measured poses of one scan in the frame of another; those that close a loop are {off:.2} m off in the \
         median before and {left:.2} m after. Of the points that scans see, {:.0} % lie in a cell that the map holds occupied before, {:.0} % after. Mapped in {mapping:.2} s, moved in \
         {moving:.2} s; the same bytes as mapping again.",
        drive.name,
        drive.scans.len(),
        drive.closures.len(),
        100.0 * smeared,
        100.0 * sharp,
    );
    let panels = [("wheels alone", &before, &wheels), ("after the loops were closed", &after, &optimized)];
    std::fs::write(&args.out, picture(&words, panels)?).with_context(|| args.out.display().to_string())?;
    let text = format!("{words}\n{}\n", args.out.display());
    Ok(std::io::Write::write_all(&mut std::io::stdout(), text.as_bytes())?)
}

fn timed<T>(work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<(T, f64)> {
    let start = Instant::now();
    Ok((work()?, start.elapsed().as_secs_f64()))
}

/// Scans of a log a quarter of a meter or 15 degrees apart, and those that relations are about.
fn recorded(log: &Path, relations: &Path) -> anyhow::Result<Drive> {
    let name = log.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let text = std::fs::read_to_string(relations).with_context(|| relations.display().to_string())?;
    let log = LaserLog::read_carmen(log)?;
    let limits =
        RangeLimits { no_return: detect_no_return(&log).unwrap_or(f64::INFINITY), ..Default::default() };
    let times: Vec<f64> = log.raw_scans().map(|scan| scan.time.unwrap_or(f64::NAN)).collect();
    let at = |time: f64| {
        let off = |i: &usize| (times[*i] - time).abs();
        (0..times.len()).filter(|i| off(i) < 0.1).min_by(|a, b| off(a).total_cmp(&off(b)))
    };
    let (mut related, mut lost) = (Vec::new(), 0);
    for (n, line) in text.lines().enumerate() {
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        let [t1, t2, x, y, _, _, _, yaw] =
            numbers.ok().and_then(|all| <[f64; 8]>::try_from(all).ok()).with_context(|| {
                format!("{}:{}: eight numbers are wanted: {line:?}", relations.display(), n + 1)
            })?;
        if let (Some(a), Some(b)) = (at(t1), at(t2))
            && a != b
        {
            related.push((a, b, planar(x, y, yaw)));
        } else {
            lost += 1;
        }
    }
    let name = match lost {
        0 => name,
        lost => {
            format!("{name} ({lost} relations have no scan within 0.1 s of their times and are left out)")
        }
    };
    ensure!(!related.is_empty(), "{}: no relation is about a scan of {name}", relations.display());
    let mut keep = vec![false; log.len()];
    related.iter().for_each(|(a, b, _)| (keep[*a], keep[*b]) = (true, true));
    let mut last = log.raw(0).world_from_laser;
    for (i, keep) in keep.iter_mut().enumerate() {
        let motion = last.inverse() * log.raw(i).world_from_laser;
        *keep |= i == 0 || norm(motion.translation) > 0.25 || heading(&motion).abs() > 15f64.to_radians();
        last = if *keep { log.raw(i).world_from_laser } else { last };
    }
    let kept: Vec<usize> = (0..log.len()).filter(|i| keep[*i]).collect();
    let place = |i: usize| kept.binary_search(&i).unwrap_or_default();
    let closures = related.into_iter().map(|(a, b, pose)| (place(a), place(b), pose)).collect();
    let scans = kept.iter().map(|&i| (log.raw(i).world_from_laser, log.scan(i, &limits))).collect();
    Ok(Drive { name, scans, closures })
}

/// Two laps of the apartment by wheels that drift; every twentieth place of the second one is recognized.
fn simulated() -> Drive {
    const SCANS: usize = 200;
    let world = portolan_sim::apartment().world;
    let lap = |first_index| {
        portolan_sim::lap(
            &world,
            &portolan_sim::LapConfig { scans: SCANS, first_index, ..Default::default() },
        )
    };
    let scans: Vec<(Pose<2>, Scan<2>)> = lap(0).into_iter().chain(lap(SCANS as u64)).collect();
    let truth: Vec<Pose<2>> = scans.iter().map(|(pose, _)| *pose).collect();
    let wheels =
        dead_reckon(truth[0], &measure_motions(&truth, &OdometryNoise::default(), portolan_sim::SEED));
    let closure = |i: usize| {
        let mut random = Random::stream(portolan_sim::SEED, i as u64);
        let mut off = |sigma: f64| sigma * random.normal();
        let motion = truth[i].inverse() * truth[i + SCANS];
        let noise = planar(off(0.02), off(0.02), off(0.005));
        (i, i + SCANS, motion * noise)
    };
    let closures = (0..SCANS).step_by(20).map(closure).collect();
    let scans = wheels.into_iter().zip(scans).map(|(pose, (_, scan))| (pose, scan)).collect();
    Drive { name: "two laps of the apartment".into(), scans, closures }
}

/// The poses that fit wheels and recognized places best. From the wheels alone the nearest minimum may be a wrong one: rotations first
/// (chordal relaxation). No place is recognized wrongly here; where some may be, a robust kernel is needed.
fn optimized(drive: &Drive) -> anyhow::Result<Vec<Pose<2>>> {
    let mut graph = PoseGraph::<2>::new();
    for (i, (pose, _)) in drive.scans.iter().enumerate() {
        graph.add_vertex(i as u64, *pose)?;
    }
    let noise = OdometryNoise {
        position_per_metre: 0.05,
        heading_per_metre: 0.03,
        heading_per_radian: 0.05,
        ..Default::default()
    };
    for (i, pair) in drive.scans.windows(2).enumerate() {
        let motion = pair[0].0.inverse() * pair[1].0;
        let [position, turn] = noise.sigmas(&motion);
        let information = Information::from_sigmas(position, turn)?;
        let (i, j) = (i as u64, i as u64 + 1);
        graph.add_edge(Edge { i, j, i_from_j: motion, information, kind: EdgeKind::Odometry })?;
    }
    for (a, b, i_from_j) in &drive.closures {
        let (i, j) = (*a as u64, *b as u64);
        let information = Information::from_sigmas(0.05, 0.01)?;
        graph.add_edge(Edge { i, j, i_from_j: *i_from_j, information, kind: EdgeKind::Closure })?;
    }
    graph.set_fixed(0, true)?;
    graph.start_from_chordal()?;
    graph.optimize(&Settings::default())?;
    Ok((0..drive.scans.len() as u64).filter_map(|i| graph.pose(i).copied()).collect())
}

/// Places that are recognized so many scans later close a loop.
const LOOP: usize = 50;

/// How far the ends of loops are apart that should be one place, in the median (meters).
fn median_error(closures: &[(usize, usize, Pose<2>)], poses: &[Pose<2>]) -> f64 {
    let error = |(a, b, pose): &(usize, usize, Pose<2>)| {
        distance((poses[*a] * *pose).translation, poses[*b].translation)
    };
    let loops = closures.iter().filter(|(a, b, _)| a.abs_diff(*b) >= LOOP);
    let mut errors: Vec<f64> = loops.map(error).collect();
    errors.sort_by(f64::total_cmp);
    errors.get(errors.len() / 2).copied().unwrap_or(0.0)
}

/// The share of all points that lie in cells that are more likely occupied than not.
fn share_on_surfaces(ledger: &Ledger<2>, poses: &[Pose<2>], drive: &Drive) -> anyhow::Result<f64> {
    let mapper = ledger.mapper()?;
    let occupancy = mapper.occupancy().context("there is no occupancy")?;
    let points = || poses.iter().zip(&drive.scans).flat_map(|(pose, (_, scan))| scan.hits_world(pose));
    let on = points().filter(|p| occupancy.probability(*p).known().is_some_and(|p| p > 0.5)).count();
    Ok(on as f64 / points().count().max(1) as f64)
}

/// Two maps beside each other, with the way of the robot.
fn picture(words: &str, panels: [(&str, &Ledger<2>, &Vec<Pose<2>>); 2]) -> anyhow::Result<Vec<u8>> {
    const MARGIN: f64 = 28.0;
    const WIDTH: f64 = 760.0;
    let (heading, small) = (Font::new(24).bold(), Font::new(16));
    let lines = small.wrap(words, 2.0 * WIDTH + MARGIN);
    let top = MARGIN + 40.0 + 18.0 * lines.len() as f64 + 30.0;
    let mut canvas = Canvas::new((2.0 * WIDTH + 3.0 * MARGIN) as u32, (top + WIDTH + MARGIN) as u32);
    canvas.text([MARGIN, MARGIN - 4.0], "A loop closes, and the map follows", heading, Anchor::Left);
    for (k, line) in lines.iter().enumerate() {
        canvas.text([MARGIN, MARGIN + 28.0 + 18.0 * k as f64], line, small.color(color::MUTED), Anchor::Left);
    }
    for (k, (name, ledger, poses)) in panels.into_iter().enumerate() {
        let mapper = ledger.mapper()?;
        let occupancy = mapper.occupancy().context("there is no occupancy")?;
        let mut seen = Aabb::EMPTY;
        poses.iter().for_each(|pose| seen.include(pose.translation));
        let resolution = occupancy.store().lattice().resolution;
        let grid = Grid::covering(seen.grown(4.0), resolution).context("the drive has no box")?;
        let rect = PixelRect::new(MARGIN + k as f64 * (WIDTH + MARGIN), top, WIDTH, WIDTH);
        let view = View::fit(grid.aabb().min, grid.aabb().max, rect);
        canvas.text([rect.x, top - 26.0], name, small.bold(), Anchor::Left);
        canvas.fill_rect(view.rect(), color::UNKNOWN);
        canvas.raster(&view, grid.shape, grid.lattice.origin, resolution, |[x, y]| {
            match occupancy.probability(grid.lattice.center([x as i32, y as i32])) {
                Answer::Known(p) => color::occupancy(p),
                _ => color::UNKNOWN,
            }
        });
        let way: Vec<[f64; 2]> = poses.iter().map(|pose| pose.translation).collect();
        canvas.polyline(&view, &way, Pen::new(color::POSITIVE.with_alpha(0.5), 1.5));
        canvas.scale_bar(&view);
    }
    Ok(canvas.encode_png())
}
