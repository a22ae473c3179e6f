//! `map`: fuse a log into maps.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, anyhow, bail};
use portolan::geom::Aabb;
use portolan::scan::ScanStats;
use portolan_io::{IoError, Manifest, detect_no_return, write_atomic};

use crate::arguments::{box3, bytes, length_or_zero, shard};
use crate::dimension::{Dimension, Given, ONLY_3D};
use crate::error::{self, bad_call};
use crate::esdf::check_thin;
use crate::folder::Results;
use crate::json;
use crate::log::{self, Log, LogArgs, Wanted};
use crate::mapping::{
    ARTIFACTS, Artifacts, Derived, FusionReport, Limits, Looking, MapKind, Run, Settings, Summary, TOO_LARGE,
    Written, report, title,
};
use crate::output::Output;
use crate::progress::Progress;
use crate::saved::SavedMap;
use crate::stop::{self, Signal};
use crate::up::Up;

#[derive(Clone, clap::Args)]
#[command(after_help = "Examples:\n  portolan map intel-corrected.log.gz --resolution 0.05 --out intel\n  \
                  portolan map rgbd_redkitchen --resolution 0.02 --out kitchen")]
pub(crate) struct Args {
    /// Log of range scans with poses, 2-D or 3-D; the format is detected
    log: PathBuf,
    /// Folder for the results; created if missing. A map that is there is not replaced without --overwrite
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    settings: Given<Settings>,
    /// Write only this box of the esdf into esdf.bin, for a field larger than 256 MiB
    #[arg(long, value_name = "BOX", value_parser = box3, allow_hyphen_values = true, help_heading = ONLY_3D)]
    dense: Option<Aabb<3>>,
    /// Add the log to the map in DIR. Settings that are not given are those of the map, except --bounds
    #[arg(long)]
    append: bool,
    /// Replace the map in DIR, and what was written with it
    #[arg(long, conflicts_with_all = ["append", "repose"])]
    overwrite: bool,
    /// Map only part I of N of the log's scans, as sums (--ledger): `merge` adds the parts up to the map of the whole log,
    /// the same bytes. Writes the map alone
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<(usize, usize)>,
    /// Move the scans of the map in DIR, which was made with --ledger, to these poses of the same log: the map becomes that
    /// of the log with these poses, the same bytes. --poses and the like are those that it was made with
    #[arg(long, value_name = "POSES", conflicts_with_all = ["append", "shard"])]
    repose: Option<PathBuf>,
    /// Leave scans where they are whose sensor, and whatever it sees 10 m away, moves by no more than this (meters) [default:
    /// 0]
    #[arg(long, value_name = "M", value_parser = length_or_zero, requires = "repose", allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Number of threads [default: one per core]; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), allow_negative_numbers = true)]
    threads: Option<u16>,
    /// Memory for the maps, with suffix K, M or G
    #[arg(long, value_name = "BYTES", value_parser = bytes, default_value = "4G")]
    memory: u64,
    #[command(flatten)]
    source: LogArgs,
    #[command(flatten)]
    output: Output,
}

/// A log of which a larger share of scans cannot be read is damaged, or not what it is taken for; a smaller one is left out.
const MOST_LOST: f64 = 0.5;

