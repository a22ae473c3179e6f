//! The map, the scan that it is at, and what follows its cells.

use std::sync::Arc;

use portolan::geom::vector::along;
use portolan::geom::{Aabb, Grid};
use portolan::map::Tsdf2;
use portolan::scan::ScanStats;
use serde_json::json;

use super::ask::{Ask, ExportFile};
use super::chair::Ghost;
use super::frame;
use super::inspect::Inspected;
use super::lap::Lap;
use super::seen::Seen;
use super::settings::Settings;
use crate::engine::exports;
use crate::engine::{Clock, Limits, Logs, PlaneLog, Refusal, Reply};

/// Scans that one question may fuse: more would keep the page waiting for its picture.
const MOST_STEPS: usize = 256;
/// Cells around everything that was seen, besides the truncation.
const MARGIN_CELLS: f64 = 4.0;
/// Bytes of a cell: the map, the page's copy, what is derived from them for a picture or a file.
const BYTES_PER_CELL: f64 = 64.0;

/// The view of fusion.
pub(in crate::engine) struct Fusion {
    limits: Limits,
    clock: Clock,
    settings: Settings,
    lap: Lap,
    made: Option<Made>,
    inspected: Option<Inspected>,
    revision: u64,
}

/// What there is once it was asked for.
struct Made {
    at: usize,
    tsdf: Tsdf2,
    seen: Seen,
    ghost: Option<Ghost>,
    stats: ScanStats,
}

impl Fusion {
    pub(in crate::engine) fn new(logs: &Arc<Logs>, limits: Limits, clock: &Clock) -> Self {
        let settings = match logs.plane {
            PlaneLog::Apartment => Settings::default(),
            PlaneLog::Recorded { .. } => Settings::of_log(),
        };
        Self {
            limits,
            clock: clock.clone(),
            lap: Lap::new(logs, settings.noise),
            settings,
            made: None,
            inspected: None,
            revision: 0,
        }
    }

    /// Answers.
    pub(in crate::engine) fn ask(&mut self, ask: Ask) -> Result<Reply, Refusal> {
        match ask {
            Ask::Open {} => {
                let made = self.made()?;
                made.seen = Seen::nothing(made.tsdf.grid().shape);
                self.frame(0.0, true)
            }
            Ask::Step { scans } => {
                let to = self.at() + scans.min(MOST_STEPS);
                self.go(to)
            }
            Ask::Seek { scan } => self.go(scan),
            Ask::Set { settings } => self.set(settings),
            Ask::MoveChair { to } => {
                let at = self.at();
                self.lap.move_chair(at, to)?;
                self.made()?;
                if let Some(made) = &mut self.made {
                    made.start_ghost(&self.lap);
                    made.watch(self.inspected.as_ref());
                }
                self.revision += 1;
                self.frame(0.0, true)
            }
            Ask::Watch { cell } => self.watch(cell),
            Ask::Export { file } => self.export(file),
        }
    }

    /// Scans that are fused.
    pub(in crate::engine) fn at(&self) -> usize {
        self.made.as_ref().map_or(0, |m| m.at)
    }

    /// The map as it is; made if there was none.
    pub(in crate::engine) fn tsdf(&mut self) -> Result<&Tsdf2, Refusal> {
        Ok(&self.made()?.tsdf)
    }

    /// Another number whenever the map is another.
    pub(in crate::engine) fn revision(&self) -> u64 {
        self.revision
    }

    /// The scans, and what there is in truth.
    pub(in crate::engine) fn lap(&self) -> &Lap {
        &self.lap
    }

    /// How scans are fused.
    pub(in crate::engine) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Fuses all of a log, or one lap, where nothing was fused yet: for views that show what is finished.
    pub(in crate::engine) fn finish_if_new(&mut self) -> Result<(), Refusal> {
        if self.at() == 0 {
            self.drive_to(self.lap.lap_length())?;
        }
        Ok(())
    }

    fn made(&mut self) -> Result<&mut Made, Refusal> {
        if self.made.is_none() {
            self.made = Some(self.empty()?);
        }
        self.made.as_mut().ok_or_else(|| Refusal::new("there is no map"))
    }

