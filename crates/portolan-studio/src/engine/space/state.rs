//! The view of space: what is asked of it, and what it tells of its maps.

use std::sync::Arc;

use portolan::field::Esdf;
use portolan::geom::BLOCK_EDGE;
use portolan::geom::vector::{add, dot, sub};
use portolan::map::Occupancy;
use serde_json::{Value, json};

use super::ask::{Ask, ColorBy, ExportFile, Field, Slice};
use super::drawn::Drawn;
use super::history::Watched;
use super::made::{Made, Seconds};
use super::settings::Settings;
use super::slice::{self, AXES, Extent};
use super::source::Source;
use super::{export, shade, voxel};
use crate::engine::{Clock, Limits, Logs, Refusal, Reply};

/// Frames that one question may fuse.
const MOST_STEPS: usize = 64;
/// Seconds after which an answer is given, whatever is still to be fused.
const LONGEST: f64 = 0.25;
/// Indices of cells that can be asked for lie below this, so that those of their neighbours are numbers, too.
const FURTHEST: i32 = 1 << 28;

/// The view of space.
pub(in crate::engine) struct Space {
    limits: Limits,
    clock: Clock,
    settings: Settings,
    source: Source,
    made: Option<Made>,
    color: ColorBy,
    revision: u64,
}

impl Space {
    pub(in crate::engine) fn new(logs: &Arc<Logs>, limits: Limits, clock: &Clock) -> Self {
        let settings = Settings::default();
        Self {
            limits,
            clock: clock.clone(),
            source: Source::new(logs, settings.sensor),
            settings,
            made: None,
            color: ColorBy::default(),
            revision: 0,
        }
    }

    /// Answers.
    pub(in crate::engine) fn ask(&mut self, ask: Ask) -> Result<Reply, Refusal> {
        match ask {
            Ask::Open {} => {
                let up = self.source.up();
                let made = self.made()?;
                made.drawn = Drawn::nothing(up);
                made.drawn.change(&made.mesh.keys(), &made.mesh)?;
                self.tell(true)
            }
            Ask::Step { frames } => {
                let to = self.at() + frames.min(MOST_STEPS);
                self.go(to)
            }
            Ask::Seek { frame } => self.go(frame),
            Ask::Set { settings } => self.set(settings),
            Ask::Color { by } => self.color(by),
            Ask::Mesh {} => self.tell(false),
            Ask::Slice { slice } => self.slice(slice),
            Ask::Pick { origin, direction, slice } => self.pick(origin, direction, slice),
            Ask::Voxel { cell } => self.voxel(cell),
            Ask::History {} => {
                let Some(made) = &mut self.made else { return Reply::of(Value::Null) };
                let Some(watched) = &mut made.watched else { return Reply::of(Value::Null) };
                watched.go_on(&mut self.source, &self.clock);
                Reply::of(watched.tell())
            }
            Ask::Export { file } => {
                if matches!(file, ExportFile::Esdf) {
                    self.measure()?;
                }
                export::file(self.made()?, file)
            }
        }
    }

    fn at(&self) -> usize {
        self.made.as_ref().map_or(0, |m| m.at)
    }

    /// What is left of the tab's memory for more of this view.
    fn room(&self) -> usize {
        (self.limits.memory / 10 * 9).saturating_sub(self.memory_bytes())
    }

    fn made(&mut self) -> Result<&mut Made, Refusal> {
        if self.made.is_none() {
            let mut made = Made::new(&self.source, &self.settings)?;
            made.follow(&self.clock)?;
            self.made = Some(made);
        }
        self.made.as_mut().ok_or_else(|| Refusal::new("there is no map"))
    }

    /// Fuses on, or from the beginning, towards where `to` frames are fused.
    fn go(&mut self, to: usize) -> Result<Reply, Refusal> {
        let start = self.clock.now();
        let to = to.min(self.source.len());
        if to < self.at() {
            self.begin()?;
        }
        self.made()?;
        let before = self.at();
        // Half for maps; the rest is for mesh, Euclidean field and simulated frames.
        let memory = self.limits.memory / 2;
        let Some(made) = &mut self.made else { return Err(Refusal::new("there is no map")) };
        made.seconds = Seconds::default();
        while made.at < to && made.full.is_none() {
            made.fuse_one(&mut self.source, memory, &self.clock);
            if self.clock.now() - start > LONGEST {
                break;
            }
        }
        if made.at != before {
            self.revision += 1;
        }
        made.follow(&self.clock)?;
        if self.room() == 0
            && let Some(made) = &mut self.made
        {
            let limit = self.limits.memory >> 20;
            made.full.get_or_insert(format!(
                "map and mesh take nearly all of the {limit} MiB that a tab may have; choose larger cells"
            ));
        }
        self.tell(false)
    }

