//! The surface in the 8 x 8 x 8 cubes whose lowest nodes are one brick's.

use super::numbers::Numbers;
use super::samples::Samples;
use super::signs::{LAST_COLUMN, LAST_ROW, Layers, next_column};
use super::table::{AMBIGUOUS, TABLE, Table, local};
use super::vertex::{Attributes, Vertex, centre, crossing};
use crate::geom::BlockKey;
use crate::sets::bits;

/// Words of edge bits of a brick: axis + 3 z, a bit per node where an edge starts.
pub(super) const WORDS: usize = 24;

/// Place of an edge among those of its brick: 64 word + bit. An edge of an upper neighbor has the neighbor's octant
/// in the bits from 11 on.
pub(super) type EdgeCode = u16;

/// Word and bit of an edge in its brick.
pub(super) fn place_of(code: EdgeCode) -> (usize, u32) {
    (usize::from(code >> 6 & 31), u32::from(code & 63))
}

/// What one brick adds to a [`Part`]: how many entries, and where they start.
///
/// The vertices of a piece are numbered: crossings of its own edges (those that start at its nodes) in the order of the
/// words, then crossings of its upper neighbors' edges that its cubes use, then centers of cubes.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) key: BlockKey<3>,
    /// Own edges with a crossing between two observed nodes.
    pub(super) crossing: [u64; WORDS],
    /// Number of crossings in the words before each.
    pub(super) rank: [u16; WORDS],
    /// Own edges that the piece's own cubes use; `None` for all crossings. Crossings that no cube uses, of this brick or of
    /// a neighbor, do not become vertices.
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
    /// Own crossings, then centers, of each piece: in cells from the brick's lowest node.
    pub(super) vertices: Vec<[f32; 3]>,
    /// Gradients of the field there, not normalized; empty if not requested.
    pub(super) gradients: Vec<[f32; 3]>,
    pub(super) colors: Vec<[u8; 3]>,
    /// How far samples around them lie from each other; empty if not requested.
    pub(super) ranges: Vec<f32>,
    pub(super) foreign: Vec<EdgeCode>,
    pub(super) triangles: Vec<[u16; 3]>,
}

impl Part {
    /// An empty part with a capacity of the sizes of another one and an eighth more.
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

    /// Numbers of pieces, vertices, edges of neighbors and triangles.
    pub(super) fn sizes(&self) -> [usize; 4] {
        [self.pieces.len(), self.vertices.len(), self.foreign.len(), self.triangles.len()]
    }

    /// Adds the piece of a brick, if it has surface.
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
            full[z] = o.all() & observed[z + 1].all() & samples.cubes(z);
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
                if plain.triangles == AMBIGUOUS {
                    self.triangles.extend_from_slice(&numbers.triangles[..count]);
                    count = 0;
                    let at = [(i & 7) as i32, (i >> 3) as i32, z as i32];
                    self.add_ambiguous(&mut piece, case as u8, at, table, samples, want, numbers);
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

    /// Memory of the arrays (bytes).
    pub(super) fn memory_bytes(&self) -> usize {
        self.pieces.capacity() * size_of::<Piece>()
            + (self.vertices.capacity() + self.gradients.capacity()) * 12
            + self.colors.capacity() * 3
            + self.ranges.capacity() * 4
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
        if want.ranges {
            self.ranges.push(vertex.range);
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

    /// The axis is a constant, so that indices are constants.
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
            if want.ranges {
                self.ranges.push(vertex.range);
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

    /// Adds the triangles of a cube that its signs leave ambiguous.
    #[cold]
    #[expect(clippy::too_many_arguments, reason = "the state of one loop")]
    fn add_ambiguous(
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

/// The crossings that a brick's own cubes use; `None` for all.
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
