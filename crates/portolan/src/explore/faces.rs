//! The frontier cells of one brick.

use super::cells::{Known, known};
use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};
use crate::store::Bricks;

/// A free cell with an unknown neighbour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FrontierCell {
    /// Its place in the brick.
    pub(super) offset: u16,
    /// Bit `2 k`: the neighbour below along axis `k` is unknown; bit `2 k + 1`: the one above.
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
    /// The group of the cell at a place; `None` where it is no frontier cell.
    #[inline]
    pub(super) fn group_at(&self, offset: usize) -> Option<u16> {
        let i = self.cells.binary_search_by_key(&(offset as u16), |c| c.offset).ok()?;
        Some(self.cells[i].group)
    }

    /// Of a brick of the store. Reads its face neighbours, too.
    pub(super) fn of<const D: usize>(
        store: &Bricks<SignedDistance, D>,
        key: BlockKey<D>,
        min_weight: f32,
    ) -> Self {
        let Some(brick) = store.brick(key) else { return Self::default() };
        let neighbours: [[Option<&DistanceBrick>; 2]; D] = std::array::from_fn(|k| {
            [-1, 1].map(|step| {
                let mut at = key;
                at.0[k] += step;
                store.brick(at)
            })
        });
        let mut cells = Vec::new();
        let unknown = |brick: Option<&DistanceBrick>, i| {
            brick.is_none_or(|b| known(b, i, min_weight) == Known::Unknown)
        };
        for i in 0..block_cells::<D>() {
            if known(brick, i, min_weight) != Known::Free {
                continue;
            }
            let mut faces = 0;
            for k in 0..D {
                let stride = BLOCK_EDGE.pow(k as u32);
                let around = (BLOCK_EDGE - 1) * stride;
                let place = i / stride % BLOCK_EDGE;
                let below = if place > 0 {
                    unknown(Some(brick), i - stride)
                } else {
                    unknown(neighbours[k][0], i + around)
                };
                let above = if place + 1 < BLOCK_EDGE {
                    unknown(Some(brick), i + stride)
                } else {
                    unknown(neighbours[k][1], i - around)
                };
                faces |= (u8::from(below) | u8::from(above) << 1) << (2 * k);
            }
            if faces != 0 {
                cells.push(FrontierCell { offset: i as u16, faces, group: NONE });
            }
        }
        let mut frontier = Self { cells, groups: 0 };
        frontier.group::<D>();
        frontier
    }

    /// Numbers the groups in the order of their first cells.
    fn group<const D: usize>(&mut self) {
        let mut open = Vec::new();
        for start in 0..self.cells.len() {
            if self.cells[start].group != NONE {
                continue;
            }
            let group = self.groups;
            self.groups += 1;
            self.cells[start].group = group;
            open.push(start);
            while let Some(i) = open.pop() {
                let at = BlockKey([0; D]).cell(usize::from(self.cells[i].offset));
                for n in 0..3usize.pow(D as u32) {
                    let cell = neighbour(at, n);
                    if cell.iter().any(|&v| v < 0 || v >= BLOCK_EDGE as i32) {
                        continue;
                    }
                    let offset = BlockKey::offset(cell) as u16;
                    if let Ok(j) = self.cells.binary_search_by_key(&offset, |c| c.offset)
                        && self.cells[j].group == NONE
                    {
                        self.cells[j].group = group;
                        open.push(j);
                    }
                }
            }
        }
    }
}

/// No group yet.
const NONE: u16 = u16::MAX;

/// The `n`-th of the `3^D` indices around one, itself among them.
#[inline(always)]
pub(super) fn neighbour<const D: usize>(at: [i32; D], n: usize) -> [i32; D] {
    let mut n = n as i32;
    std::array::from_fn(|k| {
        let step = n % 3 - 1;
        n /= 3;
        at[k] + step
    })
}
