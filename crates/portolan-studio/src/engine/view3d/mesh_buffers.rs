//! What the page has of the mesh: the pieces of bricks in ranges of its buffers, and which of them are still to be sent.

use std::collections::{BTreeMap, BTreeSet};

use portolan::geom::BlockKey;
use portolan::geom::vector::dot;
use portolan::surface::{IncrementalMesh, Mesh};

use super::ranges::{Range, Ranges};
use crate::engine::{Clock, Refusal};

/// Triangles of one answer: more would take the page longer than a picture lasts.
const MOST_TRIANGLES: usize = 120_000;
/// Seconds that the making of one answer may take.
const LONGEST: f64 = 0.1;

/// A piece's place in the buffers, and how high it reaches.
#[derive(Debug, Default)]
struct Place {
    vertices: Range,
    /// Three indices each.
    triangles: Range,
    heights: Option<[f32; 2]>,
}

/// The page's copy of the mesh.
#[derive(Debug)]
pub(super) struct MeshBuffers {
    vertices: Ranges,
    /// Of three indices each: no triangle lies across the border of two rooms.
    corners: Ranges,
    places: BTreeMap<BlockKey<3>, Place>,
    pending: BTreeSet<BlockKey<3>>,
    /// Ranges of indices that no triangle uses any more.
    holes: Vec<u32>,
    fresh: bool,
    triangles: usize,
    up: [f32; 3],
}

/// What the page must write where.
#[derive(Debug, Default)]
pub(super) struct Delta {
    /// What it has is no more.
    pub(super) fresh: bool,
    /// First index and number of indices that become 0: a triangle of three equal corners draws nothing.
    pub(super) holes: Vec<u32>,
    /// Per piece: first vertex, vertices, first index, indices, room for indices, of which the rest becomes 0.
    pub(super) runs: Vec<u32>,
    /// Of all pieces, one after the other: meters from the origin.
    pub(super) positions: Vec<f32>,
    /// Four per vertex: 127 times a unit normal, and 0.
    pub(super) normals: Vec<i8>,
    /// Four per vertex, as [`super::shade`] makes them.
    pub(super) shades: Vec<u8>,
    /// Relative to the piece's first vertex.
    pub(super) indices: Vec<u16>,
}

impl MeshBuffers {
    /// A page that has nothing.
    pub(super) fn nothing(up: [f64; 3]) -> Self {
        Self {
            vertices: Ranges::default(),
            corners: Ranges::default(),
            places: BTreeMap::new(),
            pending: BTreeSet::new(),
            holes: Vec::new(),
            fresh: true,
            triangles: 0,
            up: up.map(|v| v as f32),
        }
    }

    /// These pieces are not what they were.
    ///
    /// # Errors
    /// Where there are more triangles than a page can hold.
    pub(super) fn change(&mut self, keys: &[BlockKey<3>], mesh: &IncrementalMesh) -> Result<(), Refusal> {
        for &key in keys {
            let [vertices, triangles] = mesh.piece_size(key);
            if triangles == 0 {
                if let Some(place) = self.places.remove(&key) {
                    self.give(&place);
                }
                self.pending.remove(&key);
                continue;
            }
            let (vertices, triangles) = (vertices as u32, triangles as u32);
            let place = self.places.remove(&key).unwrap_or_default();
            if place.vertices.capacity >= vertices && place.triangles.capacity >= triangles {
                self.places.insert(key, place);
            } else {
                self.give(&place);
                let rooms = self.vertices.take(vertices).zip(self.corners.take(triangles));
                let (vertices, triangles) = rooms.ok_or_else(|| {
                    Refusal::new("the mesh has more triangles than a page can draw; choose larger cells")
                })?;
                self.places.insert(key, Place { vertices, triangles, heights: None });
            }
            self.pending.insert(key);
        }
        self.triangles = self.places.keys().map(|&key| mesh.piece_size(key)[1]).sum();
        Ok(())
    }

    fn give(&mut self, place: &Place) {
        self.vertices.give(place.vertices);
        self.corners.give(place.triangles);
        if place.triangles.capacity > 0 {
            self.holes.extend([3 * place.triangles.start, 3 * place.triangles.capacity]);
        }
    }

    /// Everything is to be sent again, in the places that it has.
    pub(super) fn again(&mut self) {
        self.pending = self.places.keys().copied().collect();
    }

