//! `studio`: the local web app in which maps are watched while they are made.

use std::io::{self, Write};
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{anyhow, bail};
use portolan::map::{Attenuation, Tsdf3, TsdfConfig};
use portolan_io::{FileKind, Manifest, detect, read_ply_cloud};
use portolan_studio::engine::{BesideMap, Limits, Logs, Source2d, Source3d, check};
use portolan_studio::server::{Server, Settings};
use serde_json::json;

use crate::arguments::bytes;
use crate::dimension::{Dimension, Given, ONLY_3D};
use crate::error::{bad_call, stopped};
use crate::folder;
use crate::log::{self, LimitArgs, LogArgs, Selection, Wanted};
use crate::mapping::{MOVERS_FILE, SIGMA_FILE, read_sigma, with_outlier};
use crate::output::Output;
use crate::saved::SavedMap;
use crate::stop::{self, Signal};
use crate::up::{Up, up};

#[derive(clap::Args)]
#[command(
    after_help = "Open the printed address in a browser. Every tab has its own maps, which are freed when it is closed. \
                  Ctrl-C stops the studio.

Examples:
  portolan studio
  portolan studio \
                  intel-corrected.log.gz --every 2
  portolan studio out/kitchen"
)]
pub(crate) struct Args {
    #[command(flatten)]
    given: Given<()>,
    /// Log of range scans with poses, 2-D or 3-D, or a 3-D map written by `map`; the format is detected. Views that it
    /// does not fit show simulated scans, as all views do without a log
    log: Option<PathBuf>,
    /// Port to listen on; 0 takes any free port
    #[arg(long, value_name = "PORT", default_value = "7700")]
    port: u16,
    /// Address to listen on. With any but a loopback address, whoever can reach this machine and has the printed address, which
    /// holds a token, can use the studio
    #[arg(long, value_name = "ADDRESS", value_parser = host, default_value = "127.0.0.1")]
    host: IpAddr,
    /// Put a random token into the address, without which other users of this machine are not let in either
    #[arg(long)]
    token: bool,
    /// Largest number of tabs at the same time; further tabs wait
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), default_value = "8")]
    sessions: u16,
    /// Memory for the maps of each tab, with suffix K, M or G
    #[arg(long, value_name = "BYTES", value_parser = bytes, default_value = "2G")]
    memory: u64,
    /// Use only every N-th scan of the log
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<u64>,
    /// Which way is up: an axis like +z or -y, or a direction x,y,z [default: as the map says, or how the sensors of the log were
    /// held]
    #[arg(long, value_name = "AXIS|X,Y,Z", value_parser = up, allow_hyphen_values = true, requires = "log", help_heading = ONLY_3D)]
    up: Option<Up>,
    #[command(flatten)]
    source: LogArgs,
    #[command(flatten)]
    limits: LimitArgs,
    #[command(flatten)]
    output: Output,
}

/// Serves until Ctrl-C or SIGTERM.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let logs = Arc::new(args.logs()?);
    args.check_shown(&logs)?;
    let server = args.listen(logs.clone())?;
    args.warn_of_others()?;
    args.announce(&server, &logs)?;
    match stop::wait() {
        Some(signal) => {
            server.close();
            // Ctrl-C is how it is told to stop.
            match signal {
                Signal::Interrupt => Ok(()),
                Signal::Terminate => Err(stopped(signal, "the studio is closed")),
            }
        }
        None => Ok(server.wait()?),
    }
}

/// `localhost`, or an address.
fn host(text: &str) -> Result<IpAddr, String> {
    match text {
        "localhost" => Ok(Ipv4Addr::LOCALHOST.into()),
        _ => text.parse().map_err(|_| "must be an address of this machine, like 127.0.0.1 or 0.0.0.0".into()),
    }
}

