//! The surface in the 8 x 8 x 8 cubes whose lowest nodes are one brick's.

use super::samples::Samples;
use super::signs::{LAST_COLUMN, LAST_ROW, Layers, next_column};
use super::table::{ASK, MOST, Plain, TABLE, Table, local};
use crate::geom::BlockKey;

/// What vertices carry beside their position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Attributes {
    pub(super) normals: bool,
    pub(super) colors: bool,
}

/// Words of edge bits of a brick: axis + 3 z, a bit per node where an edge starts.
pub(super) const WORDS: usize = 24;

/// Place of an edge among those of its brick: 64 word + bit. An edge of an upper neighbour has the neighbour's octant
/// in the bits from 11 on.
pub(super) type EdgeCode = u16;

/// Word and bit of an edge in its brick.
pub(super) fn place_of(code: EdgeCode) -> (usize, u32) {
    (usize::from(code >> 6 & 31), u32::from(code & 63))
}

/// What one brick adds to a [`Part`]: how many entries, and where they start.
///
/// The vertices of a piece are numbered: crossings of its own edges (those that start at its nodes) in the order of the
/// words, then crossings of its upper neighbours' edges that its cubes use, then centres of cubes.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) key: BlockKey<3>,
    /// Own edges with a crossing between two observed nodes.
    pub(super) crossing: [u64; WORDS],
    /// Number of crossings in the words before each.
    pub(super) rank: [u16; WORDS],
    /// Own edges that the piece's own cubes use; `None`: all crossings. Those that no cube uses, of this brick or of a
    /// neighbour, are no vertices.
    pub(super) used: Option<Box<[u64; WORDS]>>,
    pub(super) own: u32,
    pub(super) foreign: u32,
    pub(super) centres: u32,
    pub(super) triangles: u32,
    pub(super) first_vertex: u32,
    pub(super) first_foreign: u32,
    pub(super) first_triangle: u32,
}

/// The pieces of some bricks, one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    pub(super) pieces: Vec<Piece>,
    /// Own crossings, then centres, of each piece: in cells from the brick's lowest node.
    pub(super) vertices: Vec<[f32; 3]>,
    /// Derivatives of the field there, not yet of length one; empty if not asked for.
    pub(super) gradients: Vec<[f32; 3]>,
    pub(super) colors: Vec<[u8; 3]>,
    pub(super) foreign: Vec<EdgeCode>,
    pub(super) triangles: Vec<[u16; 3]>,
}

/// A crossing keeps this much of its edge away from both nodes: a value of exactly zero makes no triangles without area
/// and no two vertices in one place. It moves a vertex by 1/256 of a cell at most.
const MARGIN: f32 = 1.0 / 256.0;

/// Colour of a vertex of which no node has one.
const NO_COLOR: [u8; 3] = [128; 3];

#[derive(Clone, Copy, Default)]
struct Vertex {
    position: [f32; 3],
    gradient: [f32; 3],
    color: [u8; 3],
}

/// Where between two nodes with these values of different sign the surface crosses: in cells from the lower one.
#[inline(always)]
pub(crate) fn crossing_place(a: f32, b: f32) -> f32 {
    (a / (a - b)).clamp(MARGIN, 1.0 - MARGIN)
}

/// The crossing of the edge that starts at `node`: linear between its ends, from the lower one to the upper one, so
/// that every cube at the edge computes the same bits.
#[inline(always)]
fn crossing(samples: &impl Samples, node: [i32; 3], axis: usize, want: Attributes) -> Vertex {
    let mut end = node;
    end[axis] += 1;
    let (a, b) = (samples.value(node), samples.value(end));
    let t = crossing_place(a, b);
    let mut vertex =
        Vertex { position: [node[0] as f32, node[1] as f32, node[2] as f32], ..Vertex::default() };
    vertex.position[axis] += t;
    if want.normals {
        let (ga, gb) = (samples.gradient(node), samples.gradient(end));
        for k in 0..3 {
            vertex.gradient[k] = ga[k] + t * (gb[k] - ga[k]);
        }
    }
    if want.colors {
        vertex.color = color(samples, node, end, t);
    }
    vertex
}

