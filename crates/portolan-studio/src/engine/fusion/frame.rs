//! Parts of a frame: what the page draws of a scan and a map.

use portolan::geom::{Grid, Pose};
use portolan::map::Tsdf2;
use portolan::scan::{BeamKind, Scan, ScanStats};
use portolan::surface::{ContourSettings, Polyline, marching_squares};
use portolan_chapter::ghost::chair;
use portolan_sim::World;
use serde_json::{Value, json};

/// Lines in one array: points as x, y pairs, and where each line begins, counted in points, the end included.
pub(in crate::engine) struct Lines {
    pub(in crate::engine) points: Vec<f32>,
    pub(in crate::engine) starts: Vec<u32>,
}

impl Lines {
    pub(in crate::engine) fn of(lines: &[Polyline]) -> Self {
        let mut made = Self { points: Vec::new(), starts: vec![0] };
        for line in lines {
            // A closed line ends where it began.
            let again = line.vertices.first().filter(|_| line.closed);
            made.points.extend(line.vertices.iter().chain(again).flatten().map(|&v| v as f32));
            made.starts.push((made.points.len() / 2) as u32);
        }
        made
    }
}

/// The surface as it is extracted now.
pub(in crate::engine) fn contour(tsdf: &Tsdf2) -> Lines {
    Lines::of(&marching_squares(tsdf, &ContourSettings::of(tsdf)).polylines())
}

/// Ends of beams in the world, and of which kind each is.
pub(super) struct Beams {
    pub(super) ends: Vec<f32>,
    /// 0 a surface, 1 free up to there.
    pub(super) kinds: Vec<u8>,
}

pub(super) fn beams(pose: &Pose<2>, scan: &Scan<2>) -> Beams {
    let mut beams = Beams { ends: Vec::new(), kinds: Vec::new() };
    for beam in scan.beams().filter(|b| b.free_range() > 0.0) {
        let [x, y] = pose.transform_point(beam.direction.map(|v| v * beam.range));
        beams.ends.extend([x as f32, y as f32]);
        beams.kinds.push(u8::from(beam.kind != BeamKind::Hit));
    }
    beams
}

pub(super) fn pose(pose: &Pose<2>) -> Value {
    let [x, y] = pose.translation;
    let forward = pose.rotate([1.0, 0.0]);
    json!([x, y, forward[1].atan2(forward[0])])
}

pub(in crate::engine) fn grid(grid: &Grid<2>) -> Value {
    json!({ "origin": grid.lattice.origin, "resolution": grid.lattice.resolution, "shape": grid.shape })
}

/// Faces of walls and things, and where the chair stands.
pub(in crate::engine) fn truth(world: &World) -> Value {
    let chair = chair(world);
    let faces: Vec<_> = world.boundary().iter().map(|s| [s.a, s.b]).collect();
    json!({ "faces": faces, "chair": { "min": chair.min, "max": chair.max } })
}

/// Beams of the last scan by kind.
pub(super) fn counts(stats: &ScanStats) -> Value {
    let b = stats.beams;
    json!({ "hit": b.hit, "max_range": b.max_range, "no_return": b.no_return, "dropped": b.dropped, "cells": stats.cells })
}
