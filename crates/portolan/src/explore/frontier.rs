//! Connected frontier cells as one frontier.

use super::faces::{BrickFrontier, neighbor};
use crate::geom::vector::unit;
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, Lattice};
use crate::sets::Sets;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;

/// A frontier: free cells connected by a face, an edge or a corner, each with an unknown cell at one of its faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Frontier<const D: usize> {
    /// The free cells, in ascending order of bricks, within a brick x fastest.
    pub cells: Vec<[i32; D]>,
    /// Number of faces between these cells and unknown ones; times `resolution^(D - 1)` the length or area.
    pub faces: usize,
    /// Mean of the cell centers (world). Of a curved frontier it may lie in a wall or in unknown space.
    pub centroid: [f64; D],
    /// Center of the cell nearest to the centroid (world), the first of equals: a goal for the robot.
    pub middle: [f64; D],
    /// Unit mean direction of the faces, from free to unknown space; `None` where they cancel out.
    pub normal: Option<[f64; D]>,
    /// Bounding box of the cells (world).
    pub extent: Aabb<D>,
}

/// The frontier cells of all bricks, by key.
pub(super) type Pieces<const D: usize> = FxHashMap<BlockKey<D>, BrickFrontier>;

/// Joins the groups of all bricks into frontiers, sorted by size, largest first, then by first cell.
pub(super) fn join<const D: usize>(
    pieces: &Pieces<D>,
    lattice: &Lattice<D>,
    min_cells: usize,
) -> Vec<Frontier<D>> {
    let mut keys: Vec<_> = pieces.keys().copied().collect();
    keys.sort_unstable();
    // Groups are numbered through, in the order of keys.
    let mut first = FxHashMap::default();
    let mut groups = 0u32;
    for key in &keys {
        first.insert(*key, groups);
        groups += u32::from(pieces[key].groups);
    }
    let mut sets = Sets::new(groups);
    for key in &keys {
        join_with_neighbors(pieces, &first, *key, &mut sets);
    }
    let mut sums: Vec<Sum<D>> = Vec::new();
    // Where the sum of a set is, by the set's name.
    let mut sum_of = vec![usize::MAX; groups as usize];
    for key in &keys {
        let (piece, first) = (&pieces[key], first[key]);
        for cell in &piece.cells {
            let at = &mut sum_of[sets.find(first + u32::from(cell.group)) as usize];
            if *at == usize::MAX {
                *at = sums.len();
                sums.push(Sum::default());
            }
            sums[*at].include(key.cell(usize::from(cell.offset)), cell.faces);
        }
    }
    sums.retain(|sum| sum.cells.len() >= min_cells.max(1));
    // Stable: they came in the order of their first cells.
    sums.sort_by_key(|sum| Reverse(sum.cells.len()));
    sums.into_iter().map(|sum| sum.measured(lattice)).collect()
}

/// Joins the groups of a brick with those they touch in neighboring bricks with greater keys; the pairs with smaller keys
/// are joined from there.
fn join_with_neighbors<const D: usize>(
    pieces: &Pieces<D>,
    first: &FxHashMap<BlockKey<D>, u32>,
    key: BlockKey<D>,
    sets: &mut Sets,
) {
    let around: [Option<(&BrickFrontier, u32)>; 27] = std::array::from_fn(|n| {
        let at = BlockKey(if n < 3usize.pow(D as u32) { neighbor(key.0, n) } else { key.0 });
        if at > key { pieces.get(&at).map(|piece| (piece, first[&at])) } else { None }
    });
    if around.iter().all(Option::is_none) {
        return;
    }
    let (piece, first_here) = (&pieces[&key], first[&key]);
    for cell in &piece.cells {
        let at = BlockKey([0; D]).cell(usize::from(cell.offset));
        if at.iter().all(|v| (1..BLOCK_EDGE as i32 - 1).contains(v)) {
            continue;
        }
        for n in 0..3usize.pow(D as u32) {
            let next = neighbor(at, n);
            // Which of the bricks around: their numbers count like those of cells.
            let brick =
                (0..D).rev().fold(0, |b, k| 3 * b + (1 + next[k].div_euclid(BLOCK_EDGE as i32)) as usize);
            if let Some((piece, first_there)) = around[brick]
                && let Some(group) = piece.group_at(BlockKey::offset(next))
            {
                sets.join(first_here + u32::from(cell.group), first_there + u32::from(group));
            }
        }
    }
}

/// Sums over the cells of a frontier: integers, so that the order has no influence.
struct Sum<const D: usize> {
    cells: Vec<[i32; D]>,
    places: [i64; D],
    /// Faces in positive direction less faces in negative direction, per axis.
    normal: [i64; D],
    faces: usize,
}

impl<const D: usize> Default for Sum<D> {
    fn default() -> Self {
        Self { cells: Vec::new(), places: [0; D], normal: [0; D], faces: 0 }
    }
}

impl<const D: usize> Sum<D> {
    fn include(&mut self, cell: [i32; D], faces: u8) {
        self.cells.push(cell);
        self.faces += faces.count_ones() as usize;
        for k in 0..D {
            self.places[k] += i64::from(cell[k]);
            self.normal[k] += i64::from(faces >> (2 * k + 1) & 1) - i64::from(faces >> (2 * k) & 1);
        }
    }

    fn measured(self, lattice: &Lattice<D>) -> Frontier<D> {
        let n = self.cells.len() as f64;
        let mean = self.places.map(|sum| sum as f64 / n);
        let off = |cell: &[i32; D]| (0..D).map(|k| (f64::from(cell[k]) - mean[k]).powi(2)).sum::<f64>();
        let nearest = self.cells.iter().copied().reduce(|a, b| if off(&b) < off(&a) { b } else { a });
        let mut extent = Aabb::EMPTY;
        for cell in &self.cells {
            extent = extent.union(lattice.aabb(*cell, cell.map(|v| v + 1)));
        }
        Frontier {
            faces: self.faces,
            centroid: std::array::from_fn(|k| lattice.origin[k] + (mean[k] + 0.5) * lattice.resolution),
            middle: lattice.center(nearest.unwrap_or([0; D])),
            normal: unit(self.normal.map(|v| v as f64)),
            extent,
            cells: self.cells,
        }
    }
}