/// The colour between two nodes: each counts by its weight and its nearness.
fn color(samples: &impl Samples, node: [i32; 3], end: [i32; 3], t: f32) -> [u8; 3] {
    let ends = [(samples.color(node), 1.0 - t), (samples.color(end), t)];
    let (mut sum, mut total) = ([0.0f32; 3], 0.0);
    for (c, near) in ends.into_iter().filter_map(|(c, near)| Some((c?, near))) {
        let w = f32::from(c.weight) * near;
        total += w;
        (0..3).for_each(|k| sum[k] += w * f32::from(c.rgb[k]));
    }
    if total > 0.0 { sum.map(|s| (s / total / 257.0 + 0.5) as u8) } else { NO_COLOR }
}

/// Vertex numbers by place of the edge ([`local`]), and the triangles of one layer; reused from brick to brick.
pub(super) struct Numbers {
    edges: Box<[u16; 4096]>,
    triangles: Box<[[u16; 3]; 64 * MOST]>,
}

impl Numbers {
    pub(super) fn new() -> Self {
        Self { edges: Box::new([0; 4096]), triangles: Box::new([[0; 3]; 64 * MOST]) }
    }

    #[inline(always)]
    fn at(&mut self, axis: usize, node: usize) -> &mut u16 {
        &mut self.edges[(axis << 10 | node) & 4095]
    }

    #[inline(always)]
    fn get(&self, node: usize, edge: u16) -> u16 {
        self.edges[(node + usize::from(edge)) & 4095]
    }

    /// Triangles of a cube from place `at` on. Always [`MOST`] of them: what is too many the next cube overwrites, and
    /// no branch depends on how many there are.
    #[inline(always)]
    fn put(&mut self, at: usize, node: usize, plain: &Plain) {
        if let Some(out) = self.triangles.get_mut(at..at + MOST) {
            for k in 0..MOST {
                for v in 0..3 {
                    out[k][v] = self.edges[(node + usize::from(plain.corners[k][v])) & 4095];
                }
            }
        }
    }
}

#[inline(always)]
pub(super) fn bits(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = word.trailing_zeros() as usize;
        let some = word != 0;
        word &= word.wrapping_sub(1);
        some.then_some(bit)
    })
}

impl Part {
    /// An empty part with room for as much as another one holds, and a little more.
    pub(super) fn like(other: &[usize; 4]) -> Self {
        let [pieces, vertices, foreign, triangles] = other.map(|n| n + n / 8);
        Self {
            pieces: Vec::with_capacity(pieces),
            vertices: Vec::with_capacity(vertices),
            foreign: Vec::with_capacity(foreign),
            triangles: Vec::with_capacity(triangles),
            ..Self::default()
        }
    }

    /// How many pieces, vertices, edges of neighbours and triangles it holds.
    pub(super) fn sizes(&self) -> [usize; 4] {
        [self.pieces.len(), self.vertices.len(), self.foreign.len(), self.triangles.len()]
    }

