//! The map, the scan that it is at, and what follows its cells.

use std::sync::Arc;

use portolan::geom::vector::along;
use portolan::geom::{Aabb, Grid};
use portolan::map::Tsdf2;
use portolan::scan::ScanStats;
use serde_json::json;

use super::ask::{Ask, ExportFile};
use super::beside::Beside;
use super::chair::Ghost;
use super::frame;
use super::inspect::Inspected;
use super::page_copy::PageCopy;
use super::scans::Scans;
use super::settings::Settings;
use crate::engine::exports;
use crate::engine::{Clock, Limits, Logs, Refusal, Reply, Source2d};

/// Scans that one question may fuse: more would keep the page waiting for its picture.
const MOST_STEPS: usize = 256;
/// Cells around everything that was seen, besides the truncation.
const MARGIN_CELLS: f64 = 4.0;
/// Bytes of a cell: the map and what is fused beside it, the page's copy, what is derived from them for a picture or a file.
const BYTES_PER_CELL: f64 = 80.0;

/// The view of fusion.
pub(in crate::engine) struct Fusion {
    limits: Limits,
    clock: Clock,
    settings: Settings,
    scans: Scans,
    fused: Option<Fused>,
    inspected: Option<Inspected>,
    revision: u64,
}

/// What there is once it was asked for.
struct Fused {
    at: usize,
    tsdf: Tsdf2,
    /// Made when it is asked for; never ahead of the map.
    beside: Option<Beside>,
    page: PageCopy,
    ghost: Option<Ghost>,
    stats: ScanStats,
}

impl Fusion {
    pub(in crate::engine) fn new(logs: &Arc<Logs>, limits: Limits, clock: &Clock) -> Self {
        let settings = match logs.source_2d {
            Source2d::Apartment => Settings::default(),
            Source2d::Recorded { .. } => Settings::of_log(),
        };
        Self {
            limits,
            clock: clock.clone(),
            scans: Scans::new(logs, settings.noise),
            settings,
            fused: None,
            inspected: None,
            revision: 0,
        }
    }

    /// Answers.
    pub(in crate::engine) fn ask(&mut self, ask: Ask) -> Result<Reply, Refusal> {
        match ask {
            Ask::Open {} => {
                let fused = self.fused()?;
                fused.page = PageCopy::nothing(fused.tsdf.grid().shape);
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
                self.scans.move_chair(at, to)?;
                self.fused()?;
                if let Some(fused) = &mut self.fused {
                    fused.start_ghost(&self.scans);
                    fused.watch(self.inspected.as_ref());
                }
                self.revision += 1;
                self.frame(0.0, true)
            }
            Ask::ChairFits { to } => {
                let why = self.scans.moved_chair(self.at(), to).err().map(|refusal| refusal.to_string());
                Reply::of(json!({ "refused": why }))
            }
            Ask::Watch { cell } => self.watch(cell),
            Ask::Export { file } => self.export(file),
        }
    }

    /// Scans that are fused.
    pub(in crate::engine) fn at(&self) -> usize {
        self.fused.as_ref().map_or(0, |m| m.at)
    }

    /// The map as it is, made where there was none yet.
    pub(in crate::engine) fn tsdf(&mut self) -> Result<&Tsdf2, Refusal> {
        Ok(&self.fused()?.tsdf)
    }

    /// The map as it is, and what the default recipe fuses beside it, of the same scans.
    pub(in crate::engine) fn with_beside(&mut self) -> Result<(&Tsdf2, &mut Beside), Refusal> {
        self.fused()?;
        let Some(fused) = &mut self.fused else { return Err(Refusal::new("there is no map")) };
        let beside = match fused.beside.take() {
            Some(beside) => beside,
            None => Beside::new(fused.tsdf.grid(), fused.tsdf.config())?,
        };
        let beside = fused.beside.insert(beside);
        beside.drive_to(&mut self.scans, fused.at)?;
        Ok((&fused.tsdf, beside))
    }

    /// Another number whenever the map is another.
    pub(in crate::engine) fn revision(&self) -> u64 {
        self.revision
    }

    /// The scans, and what there is in truth.
    pub(in crate::engine) fn scans(&self) -> &Scans {
        &self.scans
    }

    /// How scans are fused.
    pub(in crate::engine) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Fuses all of a log, or one lap, where nothing was fused yet: for views that show what is finished.
    pub(in crate::engine) fn finish_if_new(&mut self) -> Result<(), Refusal> {
        if self.at() == 0 {
            self.drive_to(self.scans.lap_length())?;
        }
        Ok(())
    }

    fn fused(&mut self) -> Result<&mut Fused, Refusal> {
        if self.fused.is_none() {
            self.fused = Some(self.empty()?);
        }
        self.fused.as_mut().ok_or_else(|| Refusal::new("there is no map"))
    }

    /// A map of nothing.
    fn empty(&self) -> Result<Fused, Refusal> {
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
        let tsdf = Tsdf2::covering(&grid, config).map_err(Refusal::new)?;
        let page = PageCopy::nothing(grid.shape);
        Ok(Fused { at: 0, tsdf, beside: None, page, ghost: None, stats: ScanStats::default() })
    }

