//! Pieces of bricks joined into one mesh.

use super::piece::{Part, Piece, WORDS, place_of};
use super::vertex::Attributes;
use crate::parallel;
use crate::sets::bits;
use crate::surface::Mesh;

/// Positions of nodes: node `i` lies at `origin + (i + offset) * resolution`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub(super) origin: [f64; 3],
    pub(super) resolution: f64,
    pub(super) offset: f64,
    /// The brick whose lower corner is the origin of the mesh; `None` for the lower corner of all bricks with a piece.
    pub(super) first: Option<[i32; 3]>,
}

/// Pieces in one task.
const TOGETHER: usize = 128;

/// No piece, or no vertex.
const NONE: u32 = u32::MAX;

/// Joins pieces in ascending order of keys. Every crossing belongs to the brick where its edge starts; lower neighbors find
/// it by its place there, without comparing positions. Beside the mesh the ranges of its vertices, if they are wanted. On so
/// many `threads` at most.
pub(super) fn assemble(
    pieces: &[(&Part, &Piece)],
    placement: &Placement,
    want: Attributes,
    threads: usize,
) -> (Mesh, Vec<f32>) {
    let lowest = |k: usize| pieces.iter().map(|(_, p)| p.key.0[k]).min().unwrap_or(0);
    let first = placement.first.unwrap_or_else(|| [0, 1, 2].map(lowest));
    let owners = owners(pieces, threads);
    let kept = kept(pieces, &owners);
    let joint = Joint { pieces, owners, starts: starts(pieces, &kept), kept, placement, first, want };
    let (vertices, triangles) = joint.starts[pieces.len()];
    let mut mesh = Mesh {
        origin: std::array::from_fn(|k| {
            placement.origin[k] + f64::from(first[k]) * 8.0 * placement.resolution
        }),
        vertices: vec![[0.0; 3]; vertices as usize],
        triangles: vec![[0; 3]; triangles],
        normals: vec![[0.0; 3]; if want.normals { vertices as usize } else { 0 }],
        colors: vec![[0; 3]; if want.colors { vertices as usize } else { 0 }],
    };
    let mut ranges = vec![0.0; if want.ranges { vertices as usize } else { 0 }];
    let mut r = &mut ranges[..];
    let (mut v, mut t) = (&mut mesh.vertices[..], &mut mesh.triangles[..]);
    let (mut n, mut c) = (&mut mesh.normals[..], &mut mesh.colors[..]);
    let mut places: Vec<Place> = (0..pieces.len().div_ceil(TOGETHER))
        .map(|chunk| {
            let (from, to) = (chunk * TOGETHER, ((chunk + 1) * TOGETHER).min(pieces.len()));
            let count = (joint.starts[to].0 - joint.starts[from].0) as usize;
            let triangles = joint.starts[to].1 - joint.starts[from].1;
            Place {
                pieces: from..to,
                vertices: v.split_off_mut(..count).unwrap_or_default(),
                triangles: t.split_off_mut(..triangles).unwrap_or_default(),
                normals: n.split_off_mut(..count).unwrap_or_default(),
                colors: c.split_off_mut(..count).unwrap_or_default(),
                ranges: r.split_off_mut(..count).unwrap_or_default(),
            }
        })
        .collect();
    parallel::change_each_on(threads, &mut places, 1, Vec::new, |place, numbers| joint.fill(place, numbers));
    super::normals::complete(&mut mesh);
    (mesh, ranges)
}

/// The crossings of a brick that are vertices, for bricks with others.
struct Kept {
    words: [u64; WORDS],
    rank: [u16; WORDS],
    count: u32,
}

/// The layout of the mesh, computed before vertices and triangles are written.
struct Joint<'a> {
    pieces: &'a [(&'a Part, &'a Piece)],
    /// By piece and octant: the piece of the upper neighbor.
    owners: Vec<[u32; 8]>,
    kept: Vec<Option<Box<Kept>>>,
    /// First vertex and first triangle of every piece, and the totals.
    starts: Vec<(u32, usize)>,
    placement: &'a Placement,
    first: [i32; 3],
    want: Attributes,
}