    /// Maps of nothing, with the cell that is looked at.
    fn begin(&mut self) -> Result<(), Refusal> {
        let mut made = Made::new(&self.source, &self.settings)?;
        let before = self.made.take();
        let same = before.as_ref().is_some_and(|b| b.tsdf.lattice() == made.tsdf.lattice());
        if let Some(mut watched) = before.and_then(|b| b.watched).filter(|_| same) {
            watched.begin();
            made.watch(Some(watched));
        }
        made.follow(&self.clock)?;
        self.made = Some(made);
        self.revision += 1;
        Ok(())
    }

    fn set(&mut self, settings: Settings) -> Result<Reply, Refusal> {
        settings.config([0.0; 3], false)?;
        self.settings = settings;
        self.source.set_sensor(self.settings.sensor);
        if self.color == ColorBy::Color && !self.source.has_color() {
            self.color = ColorBy::Height;
        }
        self.begin()?;
        self.tell(true)
    }

    fn color(&mut self, by: ColorBy) -> Result<Reply, Refusal> {
        if let Some(why) = self.refused(by) {
            return Err(Refusal::new(why));
        }
        self.color = by;
        self.made()?.drawn.again();
        self.tell(false)
    }

    /// Why the surface cannot be coloured so.
    fn refused(&self, by: ColorBy) -> Option<&'static str> {
        let colored = match self.source.map() {
            Some(map) => map.colors().is_some(),
            None => self.source.has_color(),
        };
        match by {
            ColorBy::Color if !colored => Some("this sensor sees no colours"),
            ColorBy::Error if self.source.world().is_none() => {
                Some("errors are distances to the true surface, which nobody knows for a recorded log")
            }
            ColorBy::Height | ColorBy::Weight | ColorBy::Color | ColorBy::Error => None,
        }
    }

    /// What is new; with `all` also what seldom changes.
    fn tell(&mut self, all: bool) -> Result<Reply, Refusal> {
        self.made()?;
        let colors = [ColorBy::Height, ColorBy::Color, ColorBy::Weight, ColorBy::Error];
        let colors: Vec<_> = colors.map(|by| json!({ "by": by, "refused": self.refused(by) })).into();
        let Some(made) = &mut self.made else { return Err(Refusal::new("there is no map")) };
        let (by, tsdf, world) = (self.color, &made.tsdf, self.source.world());
        let delta = made.drawn.next(&made.mesh, made.first, &self.clock, |piece, out| {
            shade::shades(by, piece, tsdf, world, out);
        });
        let lattice = tsdf.lattice();
        let bounds = Extent::of(tsdf).map(|e| e.aabb(lattice));
        let local = |p: [f64; 3]| sub(p, made.origin);
        let surface = made.drawn.extent().map(|[a, b]| {
            let end = b.first_cell().map(|c| c + BLOCK_EDGE as i32);
            [lattice.corner(a.first_cell()), lattice.corner(end)].map(|p| sub(p, made.origin))
        });
        let [vertices, indices] = made.drawn.room();
        let s = made.seconds;
        let mut body = json!({
            "at": made.at,
            "frames": self.source.len(),
            "revision": self.revision,
            "seconds": { "frames": s.frames, "tsdf": s.tsdf, "occupancy": s.occupancy, "mesh": s.mesh },
            "hits": made.last.as_ref().map(|(_, frame)| frame.hits()),
            "cells": made.stats.cells,
            "bricks": tsdf.store().len(),
            "bytes": {
                "tsdf": tsdf.memory_bytes(),
                "occupancy": made.occupancy.as_ref().map(Occupancy::memory_bytes),
                "esdf": made.esdf.as_ref().map(Esdf::memory_bytes),
                "mesh": made.mesh.memory_bytes(),
            },
            "surface": surface,
            "bounds": bounds.map(|b| [local(b.min), local(b.max)]),
            "pose": made.last.as_ref().map(|(pose, _)| local(pose.translation)),
            "left_out": { "frames": made.left_out.0, "why": made.left_out.1 },
            "full": made.full,
            "voxel": made.watched.as_ref().map(|w| voxel::tell(made, &self.source, w.cell, made.origin)),
            "mesh": {
                "fresh": delta.fresh,
                "vertices": vertices,
                "indices": indices,
                "triangles": made.drawn.triangles(),
                "pending": made.drawn.pending(),
            },
            "color": { "by": by, "ramp": shade::ramp(by, tsdf, made.drawn.heights()) },
        });
        if all {
            body["all"] = json!({
                "name": self.source.name(),
                "settings": self.settings,
                "simulated": self.source.world().is_some(),
                "fixed": self.source.map().is_some(),
                "resolution": lattice.resolution,
                "truncation": tsdf.rule().truncation,
                "origin": made.origin,
                "up": self.source.up(),
                "height": dot(made.origin, self.source.up()),
                "way": self.source.way().into_iter().map(local).collect::<Vec<_>>(),
                "colors": colors,
                "occupancy": made.occupancy.is_some(),
                "half_life": tsdf.rule().half_life(1.0),
            });
        }
        let points = made.points();
        Ok(Reply::of(body)?
            .with("holes", delta.holes)
            .with("runs", delta.runs)
            .with("positions", delta.positions)
            .with("normals", delta.normals)
            .with("shades", delta.shades)
            .with("indices", delta.indices)
            .with("points", points))
    }

    /// The Euclidean field of the map as it is.
    fn measure(&mut self) -> Result<f64, Refusal> {
        let room = self.room();
        let clock = self.clock.clone();
        self.made()?.measure(room, &clock)
    }

    fn slice(&mut self, slice: Slice) -> Result<Reply, Refusal> {
        let seconds = if slice.field == Field::Esdf { self.measure()? } else { 0.0 };
        let made = self.made()?;
        if slice.field == Field::Occupancy && made.occupancy.is_none() {
            return Err(Refusal::new("this map holds distances only; switch on occupancy in the settings"));
        }
        let lattice = *made.tsdf.lattice();
        let Some(extent) = Extent::of(&made.tsdf) else {
            return Err(Refusal::new("nothing was observed yet, so that there is nothing to cut"));
        };
        let slice = world(slice, made.origin);
        let cell = slice::layer_index(&slice, slice.at, &extent, &lattice)?;
        let value = slice::value_of(slice.field, &made.tsdf, made.occupancy.as_ref(), made.esdf.as_ref());
        let layer = slice::layer(slice.axis, cell, &extent, &lattice, value);
        let most = match slice.field {
            Field::Tsdf => f64::from(made.tsdf.rule().truncation),
            Field::Esdf => made.esdf.as_ref().map_or(0.0, |e| f64::from(e.max_distance())),
            Field::Occupancy => 1.0,
        };
        // The quad runs through the middle of the layer.
        let mut corner = sub(layer.corner, made.origin);
        corner[slice.axis] = layer.at - made.origin[slice.axis];
        let side = |i: usize| (layer.shape[i] * layer.step) as f64 * lattice.resolution;
        let reply = Reply::of(json!({
            "cell": layer.cell,
            "at": layer.at - made.origin[slice.axis],
            "world": layer.at,
            "axes": AXES[slice.axis],
            "shape": layer.shape,
            "step": layer.step,
            "corner": corner,
            "sides": [side(0), side(1)],
            "most": most,
            "seconds": seconds,
            "revision": self.revision,
        }))?;
        Ok(reply.with("values", layer.values))
    }

    fn pick(
        &mut self,
        origin: [f64; 3],
        direction: [f64; 3],
        slice: Option<Slice>,
    ) -> Result<Reply, Refusal> {
        let made = self.made()?;
        let slice = slice.map(|slice| world(slice, made.origin));
        let met = voxel::pick(made, add(origin, made.origin), direction, slice.as_ref())?;
        Reply::of(met.map(
            |met| json!({ "cell": met.cell, "point": sub(met.point, made.origin), "slice": met.on_slice }),
        ))
    }

    fn voxel(&mut self, cell: Option<[i32; 3]>) -> Result<Reply, Refusal> {
        let Some(cell) = cell else {
            self.made()?.watch(None);
            return Reply::of(Value::Null);
        };
        if !cell.iter().all(|v| v.abs() < FURTHEST) {
            return Err(Refusal::new(format!("there is no cell {cell:?}")));
        }
        // Without the field there is still all the rest to tell.
        let trouble = self.measure().err().map(|why| why.to_string());
        let since = self.at();
        let made = self.made()?;
        if made.watched.as_ref().is_none_or(|w| w.cell != cell) {
            let watched = Watched::new(cell, since, *made.tsdf.config())?;
            made.watch(Some(watched));
        }
        let Some(made) = &self.made else { return Reply::of(Value::Null) };
        let mut body = voxel::tell(made, &self.source, cell, made.origin);
        body["trouble"] = json!(trouble);
        body["history"] = json!(made.watched.as_ref().map(Watched::tell));
        body["recorded"] = json!(self.source.map().is_none());
        Reply::of(body)
    }

    #[cfg(test)]
    pub(super) fn made_for_tests(&self) -> &Made {
        self.made.as_ref().unwrap()
    }

    #[cfg(test)]
    pub(super) fn world_for_tests(&self) -> Option<&portolan_sim::building::World3> {
        self.source.world()
    }

    pub(in crate::engine) fn memory_bytes(&self) -> usize {
        self.made.as_ref().map_or(0, Made::memory_bytes) + self.source.memory_bytes()
    }

    /// Gives the maps up.
    pub(in crate::engine) fn forget(&mut self) {
        self.made = None;
        self.revision += 1;
    }
}

/// The slice with its place in the world.
fn world(slice: Slice, origin: [f64; 3]) -> Slice {
    Slice { at: slice.at + origin.get(slice.axis).copied().unwrap_or(0.0), ..slice }
}
