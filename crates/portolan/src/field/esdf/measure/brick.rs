//! From the nearest crossings to the distances of the nodes of a brick.

use super::simplices::{Block, LANES, Lane};
use crate::field::esdf::surface::{SurfaceElements, cells_around};
use crate::field::esdf::transform::Feature;
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};
use multiversion::multiversion;

/// Scratch of [`NodeDistances::brick`], used again for every brick.
pub(crate) struct NodeDistances<const D: usize> {
    /// Elements of the cells at the brick's nodes.
    near: Vec<Near<D>>,
    lanes: Vec<Lane>,
    /// For the brick's nodes and those beside it: the group of what the transform found; `NONE`.
    groups_at: Vec<u16>,
    groups: Vec<Group<D>>,
    corners: Vec<[[Lane; D]; D]>,
    blocks: Vec<Block<D>>,
    table: Table,
    tasks: Vec<Task>,
    packed: Packed<D>,
}

/// A simplex of a cell at the brick's nodes.
#[derive(Clone, Copy)]
struct Near<const D: usize> {
    cell: [i32; D],
    simplex: [[f32; D]; D],
}

/// The elements around one crossing.
#[derive(Clone, Copy)]
struct Group<const D: usize> {
    /// Node where the crossing's edge starts, in cells from the brick's lowest node: what corners are relative to.
    origin: [f32; D],
    first: u32,
    simplices: u32,
    /// Nodes that ask for it.
    nodes: u32,
    /// Where they are packed.
    packed: u32,
    packed_end: u32,
}

/// A node whose distance to a group is wanted.
#[derive(Clone, Copy)]
struct Task {
    node: u16,
    group: u16,
}

const NONE: u16 = u16::MAX;
/// Nodes that are measured together, the widest vectors full; a group's are filled up to a multiple.
const TOGETHER: usize = 16;
/// Nodes along an axis with those beside the brick.
const PADDED: usize = BLOCK_EDGE + 2;

impl<const D: usize> NodeDistances<D> {
    pub(crate) fn new() -> Self {
        Self {
            near: Vec::new(),
            lanes: Vec::new(),
            groups_at: vec![NONE; PADDED.pow(D as u32)],
            groups: Vec::new(),
            corners: Vec::new(),
            blocks: Vec::new(),
            table: Table::new(),
            tasks: Vec::new(),
            packed: Packed { points: std::array::from_fn(|_| Vec::new()), best: Vec::new() },
        }
    }

