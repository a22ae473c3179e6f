//! Mapping a log of space.

use std::io::Write;

use anyhow::{Context, bail};
use portolan::geom::Aabb;
use portolan::sweep::OccupancySweep;
use portolan::scan::{FrameFilter, ScanStats};
use portolan_io::scan_log::ScanLog;
use portolan_io::{MapFile, weights_of, write_atomic};

use super::common::{CARVE_WEIGHT, Watch, start_threads, three_cells, title};
use super::{Args, SweepArg};
use crate::arguments::Bounds;
use crate::error::bad_call;
use crate::esdf::EsdfArg;
use crate::json;
use crate::log::{self, LimitArgs, Selection};
use crate::mapping::MapKind;
use crate::progress::Progress;
use crate::saved::Saved;
use crate::space::{Artefacts, Derived, Settings, SpaceMaps, Summary, fuse, report, sweep_of};

/// The maps that a log of space can make; all of them where the call names none.
const SPACE: [MapKind; 4] = [MapKind::Tree, MapKind::Tsdf, MapKind::Esdf, MapKind::Mesh];

/// Fuses the log.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let bounds = args.check_space()?;
    let mut watch = Watch::start();
    let threads = start_threads(args.threads)?;
    let before = args.saved_space_map()?;
    let log = log::read_space(&args.log, &args.source, !args.no_color)?;
    watch.stage("read");

    let settings = args.space_settings(before.as_ref(), bounds)?;
    args.check_fits(&log, &settings)?;
    if let Some(before) = &before {
        settings.check_agree(&before.header.settings, &args.map_path().display().to_string())?;
    }
    let selection = Selection { every: settings.every, hold_out: settings.hold_out };
    let (fused, held_out) = selection.split(log.len());
    let mut file = before.unwrap_or_default();
    let mut maps = args.space_maps(&mut file, &settings, anchor(&log, settings.resolution))?;
    watch.stage("prepare");

    let progress = Progress::new(fused.len(), "fusing", args.output);
    let memory = usize::try_from(args.memory).unwrap_or(usize::MAX);
    let mut fusion = fuse(&mut maps, &log, &fused, &settings.filter, (memory, threads), &progress);
    drop(progress);
    watch.stage("fuse");
    if fusion.stats.scans == 0
        && let Some(error) = fusion.unreadable.1.take()
    {
        // Not one frame could be used: what was wrong with the first tells more than an empty map.
        bail!(error);
    }
    let mut bytes = maps.bytes();
    file.poses.extend(&fusion.poses);
    describe(&mut file, &settings, &log, &fusion.stats);
    maps.store_into(&mut file);
    std::fs::create_dir_all(&args.out).with_context(|| {
        format!("{}: cannot make the folder; name one that can be written to", args.out.display())
    })?;
    // Before anything is derived from it: whatever happens then, what was fused is saved.
    file.write(args.map_path())?;
    watch.stage("save");

    let derived = Derived::of(&file, &settings, memory);
    bytes.extend(derived.bytes());
    let mut seconds = watch.total();
    let title = title(&file.header.logs, settings.resolution, file.header.scans);
    let written = Artefacts {
        file: &file,
        derived: &derived,
        dense: args.dense,
        camera: log.camera().is_some(),
        title,
    }
    .write(&args.out)?;
    let mut files = written.files;
    files.push("summary.json");
    seconds.extend(fusion.seconds.iter().chain(&derived.seconds).chain(&written.seconds));
    let summary = Summary {
        log: &log,
        settings: &settings,
        held_out: held_out.len(),
        fusion: &fusion,
        file: &file,
        derived: &derived,
        notes: written.notes,
        bytes,
        seconds,
        files,
    };
    let document = summary.to_json();
    let text = format!("{document:#}\n");
    write_atomic(args.out.join("summary.json"), |w| w.write_all(text.as_bytes()))?;
    args.output.print(&document, report(&summary, &args.out.display().to_string()))?;
    if let Some(full) = &fusion.full {
        bail!(
            "{}: {full}; {} of {} scans were fused and saved; start again with more --memory, a coarser --resolution or --bounds",
            args.log.display(),
            fusion.stats.scans,
            fused.len()
        );
    }
    Ok(())
}

/// The origin of the lattice: zero, unless the log is so far from it that indices would run out or files of other
/// programs could not hold them anyway; then the multiple of the resolution next to the first pose.
fn anchor(log: &ScanLog, resolution: f64) -> [f64; 3] {
    const FAR: f64 = 1e6;
    log.pose(0)
        .translation
        .map(|v| if (v / resolution).abs() < FAR { 0.0 } else { (v / resolution).round() * resolution })
}

impl Args {
    /// Refuses what a log of space cannot have; gives the box.
    fn check_space(&self) -> anyhow::Result<Option<Aabb<3>>> {
        let refused =
            |what: &str| Err(bad_call(format!("{what} is for planar scans; the log has three dimensions")));
        let planar = |m: &MapKind| matches!(m, MapKind::Grid | MapKind::Contour);
        match self.sweep {
            Some(SweepArg::CellCentre | SweepArg::March) => return refused("this --sweep"),
            _ if self.maps.iter().flatten().any(planar) => return refused("--maps grid or contour"),
            _ => {}
        }
        self.limits.filter()?;
        match self.bounds {
            Some(Bounds::Plane(_)) => {
                Err(bad_call("--bounds of a log of space has six numbers x0,y0,z0,x1,y1,z1"))
            }
            Some(Bounds::Space(bounds)) => Ok(Some(bounds)),
            None => Ok(None),
        }
    }

