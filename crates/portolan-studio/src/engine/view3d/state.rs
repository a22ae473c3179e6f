//! The 3-D view: its maps, and its answers to the page.

use std::sync::Arc;

use serde_json::Value;

use super::ask::{Ask, ColorBy, ExportFile};
use super::export;
use super::maps::{Maps, Seconds};
use super::mesh_buffers::MeshBuffers;
use super::settings::Settings;
use super::source::Source;
use crate::engine::{Clock, Limits, Logs, Refusal, Reply};

/// Frames that one question may fuse.
const MOST_STEPS: usize = 64;
/// Seconds after which an answer is given, whatever is still to be fused.
const LONGEST: f64 = 0.25;
/// The 3-D view.
pub(in crate::engine) struct View3d {
    limits: Limits,
    pub(super) clock: Clock,
    pub(super) settings: Settings,
    pub(super) source: Source,
    pub(super) maps: Option<Maps>,
    pub(super) color: ColorBy,
    pub(super) revision: u64,
}

impl View3d {
    pub(in crate::engine) fn new(logs: &Arc<Logs>, limits: Limits, clock: &Clock) -> Self {
        let settings = Settings::default();
        let source = Source::new(logs, settings.sensor);
        Self {
            limits,
            clock: clock.clone(),
            // What has colors is known by them.
            color: if source.has_color() { ColorBy::Color } else { ColorBy::Height },
            source,
            settings,
            maps: None,
            revision: 0,
        }
    }

    /// Answers.
    pub(in crate::engine) fn ask(&mut self, ask: Ask) -> Result<Reply, Refusal> {
        match ask {
            Ask::Open {} => {
                let up = self.source.up();
                let maps = self.maps()?;
                maps.buffers = MeshBuffers::nothing(up);
                maps.buffers.change(&maps.mesh.keys(), &maps.mesh)?;
                self.answer(true)
            }
            Ask::Step { frames } => {
                let to = self.at() + frames.min(MOST_STEPS);
                self.go(to)
            }
            Ask::Seek { frame } => self.go(frame),
            Ask::Set { settings } => self.set(settings),
            Ask::Color { by } => self.color(by),
            Ask::Mesh {} => self.answer(false),
            Ask::Slice { slice } => self.slice(slice),
            Ask::Pick { origin, direction, slice } => self.pick(origin, direction, slice),
            Ask::Voxel { cell } => self.voxel(cell),
            Ask::History {} => {
                let Some(maps) = &mut self.maps else { return Reply::of(Value::Null) };
                let Some(watched) = &mut maps.watched else { return Reply::of(Value::Null) };
                watched.go_on(&mut self.source, &self.clock);
                Reply::of(watched.to_json())
            }
            Ask::Export { file } => {
                if matches!(file, ExportFile::Esdf) {
                    self.measure()?;
                }
                export::file(self.maps()?, file)
            }
        }
    }

    /// Frames that are fused.
    pub(super) fn at(&self) -> usize {
        self.maps.as_ref().map_or(0, |m| m.at)
    }

    /// What is left of the tab's memory for more of this view.
    pub(super) fn room(&self) -> usize {
        (self.limits.memory / 10 * 9).saturating_sub(self.memory_bytes())
    }

    pub(super) fn maps(&mut self) -> Result<&mut Maps, Refusal> {
        if self.maps.is_none() {
            let mut maps = Maps::new(&self.source, &self.settings)?;
            maps.follow(&self.clock)?;
            self.maps = Some(maps);
        }
        self.maps.as_mut().ok_or_else(|| Refusal::new("there is no map"))
    }

    /// Fuses on, or from the beginning, towards where `to` frames are fused.
    fn go(&mut self, to: usize) -> Result<Reply, Refusal> {
        let start = self.clock.now();
        let to = to.min(self.source.len());
        if to < self.at() {
            self.begin()?;
        }
        self.maps()?;
        let before = self.at();
        // Half for maps; the rest is for mesh, Euclidean field and simulated frames.
        let memory = self.limits.memory / 2;
        let Some(maps) = &mut self.maps else { return Err(Refusal::new("there is no map")) };
        maps.seconds = Seconds::default();
        while maps.at < to && maps.full.is_none() {
            maps.fuse_one(&mut self.source, memory, &self.clock);
            if self.clock.now() - start > LONGEST {
                break;
            }
        }
        if maps.at != before {
            self.revision += 1;
        }
        maps.follow(&self.clock)?;
        if self.room() == 0
            && let Some(maps) = &mut self.maps
        {
            let limit = self.limits.memory >> 20;
            maps.full.get_or_insert(format!(
                "map and mesh take nearly all of the {limit} MiB that a tab may have; choose larger cells"
            ));
        }
        self.answer(false)
    }

    /// Maps of nothing, with the cell that is looked at.
    fn begin(&mut self) -> Result<(), Refusal> {
        let mut maps = Maps::new(&self.source, &self.settings)?;
        let before = self.maps.take();
        let same = before.as_ref().is_some_and(|b| b.tsdf().lattice() == maps.tsdf().lattice());
        if let Some(mut watched) = before.and_then(|b| b.watched).filter(|_| same) {
            watched.begin();
            maps.watch(Some(watched));
        }
        maps.follow(&self.clock)?;
        self.maps = Some(maps);
        self.revision += 1;
        Ok(())
    }

    fn set(&mut self, settings: Settings) -> Result<Reply, Refusal> {
        settings.mapper(false)?;
        self.settings = settings;
        self.source.set_sensor(self.settings.sensor);
        if self.color == ColorBy::Color && !self.source.has_color() {
            self.color = ColorBy::Height;
        }
        self.begin()?;
        self.answer(true)
    }

    fn color(&mut self, by: ColorBy) -> Result<Reply, Refusal> {
        if let Some(why) = self.refused(by) {
            return Err(Refusal::new(why));
        }
        self.color = by;
        self.maps()?.buffers.again();
        self.answer(false)
    }

    /// Why the surface cannot be colored so.
    pub(super) fn refused(&self, by: ColorBy) -> Option<&'static str> {
        match by {
            ColorBy::Color if !self.source.has_color() => Some("this sensor measures no color"),
            ColorBy::Error if self.source.world().is_none() => {
                Some("errors are distances to the true surface, which is unknown for a recorded log")
            }
            ColorBy::Sigma if self.source.sigma().is_none() => Some(
                "how sure the surface is is known of maps that were made with --ledger, by sigma.json beside them",
            ),
            ColorBy::Passed if self.source.attenuation().is_none() => {
                Some("which share of the looks passed is known of saved maps that hold hits per meter")
            }
            _ => None,
        }
    }

    #[cfg(test)]
    pub(super) fn maps_for_tests(&self) -> &Maps {
        self.maps.as_ref().unwrap()
    }

    #[cfg(test)]
    pub(super) fn world_for_tests(&self) -> Option<&portolan_sim::building::World3> {
        self.source.world()
    }

    pub(in crate::engine) fn memory_bytes(&self) -> usize {
        self.maps.as_ref().map_or(0, Maps::memory_bytes) + self.source.memory_bytes()
    }

    /// Gives the maps up.
    pub(in crate::engine) fn forget(&mut self) {
        self.maps = None;
        self.revision += 1;
    }
}
