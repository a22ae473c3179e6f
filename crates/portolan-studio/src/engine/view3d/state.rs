//! The view of space: what is asked of it, and what it tells of its maps.

use std::sync::Arc;

use portolan::field::Esdf;
use portolan::geom::BLOCK_EDGE;
use portolan::geom::vector::{add, dot, sub};
use portolan::map::Occupancy;
use serde_json::{Value, json};

use super::ask::{Ask, ColorBy, ExportFile, Field, Slice};
use super::history::Watched;
use super::maps::{Maps, Seconds};
use super::mesh_buffers::MeshBuffers;
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
pub(in crate::engine) struct View3d {
    limits: Limits,
    clock: Clock,
    settings: Settings,
    source: Source,
    maps: Option<Maps>,
    color: ColorBy,
    revision: u64,
}

impl View3d {
    pub(in crate::engine) fn new(logs: &Arc<Logs>, limits: Limits, clock: &Clock) -> Self {
        let settings = Settings::default();
        Self {
            limits,
            clock: clock.clone(),
            source: Source::new(logs, settings.sensor),
            settings,
            maps: None,
            color: ColorBy::default(),
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

    fn at(&self) -> usize {
        self.maps.as_ref().map_or(0, |m| m.at)
    }

    /// What is left of the tab's memory for more of this view.
    fn room(&self) -> usize {
        (self.limits.memory / 10 * 9).saturating_sub(self.memory_bytes())
    }

    fn maps(&mut self) -> Result<&mut Maps, Refusal> {
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
        let same = before.as_ref().is_some_and(|b| b.tsdf.lattice() == maps.tsdf.lattice());
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
        settings.config([0.0; 3], false)?;
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
    fn answer(&mut self, all: bool) -> Result<Reply, Refusal> {
        self.maps()?;
        let colors = [ColorBy::Height, ColorBy::Color, ColorBy::Weight, ColorBy::Error];
        let colors: Vec<_> = colors.map(|by| json!({ "by": by, "refused": self.refused(by) })).into();
        let Some(maps) = &mut self.maps else { return Err(Refusal::new("there is no map")) };
        let (by, tsdf, world) = (self.color, &maps.tsdf, self.source.world());
        let delta = maps.buffers.next(&maps.mesh, maps.first, &self.clock, |piece, out| {
            shade::shades(by, piece, tsdf, world, out);
        });
        let lattice = tsdf.lattice();
        let bounds = Extent::of(tsdf).map(|e| e.aabb(lattice));
        let local = |p: [f64; 3]| sub(p, maps.origin);
        let surface = maps.buffers.extent().map(|[a, b]| {
            let end = b.first_cell().map(|c| c + BLOCK_EDGE as i32);
            [lattice.corner(a.first_cell()), lattice.corner(end)].map(|p| sub(p, maps.origin))
        });
        let [vertices, indices] = maps.buffers.room();
        let s = maps.seconds;
        let mut body = json!({
            "at": maps.at,
            "frames": self.source.len(),
            "revision": self.revision,
            "seconds": { "frames": s.frames, "tsdf": s.tsdf, "occupancy": s.occupancy, "mesh": s.mesh },
            "hits": maps.last.as_ref().map(|(_, frame)| frame.hits()),
            "cells": maps.stats.cells,
            "bricks": tsdf.store().len(),
            "bytes": {
                "tsdf": tsdf.memory_bytes(),
                "occupancy": maps.occupancy.as_ref().map(Occupancy::memory_bytes),
                "esdf": maps.esdf.as_ref().map(SparseEsdf::memory_bytes),
                "mesh": maps.mesh.memory_bytes(),
            },
            "surface": surface,
            "bounds": bounds.map(|b| [local(b.min), local(b.max)]),
            "pose": maps.last.as_ref().map(|(pose, _)| local(pose.translation)),
            "left_out": { "frames": maps.left_out.0, "why": maps.left_out.1 },
            "full": maps.full,
            "voxel": maps.watched.as_ref().map(|w| voxel::describe(maps, &self.source, w.cell, maps.origin)),
            "mesh": {
                "fresh": delta.fresh,
                "vertices": vertices,
                "indices": indices,
                "triangles": maps.buffers.triangles(),
                "pending": maps.buffers.pending(),
            },
            "color": { "by": by, "ramp": shade::ramp(by, tsdf, maps.buffers.heights()) },
        });
        if all {
            body["all"] = json!({
                "name": self.source.name(),
                "settings": self.settings,
                "simulated": self.source.world().is_some(),
                "fixed": self.source.map().is_some(),
                "resolution": lattice.resolution,
                "truncation": tsdf.rule().truncation,
                "origin": maps.origin,
                "up": self.source.up(),
                "height": dot(maps.origin, self.source.up()),
                "way": self.source.way().into_iter().map(local).collect::<Vec<_>>(),
                "colors": colors,
                "occupancy": maps.occupancy.is_some(),
                "half_life": tsdf.rule().half_life(1.0),
            });
        }
        let points = maps.points();
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
        self.maps()?.measure(room, &clock)
    }

    fn slice(&mut self, slice: Slice) -> Result<Reply, Refusal> {
        let seconds = if slice.field == Field::Esdf { self.measure()? } else { 0.0 };
        let maps = self.maps()?;
        if slice.field == Field::Occupancy && maps.occupancy.is_none() {
            return Err(Refusal::new("this map holds distances only; switch on occupancy in the settings"));
        }
        let lattice = *maps.tsdf.lattice();
        let Some(extent) = Extent::of(&maps.tsdf) else {
            return Err(Refusal::new("nothing was observed yet, so that there is nothing to cut"));
        };
        let slice = world(slice, maps.origin);
        let cell = slice::layer_index(&slice, slice.at, &extent, &lattice)?;
        let value = slice::value_of(slice.field, &maps.tsdf, maps.occupancy.as_ref(), maps.esdf.as_ref());
        let layer = slice::layer(slice.axis, cell, &extent, &lattice, value);
        let most = match slice.field {
            Field::Tsdf => f64::from(maps.tsdf.rule().truncation),
            Field::Esdf => maps.esdf.as_ref().map_or(0.0, |e| f64::from(e.max_distance())),
            Field::Occupancy => 1.0,
        };
        // The quad runs through the middle of the layer.
        let mut corner = sub(layer.corner, maps.origin);
        corner[slice.axis] = layer.at - maps.origin[slice.axis];
        let side = |i: usize| (layer.shape[i] * layer.step) as f64 * lattice.resolution;
        let reply = Reply::of(json!({
            "cell": layer.cell,
            "at": layer.at - maps.origin[slice.axis],
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
        let maps = self.maps()?;
        let slice = slice.map(|slice| world(slice, maps.origin));
        let met = voxel::pick(maps, add(origin, maps.origin), direction, slice.as_ref())?;
        Reply::of(met.map(
            |met| json!({ "cell": met.cell, "point": sub(met.point, maps.origin), "slice": met.on_slice }),
        ))
    }

    fn voxel(&mut self, cell: Option<[i32; 3]>) -> Result<Reply, Refusal> {
        let Some(cell) = cell else {
            self.maps()?.watch(None);
            return Reply::of(Value::Null);
        };
        if !cell.iter().all(|v| v.abs() < FURTHEST) {
            return Err(Refusal::new(format!("there is no cell {cell:?}")));
        }
        // Without the field there is still all the rest to tell.
        let trouble = self.measure().err().map(|why| why.to_string());
        let since = self.at();
        let maps = self.maps()?;
        if maps.watched.as_ref().is_none_or(|w| w.cell != cell) {
            let watched = Watched::new(cell, since, *maps.tsdf.config())?;
            maps.watch(Some(watched));
        }
        let Some(maps) = &self.maps else { return Reply::of(Value::Null) };
        let mut body = voxel::describe(maps, &self.source, cell, maps.origin);
        body["trouble"] = json!(trouble);
        body["history"] = json!(maps.watched.as_ref().map(Watched::to_json));
        body["recorded"] = json!(self.source.map().is_none());
        Reply::of(body)
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

/// The slice with its place in the world.
fn world(slice: Slice, origin: [f64; 3]) -> Slice {
    Slice { at: slice.at + origin.get(slice.axis).copied().unwrap_or(0.0), ..slice }
}
