//! Which crossings the nodes of a brick have found, and the elements around each.

use super::simplices::{LANES, Lane};
use crate::field::esdf::surface::{SurfaceElements, cells_around};
use crate::field::esdf::transform::Feature;
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};

/// The elements around one crossing.
#[derive(Clone, Copy)]
pub(super) struct Group<const D: usize> {
    /// Node where the crossing's edge starts, in cells from the brick's lowest node: what corners are relative to.
    pub(super) origin: [f32; D],
    pub(super) first: u32,
    pub(super) simplices: u32,
    /// Nodes that ask for it.
    pub(super) nodes: u32,
    /// Where they are packed.
    pub(super) packed: u32,
    pub(super) packed_end: u32,
}

/// The groups of a brick.
pub(super) struct Groups<const D: usize> {
    /// For the brick's nodes and those beside it: the group of what the transform found; `NONE`.
    at: Vec<u16>,
    pub(super) list: Vec<Group<D>>,
    /// Corners of the groups' simplices, eight side by side.
    pub(super) corners: Vec<[[Lane; D]; D]>,
    table: Table,
}

const NONE: u16 = u16::MAX;
/// Nodes along an axis with those beside the brick.
const PADDED: usize = BLOCK_EDGE + 2;

impl<const D: usize> Groups<D> {
    pub(super) fn new() -> Self {
        Self {
            at: vec![NONE; PADDED.pow(D as u32)],
            list: Vec::new(),
            corners: Vec::new(),
            table: Table::new(),
        }
    }

    /// The groups of what was found for a node and for its `2 D` neighbors, each once, and how many they are; none where
    /// nothing was found for the node.
    #[inline]
    pub(super) fn around(&self, node: usize) -> ([u16; 7], usize) {
        let at = padded::<D>(std::array::from_fn(|k| digit(node, k) as i32));
        let mut groups = [NONE; 7];
        if self.at[at] == NONE {
            return (groups, 0);
        }
        groups[0] = self.at[at];
        let mut count = 1;
        for k in 0..D {
            for beside in [at - PADDED.pow(k as u32), at + PADDED.pow(k as u32)] {
                let group = self.at[beside];
                if group != NONE && !groups[..count].contains(&group) {
                    groups[count] = group;
                    count += 1;
                }
            }
        }
        (groups, count)
    }

    /// Finds the groups of all nodes.
    pub(super) fn number<'f>(
        &mut self,
        elements: &SurfaceElements<D>,
        key: BlockKey<D>,
        features: &[u32],
        beside: impl Fn(usize, usize) -> Option<&'f [u32]>,
    ) {
        self.at.fill(NONE);
        self.list.clear();
        self.corners.clear();
        self.table.clear();
        let mut last = (u64::MAX, NONE);
        for (i, &word) in features.iter().enumerate().take(block_cells::<D>()) {
            self.number_one(elements, key, std::array::from_fn(|k| digit(i, k) as i32), word, &mut last);
        }
        for (axis, side) in (0..D).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let Some(features) = beside(axis, side) else { continue };
            let layer = if side == 0 { BLOCK_EDGE - 1 } else { 0 };
            for (i, &word) in features.iter().enumerate().filter(|(i, _)| digit(*i, axis) == layer) {
                let mut node: [i32; D] = std::array::from_fn(|k| digit(i, k) as i32);
                node[axis] = if side == 0 { -1 } else { BLOCK_EDGE as i32 };
                self.number_one(elements, key, node, word, &mut last);
            }
        }
    }

    #[inline]
    fn number_one(
        &mut self,
        elements: &SurfaceElements<D>,
        key: BlockKey<D>,
        node: [i32; D],
        word: u32,
        last: &mut (u64, u16),
    ) {
        let Some(feature) = Feature(word).known() else { return };
        let offset = feature.offset::<D>();
        let start: [i32; D] = std::array::from_fn(|k| node[k] + offset[k]);
        let name = start.iter().fold(feature.axis() as u64, |name, &v| name << 12 | (v + 2048) as u64);
        if name != last.0 {
            let slot = self.table.slot(name);
            if slot.number == NONE {
                slot.number = self.list.len() as u16;
                *last = (name, slot.number);
                self.add_group(elements, key, start, feature.axis());
            } else {
                *last = (name, slot.number);
            }
        }
        self.at[padded::<D>(node)] = last.1;
    }

    /// Collects the elements around a crossing.
    fn add_group(&mut self, elements: &SurfaceElements<D>, key: BlockKey<D>, start: [i32; D], axis: usize) {
        let first_cell = key.first_cell();
        let edge: [i32; D] = std::array::from_fn(|k| first_cell[k] + start[k]);
        let place = elements.brick(BlockKey::of_cell(edge)).map(|b| b.place[axis][BlockKey::offset(edge)]);
        let first = self.corners.len();
        let mut lane = 0;
        let corners = &mut self.corners;
        cells_around(edge, axis, place.unwrap_or(0.5), |cell| {
            let off: [f32; D] = std::array::from_fn(|k| (cell[k] - edge[k]) as f32);
            for simplex in elements.cell(cell) {
                if lane % LANES == 0 {
                    // Lanes that nothing follows for repeat the first.
                    corners.push(simplex.map(|p| std::array::from_fn(|k| [p[k] + off[k]; LANES])));
                } else if let Some(block) = corners.last_mut() {
                    for (i, p) in simplex.iter().enumerate() {
                        for k in 0..D {
                            block[i][k][lane % LANES] = p[k] + off[k];
                        }
                    }
                }
                lane += 1;
            }
        });
        let origin = start.map(|v| v as f32);
        self.list.push(Group {
            origin,
            first: first as u32,
            simplices: lane as u32,
            nodes: 0,
            packed: 0,
            packed_end: 0,
        });
    }
}

#[inline(always)]
pub(super) fn digit(at: usize, k: usize) -> usize {
    at >> (3 * k) & 7
}

/// Place of a node, -1 to 8 along each axis.
#[inline(always)]
fn padded<const D: usize>(node: [i32; D]) -> usize {
    (0..D).rev().fold(0, |at, k| at * PADDED + (node[k] + 1) as usize)
}

/// Numbers of crossings by their names: open addressing, emptied by counting rounds.
struct Table {
    slots: Vec<Slot>,
    round: u32,
}

#[derive(Clone, Copy)]
struct Slot {
    name: u64,
    round: u32,
    number: u16,
}

impl Table {
    /// More than twice the nodes in and beside a brick.
    const SLOTS: usize = 2048;

    fn new() -> Self {
        Self { slots: vec![Slot { name: 0, round: 0, number: NONE }; Self::SLOTS], round: 0 }
    }

    fn clear(&mut self) {
        self.round = self.round.wrapping_add(1);
        if self.round == 0 {
            *self = Self::new();
            self.round = 1;
        }
    }

    /// The slot of a name; its number is `NONE` if the name is new.
    #[inline]
    fn slot(&mut self, name: u64) -> &mut Slot {
        let mut at = (name.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 53) as usize;
        while self.slots[at].round == self.round && self.slots[at].name != name {
            at = (at + 1) % Self::SLOTS;
        }
        if self.slots[at].round != self.round {
            self.slots[at] = Slot { name, round: self.round, number: NONE };
        }
        &mut self.slots[at]
    }
}
