//! The frontier cells of one brick.

use super::cells::{Known, known};
use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};
use crate::sets::bits_of;
use crate::store::Bricks;

/// A free cell with an unknown neighbor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FrontierCell {
    /// Its place in the brick.
    pub(super) offset: u16,
    /// Bit `2 k`: the neighbor below along axis `k` is unknown; bit `2 k + 1`: the one above.
    pub(super) faces: u8,
    /// Which of the brick's groups of touching cells it belongs to.
    pub(super) group: u16,
}

/// The frontier cells of one brick, by their place, in groups that touch within the brick.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct BrickFrontier {
    pub(super) cells: Vec<FrontierCell>,
    pub(super) groups: u16,
}

impl BrickFrontier {
    /// The group of the frontier cell with this offset; `None` for other cells.
    #[inline]
    pub(super) fn group_at(&self, offset: usize) -> Option<u16> {
        let i = self.cells.binary_search_by_key(&(offset as u16), |c| c.offset).ok()?;
        Some(self.cells[i].group)
    }

    /// The frontier cells of a brick of the store. Also reads its face neighbors.
    pub(super) fn of<const D: usize>(
        store: &Bricks<SignedDistance, D>,
        key: BlockKey<D>,
        min_weight: f32,
    ) -> Self {
        let Some(brick) = store.brick(key) else { return Self::default() };
        let (free, unknown) = masks(brick, min_weight);
        if free == NO_CELLS {
            return Self::default();
        }
        // Cells whose neighbor through a face is unknown, face by face.
        let mut faces = [NO_CELLS; 6];
        for k in 0..D {
            for (side, step) in [-1, 1].into_iter().enumerate() {
                let mut at = key;
                at.0[k] += step;
                let beyond = store.brick(at).map_or([!0; WORDS], |b| masks(b, min_weight).1);
                faces[2 * k + side] = shifted::<D>(&unknown, &beyond, k, step);
            }
        }
        let open: Cells = std::array::from_fn(|w| free[w] & faces.iter().fold(0, |any, face| any | face[w]));
        let mut cells = Vec::with_capacity(open.iter().map(|w| w.count_ones() as usize).sum());
        for i in bits_of(&open) {
            let of = |face: &Cells| (face[i >> 6] >> (i & 63) & 1) as u8;
            let faces = faces.iter().rev().fold(0, |bits, face| bits << 1 | of(face));
            cells.push(FrontierCell { offset: i as u16, faces, group: NONE });
        }
        let mut frontier = Self { cells, groups: 0 };
        frontier.group::<D>(open);
        frontier
    }

    /// Numbers the groups in the order of their first cells. `open` are the cells.
    fn group<const D: usize>(&mut self, mut open: Cells) {
        let mut front = Vec::new();
        for start in 0..self.cells.len() {
            if self.cells[start].group != NONE {
                continue;
            }
            let group = self.groups;
            self.groups += 1;
            let first = usize::from(self.cells[start].offset);
            open[first >> 6] &= !(1 << (first & 63));
            front.push((first, start));
            while let Some((offset, i)) = front.pop() {
                self.cells[i].group = group;
                let at = BlockKey([0; D]).cell(offset);
                for n in 0..3usize.pow(D as u32) {
                    let cell = neighbor(at, n);
                    if cell.iter().any(|&v| v < 0 || v >= BLOCK_EDGE as i32) {
                        continue;
                    }
                    let offset = BlockKey::offset(cell);
                    let (word, bit) = (&mut open[offset >> 6], 1u64 << (offset & 63));
                    if *word & bit != 0
                        && let Ok(j) = self.cells.binary_search_by_key(&(offset as u16), |c| c.offset)
                    {
                        *word &= !bit;
                        front.push((offset, j));
                    }
                }
            }
        }
    }
}

/// A bit for each cell of a brick, x from the lowest bit on: a word is a layer of 8 x 8. 2-D needs one word.
type Cells = [u64; WORDS];
const WORDS: usize = 8;
const NO_CELLS: Cells = [0; WORDS];

/// Free cells and unknown cells; in 2-D all words but the first are empty.
fn masks(brick: &DistanceBrick, min_weight: f32) -> (Cells, Cells) {
    let (mut free, mut unknown) = (NO_CELLS, NO_CELLS);
    let layers = brick.distances().chunks(64).zip(brick.weights().chunks(64));
    for ((distances, weights), (free, unknown)) in layers.zip(free.iter_mut().zip(&mut unknown)) {
        for (i, (distance, weight)) in distances.iter().zip(weights).enumerate() {
            let known = known(*distance, *weight, min_weight);
            *free |= u64::from(known == Known::Free) << i;
            *unknown |= u64::from(known == Known::Unknown) << i;
        }
    }
    (free, unknown)
}

/// Cells whose neighbor one step along an axis is in a set; `beyond` is the set in the next brick.
fn shifted<const D: usize>(set: &Cells, beyond: &Cells, axis: usize, step: i32) -> Cells {
    /// The cells with x = 0 of a layer.
    const FIRST: u64 = 0x0101_0101_0101_0101;
    let words = block_cells::<D>() / 64;
    let mut out = NO_CELLS;
    for w in 0..words {
        let (here, there) = (set[w], beyond[w]);
        out[w] = match (axis, step < 0) {
            (0, true) => (here << 1 & !FIRST) | (there >> 7 & FIRST),
            (0, false) => (here >> 1 & !(FIRST << 7)) | (there << 7 & (FIRST << 7)),
            (1, true) => here << 8 | there >> 56,
            (1, false) => here >> 8 | there << 56,
            (_, true) => {
                if w > 0 {
                    set[w - 1]
                } else {
                    beyond[words - 1]
                }
            }
            (_, false) => {
                if w + 1 < words {
                    set[w + 1]
                } else {
                    beyond[0]
                }
            }
        };
    }
    out
}

/// No group yet.
const NONE: u16 = u16::MAX;

/// The `n`-th of the `3^D` indices around one, itself among them.
#[inline(always)]
pub(super) fn neighbor<const D: usize>(at: [i32; D], n: usize) -> [i32; D] {
    let mut n = n as i32;
    std::array::from_fn(|k| {
        let step = n % 3 - 1;
        n /= 3;
        at[k] + step
    })
}
