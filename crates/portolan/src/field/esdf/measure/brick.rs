//! From the nearest crossings to the distances of the nodes of a brick.

use super::groups::{Groups, digit};
use super::simplices::{Block, LANES, Lane};
use crate::field::esdf::surface::SurfaceElements;
use crate::geom::BlockKey;
use multiversion::multiversion;

/// Scratch of [`NodeDistances::brick`], used again for every brick.
pub(crate) struct NodeDistances<const D: usize> {
    /// Elements of the cells at the brick's nodes.
    near: Vec<Near<D>>,
    lanes: Vec<Lane>,
    groups: Groups<D>,
    blocks: Vec<Block<D>>,
    tasks: Vec<Task>,
    packed: Packed<D>,
}

/// A simplex of a cell at the brick's nodes.
#[derive(Clone, Copy)]
struct Near<const D: usize> {
    cell: [i32; D],
    simplex: [[f32; D]; D],
}

/// A node whose distance to a group is wanted.
#[derive(Clone, Copy)]
struct Task {
    node: u16,
    group: u16,
}

/// Nodes that are measured together, the widest vectors full; a group's are filled up to a multiple.
const TOGETHER: usize = 16;

impl<const D: usize> NodeDistances<D> {
    pub(crate) fn new() -> Self {
        Self {
            near: Vec::new(),
            lanes: Vec::new(),
            groups: Groups::new(),
            blocks: Vec::new(),
            tasks: Vec::new(),
            packed: Packed { points: std::array::from_fn(|_| Vec::new()), best: Vec::new() },
        }
    }

    /// Distance (cells) of each node of a brick to the nearest element among those in the cells around the crossings
    /// that the transform found for the node and for its `2 D` neighbours, and in the `2^D` cells around the node;
    /// infinite where nothing was found for the node.
    ///
    /// `features` are the transform's for the brick, `beside(axis, side)` those for the bricks below (0) and above
    /// (1), which hold nothing beyond what the transform is exact for.
    ///
    /// Never less than the distance to the surface, but for rounding (1e-6 of the distance and of a cell). Exact within
    /// one cell of the surface, where a ball lies in the cells around the node; further away nearly always. Depends on
    /// the features and the elements alone.
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
        self.groups.number(elements, key, features, beside);
        self.tasks.clear();
        for (node, found) in out.iter_mut().enumerate() {
            // A ball of a cell's size lies in the cells around the node.
            if *found < 1.0 {
                continue;
            }
            *found = f32::INFINITY;
            let (groups, count) = self.groups.around(node);
            for &group in &groups[..count] {
                self.groups.list[usize::from(group)].nodes += 1;
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
        for group in &mut self.groups.list {
            group.packed = length;
            length += group.nodes.next_multiple_of(TOGETHER as u32);
            group.packed_end = group.packed;
        }
        self.packed.clear(length as usize);
        for task in &self.tasks {
            let group = &mut self.groups.list[usize::from(task.group)];
            for k in 0..D {
                let at = digit(usize::from(task.node), k) as f32 - group.origin[k];
                self.packed.points[k][group.packed_end as usize] = at;
            }
            group.packed_end += 1;
        }
        for group in &mut self.groups.list {
            group.packed_end = group.packed_end.next_multiple_of(TOGETHER as u32);
        }
        self.blocks.clear();
        measure_groups(&self.groups, &mut self.blocks, &mut self.packed);
        for task in &self.tasks {
            let next = &mut self.groups.list[usize::from(task.group)].packed;
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
fn measure_groups<const D: usize>(groups: &Groups<D>, blocks: &mut Vec<Block<D>>, packed: &mut Packed<D>) {
    for corners in &groups.corners {
        blocks.push(Block::of(*corners));
    }
    for group in &groups.list {
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