    /// The Apartment's box, or what the log saw, free ends of beams included.
    fn grid(&self, resolution: f64, truncation: f64) -> Result<Grid<2>, Refusal> {
        if let Some(world) = self.scans.world(0) {
            let [w, h] = world.aabb().extent();
            // The small number keeps a rounded-up quotient from making one more column.
            let cells = |metres: f64| (metres / resolution - 1e-9).ceil().max(1.0) as usize;
            return Ok(Grid::new(world.aabb().min, resolution, [cells(w), cells(h)]));
        }
        let mut bounds = Aabb::EMPTY;
        for (pose, scan) in self.scans.first(self.scans.most()) {
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
        let to = to.min(self.scans.most());
        if to < self.at() {
            self.fused = None;
        }
        if self.fused.is_none() {
            if let Some(inspected) = &mut self.inspected {
                inspected.forget_events();
            }
            self.fused = Some(self.empty()?);
        }
        let Some(fused) = &mut self.fused else { return Ok(()) };
        if to != fused.at {
            self.revision += 1;
        }
        if fused.at == 0 {
            fused.start_ghost(&self.scans);
            fused.watch(self.inspected.as_ref());
        }
        while fused.at < to {
            fused.fuse_one(&mut self.scans, self.inspected.as_mut())?;
            fused.at += 1;
            if self.scans.move_before(fused.at).is_some() {
                fused.start_ghost(&self.scans);
                fused.watch(self.inspected.as_ref());
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
        self.scans.set_noise(self.settings.noise);
        if before.resolution != self.settings.resolution {
            self.inspected = None;
        }
        self.fused = None;
        self.revision += 1;
        let clock = self.clock.clone();
        let (done, seconds) = clock.time(|| self.drive_to(at));
        done?;
        self.frame(seconds, true)
    }

    /// What the page must know to draw; with `all` also what seldom changes.
    fn frame(&mut self, seconds: f64, all: bool) -> Result<Reply, Refusal> {
        self.fused()?;
        let Some(fused) = &mut self.fused else { return Err(Refusal::new("there is no map")) };
        let delta = fused.page.update(&fused.tsdf);
        let mut body = json!({
            "at": fused.at,
            "fresh": delta.fresh,
            "lap": self.scans.lap_length(),
            "most": self.scans.most(),
            "revision": self.revision,
            "seconds": seconds,
            "observed": fused.tsdf.observed_cells(0.0),
            "beams": frame::counts(&fused.stats),
            "bytes": fused.tsdf.memory_bytes(),
            "half_life": self.settings.config()?.w_max.is_finite().then(|| fused.tsdf.rule().half_life(1.0)),
            "ghost": fused.ghost.as_ref().map(|g| g.to_json(&fused.tsdf, fused.at, self.scans.lap_length())),
            "inspected": self.inspected.as_ref().map(|i| i.news(&fused.tsdf, self.scans.last_move(fused.at))),
        });
        let last = fused.at.checked_sub(1).map(|i| &self.scans.first(i + 1)[i]);
        body["pose"] = json!(last.map(|(pose, _)| frame::pose(pose)));
        if all {
            body["all"] = json!({
                "name": self.scans.name(),
                "settings": self.settings,
                "grid": frame::grid(fused.tsdf.grid()),
                "way": self.scans.way(),
                "truth": self.scans.world(fused.at).map(frame::truth),
                "moves": self.scans.moves(),
                "block": super::page_copy::EDGE,
            });
        }
        let contour = frame::contour(&fused.tsdf);
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
        self.fused()?;
        let Some(cell) = cell else {
            self.inspected = None;
            self.fused()?.watch(None);
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
            again.fuse_one(&mut self.scans, Some(&mut inspected))?;
            again.at += 1;
        }
        let mut body = json!(null);
        if let Some(fused) = &mut self.fused {
            fused.watch(Some(&inspected));
            body = inspected.all(&fused.tsdf, self.scans.last_move(at));
        }
        self.inspected = Some(inspected);
        Reply::of(body)
    }

    fn export(&mut self, file: ExportFile) -> Result<Reply, Refusal> {
        let (at, name, settings) = (self.at(), self.scans.name().to_owned(), json!(self.settings));
        match file {
            ExportFile::Esdf => {
                let (tsdf, beside) = self.with_beside()?;
                exports::esdf(tsdf, beside.cells())
            }
            ExportFile::Contour => exports::contour(self.tsdf()?),
            ExportFile::Map => {
                let (tsdf, beside) = self.with_beside()?;
                exports::map(tsdf, beside, &name, at, &settings)
            }
        }
    }

    pub(in crate::engine) fn memory_bytes(&self) -> usize {
        let of = |m: &Fused| {
            let beside = m.beside.as_ref().map_or(0, Beside::memory_bytes);
            m.tsdf.memory_bytes() + m.page.memory_bytes() + beside
        };
        self.fused.as_ref().map_or(0, of) + self.scans.memory_bytes()
    }

    /// Gives the map up.
    pub(in crate::engine) fn forget(&mut self) {
        self.fused = None;
        self.inspected = None;
        self.revision += 1;
    }
}

impl Fused {
    /// Fuses the scan after those that are fused.
    fn fuse_one(&mut self, scans: &mut Scans, inspected: Option<&mut Inspected>) -> Result<(), Refusal> {
        let (pose, scan) = scans.scan(self.at);
        self.stats = self.tsdf.integrate(pose, scan).map_err(Refusal::new)?;
        if let Some(ghost) = &mut self.ghost {
            ghost.observe(self.tsdf.events());
        }
        if let Some(inspected) = inspected {
            inspected.observe(self.at, self.tsdf.events());
        }
        Ok(())
    }

    /// Follows the chair that was just moved, if one was.
    fn start_ghost(&mut self, scans: &Scans) {
        if let Some(moved) = scans.move_before(self.at) {
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