    /// Refuses options that this log or these maps have no use for.
    fn check_fits(&self, log: &ScanLog, settings: &Settings) -> anyhow::Result<()> {
        let kind = log.kind().word();
        let (camera, source) = (log.camera().is_some(), &self.source);
        if !camera && (source.intrinsics.is_some() || source.depth_scale.is_some()) {
            return Err(bad_call(format!(
                "--intrinsics and --depth-scale are for depth images; the log is {kind}"
            )));
        }
        if camera && source.origin.is_some() {
            return Err(bad_call(format!("--origin is for clouds; the log is {kind}")));
        }
        if self.dense.is_some() && !settings.wants(MapKind::Esdf) {
            return Err(bad_call("--dense writes the esdf, which --maps leaves out"));
        }
        Ok(())
    }

    /// The map to go on with.
    fn saved_space_map(&self) -> anyhow::Result<Option<MapFile<3>>> {
        if !self.append {
            self.check_out()?;
            return Ok(None);
        }
        Ok(Some(MapFile::<3>::read_within(self.map_path(), self.memory)?))
    }

    /// What was given, else what the map to go on with was made with, else the defaults.
    fn space_settings(
        &self,
        before: Option<&MapFile<3>>,
        bounds: Option<Aabb<3>>,
    ) -> anyhow::Result<Settings> {
        let saved = Saved(before.map(|f| &f.header.settings));
        let resolution = self.resolution.or(saved.number("resolution")).unwrap_or(0.05);
        let never_forget = before.map(|_| f32::INFINITY).filter(|_| saved.number("w_max").is_none());
        let saved_w_max = saved.number("w_max").map(|w| w as f32).or(never_forget);
        let mut maps = self.maps.clone().or_else(|| saved.maps()).unwrap_or_else(|| SPACE.to_vec());
        if maps.contains(&MapKind::Esdf) || maps.contains(&MapKind::Mesh) {
            maps.push(MapKind::Tsdf);
        }
        maps.sort_unstable();
        maps.dedup();
        let limits = LimitArgs {
            min_range: self.limits.min_range.or(saved.number("min_range")),
            max_range: self.limits.max_range.or(saved.number("max_range")),
            ..self.limits
        };
        let body = if self.self_filter.is_empty() { saved.bodies()? } else { self.self_filter.clone() };
        Ok(Settings {
            resolution,
            truncation: self.truncation.or(saved.number("truncation")).unwrap_or(three_cells(resolution)),
            w_max: self.forgetting.w_max().or(saved_w_max).unwrap_or(64.0),
            weights: match self.weights {
                Some(word) => word.model(),
                None => saved.word("weights").and_then(weights_of).unwrap_or_default(),
            },
            sweep: match self.sweep {
                Some(SweepArg::Exact) => OccupancySweep::Exact,
                Some(SweepArg::Projective) => OccupancySweep::Projective,
                Some(_) => OccupancySweep::Auto,
                None => saved.word("sweep").and_then(sweep_of).unwrap_or_default(),
            },
            carve: !self.no_carve && saved.flag("carve").unwrap_or(true),
            carve_weight: self
                .carve_weight
                .or(saved.number("carve_weight").map(|w| w as f32))
                .unwrap_or(CARVE_WEIGHT),
            color: !self.no_color && saved.flag("color").unwrap_or(true),
            filter: FrameFilter { body, ..limits.filter()? },
            every: self.every.or(saved.number("every").map(|n| n as u64)),
            hold_out: self.hold_out.or(saved.number("hold_out").map(|n| n as u64)),
            bounds,
            max_distance: self.max_distance.or(saved.number("max_distance")).unwrap_or(1.0),
            maps,
            esdf: self.esdf.or(saved.0.and_then(EsdfArg::of_settings)).unwrap_or_default(),
        })
    }

    /// Empty maps, or the saved ones. They are taken out of `file`.
    fn space_maps(
        &self,
        file: &mut MapFile<3>,
        settings: &Settings,
        anchor: [f64; 3],
    ) -> anyhow::Result<SpaceMaps> {
        let mut maps = if self.append {
            SpaceMaps::take_from(file, settings, &self.map_path().display().to_string())?
        } else {
            settings.empty_maps(anchor)?
        };
        maps.set_bounds(settings.bounds);
        Ok(maps)
    }
}

/// Writes into the file's header what it is made of.
fn describe(file: &mut MapFile<3>, settings: &Settings, log: &ScanLog, stats: &ScanStats) {
    let header = &mut file.header;
    header.logs.push(log.name().to_owned());
    header.scans += stats.scans;
    header.every = settings.every;
    header.hold_out = settings.hold_out;
    header.settings = settings.to_json();
    json::add_counts(&mut header.statistics, &json::object(json::stats(stats)));
}