    /// A map of nothing.
    fn empty(&self) -> Result<Made, Refusal> {
        let config = self.settings.config()?;
        let grid = self.grid(config.resolution, config.truncation)?;
        let cells: f64 = grid.shape.iter().map(|&n| n as f64).product();
        if BYTES_PER_CELL * cells > self.limits.memory as f64 {
            let [w, h] = grid.aabb().extent();
            return Err(Refusal::new(format!(
                "{w:.0} x {h:.0} m in cells of {} m need more than the {} MiB that a tab may have; choose larger cells",
                config.resolution,
                self.limits.memory >> 20
            )));
        }
        let tsdf = Tsdf2::new(config.with_grid(&grid)).map_err(Refusal::new)?;
        let seen = Seen::nothing(grid.shape);
        Ok(Made { at: 0, tsdf, seen, ghost: None, stats: ScanStats::default() })
    }

    /// The Apartment's box, or what the log saw, free ends of beams included.
    fn grid(&self, resolution: f64, truncation: f64) -> Result<Grid<2>, Refusal> {
        if let Some(world) = self.lap.world(0) {
            let [w, h] = world.aabb().extent();
            // The small number keeps a rounded-up quotient from making one more column.
            let cells = |metres: f64| (metres / resolution - 1e-9).ceil().max(1.0) as usize;
            return Ok(Grid::new(world.aabb().min, resolution, [cells(w), cells(h)]));
        }
        let mut bounds = Aabb::EMPTY;
        for (pose, scan) in self.lap.first(self.lap.most()) {
            bounds.include(pose.translation);
            for beam in scan.beams().filter(|b| b.free_range() > 0.0) {
                bounds.include(along(pose.translation, pose.rotate(beam.direction), beam.free_range()));
            }
        }
        let bounds = bounds.grown(truncation + MARGIN_CELLS * resolution);
        Grid::covering(bounds, resolution)
            .ok_or_else(|| Refusal::new("the log reaches too far for cells of this size; choose larger ones"))
    }

    fn go(&mut self, to: usize) -> Result<Reply, Refusal> {
        let clock = self.clock.clone();
        let (done, seconds) = clock.time(|| self.drive_to(to));
        done?;
        self.frame(seconds, false)
    }

    /// Fuses on, or from the beginning, until `to` scans are fused.
    fn drive_to(&mut self, to: usize) -> Result<(), Refusal> {
        let to = to.min(self.lap.most());
        if to < self.at() {
            self.made = None;
        }
        if self.made.is_none() {
            if let Some(inspected) = &mut self.inspected {
                inspected.forget_events();
            }
            self.made = Some(self.empty()?);
        }
        let Some(made) = &mut self.made else { return Ok(()) };
        if to != made.at {
            self.revision += 1;
        }
        if made.at == 0 {
            made.start_ghost(&self.lap);
            made.watch(self.inspected.as_ref());
        }
        while made.at < to {
            made.fuse_one(&mut self.lap, self.settings.carve, self.inspected.as_mut());
            made.at += 1;
            if self.lap.move_before(made.at).is_some() {
                made.start_ghost(&self.lap);
                made.watch(self.inspected.as_ref());
            }
        }
        Ok(())
    }

    fn set(&mut self, settings: Settings) -> Result<Reply, Refusal> {
        settings.config()?;
        let at = self.at();
        let before = std::mem::replace(&mut self.settings, settings);
        // What cannot be made leaves what there is.
        if let Err(refusal) = self.empty() {
            self.settings = before;
            return Err(refusal);
        }
        self.lap.set_noise(self.settings.noise);
        if before.resolution != self.settings.resolution {
            self.inspected = None;
        }
        self.made = None;
        self.revision += 1;
        let clock = self.clock.clone();
        let (done, seconds) = clock.time(|| self.drive_to(at));
        done?;
        self.frame(seconds, true)
    }