impl Args {
    /// What is shown: the log where one was given, simulated scans elsewhere.
    fn logs(&self) -> anyhow::Result<Logs> {
        let Some(path) = &self.log else {
            self.check_no_log()?;
            return Ok(Logs::default());
        };
        if self.source.format.is_none()
            && matches!(detect(path)?, FileKind::Portolan | FileKind::PortolanFolder)
        {
            return self.map(path);
        }
        match self.source.dimension(path)? {
            Dimension::Two => self.log_2d(path),
            Dimension::Three => self.log_3d(path),
        }
    }

    /// A 3-D map that was made before.
    fn map(&self, path: &Path) -> anyhow::Result<Logs> {
        if self.every.is_some() || self.given.has_any::<LimitArgs>() {
            return Err(bad_call("--every, --min-range and the like are options for logs; this is a map"));
        }
        let shown = path.display();
        let mut beside = beside(if path.is_dir() { path } else { path.parent().unwrap_or(Path::new("")) })?;
        let file = if path.is_dir() { path.join("map.portolan") } else { path.into() };
        let Some(file) = SavedMap::read(&file, self.memory)?.in_3d() else {
            bail!("{shown}: a 2-D map; give the log that it was made of, and the studio makes the map again");
        };
        let up = self.up.or_else(|| Up::of_header(&file.header)).unwrap_or(Up::Z).0;
        let Some(held) = file.tsdf_bricks else {
            bail!("{shown}: the map has no tsdf, and so no surface; make it with --maps tsdf");
        };
        let config = TsdfConfig {
            truncation: held.truncation,
            w_max: held.w_max,
            carve_weight: held.carve_weight,
            weights: held.weights,
            ..TsdfConfig::default()
        };
        beside.attenuation =
            file.attenuation.map(|held| Attenuation::from_store(held.store, held.rule)).transpose()?;
        let tsdf = Tsdf3::from_stores(held.store, file.color_bricks.map(|c| c.store), config)?;
        let source_3d =
            Source3d::Map { name: name(path), tsdf: Box::new(tsdf), up, beside: Box::new(beside) };
        Ok(Logs { source_3d, ..Logs::default() })
    }

    fn log_2d(&self, path: &Path) -> anyhow::Result<Logs> {
        Dimension::Two.check::<Self, _>(&self.given, "the log")?;
        let log = log::read_2d(path, &self.source, true)?;
        let (shown, _) = Selection { every: self.every, hold_out: None }.split(log.len());
        let scans = log::scans(&log, &shown, &self.limits.limits(&log));
        if scans.iter().all(|(_, scan)| scan.counts().hit == 0) {
            bail!(
                "{}: no beam of {} scans hit anything; there is nothing to show",
                path.display(),
                scans.len()
            );
        }
        Ok(Logs { source_2d: Source2d::Recorded { name: name(path), scans }, ..Logs::default() })
    }

    fn log_3d(&self, path: &Path) -> anyhow::Result<Logs> {
        Dimension::Three.check::<Self, _>(&self.given, "the log")?;
        let filter = self.limits.range.filter(Vec::new())?;
        let wanted = Wanted { color: true, deskew: true, points_only: false };
        let log = log::read_3d(path, &self.source, wanted)?;
        let up = self.up.map_or_else(|| log.up(), |up| up.0);
        let every = usize::try_from(self.every.unwrap_or(1)).unwrap_or(usize::MAX);
        Ok(Logs {
            source_3d: Source3d::Recorded { log: Box::new(log.every(every)), filter, up },
            ..Logs::default()
        })
    }

    /// Options about a log would do nothing without one, silently.
    fn check_no_log(&self) -> anyhow::Result<()> {
        let given = self.given.has_any::<LogArgs>() || self.given.has_any::<LimitArgs>();
        if given || self.every.is_some() {
            return Err(bad_call("--every, --poses, --format and the like are options for logs; give one"));
        }
        Ok(())
    }

    /// A log that no tab could open is refused here and not in the browser.
    fn check_shown(&self, logs: &Arc<Logs>) -> anyhow::Result<()> {
        let Err(refusal) = check(logs, self.limits_of_a_tab()) else { return Ok(()) };
        let log = self.log.as_deref().map_or("the simulation".into(), Path::to_string_lossy);
        let error = anyhow!("{log}: {refusal}, or give each tab more --memory");
        Err(match &logs.source_2d {
            Source2d::Recorded { scans, .. } => with_outlier(error, scans),
            Source2d::Apartment => error,
        })
    }