/// The part of the mesh that some pieces fill.
struct Place<'a> {
    pieces: std::ops::Range<usize>,
    vertices: &'a mut [[f32; 3]],
    triangles: &'a mut [[u32; 3]],
    normals: &'a mut [[f32; 3]],
    colors: &'a mut [[u8; 3]],
    ranges: &'a mut [f32],
}

impl Joint<'_> {
    fn fill(&self, place: &mut Place, numbers: &mut Vec<u32>) {
        let (vertex_0, triangle_0) = self.starts[place.pieces.start];
        for i in place.pieces.clone() {
            let (part, piece) = self.pieces[i];
            self.number(i, numbers);
            if self.kept[i].is_none() {
                self.fill_all(i, (self.starts[i].0 - vertex_0) as usize, place);
            } else {
                self.fill_kept(i, vertex_0, numbers, place);
            }
            let from = piece.first_triangle as usize;
            let triangles = &part.triangles[from..from + piece.triangles as usize];
            let to = self.starts[i].1 - triangle_0;
            for (out, t) in place.triangles[to..].iter_mut().zip(triangles) {
                *out = t.map(|v| numbers[usize::from(v)]);
            }
        }
    }

    /// Writes the vertices of a piece whose crossings are all vertices of the mesh, contiguous from `to` on.
    fn fill_all(&self, i: usize, to: usize, place: &mut Place) {
        let (part, piece) = self.pieces[i];
        let (from, count) = (piece.first_vertex as usize, (piece.own + piece.centres) as usize);
        let put = self.position(piece);
        for (out, p) in place.vertices[to..to + count].iter_mut().zip(&part.vertices[from..]) {
            *out = put(p);
        }
        if self.want.normals {
            for (out, g) in place.normals[to..to + count].iter_mut().zip(&part.gradients[from..]) {
                *out = super::normals::unit(*g);
            }
        }
        if self.want.colors {
            place.colors[to..to + count].copy_from_slice(&part.colors[from..from + count]);
        }
        if self.want.ranges {
            place.ranges[to..to + count].copy_from_slice(&part.ranges[from..from + count]);
        }
    }

    /// Writes those vertices of a piece that some cube uses.
    fn fill_kept(&self, i: usize, vertex_0: u32, numbers: &[u32], place: &mut Place) {
        let (part, piece) = self.pieces[i];
        let (own, foreign, from) = (piece.own as usize, piece.foreign as usize, piece.first_vertex as usize);
        let put = self.position(piece);
        for j in 0..own + piece.centres as usize {
            let number = numbers[if j < own { j } else { j + foreign }];
            if number == NONE {
                continue;
            }
            let to = (number - vertex_0) as usize;
            place.vertices[to] = put(&part.vertices[from + j]);
            if self.want.normals {
                place.normals[to] = super::normals::unit(part.gradients[from + j]);
            }
            if self.want.colors {
                place.colors[to] = part.colors[from + j];
            }
            if self.want.ranges {
                place.ranges[to] = part.ranges[from + j];
            }
        }
    }

    /// From cells of a brick to meters from the origin of the mesh.
    #[inline(always)]
    fn position(&self, piece: &Piece) -> impl Fn(&[f32; 3]) -> [f32; 3] {
        let base = [0, 1, 2]
            .map(|k| 8.0 * (f64::from(piece.key.0[k]) - f64::from(self.first[k])) + self.placement.offset);
        let scale = self.placement.resolution;
        move |p| [0, 1, 2].map(|k| ((base[k] + f64::from(p[k])) * scale) as f32)
    }

    /// The indices in the mesh of the vertices of a piece.
    fn number(&self, i: usize, numbers: &mut Vec<u32>) {
        let (part, piece) = self.pieces[i];
        let start = self.starts[i].0;
        numbers.clear();
        let own = match &self.kept[i] {
            None => {
                numbers.extend(start..start + piece.own);
                piece.own
            }
            Some(kept) => {
                let mut next = start;
                for (crossing, kept) in piece.crossing.iter().zip(&kept.words) {
                    numbers.extend(bits(*crossing).map(|bit| {
                        let is_kept = kept >> bit & 1 == 1;
                        next += u32::from(is_kept);
                        if is_kept { next - 1 } else { NONE }
                    }));
                }
                kept.count
            }
        };
        let first = piece.first_foreign as usize;
        for &code in &part.foreign[first..first + piece.foreign as usize] {
            let owner = self.owners[i][usize::from(code >> 11)] as usize;
            let (word, bit) = place_of(code);
            let (words, rank) = match &self.kept[owner] {
                None => (&self.pieces[owner].1.crossing, &self.pieces[owner].1.rank),
                Some(kept) => (&kept.words, &kept.rank),
            };
            let below = (words[word] & ((1 << bit) - 1)).count_ones();
            numbers.push(self.starts[owner].0 + u32::from(rank[word]) + below);
        }
        numbers.extend(start + own..start + own + piece.centres);
    }
}