    /// Distance (cells) of each node of a brick to the nearest element among those in the cells around the crossings
    /// that the transform found for the node and for its `2 D` neighbours, and in the `2^D` cells around the node;
    /// infinite where nothing was found for the node.
    ///
    /// `features` are the transform's words for the brick, `beside(axis, side)` those for the bricks below (0) and above
    /// (1), which hold nothing beyond what the transform is exact for.
    ///
    /// Never less than the distance to the surface, but for rounding (1e-6 of the distance and of a cell). Exact within
    /// one cell of the surface, where a ball lies in the cells around the node; further away nearly always. Depends on
    /// the words and the elements alone.
    pub(crate) fn brick<'f>(
        &mut self,
        elements: &SurfaceElements<D>,
        key: BlockKey<D>,
        features: &[u32],
        beside: impl Fn(usize, usize) -> Option<&'f [u32]>,
        out: &mut [f32],
    ) {
        out.fill(f32::INFINITY);
        self.near(elements, key, out);
        self.number(elements, key, features, beside);
        self.tasks.clear();
        for (node, found) in out.iter_mut().enumerate() {
            // A ball of a cell's size lies in the cells around the node.
            if *found < 1.0 {
                continue;
            }
            *found = f32::INFINITY;
            let at = padded::<D>(std::array::from_fn(|k| digit(node, k) as i32));
            if self.groups_at[at] == NONE {
                continue;
            }
            let mut groups = [NONE; 7];
            groups[0] = self.groups_at[at];
            let mut count = 1;
            for k in 0..D {
                for beside in [at - PADDED.pow(k as u32), at + PADDED.pow(k as u32)] {
                    let group = self.groups_at[beside];
                    if group != NONE && !groups[..count].contains(&group) {
                        groups[count] = group;
                        count += 1;
                    }
                }
            }
            for &group in &groups[..count] {
                self.groups[usize::from(group)].nodes += 1;
                self.tasks.push(Task { node: node as u16, group });
            }
        }
        self.measure(out);
        for v in out.iter_mut() {
            *v = v.sqrt();
        }
    }

    /// Squared distances of all tasks.
    fn measure(&mut self, out: &mut [f32]) {
        let mut length = 0;
        for group in &mut self.groups {
            group.packed = length;
            length += group.nodes.next_multiple_of(TOGETHER as u32);
            group.packed_end = group.packed;
        }
        self.packed.clear(length as usize);
        for task in &self.tasks {
            let group = &mut self.groups[usize::from(task.group)];
            for k in 0..D {
                let at = digit(usize::from(task.node), k) as f32 - group.origin[k];
                self.packed.points[k][group.packed_end as usize] = at;
            }
            group.packed_end += 1;
        }
        for group in &mut self.groups {
            group.packed_end = group.packed_end.next_multiple_of(TOGETHER as u32);
        }
        self.blocks.clear();
        measure_groups(&self.corners, &mut self.blocks, &self.groups, &mut self.packed);
        for task in &self.tasks {
            let next = &mut self.groups[usize::from(task.group)].packed;
            let (found, least) = (self.packed.best[*next as usize], &mut out[usize::from(task.node)]);
            *least = if found < *least { found } else { *least };
            *next += 1;
        }
    }

    /// Squared distances to the elements of the cells around each node.
    fn near(&mut self, elements: &SurfaceElements<D>, key: BlockKey<D>, out: &mut [f32]) {
        self.near.clear();
        for octant in 0..1usize << D {
            let below = |k: usize| (octant >> k & 1) as i32;
            let lower = BlockKey(std::array::from_fn(|k| key.0[k].wrapping_sub(below(k))));
            let Some(brick) = elements.brick_elements(lower) else { continue };
            for (at, simplices) in brick.cells() {
                let cell: [i32; D] = std::array::from_fn(|k| digit(at, k) as i32 - 8 * below(k));
                if cell.iter().all(|&v| v >= -1) {
                    self.near.extend(simplices.iter().map(|&simplex| Near { cell, simplex }));
                }
            }
        }
        self.lanes.clear();
        measure_near(&self.near, &mut self.lanes);
        for (near, lane) in self.near.iter().zip(&self.lanes) {
            for c in 0..1usize << D {
                let node: [i32; D] = std::array::from_fn(|k| near.cell[k] + (c >> k & 1) as i32);
                if node.iter().all(|v| (0..8).contains(v)) {
                    let found = &mut out[BlockKey::offset(node)];
                    *found = if lane[c] < *found { lane[c] } else { *found };
                }
            }
        }
    }

    /// Finds the groups of all nodes.
    fn number<'f>(
        &mut self,
        elements: &SurfaceElements<D>,
        key: BlockKey<D>,
        features: &[u32],
        beside: impl Fn(usize, usize) -> Option<&'f [u32]>,
    ) {
        self.groups_at.fill(NONE);
        self.groups.clear();
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
                slot.number = self.groups.len() as u16;
                *last = (name, slot.number);
                self.add_group(elements, key, start, feature.axis());
            } else {
                *last = (name, slot.number);
            }
        }
        self.groups_at[padded::<D>(node)] = last.1;
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
        self.groups.push(Group {
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
fn digit(at: usize, k: usize) -> usize {
    at >> (3 * k) & 7
}

/// Place of a node, -1 to 8 along each axis.
#[inline(always)]
fn padded<const D: usize>(node: [i32; D]) -> usize {
    (0..D).rev().fold(0, |at, k| at * PADDED + (node[k] + 1) as usize)
}

/// Squared distances of the nodes of a cell to each simplex in it.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn measure_near<const D: usize>(near: &[Near<D>], lanes: &mut Vec<Lane>) {
    let mut nodes = [[0.0; LANES]; D];
    for k in 0..D {
        for l in 0..LANES {
            nodes[k][l] = (l >> k & 1) as f32;
        }
    }
    for near in near.chunks(LANES) {
        let mut corners = [[[0.0; LANES]; D]; D];
        for (l, near) in near.iter().enumerate() {
            for (to, from) in corners.as_flattened_mut().iter_mut().zip(near.simplex.as_flattened()) {
                to[l] = *from;
            }
        }
        let block = Block::of(corners);
        for l in 0..near.len() {
            let mut found = [f32::INFINITY; LANES];
            block.relax(l, &nodes, &mut found);
            lanes.push(found);
        }
    }
}

/// Squared distances of nodes, packed by groups, to the elements of their groups.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn measure_groups<const D: usize>(
    corners: &[[[Lane; D]; D]],
    blocks: &mut Vec<Block<D>>,
    groups: &[Group<D>],
    packed: &mut Packed<D>,
) {
    for corners in corners {
        blocks.push(Block::of(*corners));
    }
    for group in groups {
        let nodes = group.packed as usize..group.packed_end as usize;
        for at in nodes.step_by(TOGETHER) {
            let mut points = [[0.0; TOGETHER]; D];
            let mut best = [f32::INFINITY; TOGETHER];
            for (to, from) in points.iter_mut().zip(&packed.points) {
                to.copy_from_slice(&from[at..at + TOGETHER]);
            }
            for simplex in 0..group.simplices as usize {
                blocks[group.first as usize + simplex / LANES].relax(simplex % LANES, &points, &mut best);
            }
            packed.best[at..at + TOGETHER].copy_from_slice(&best);
        }
    }
}

/// Nodes in the order of their groups, those of each filled up to whole vectors.
#[derive(Debug)]
struct Packed<const D: usize> {
    /// In cells from the group's origin, along each axis.
    points: [Vec<f32>; D],
    best: Vec<f32>,
}

impl<const D: usize> Packed<D> {
    fn clear(&mut self, length: usize) {
        for list in self.points.iter_mut().chain([&mut self.best]) {
            list.clear();
            list.resize(length, f32::INFINITY);
        }
        // What fills up may be anywhere.
        self.points.iter_mut().for_each(|list| list.fill(0.0));
    }
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