/// Fuses the log.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let dimension = args.source.dimension(&args.log)?;
    dimension.check::<Args, _>(&args.settings, "the log")?;
    let mut stages = Stages::start();
    let threads = start_threads(args.threads)?;
    // Whatever cannot work does not do so before the log is read, and nobody else writes until this run has ended.
    let mut results = args.claim()?;
    let before = args.saved_map(dimension)?;
    let mut settings = args.settings(dimension, before.as_ref())?;
    let told = settings.no_return.no_return;
    let log = args.open(&mut settings)?;
    stages.end("read");

    let (fused, held_out) = settings.selection().split(log.len());
    let (whole, fused) = (fused.clone(), args.part(fused));
    let (log_name, map_name) = (args.log.display().to_string(), args.map_path().display().to_string());
    let memory = usize::try_from(args.memory).unwrap_or(usize::MAX);
    let limits = Limits { memory, log: &log_name, map: &map_name };
    let mut run = Run::new(&log, &fused, &settings, before, &limits)?;
    stages.end("prepare");
    if let Some(pose_sigma) = settings.shape.movers {
        // At all scans, whatever part is fused: parts of a log add up to the map of the whole.
        let progress = Progress::new(whole.len(), "looking for what moved", args.output);
        run.look(&Looking { pose_sigma, indices: &whole, memory, progress: &progress })?;
        stages.end("movers");
    }

    // From here on there is something to save.
    let mut hold = None;
    let (fusion, taken) = match &args.repose {
        Some(poses) => args.repose(poses, &mut run, &log, &settings)?,
        None => {
            hold = Some(stop::hold());
            let progress = Progress::new(run.scans(), "fusing", args.output);
            (run.fuse(threads, &progress), ScanStats::default())
        }
    };
    stages.end("fuse");
    if let Some(why) = &fusion.contradiction {
        bail!("{log_name}: {why}; logs are known by their file names: give this one another name");
    }
    let scans = fusion.stats.scans;
    let stopped = stop::asked();
    if let Some(signal) = stopped {
        args.check_worth_saving(signal, scans, fused.len(), settings.shape.ledger)?;
    }
    if let (0, None, (_, Some(error))) = (fusion.stats.scans, &args.repose, &fusion.unreadable) {
        // Not one scan could be used: the first error is of more use than an empty map.
        bail!("{error}");
    }
    if let (lost, (_, Some(first))) = (fusion.damaged, &fusion.unreadable)
        && lost as f64 > MOST_LOST * fused.len() as f64
    {
        bail!(
            "{log_name}: {lost} of {} scans cannot be read, more than half (first: {first}); {}",
            fused.len(),
            args.as_it_was()
        );
    }
    if let (0, Some(full)) = (fusion.stats.scans, &fusion.full)
        && settings.shape.ledger
    {
        bail!(
            "{log_name}: {full}; not one scan was fused; start again with more --memory, a coarser --resolution or --bounds"
        );
    }
    let (mut file, extent, aside) = run.finish(&settings)?;
    stages.end("store");
    let mut bytes = file.bytes();
    // What was found in a log is no setting of a map that may have others.
    let mut noted = settings.clone();
    if noted.shape.ledger {
        noted.no_return.no_return = told;
    } else if let (None, Log::Three(log), SavedMap::Three(file)) = (settings.up, &log, &file) {
        settings.up = Some(Up::estimate(log, file));
        noted.up = settings.up;
    }
    describe(&mut file, &noted, &log, &fusion.stats, &taken);
    // Before anything is derived from it: whatever happens then, what was fused is saved.
    let path = results.map_file()?;
    let copies = match &aside {
        Some(parts) => parts.add_up(&mut file, &path, args.memory)?,
        None => {
            file.write(&path).map_err(|error| args.not_saved(error))?;
            file.copies()
        }
    };
    results.publish()?;
    stop::leaves(format!("{map_name} is saved, the files around it are not whole"));
    drop(hold);
    stages.end("save");
    let stopped = stopped.or(stop::asked());
    let alone = args.shard.is_some() || aside.is_some() || stopped.is_some();

    let derived = if alone { Derived::default() } else { Derived::of(&file, &settings, memory) };
    bytes.extend(derived.bytes());
    let header = file.header();
    let title = title(&header.logs, settings.resolution(), header.scans);
    let (dense, camera) = (args.dense, log.is_of_camera());
    let artifacts = Artifacts {
        file: &file,
        derived: &derived,
        dense,
        edge: settings.resolution(),
        camera,
        movers: fusion.movers.as_ref(),
        sigma: fusion.sigma.as_ref().and_then(|sigma| sigma.as_ref().ok()),
        title,
    };
    let written = if alone {
        let mut written = Written::of_map_alone();
        artifacts.write_movers(&args.out, &mut written).map(|()| written)
    } else {
        artifacts.write(&args.out)
    };
    let mut written = written.map_err(|error| args.not_whole(&error))?;
    written.notes.extend(copies);
    written.notes.extend(aside.as_ref().filter(|_| args.shard.is_none()).map(|_| TOO_LARGE.to_owned()));
    written.notes.extend(stopped.map(|signal| {
        format!(
            "{} ended this run after {scans} of {} scans: the map was written alone",
            signal.name(),
            fused.len()
        )
    }));
    let mut seconds = stages.total();
    seconds.extend(fusion.seconds.iter().chain(&derived.seconds).chain(&written.seconds));
    let mut files = written.files;
    files.extend(["summary.json", Manifest::NAME]);
    let summary = Summary {
        log: &log,
        settings: &settings,
        extent,
        held_out: held_out.len(),
        fusion: &fusion,
        file: &file,
        derived: &derived,
        notes: written.notes,
        bytes,
        seconds,
        files: files.clone(),
    };
    let document = summary.to_json();
    write_atomic(args.out.join("summary.json"), |w| writeln!(w, "{document:#}"))
        .map_err(|error| args.not_whole(&error.into()))?;
    results.complete(&files).map_err(|error| args.not_whole(&error))?;
    args.output.print(&document, report(&summary, &args.out.display().to_string()))?;
    if let Some(signal) = stopped {
        return Err(error::stopped(
            signal,
            format!(
                "{scans} of {} scans are fused and saved in {map_name}, alone: convert and mesh make the rest of it; for all \
                 scans start again with --overwrite",
                fused.len()
            ),
        ));
    }
    if let Some(full) = &fusion.full {
        bail!(
            "{log_name}: {full}; {} of {} scans were fused and saved; start again with more --memory, a coarser \
             --resolution or --bounds",
            fusion.stats.scans,
            fused.len()
        );
    }
    Ok(())
}