    /// Adds the piece of a brick, where there is surface.
    pub(super) fn add(
        &mut self,
        key: BlockKey<3>,
        layers: &Layers,
        samples: &impl Samples,
        want: Attributes,
        numbers: &mut Numbers,
    ) {
        let (inside, observed) = (&layers.inside, &layers.observed);
        let mut crossing = [0u64; WORDS];
        let mut any = 0;
        // Cubes with all corners observed, and those of them with surface.
        let (mut full, mut active) = ([0u64; 9], [0u64; 8]);
        for z in 0..8 {
            let (i, o, above) = (&inside[z], &observed[z], &inside[z + 1]);
            crossing[3 * z] = (i.at ^ i.x) & o.at & o.x;
            crossing[3 * z + 1] = (i.at ^ i.y) & o.at & o.y;
            crossing[3 * z + 2] = (i.at ^ above.at) & o.at & observed[z + 1].at;
            full[z] = o.all() & observed[z + 1].all();
            active[z] = full[z] & (i.any() | above.any()) & !(i.all() & above.all());
            any |= crossing[3 * z] | crossing[3 * z + 1] | crossing[3 * z + 2] | active[z];
        }
        if any == 0 {
            return;
        }
        let mut piece = Piece {
            key,
            crossing,
            rank: [0; WORDS],
            used: None,
            own: 0,
            foreign: 0,
            centres: 0,
            triangles: 0,
            first_vertex: self.vertices.len() as u32,
            first_foreign: self.foreign.len() as u32,
            first_triangle: self.triangles.len() as u32,
        };
        self.own_crossings(&mut piece, samples, want, numbers);
        piece.used = own_used(&crossing, &full);
        self.foreign_crossings(&mut piece, layers, &full, numbers);
        let table = &*TABLE;
        for z in 0..8 {
            let (low, high) = (&inside[z], &inside[z + 1]);
            // Triangles of the layer that are not yet in the part.
            let mut count = 0;
            for i in bits(active[z]) {
                let bit = |word: u64, k: usize| (word >> i & 1) << k;
                let case = bit(low.at, 0) | bit(low.x, 1) | bit(low.y, 2) | bit(low.xy, 3);
                let case = case | bit(high.at, 4) | bit(high.x, 5) | bit(high.y, 6) | bit(high.xy, 7);
                let node = (i & 7) + 9 * (i >> 3) + 81 * z;
                let plain = &table.plain[case as usize & 255];
                if plain.triangles == ASK {
                    self.triangles.extend_from_slice(&numbers.triangles[..count]);
                    count = 0;
                    let at = [(i & 7) as i32, (i >> 3) as i32, z as i32];
                    self.asked(&mut piece, case as u8, at, table, samples, want, numbers);
                    continue;
                }
                numbers.put(count, node, plain);
                count += usize::from(plain.triangles);
            }
            self.triangles.extend_from_slice(&numbers.triangles[..count]);
        }
        piece.triangles = self.triangles.len() as u32 - piece.first_triangle;
        self.pieces.push(piece);
    }

    /// Bytes that the arrays hold.
    pub(super) fn memory_bytes(&self) -> usize {
        self.pieces.capacity() * size_of::<Piece>()
            + (self.vertices.capacity() + self.gradients.capacity()) * 12
            + self.colors.capacity() * 3
            + self.foreign.capacity() * 2
            + self.triangles.capacity() * 6
    }

    fn push(&mut self, vertex: &Vertex, want: Attributes) {
        self.vertices.push(vertex.position);
        if want.normals {
            self.gradients.push(vertex.gradient);
        }
        if want.colors {
            self.colors.push(vertex.color);
        }
    }

    fn own_crossings(
        &mut self,
        piece: &mut Piece,
        samples: &impl Samples,
        want: Attributes,
        numbers: &mut Numbers,
    ) {
        let count: u32 = piece.crossing.iter().map(|word| word.count_ones()).sum();
        self.vertices.resize(self.vertices.len() + count as usize, [0.0; 3]);
        for z in 0..8 {
            self.own_crossings_along::<0>(piece, z, samples, want, numbers);
            self.own_crossings_along::<1>(piece, z, samples, want, numbers);
            self.own_crossings_along::<2>(piece, z, samples, want, numbers);
        }
    }

    /// The axis is a constant, so that every index is one.
    #[inline(always)]
    fn own_crossings_along<const AXIS: usize>(
        &mut self,
        piece: &mut Piece,
        z: usize,
        samples: &impl Samples,
        want: Attributes,
        numbers: &mut Numbers,
    ) {
        let mut count = piece.own as u16;
        piece.rank[3 * z + AXIS] = count;
        let vertices = &mut self.vertices[(piece.first_vertex + piece.own) as usize..];
        for (position, i) in vertices.iter_mut().zip(bits(piece.crossing[3 * z + AXIS])) {
            let (x, y) = (i & 7, i >> 3);
            *numbers.at(AXIS, x + 9 * y + 81 * z) = count;
            count += 1;
            let vertex = crossing(samples, [x as i32, y as i32, z as i32], AXIS, want);
            *position = vertex.position;
            if want.normals {
                self.gradients.push(vertex.gradient);
            }
            if want.colors {
                self.colors.push(vertex.color);
            }
        }
        piece.own = u32::from(count);
    }