    /// What the page must know to draw; with `all` also what seldom changes.
    fn frame(&mut self, seconds: f64, all: bool) -> Result<Reply, Refusal> {
        self.made()?;
        let Some(made) = &mut self.made else { return Err(Refusal::new("there is no map")) };
        let delta = made.seen.update(&made.tsdf);
        let mut body = json!({
            "at": made.at,
            "fresh": delta.fresh,
            "lap": self.lap.lap_length(),
            "most": self.lap.most(),
            "revision": self.revision,
            "seconds": seconds,
            "observed": made.tsdf.observed_cells(0.0),
            "beams": frame::counts(&made.stats),
            "bytes": made.tsdf.memory_bytes(),
            "half_life": self.settings.config()?.w_max.is_finite().then(|| made.tsdf.rule().half_life(1.0)),
            "ghost": made.ghost.as_ref().map(|g| g.tell(&made.tsdf, made.at, self.lap.lap_length())),
            "inspected": self.inspected.as_ref().map(|i| i.news(&made.tsdf, self.lap.last_move(made.at))),
        });
        let last = made.at.checked_sub(1).map(|i| &self.lap.first(i + 1)[i]);
        body["pose"] = json!(last.map(|(pose, _)| frame::pose(pose)));
        if all {
            body["all"] = json!({
                "name": self.lap.name(),
                "settings": self.settings,
                "grid": frame::grid(made.tsdf.grid()),
                "way": self.lap.way(),
                "truth": self.lap.world(made.at).map(frame::truth),
                "moves": self.lap.moves(),
                "block": super::seen::EDGE,
            });
        }
        let contour = frame::contour(&made.tsdf);
        let mut reply = Reply::of(body)?
            .with("blocks", delta.blocks)
            .with("distance", delta.distance)
            .with("weight", delta.weight)
            .with("contour", contour.points)
            .with("lines", contour.starts);
        if let Some((pose, scan)) = last {
            let beams = frame::beams(pose, scan);
            reply = reply.with("beam_ends", beams.ends).with("beam_kinds", beams.kinds);
        }
        Ok(reply)
    }

    fn watch(&mut self, cell: Option<[i32; 2]>) -> Result<Reply, Refusal> {
        self.made()?;
        let Some(cell) = cell else {
            self.inspected = None;
            self.made()?.watch(None);
            return Reply::of(json!(null));
        };
        let at = self.at();
        if self.tsdf()?.grid().index(cell).is_none() {
            return Err(Refusal::new(format!("cell {cell:?} is outside of the map")));
        }
        // What happened before it was watched is done again: the same map from the same scans, and so the same events.
        let mut again = self.empty()?;
        let mut inspected = Inspected::new(cell);
        again.watch(Some(&inspected));
        while again.at < at {
            again.fuse_one(&mut self.lap, self.settings.carve, Some(&mut inspected));
            again.at += 1;
        }
        let mut body = json!(null);
        if let Some(made) = &mut self.made {
            made.watch(Some(&inspected));
            body = inspected.all(&made.tsdf, self.lap.last_move(at));
        }
        self.inspected = Some(inspected);
        Reply::of(body)
    }

    fn export(&mut self, file: ExportFile) -> Result<Reply, Refusal> {
        self.made()?;
        let Some(made) = &self.made else { return Err(Refusal::new("there is no map")) };
        match file {
            ExportFile::Esdf => exports::esdf(&made.tsdf),
            ExportFile::Contour => exports::contour(&made.tsdf),
            ExportFile::Map => exports::map(&made.tsdf, self.lap.name(), made.at, &json!(self.settings)),
        }
    }

    pub(in crate::engine) fn memory_bytes(&self) -> usize {
        let map = self.made.as_ref().map_or(0, |m| m.tsdf.memory_bytes() + m.seen.memory_bytes());
        map + self.lap.memory_bytes()
    }

    /// Gives the map up.
    pub(in crate::engine) fn forget(&mut self) {
        self.made = None;
        self.inspected = None;
        self.revision += 1;
    }
}

impl Made {
    /// Fuses the scan after those that are fused.
    fn fuse_one(&mut self, lap: &mut Lap, carve: bool, inspected: Option<&mut Inspected>) {
        let (pose, scan) = lap.scan(self.at);
        self.stats = self.tsdf.integrate(pose, scan, carve);
        if let Some(ghost) = &mut self.ghost {
            ghost.observe(self.tsdf.events());
        }
        if let Some(inspected) = inspected {
            inspected.observe(self.at, self.tsdf.events());
        }
    }

    /// Follows the chair that was just moved, if one was.
    fn start_ghost(&mut self, lap: &Lap) {
        if let Some(moved) = lap.move_before(self.at) {
            self.ghost = Some(Ghost::new(&self.tsdf, moved));
        }
    }

    /// Watches the ghost's cells and the inspected one.
    fn watch(&mut self, inspected: Option<&Inspected>) {
        let ghost = self.ghost.iter().flat_map(Ghost::cells);
        let cells: Vec<_> = ghost.chain(inspected.map(Inspected::cell)).collect();
        self.tsdf.watch(cells);
    }
}
