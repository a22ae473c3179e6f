//! The second pass over arrays without holes: vertices and triangles of the bricks of a tile, each in its place.

use super::edges::Edges;
use super::normals::unit;
use super::samples::DenseSamples;
use super::table::{AMBIGUOUS, MOST, Plain, TABLE, local};
use super::vertex::{Attributes, centre};
use super::whole::{Brick, Counted};
use crate::sets::bits;
use multiversion::multiversion;

/// The nodes at the lower sides of a brick along x and along y.
const FIRST_COLUMN: u64 = 0x0101_0101_0101_0101;
const FIRST_ROW: u64 = 0xff;

/// The part of the mesh that a tile fills.
pub(super) struct Place<'a> {
    pub(super) tile: &'a Counted,
    pub(super) vertices: &'a mut [[f32; 3]],
    pub(super) triangles: &'a mut [[u32; 3]],
    /// Empty where not requested, as ranges are.
    pub(super) normals: &'a mut [[f32; 3]],
    pub(super) ranges: &'a mut [f32],
}

/// What all tiles share.
pub(super) struct Writer<'a> {
    pub(super) samples: &'a DenseSamples<'a>,
    pub(super) bricks: &'a [&'a Brick],
    /// By place of a brick: which of those with surface it is, or [`NONE`](super::whole::NONE).
    pub(super) grid: &'a [u32],
    /// Bricks along each axis.
    pub(super) extent: [usize; 3],
    pub(super) want: Attributes,
}

/// Number of the vertex at an edge: by axis (from bit 10 on) and the node where it starts, 9 nodes a row ([`local`]).
#[inline(always)]
fn edge(axis: usize, node: usize) -> usize {
    (axis << 10 | node) & 4095
}

/// Fills the part of a tile; `numbers` are 4096 of any value.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt", "aarch64+neon"))]
pub(super) fn fill(writer: &Writer, place: &mut Place, numbers: &mut [u32]) {
    writer.fill(place, numbers);
}

