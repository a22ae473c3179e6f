//! Which blocks a planar fan says something about.

use super::fan::Spoke;
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, Lattice};
use crate::sets::bits_of;

/// Blocks in the box around a scan: 32 MiB of bits, 6.5 km across at cells of 5 cm.
const MOST_BLOCKS: i64 = 1 << 28;

/// Marks blocks in a bitmap over the scan's surroundings, one bit a block, row by row.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockBitmap {
    first: [i64; 2],
    size: [i64; 2],
    words: usize,
    bits: Vec<u64>,
}

impl BlockBitmap {
    /// An empty bitmap over the blocks that meet the box (world); `false` where these are too many.
    #[must_use]
    pub(super) fn reset<const D: usize>(&mut self, lattice: &Lattice<D>, window: &Aabb<D>) -> bool {
        let block = |v: f64, k: usize| {
            let cells = (v - lattice.origin[k]) / lattice.resolution;
            (cells / BLOCK_EDGE as f64).floor().clamp(-1e8, 1e8) as i64
        };
        for k in 0..2 {
            self.first[k] = block(window.min[k], k);
            self.size[k] = (block(window.max[k], k) - self.first[k] + 1).max(0);
        }
        self.words = (self.size[0] as usize).div_ceil(64);
        self.bits.clear();
        let fits = self.size[0] * self.size[1] <= MOST_BLOCKS;
        if fits {
            self.bits.resize(self.words * self.size[1] as usize, 0);
        }
        fits
    }

    /// Marks the blocks of row `y` (block index) from `x0` to `x1`, both included, as far as they are inside.
    #[inline(always)]
    fn mark(&mut self, y: i64, x0: i64, x1: i64) {
        let row = y - self.first[1];
        let (x0, x1) = ((x0 - self.first[0]).max(0), (x1 - self.first[0]).min(self.size[0] - 1));
        if row < 0 || row >= self.size[1] || x0 > x1 {
            return;
        }
        let row = &mut self.bits[row as usize * self.words..][..self.words];
        let (w0, w1) = ((x0 >> 6) as usize, (x1 >> 6) as usize);
        let (from, to) = (!0u64 << (x0 & 63), !0u64 >> (63 - (x1 & 63)));
        if w0 == w1 {
            row[w0] |= from & to;
        } else {
            row[w0] |= from;
            row[w0 + 1..w1].fill(!0);
            row[w1] |= to;
        }
    }

    /// The marked blocks, ascending.
    pub(super) fn collect<const D: usize>(&self, keys: &mut Vec<BlockKey<D>>) {
        keys.clear();
        for bit in bits_of(&self.bits) {
            let (w, bit) = (bit / 64, (bit % 64) as i64);
            let x = self.first[0] + ((w % self.words) * 64) as i64 + bit;
            let y = self.first[1] + (w / self.words) as i64;
            let mut key = [0; D];
            (key[0], key[1]) = (x as i32, y as i32);
            keys.push(BlockKey(key));
        }
    }
}

/// The stretch of a beam that says something, arc lengths in meters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub from: f64,
    pub to: f64,
}

impl Stretch {
    /// What a beam observes: the truncation band of a hit, with `carve` all that is free before it.
    pub(super) fn of(spoke: &Spoke, truncation: f64, carve: bool) -> Option<Self> {
        let z = f64::from(spoke.range);
        let from = if carve { 0.0 } else { (z - truncation).max(0.0) };
        let to = if spoke.hit { z + truncation } else { z };
        (z > 0.0 && (spoke.hit || carve)).then_some(Self { from, to })
    }
}

/// `f64::floor` for indices; on baseline x86-64 the method is a call.
#[inline(always)]
fn floor(v: f64) -> i64 {
    // Far beyond any block, and far from where indices end: a reading may be as large as a number can be.
    let v = v.clamp(-1e15, 1e15);
    let toward_zero = v as i64;
    toward_zero - i64::from(v < toward_zero as f64)
}