/// Writes the log, the settings and the counts into the header: of scans that were added, and of those that were taken out.
fn describe(file: &mut SavedMap, settings: &Settings, log: &Log, stats: &ScanStats, taken: &ScanStats) {
    let header = file.header_mut();
    // A ledger knows its scans.
    if !settings.shape.ledger {
        header.logs.push(log.name());
        header.scans += stats.scans;
    }
    json::take_counts(&mut header.statistics, &json::object(json::stats(taken)));
    // Every scan, said or not, is the same.
    header.every = settings.every.filter(|n| *n > 1);
    header.hold_out = settings.shape.hold_out;
    header.settings = settings.to_json();
    json::add_counts(&mut header.statistics, &json::object(json::stats(stats)));
}

impl Args {
    fn map_path(&self) -> PathBuf {
        self.out.join("map.portolan")
    }

    /// Those of the scans that are of this part.
    fn part(&self, scans: Vec<usize>) -> Vec<usize> {
        match self.shard {
            Some((part, parts)) => {
                let [from, to] = [part - 1, part].map(|i| scans.len() * i / parts);
                scans[from..to].to_vec()
            }
            None => scans,
        }
    }

    /// Moves scans to other poses. Returns what is to be said of those that moved, and what taking them away did.
    fn repose(
        &self,
        poses: &Path,
        run: &mut Run,
        log: &Log,
        settings: &Settings,
    ) -> anyhow::Result<(FusionReport, ScanStats)> {
        let Run::Sums(run) = run else { bail!("{}: holds no sums", self.map_path().display()) };
        let source = LogArgs { poses: Some(poses.to_owned()), ..self.source.clone() };
        let moved = Self { source, ..self.clone() }.open(&mut settings.clone())?;
        let progress = Progress::new(log.len(), "moving", self.output);
        let done = run.repose(&moved, settings, self.tolerance.unwrap_or(0.0), &progress)?;
        let moved = Some([done.moved, done.held]);
        Ok((FusionReport { stats: done.added, moved, ..FusionReport::default() }, done.taken))
    }

    /// The map to go on with.
    fn saved_map(&self, dimension: Dimension) -> anyhow::Result<Option<SavedMap>> {
        if self.append || self.repose.is_some() {
            let file = SavedMap::read_to_append(&self.map_path(), self.memory, dimension)?;
            if self.repose.is_some() && file.header().settings.contains_key("movers") {
                bail!(
                    "{}: was made with --movers, and what moved is another thing with other poses; map the log anew",
                    self.map_path().display()
                );
            }
            if self.repose.is_some() && !file.is_ledger() {
                bail!(
                    "{}: scans can be moved in maps made with --ledger only; clamped cells do not give them back",
                    self.map_path().display()
                );
            }
            return Ok(Some(file));
        }
        Ok(None)
    }

    /// Takes the folder, unless what is in it would be lost.
    fn claim(&self) -> anyhow::Result<Results> {
        let goes_on = self.append || self.repose.is_some();
        if let (false, Ok(out), Ok(log)) = (goes_on, self.out.canonicalize(), self.log.canonicalize())
            && out == log
            && out.is_dir()
        {
            return Err(bad_call("--out is the log's own folder; name another one"));
        }
        let results = Results::claim(&self.out, "map", &ARTIFACTS)?;
        if !goes_on && !self.overwrite {
            results.refuse_to_replace()?;
        }
        stop::leaves(self.as_it_was());
        Ok(results)
    }