impl Writer<'_> {
    #[inline(always)]
    fn fill(&self, place: &mut Place, numbers: &mut [u32]) {
        let Some(numbers) = numbers.first_chunk_mut::<4096>() else { return };
        let tile = place.tile;
        let (mut cases, mut patches) = (tile.cases.iter(), tile.patches.iter());
        let mut crossings = &tile.crossings[..];
        let first = tile.bricks.first().map_or(0, |brick| brick.first_vertex);
        let mut triangle = 0;
        for brick in &tile.bricks {
            let samples = DenseSamples { first: brick.at.map(|k| 8 * k), ..*self.samples };
            let mut vertex = (brick.first_vertex - first) as usize;
            for z in 0..8 {
                vertex += self.along::<0>(&samples, brick, z, &mut crossings, vertex, place, numbers);
                vertex += self.along::<1>(&samples, brick, z, &mut crossings, vertex, place, numbers);
                vertex += self.along::<2>(&samples, brick, z, &mut crossings, vertex, place, numbers);
            }
            self.number_above(brick, numbers);
            for z in 0..8 {
                for i in bits(brick.active[z]) {
                    let node = (i & 7) + 9 * (i >> 3) + 81 * z;
                    let plain = &TABLE.plain[usize::from(cases.next().copied().unwrap_or(0))];
                    let out = place.triangles.get_mut(triangle..).unwrap_or_default();
                    if plain.triangles != AMBIGUOUS {
                        put(out, node, plain, numbers);
                        triangle += usize::from(plain.triangles);
                        continue;
                    }
                    let Some(patch) = patches.next() else { continue };
                    let number = |v: u8| match v {
                        0..12 => numbers[edge(0, node + usize::from(local(v)))],
                        _ => first + vertex as u32 + u32::from(v - 12),
                    };
                    for (out, t) in out.iter_mut().zip(&patch.triangles) {
                        *out = t.map(number);
                    }
                    triangle += patch.triangles.len();
                    let at = [(i & 7) as i32, (i >> 3) as i32, z as i32];
                    for around in &patch.centres {
                        self.put_centre(&samples, around, at, vertex, place);
                        vertex += 1;
                    }
                }
            }
        }
    }

    /// The crossings along an axis in one layer; how many. The axis is a constant, so that indices are constants.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the state of one loop")]
    fn along<const AXIS: usize>(
        &self,
        samples: &DenseSamples,
        brick: &Brick,
        z: usize,
        crossings: &mut &[f32],
        to: usize,
        place: &mut Place,
        numbers: &mut [u32; 4096],
    ) -> usize {
        let word = brick.crossing[3 * z + AXIS];
        if word == 0 {
            return 0;
        }
        let edges = Edges::<AXIS>::new(samples, z);
        let first = brick.first_vertex + u32::from(brick.rank[3 * z + AXIS]);
        let count = word.count_ones() as usize;
        let t = crossings.split_off(..count).unwrap_or_default();
        for (((out, number), i), &t) in place.vertices[to..].iter_mut().zip(first..).zip(bits(word)).zip(t) {
            let (x, y) = (i & 7, i >> 3);
            numbers[edge(AXIS, x + 9 * y + 81 * z)] = number;
            *out = edges.position(x, y, t);
        }
        if !place.normals.is_empty() {
            for ((out, i), &t) in place.normals[to..].iter_mut().zip(bits(word)).zip(t) {
                *out = edges.gradient(i & 7, i >> 3, t);
            }
            // By themselves: roots and quotients of several at once.
            for gradient in &mut place.normals[to..to + count] {
                *gradient = unit(*gradient);
            }
        }
        if !place.ranges.is_empty() {
            for (out, i) in place.ranges[to..].iter_mut().zip(bits(word)) {
                *out = edges.range(i & 7, i >> 3);
            }
        }
        count
    }

    /// The numbers of the edges that start at the lower sides of the upper neighbors.
    #[inline(always)]
    fn number_above(&self, brick: &Brick, numbers: &mut [u32; 4096]) {
        let [bx, by, bz] = brick.at;
        let [ex, ey, ez] = self.extent;
        for octant in 1..7 {
            let (dx, dy, dz) = (octant & 1, octant >> 1 & 1, octant >> 2);
            if bx + dx >= ex || by + dy >= ey || bz + dz >= ez {
                continue;
            }
            let Some(above) = self.bricks.get(self.grid[bx + dx + ex * (by + dy + ey * (bz + dz))] as usize)
            else {
                continue;
            };
            let side =
                if dx == 1 { FIRST_COLUMN } else { u64::MAX } & if dy == 1 { FIRST_ROW } else { u64::MAX };
            for z in 0..if dz == 1 { 1 } else { 8 } {
                for axis in (0..3).filter(|axis| octant >> axis & 1 == 0) {
                    let (word, rank) = (above.crossing[3 * z + axis], above.rank[3 * z + axis]);
                    let first = above.first_vertex + u32::from(rank);
                    let (mut next, mut rest) = (first, word);
                    for i in bits(word & side) {
                        if dx == 1 {
                            // Those of the column are not one after the other.
                            let lower = rest & ((1 << i) - 1);
                            next += lower.count_ones();
                            rest &= !lower;
                        }
                        numbers[edge(axis, (i & 7) + 8 * dx + 9 * ((i >> 3) + 8 * dy) + 81 * (z + 8 * dz))] =
                            next;
                        next += 1;
                        rest &= rest.wrapping_sub(1);
                    }
                }
            }
        }
    }

    #[cold]
    fn put_centre(&self, samples: &DenseSamples, around: &[u8], at: [i32; 3], to: usize, place: &mut Place) {
        let vertex = centre(around, at, samples, self.want);
        let base = samples.first.map(|k| k as f64);
        place.vertices[to] = [0, 1, 2].map(|k| (base[k] + f64::from(vertex.position[k])) as f32);
        if self.want.normals {
            place.normals[to] = unit(vertex.gradient);
        }
        if self.want.ranges {
            place.ranges[to] = vertex.range;
        }
    }
}

/// Writes the triangles of a cube. Always [`MOST`] of them where there is room: the next cube overwrites the excess, and no
/// branch depends on their number.
#[inline(always)]
fn put(out: &mut [[u32; 3]], node: usize, plain: &Plain, numbers: &[u32; 4096]) {
    let number = |corner: u16| numbers[(node + usize::from(corner)) & 4095];
    if let Some(out) = out.first_chunk_mut::<MOST>() {
        for k in 0..MOST {
            out[k] = plain.corners[k].map(number);
        }
    } else {
        for (out, corners) in out.iter_mut().zip(&plain.corners[..usize::from(plain.triangles)]) {
            *out = corners.map(number);
        }
    }
}
