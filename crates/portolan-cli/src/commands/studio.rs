//! `studio`: the local web app in which maps are watched while they are made.

use std::io::{self, Write};
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{anyhow, bail};
use portolan::map::{SparseTsdf, SparseTsdfConfig};
use portolan_io::{AnyMapFile, FileKind, detect};
use portolan_studio::engine::{Limits, Logs, Source2d, Source3d, check};
use portolan_studio::server::{Server, Settings};
use serde_json::json;

use crate::arguments::bytes;
use crate::error::bad_call;
use crate::log::{self, LimitArgs, LogArgs, Selection};
use crate::mapping::with_outlier;
use crate::output::Output;

#[derive(clap::Args)]
#[command(
    after_help = "Open the address that it prints in a browser. Every tab has maps of its own; closing it frees them. \
                  Ctrl-C stops the studio.

Examples:
  portolan studio
  portolan studio \
                  intel-corrected.log.gz --every 2
  portolan studio out/kitchen"
)]
pub(crate) struct Args {
    /// Log of range scans with poses, planar or of space, or a map of space that `map` has written; its kind is
    /// recognised. Without one, and in the views that it is not for, simulated scans are shown
    log: Option<PathBuf>,
    /// Port to listen at; 0: any that is free
    #[arg(long, value_name = "PORT", default_value = "7700")]
    port: u16,
    /// Address to listen at. Another one than this machine's own lets everybody who reaches it use the studio
    #[arg(long, value_name = "ADDRESS", value_parser = host, default_value = "127.0.0.1")]
    host: IpAddr,
    /// Tabs at a time; one more is told to wait
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), default_value = "8")]
    sessions: u16,
    /// Memory that the maps of each tab may use, with suffix K, M or G
    #[arg(long, value_name = "BYTES", value_parser = bytes, default_value = "2G")]
    memory: u64,
    /// Use every N-th scan of the log only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<u64>,
    #[command(flatten)]
    source: LogArgs,
    #[command(flatten)]
    limits: LimitArgs,
    #[command(flatten)]
    output: Output,
}

/// Serves until Ctrl-C.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let logs = Arc::new(args.logs()?);
    args.check_shown(&logs)?;
    let server = args.listen(logs.clone())?;
    args.warn_of_others()?;
    args.announce(&server, &logs)?;
    server.wait()?;
    Ok(())
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
        if self.source.is_space(path)? { self.space(path) } else { self.plane(path) }
    }

    /// A map of space that was made before.
    fn map(&self, path: &Path) -> anyhow::Result<Logs> {
        if self.every.is_some() || self.limits.is_given() {
            return Err(bad_call("--every, --min-range and the like are about a log; this is a map"));
        }
        let shown = path.display();
        let file = if path.is_dir() { path.join("map.portolan") } else { path.into() };
        let container = Container::read(file)?;
        if map_dimension(&container)? != 3 {
            bail!(
                "{shown}: a map of the plane; give the log that it was made of, and the studio makes it again"
            );
        }
        let file = MapFile::<3>::from_container(&container, self.memory)?;
        let Some(held) = file.tsdf_bricks else {
            bail!("{shown}: the map holds no distances, and so no surface; make it with --maps tsdf");
        };
        let config = TsdfConfig {
            truncation: held.truncation,
            w_max: held.w_max,
            carve_weight: held.carve_weight,
            weights: held.weights,
            ..TsdfConfig::default()
        };
        let tsdf = SparseTsdf::from_stores(held.store, file.colors.map(|c| c.store), config)?;
        let source_3d = Source3d::Map { name: name(path), tsdf: Box::new(tsdf) };
        Ok(Logs { source_3d, ..Logs::default() })
    }

    fn plane(&self, path: &Path) -> anyhow::Result<Logs> {
        if self.source.is_about_space() {
            return Err(bad_call(
                "--pose-convention, --intrinsics or another option is for scans of space; the log is planar",
            ));
        }
        let log = log::read(path, &self.source)?;
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

    fn space(&self, path: &Path) -> anyhow::Result<Logs> {
        let filter = self.limits.filter()?;
        let log = log::read_space(path, &self.source, true)?;
        let every = usize::try_from(self.every.unwrap_or(1)).unwrap_or(usize::MAX);
        Ok(Logs {
            source_3d: Source3d::Recorded { log: Box::new(log.every(every)), filter },
            ..Logs::default()
        })
    }

    /// Options about a log that is not there would do nothing, silently.
    fn check_no_log(&self) -> anyhow::Result<()> {
        let LogArgs { poses, format, .. } = &self.source;
        let given = self.every.is_some()
            || poses.is_some()
            || format.is_some()
            || self.source.is_about_space()
            || self.limits.is_given();
        if given {
            return Err(bad_call("--every, --poses, --format and the like are about a log; give one"));
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
            ..Settings::default()
        };
        let (host, port) = (self.host, self.port);
        Server::start(logs, &settings).map_err(|error| match error.kind() {
            io::ErrorKind::AddrInUse => {
                anyhow!("port {port} of {host} is taken; name another one, or --port 0 for any that is free")
            }
            _ => anyhow!("cannot listen at port {port} of {host}: {error}; try another --port or --host"),
        })
    }

    fn warn_of_others(&self) -> io::Result<()> {
        if self.host.is_loopback() {
            return Ok(());
        }
        writeln!(
            io::stderr(),
            "portolan: warning: everybody who reaches {} can use this studio and see its log: it asks for no password",
            self.host
        )
    }

    /// The address, and which views show what.
    fn announce(&self, server: &Server, logs: &Logs) -> anyhow::Result<()> {
        let (plane, space) = (shown_in_the_plane(logs), shown_in_space(logs));
        let url = server.url();
        if self.output.json {
            // In one line, so that whoever started it knows where the document ends: it goes on serving.
            let document = json!({
                "url": url,
                "views": { "fusion": plane, "gallery": plane, "clearance": plane, "radiance": LINE, "space": space },
            });
            writeln!(io::stdout(), "{document}")?;
            return Ok(io::stdout().flush()?);
        }
        let text = format!(
            "portolan studio: {url}\n  Fusion, Gallery, Clearance: {plane}\n  Radiance: {LINE}\n  Space: {space}\n\
             Ctrl-C stops it.\n"
        );
        self.output.print(&json!(null), text)
    }
}

/// What the view of the renderer shows, whatever the log.
const LINE: &str = "the simulated line";

fn shown_in_the_plane(logs: &Logs) -> String {
    match &logs.source_2d {
        Source2d::Apartment => "the simulated Apartment".into(),
        Source2d::Recorded { name, scans } => format!("{name}, {} scans", scans.len()),
    }
}

fn shown_in_space(logs: &Logs) -> String {
    match &logs.source_3d {
        Source3d::Building => "the simulated building".into(),
        Source3d::Recorded { log, .. } => format!("{}, {} scans", log.name(), log.len()),
        Source3d::Map { name, .. } => name.clone(),
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