    /// What a run that writes nothing leaves.
    fn as_it_was(&self) -> String {
        match self.map_path().exists() {
            true => format!("{} is as it was", self.map_path().display()),
            false => "nothing was written".to_owned(),
        }
    }

    /// Whether what was fused up to a signal is a map to keep. Scans that were added to clamped maps cannot be told from those
    /// that are missing, so that nobody could go on with such a map; and a part of a log is merged as if it were whole.
    fn check_worth_saving(&self, signal: Signal, scans: u64, of: usize, sums: bool) -> anyhow::Result<()> {
        let whole = scans as usize == of;
        if scans > 0 && (whole || self.shard.is_none() && (sums || !self.append)) {
            return Ok(());
        }
        Err(error::stopped(signal, format!("{} after {scans} of {of} scans; start again", self.as_it_was())))
    }

    fn not_saved(&self, error: IoError) -> anyhow::Error {
        anyhow!("{}: {error}; {}", self.map_path().display(), self.as_it_was())
    }

    fn not_whole(&self, error: &anyhow::Error) -> anyhow::Error {
        anyhow!("{error:#}; {} is saved, the files around it are not whole", self.map_path().display())
    }

    /// What was given, else what the map to go on with was made with, else the defaults.
    fn settings(&self, dimension: Dimension, before: Option<&SavedMap>) -> anyhow::Result<Settings> {
        let map = self.map_path().display().to_string();
        let saved = before.map(|file| &file.header().settings);
        let base = saved.map(Settings::of_saved).unwrap_or_default();
        let mut settings = self.settings.over(base)?;
        if self.shard.is_some() {
            if self.settings.has("w_max") || self.settings.has("half_life") {
                return Err(bad_call(
                    "--shard makes a map of sums, which do not forget: leave out --w-max and --half-life",
                ));
            }
            settings.shape.ledger = true;
        }
        let settings = settings.resolved(dimension);
        settings.check(dimension)?;
        check_thin(self.settings.has("thin"), settings.esdf)?;
        if let Some(saved) = saved {
            settings.check_agree(saved, &map)?;
        }
        if self.dense.is_some() && !settings.wants(MapKind::Esdf) {
            return Err(bad_call("--dense is about the esdf, which --maps leaves out"));
        }
        Ok(settings)
    }

    /// Opens the log. From a 2-D log comes the range of readings without echo, where it was not given.
    fn open(&self, settings: &mut Settings) -> anyhow::Result<Log> {
        if settings.dimension == Dimension::Two {
            let log = log::read_2d(&self.log, &self.source, settings.shape.deskew)?;
            let no_return = &mut settings.no_return.no_return;
            *no_return = no_return.or_else(|| detect_no_return(&log));
            return Ok(Log::Two(Box::new(log)));
        }
        let shape = &settings.shape;
        let wanted = Wanted { color: shape.color, deskew: shape.deskew, points_only: shape.points_only };
        let log = log::read_3d(&self.log, &self.source, wanted)?;
        self.source.check_sensor(&log)?;
        if !log.knows_origins() && !settings.shape.points_only {
            if self.append {
                bail!(
                    "{}: its points do not say where they were seen from, and the map in {} is made of rays; give --origin or \
                     --poses, or write to another folder",
                    self.log.display(),
                    self.out.display()
                );
            }
            *settings = settings.clone().without_rays(self.settings.has("maps"))?;
        }
        Ok(Log::Three(Box::new(log)))
    }
}

/// Number of threads. Those that share out the work are started where a number was asked for, else when they are needed.
fn start_threads(threads: Option<u16>) -> anyhow::Result<usize> {
    let Some(threads) = threads.map(usize::from) else {
        return Ok(std::thread::available_parallelism().map_or(1, usize::from));
    };
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().context("cannot start threads")?;
    Ok(threads)
}

/// Seconds per stage.
struct Stages {
    start: Instant,
    last: Instant,
    seconds: BTreeMap<&'static str, f64>,
}

impl Stages {
    fn start() -> Self {
        let start = Instant::now();
        Self { start, last: start, seconds: BTreeMap::new() }
    }

    /// The stage that ends here.
    fn end(&mut self, name: &'static str) {
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