    fn limits_of_a_tab(&self) -> Limits {
        Limits { memory: usize::try_from(self.memory).unwrap_or(usize::MAX) }
    }

    fn listen(&self, logs: Arc<Logs>) -> anyhow::Result<Server> {
        let settings = Settings {
            address: self.host,
            port: self.port,
            sessions: self.sessions.into(),
            limits: self.limits_of_a_tab(),
            token: self.token,
            ..Settings::default()
        };
        let (host, port) = (self.host, self.port);
        Server::start(logs, &settings).map_err(|error| match error.kind() {
            io::ErrorKind::AddrInUse => {
                anyhow!("port {port} of {host} is in use; give another one, or --port 0 for any free port")
            }
            _ => anyhow!("cannot listen on port {port} of {host}: {error}; try another --port or --host"),
        })
    }

    fn warn_of_others(&self) -> io::Result<()> {
        if self.host.is_loopback() {
            return Ok(());
        }
        writeln!(
            io::stderr(),
            "portolan: warning: everyone who can reach {} and has the address with its token can use this studio and see \
             its log; what is sent is not encrypted",
            self.host
        )
    }

    /// The address, and which views show what.
    fn announce(&self, server: &Server, logs: &Logs) -> anyhow::Result<()> {
        let (in_2d, in_3d) = (shown_in_2d(logs), shown_in_3d(logs));
        let url = server.url();
        if self.output.json {
            // In one line, so that its end is known while the program goes on serving.
            let document = json!({
                "url": url,
                "views": { "fusion": in_2d, "gallery": in_2d, "clearance": in_2d, "radiance": LINE, "3d": in_3d },
            });
            writeln!(io::stdout(), "{document}")?;
            return Ok(io::stdout().flush()?);
        }
        let text = format!(
            "portolan studio: {url}\n  Fusion, Gallery, Clearance: {in_2d}\n  Radiance: {LINE}\n  3-D: {in_3d}\n\
             Ctrl-C stops it.\n"
        );
        self.output.print(&json!(null), text)
    }
}

/// What a run left in a folder beside its map. Files of another run, or damaged ones, say nothing about it: the folder's manifest
/// tells.
fn beside(folder: &Path) -> anyhow::Result<BesideMap> {
    let Some(set) = Manifest::read(folder) else { return Ok(BesideMap::default()) };
    let whole = |name: &str| {
        let path = folder.join(name);
        match set.files.contains_key(name) && path.is_file() {
            true => folder::check_file(&path).map(|()| Some(path)),
            false => Ok(None),
        }
    };
    let sigma = whole(SIGMA_FILE)?.map(|path| read_sigma(&path)).transpose()?;
    let movers = match whole(MOVERS_FILE)? {
        Some(path) => {
            let cloud = read_ply_cloud(path)?;
            let wide = |p: &[f32; 3]| std::array::from_fn(|k| cloud.offset[k] + f64::from(p[k]));
            cloud.points.iter().map(wide).collect()
        }
        None => Vec::new(),
    };
    Ok(BesideMap { sigma, movers, ..BesideMap::default() })
}

/// What the view of the renderer shows, whatever the log.
const LINE: &str = "the simulated line";

fn shown_in_2d(logs: &Logs) -> String {
    match &logs.source_2d {
        Source2d::Apartment => "the simulated Apartment".into(),
        Source2d::Recorded { name, scans } => format!("{name}, {} scans", scans.len()),
    }
}

fn shown_in_3d(logs: &Logs) -> String {
    match &logs.source_3d {
        Source3d::Building => "the simulated building".into(),
        Source3d::Recorded { log, .. } => format!("{}, {} scans", log.name(), log.len()),
        Source3d::Map { name, .. } => name.clone(),
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