/// The upper neighbors of every piece. Keys ascend, so that one pass per octant finds those of many pieces.
fn owners(pieces: &[(&Part, &Piece)], threads: usize) -> Vec<[u32; 8]> {
    let order = |key: [i32; 3]| (key[2], key[1], key[0]);
    let mut owners = vec![[NONE; 8]; pieces.len()];
    parallel::for_each_on(
        threads,
        owners.chunks_mut(8 * TOGETHER).enumerate(),
        || (),
        |(chunk, owners), ()| {
            let first = chunk * 8 * TOGETHER;
            let pairs = pieces[first..].iter().zip(owners.iter_mut());
            let mut at = [first; 8];
            for (n, ((_, piece), owners)) in pairs.enumerate() {
                for octant in 1..8 {
                    let key: [i32; 3] = std::array::from_fn(|k| piece.key.0[k] + (octant >> k & 1));
                    let (octant, wanted) = (octant as usize, order(key));
                    let at = &mut at[octant];
                    if n == 0 {
                        *at = pieces.partition_point(|(_, p)| order(p.key.0) < wanted);
                    }
                    while *at < pieces.len() && order(pieces[*at].1.key.0) < wanted {
                        *at += 1;
                    }
                    if *at < pieces.len() && pieces[*at].1.key.0 == key {
                        owners[octant] = *at as u32;
                    }
                }
            }
        },
    );
    owners
}

/// For pieces with crossings that their own cubes do not use: the crossings that some cube uses.
fn kept(pieces: &[(&Part, &Piece)], owners: &[[u32; 8]]) -> Vec<Option<Box<Kept>>> {
    let kept = |(_, piece): &(&Part, &Piece)| {
        let words = piece.used.as_deref().copied()?;
        Some(Box::new(Kept { words, rank: [0; WORDS], count: 0 }))
    };
    let mut kept: Vec<Option<Box<Kept>>> = pieces.iter().map(kept).collect();
    if kept.iter().all(Option::is_none) {
        return kept;
    }
    for (i, (part, piece)) in pieces.iter().enumerate() {
        let first = piece.first_foreign as usize;
        for &code in &part.foreign[first..first + piece.foreign as usize] {
            let (word, bit) = place_of(code);
            if let Some(owner) = &mut kept[owners[i][usize::from(code >> 11)] as usize] {
                owner.words[word] |= 1 << bit;
            }
        }
    }
    for kept in kept.iter_mut().flatten() {
        for word in 0..WORDS {
            kept.rank[word] = kept.count as u16;
            kept.count += kept.words[word].count_ones();
        }
    }
    kept
}

fn starts(pieces: &[(&Part, &Piece)], kept: &[Option<Box<Kept>>]) -> Vec<(u32, usize)> {
    let (mut vertices, mut triangles) = (0usize, 0usize);
    let mut starts = Vec::with_capacity(pieces.len() + 1);
    for ((_, piece), kept) in pieces.iter().zip(kept) {
        starts.push((vertices as u32, triangles));
        vertices += (kept.as_ref().map_or(piece.own, |k| k.count) + piece.centres) as usize;
        triangles += piece.triangles as usize;
        assert!(vertices < NONE as usize, "a mesh has less than 2^32 vertices");
    }
    starts.push((vertices as u32, triangles));
    starts
}