    /// What is to be sent next, of as many pieces as one answer holds, but at least one.
    pub(super) fn next(
        &mut self,
        mesh: &IncrementalMesh,
        first: BlockKey<3>,
        clock: &Clock,
        mut shade: impl FnMut(&Mesh, &mut Vec<u8>),
    ) -> Delta {
        let start = clock.now();
        let mut delta = Delta {
            fresh: std::mem::take(&mut self.fresh),
            holes: std::mem::take(&mut self.holes),
            ..Delta::default()
        };
        while 3 * MOST_TRIANGLES > delta.indices.len()
            && (delta.runs.is_empty() || clock.now() - start < LONGEST)
        {
            let Some(key) = self.pending.pop_first() else { break };
            let Some(place) = self.places.get_mut(&key) else { continue };
            let piece = mesh.piece(key, first);
            place.heights = heights(&piece, self.up);
            let counts = (piece.vertices.len() as u32, 3 * piece.triangles.len() as u32);
            delta.runs.extend([place.vertices.start, counts.0, 3 * place.triangles.start, counts.1]);
            delta.runs.push(3 * place.triangles.capacity);
            delta.positions.extend(piece.vertices.iter().flatten());
            for n in &piece.normals {
                let byte = |v: f32| (127.0 * v).round() as i8;
                delta.normals.extend([byte(n[0]), byte(n[1]), byte(n[2]), 0]);
            }
            shade(&piece, &mut delta.shades);
            // A brick has less than 2^16 vertices: 1536 edges, those of its neighbours, and a few in cubes.
            delta.indices.extend(piece.triangles.iter().flatten().map(|&v| v as u16));
        }
        delta
    }

    /// Triangles of the whole.
    pub(super) fn triangles(&self) -> usize {
        self.triangles
    }

    /// Pieces that are still to be sent.
    pub(super) fn pending(&self) -> usize {
        self.pending.len()
    }

    /// Vertices and indices that the page's buffers must have room for.
    pub(super) fn room(&self) -> [u32; 2] {
        [self.vertices.end(), 3 * self.corners.end()]
    }

    /// Between which heights the surface lies that the page has, but for the lowest and highest fiftieth of its
    /// bricks: a stray point shall not take the colors from the rest.
    pub(super) fn heights(&self) -> Option<[f32; 2]> {
        let pick = |k: usize, share: f64| {
            let mut all: Vec<f32> = self.places.values().filter_map(|p| Some(p.heights?[k])).collect();
            let at = (share * all.len().checked_sub(1)? as f64).round() as usize;
            let (_, value, _) = all.select_nth_unstable_by(at, f32::total_cmp);
            Some(*value)
        };
        Some([pick(0, 0.02)?, pick(1, 0.98)?])
    }

    /// The box of the bricks with surface, but for a hundredth of them on each side: the first brick, and the last. `None`:
    /// no brick has surface.
    pub(super) fn extent(&self) -> Option<[BlockKey<3>; 2]> {
        let last = self.places.len().checked_sub(1)?;
        let stray = self.places.len() / 100;
        let side = |k: usize| {
            let mut all: Vec<i32> = self.places.keys().map(|key| key.0[k]).collect();
            let (_, &mut low, _) = all.select_nth_unstable(stray);
            let (_, &mut high, _) = all.select_nth_unstable(last - stray);
            [low, high]
        };
        let [x, y, z] = [side(0), side(1), side(2)];
        Some([0, 1].map(|i| BlockKey([x[i], y[i], z[i]])))
    }

    pub(super) fn memory_bytes(&self) -> usize {
        // Two trees; a node's entries are three quarters used at worst.
        let entry = size_of::<(BlockKey<3>, Place)>() + size_of::<BlockKey<3>>();
        self.places.len() * entry * 4 / 3 + self.vertices.memory_bytes() + self.corners.memory_bytes()
    }
}

/// How low and how high the vertices lie (meters from the origin).
fn heights(piece: &Mesh, up: [f32; 3]) -> Option<[f32; 2]> {
    let up = up.map(f64::from);
    let all = piece.vertices.iter().map(|v| dot(v.map(f64::from), up) as f32);
    all.fold(None, |range: Option<[f32; 2]>, h| Some(range.map_or([h; 2], |[a, b]| [a.min(h), b.max(h)])))
}