/// Collects the outline of what a few neighbouring beams observe, and marks the blocks in it row by row. More
/// blocks than necessary are harmless, their evidence is empty; fewer are not.
#[derive(Clone, Debug, Default)]
pub(super) struct Outline {
    /// Leftmost and rightmost place in each row of blocks, in blocks.
    rows: Vec<[f64; 2]>,
    /// Rows in use.
    used: Option<[i64; 2]>,
    /// Rows of the bitmap.
    limits: [i64; 2],
    margin: f64,
}

impl Outline {
    /// Starts over for a bitmap; outlines are widened by `margin` blocks.
    pub(super) fn reset(&mut self, bitmap: &BlockBitmap, margin: f64) {
        self.limits = [bitmap.first[1], bitmap.first[1] + bitmap.size[1] - 1];
        self.margin = margin;
        self.rows.clear();
        self.rows.resize(bitmap.size[1].max(0) as usize, [f64::INFINITY, f64::NEG_INFINITY]);
        self.used = None;
    }

    /// Adds an edge between two points, in blocks.
    #[inline]
    pub(super) fn edge(&mut self, p: [f64; 2], q: [f64; 2]) {
        let (p, q) = if p[1] <= q[1] { (p, q) } else { (q, p) };
        let y0 = floor(p[1] - self.margin).max(self.limits[0]);
        let y1 = floor(q[1] + self.margin).min(self.limits[1]);
        if y0 > y1 {
            return;
        }
        self.used = Some(self.used.map_or([y0, y1], |u| [u[0].min(y0), u[1].max(y1)]));
        if y0 == y1 {
            // Most edges are short.
            let row = &mut self.rows[(y0 - self.limits[0]) as usize];
            row[0] = row[0].min(p[0].min(q[0]));
            row[1] = row[1].max(p[0].max(q[0]));
            return;
        }
        let slope = if q[1] > p[1] { (q[0] - p[0]) / (q[1] - p[1]) } else { 0.0 };
        for y in y0..=y1 {
            let (bottom, top) = (y as f64 - self.margin, (y + 1) as f64 + self.margin);
            let enter = if p[1] >= bottom { p[0] } else { p[0] + (bottom - p[1]) * slope };
            let leave = if q[1] <= top { q[0] } else { p[0] + (top - p[1]) * slope };
            let row = &mut self.rows[(y - self.limits[0]) as usize];
            row[0] = row[0].min(enter.min(leave));
            row[1] = row[1].max(enter.max(leave));
        }
    }

    /// Marks what is inside and forgets the outline.
    pub(super) fn mark(&mut self, bitmap: &mut BlockBitmap) {
        let Some([y0, y1]) = self.used.take() else { return };
        for y in y0..=y1 {
            let row = &mut self.rows[(y - self.limits[0]) as usize];
            let [x0, x1] = std::mem::replace(row, [f64::INFINITY, f64::NEG_INFINITY]);
            if x0 <= x1 {
                bitmap.mark(y, floor(x0 - self.margin), floor(x1 + self.margin));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drivers write the largest number for "no echo".
    #[test]
    fn outlines_as_far_as_numbers_reach_mark_what_is_near() {
        let lattice = Lattice::new([0.0; 2], 0.05);
        for far in [1e12, 1e20, f64::from(f32::MAX)] {
            for sign in [1.0, -1.0] {
                let far = sign * far;
                let mut bitmap = BlockBitmap::default();
                assert!(bitmap.reset(&lattice, &Aabb::new([-2.0; 2], [2.0; 2])));
                let mut outline = Outline::default();
                outline.reset(&bitmap, 0.1);
                for [p, q] in [[[0.5, 0.5], [far, 0.5]], [[far, 0.5], [far, far]], [[far, far], [0.5, 0.5]]] {
                    outline.edge(p, q);
                }
                outline.mark(&mut bitmap);
                let mut keys: Vec<BlockKey<2>> = Vec::new();
                bitmap.collect(&mut keys);
                assert!(keys.contains(&BlockKey([0, 0])), "{far}: {keys:?}");
                let toward = |key: &BlockKey<2>| f64::from(key.0[0]) * sign >= -1.0;
                assert!(keys.len() > 5 && keys.iter().all(toward), "{far}: {keys:?}");
            }
        }
    }
}