    /// Numbers the crossings at the brick's upper sides that its cubes use.
    fn foreign_crossings(
        &mut self,
        piece: &mut Piece,
        layers: &Layers,
        full: &[u64; 9],
        numbers: &mut Numbers,
    ) {
        let mut count = piece.own as u16;
        let mut border = |crossing: u64, axis: usize, [dx, dy]: [usize; 2], z: usize| {
            for i in bits(crossing) {
                let (x, y) = ((i & 7) + dx, (i >> 3) + dy);
                *numbers.at(axis, x + 9 * y + 81 * z) = count;
                count += 1;
                let octant = x >> 3 | y >> 3 << 1 | z >> 3 << 2;
                let code = octant << 11 | (axis + 3 * (z & 7)) << 6 | (y & 7) << 3 | (x & 7);
                self.foreign.push(code as u16);
            }
        };
        for z in 0..9 {
            let i = &layers.inside[z];
            let around = full[z] | if z > 0 { full[z - 1] } else { 0 };
            border((i.y ^ i.xy) & around & LAST_ROW, 0, [0, 1], z);
            border((i.x ^ i.xy) & around & LAST_COLUMN, 1, [1, 0], z);
            if z == 8 {
                border((i.at ^ i.x) & (around | around << 8), 0, [0, 0], z);
                border((i.at ^ i.y) & (around | next_column(around)), 1, [0, 0], z);
            } else {
                let above = &layers.inside[z + 1];
                border((i.x ^ above.x) & (full[z] | full[z] << 8) & LAST_COLUMN, 2, [1, 0], z);
                border((i.y ^ above.y) & (full[z] | next_column(full[z])) & LAST_ROW, 2, [0, 1], z);
                border((i.xy ^ above.xy) & full[z] & LAST_ROW & LAST_COLUMN, 2, [1, 1], z);
            }
        }
        piece.foreign = u32::from(count) - piece.own;
    }

    /// A cube whose signs do not tell all.
    #[cold]
    #[expect(clippy::too_many_arguments, reason = "the state of one loop")]
    fn asked(
        &mut self,
        piece: &mut Piece,
        case: u8,
        at: [i32; 3],
        table: &Table,
        samples: &impl Samples,
        want: Attributes,
        numbers: &Numbers,
    ) {
        let corner =
            |c: usize| [at[0] + (c & 1) as i32, at[1] + (c >> 1 & 1) as i32, at[2] + (c >> 2) as i32];
        let patch = table.patch(case, &std::array::from_fn(|c| samples.value(corner(c))));
        let first = (piece.own + piece.foreign + piece.centres) as u16;
        for around in &patch.centres {
            self.push(&centre(around, at, samples, want), want);
        }
        piece.centres += patch.centres.len() as u32;
        let node = (at[0] + 9 * at[1] + 81 * at[2]) as usize;
        let number = |v: u8| if v < 12 { numbers.get(node, local(v)) } else { first + u16::from(v - 12) };
        self.triangles.extend(patch.triangles.iter().map(|t| t.map(number)));
    }
}

/// The mean of some crossings of a cube.
fn centre(around: &[u8], at: [i32; 3], samples: &impl Samples, want: Attributes) -> Vertex {
    let mut mean = Vertex::default();
    let mut color = [0u32; 3];
    let share = 1.0 / around.len() as f32;
    for &edge in around {
        let (axis, c) = super::numbering::edge_start(edge);
        let node = std::array::from_fn(|k| at[k] + i32::from(c >> k & 1));
        let v = crossing(samples, node, axis, want);
        for k in 0..3 {
            mean.position[k] += share * v.position[k];
            mean.gradient[k] += share * v.gradient[k];
            color[k] += u32::from(v.color[k]);
        }
    }
    mean.color = color.map(|sum| (sum / around.len() as u32) as u8);
    mean
}

/// The crossings that a brick's own cubes use; `None`: all.
fn own_used(crossing: &[u64; WORDS], full: &[u64; 9]) -> Option<Box<[u64; WORDS]>> {
    let mut used = *crossing;
    for z in 0..8 {
        let around = full[z] | if z > 0 { full[z - 1] } else { 0 };
        used[3 * z] &= around | around << 8;
        used[3 * z + 1] &= around | next_column(around);
        let upright = full[z] | full[z] << 8;
        used[3 * z + 2] &= upright | next_column(upright);
    }
    (used != *crossing).then(|| Box::new(used))
}
