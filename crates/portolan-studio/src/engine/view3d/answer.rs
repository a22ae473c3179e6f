//! What the page gets after a question about map and mesh.

use portolan::field::Esdf;
use portolan::geom::BLOCK_EDGE;
use portolan::geom::vector::{dot, sub};
use portolan::map::Occupancy;
use serde_json::json;

use super::ask::ColorBy;
use super::slice::Extent;
use super::state::View3d;
use super::{shade, voxel};
use crate::engine::{Refusal, Reply};

/// Points of what moved that the page gets, at most.
const MOST_MOVERS: usize = 100_000;

impl View3d {
    /// What is new; with `all` also what seldom changes.
    pub(super) fn answer(&mut self, all: bool) -> Result<Reply, Refusal> {
        self.maps()?;
        use ColorBy::{Color, Error, Height, Passed, Sigma, Weight};
        let colors = [Height, Color, Weight, Sigma, Passed, Error];
        let colors: Vec<_> = colors.map(|by| json!({ "by": by, "refused": self.refused(by) })).into();
        let Some(maps) = &mut self.maps else { return Err(Refusal::new("there is no map")) };
        let (by, source) = (self.color, &self.source);
        let delta = maps.next(&self.clock, |piece, tsdf, out| shade::shades(by, piece, tsdf, source, out));
        let tsdf = maps.tsdf();
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
                "occupancy": maps.occupancy().map(Occupancy::<3>::memory_bytes),
                "esdf": maps.esdf.as_ref().map(Esdf::memory_bytes),
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
            "color": { "by": by, "ramp": shade::ramp(by, tsdf, source, maps.buffers.heights()) },
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
                "occupancy": maps.occupancy().is_some(),
                "half_life": tsdf.rule().half_life(1.0),
                "movers": source.movers().len(),
            });
        }
        // They do not change.
        let movers = if all { source.movers() } else { &[] };
        let step = movers.len().div_ceil(MOST_MOVERS).max(1);
        let movers: Vec<f32> =
            movers.iter().step_by(step).flat_map(|&p| local(p)).map(|v| v as f32).collect();
        let points = maps.points();
        Ok(Reply::of(body)?
            .with("holes", delta.holes)
            .with("runs", delta.runs)
            .with("positions", delta.positions)
            .with("normals", delta.normals)
            .with("shades", delta.shades)
            .with("indices", delta.indices)
            .with("points", points)
            .with("movers", movers))
    }
}
