//! The elements and crossings of all bricks, kept up to date with the map.

use super::brick::{BrickElements, Scratch};
use super::crossings::BrickCrossings;
use crate::cell::SignedDistance;
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};
use crate::parallel;
use crate::store::Bricks;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// The surface of a map in bricks: for every cell (the cube between `2^D` nodes, named by its lowest one) the segments
/// of marching squares or the triangles of marching cubes, and for every brick the crossings that they use.
///
/// Bricks are shared: a clone is a snapshot that later updates do not change.
#[derive(Clone, Debug)]
pub(crate) struct SurfaceElements<const D: usize> {
    min_weight: f32,
    elements: FxHashMap<BlockKey<D>, Arc<BrickElements<D>>>,
    crossings: FxHashMap<BlockKey<D>, Arc<BrickCrossings<D>>>,
    /// Cells along the longest axis of the box of all bricks with elements.
    extent: f64,
}

/// Bricks of one task.
const TOGETHER: usize = 16;

impl<const D: usize> SurfaceElements<D> {
    /// Of no brick yet; a node of smaller weight than `min_weight`, or of none, counts as never observed.
    pub(crate) fn new(min_weight: f32) -> Self {
        Self { min_weight, elements: FxHashMap::default(), crossings: FxHashMap::default(), extent: 0.0 }
    }

    /// The surface of a whole map. O(cells).
    #[cfg(test)]
    pub(crate) fn of(store: &Bricks<SignedDistance, D>, min_weight: f32) -> Self {
        let mut all = Self::new(min_weight);
        all.update(store, &store.keys());
        all
    }

    /// Follows changes of the bricks of `changed`. Returns the keys, ascending, of the bricks whose elements or
    /// crossings are not what they were: among those of `changed` and their neighbours. O(changed bricks).
    pub(crate) fn update(
        &mut self,
        store: &Bricks<SignedDistance, D>,
        changed: &[BlockKey<D>],
    ) -> Vec<BlockKey<D>> {
        const SMALLEST: f32 = f32::from_bits(1);
        let threshold = if self.min_weight > 0.0 { self.min_weight } else { SMALLEST };
        // A brick's cells read the nodes of its upper neighbours.
        let dirty = around(changed, -1);
        let made = parallel::map_with(&dirty, TOGETHER, Scratch::new, |&key, scratch| {
            BrickElements::of(store, key, threshold, scratch)
        });
        let mut touched = Vec::new();
        for (&key, made) in dirty.iter().zip(made) {
            if self.elements.get(&key).map(|e| &**e) != made.as_ref() {
                touched.push(key);
                put(&mut self.elements, key, made);
            }
        }
        // Its crossings are used by the cells of its lower neighbours too.
        let dirty = around(&touched, 1);
        let elements = &self.elements;
        let made = parallel::map(&dirty, TOGETHER, |&key| crossings(elements, key));
        for (&key, made) in dirty.iter().zip(made) {
            if self.crossings.get(&key).map(|c| &**c) != made.as_ref() {
                touched.push(key);
                put(&mut self.crossings, key, made);
            }
        }
        if !touched.is_empty() {
            self.extent = extent(self.elements.keys());
        }
        touched.sort_unstable();
        touched.dedup();
        touched
    }

    /// The elements of a brick; `None`: there are none.
    #[inline]
    pub(crate) fn brick_elements(&self, key: BlockKey<D>) -> Option<&BrickElements<D>> {
        self.elements.get(&key).map(|e| &**e)
    }

    /// The keys of the bricks with at least one crossing, ascending.
    #[cfg(test)]
    pub(crate) fn keys(&self) -> Vec<BlockKey<D>> {
        let mut keys: Vec<_> = self.crossings.keys().copied().collect();
        keys.sort_unstable();
        keys
    }

    /// The crossings on the edges that start in a brick; `None`: it has no crossing.
    #[inline]
    pub(crate) fn brick(&self, key: BlockKey<D>) -> Option<&BrickCrossings<D>> {
        self.crossings.get(&key).map(|c| &**c)
    }

    /// Simplices of a cell, in cells from its lowest node.
    #[inline]
    pub(crate) fn cell(&self, cell: [i32; D]) -> &[[[f32; D]; D]] {
        self.brick_elements(BlockKey::of_cell(cell)).map_or(&[], |b| b.cell(BlockKey::offset(cell)))
    }

    /// How far, in cells, an element may be from where the extracted mesh has it: a mesh keeps vertices as `f32` from a
    /// corner of its box, and a contour from zero in `f64`.
    #[inline]
    pub(crate) fn vertex_margin(&self) -> f64 {
        (D as f64).sqrt() * f64::from(f32::EPSILON) * (8.0 + 0.5 * self.extent)
    }

    /// The keys of the bricks with elements, ascending.
    #[cfg(test)]
    pub(crate) fn element_keys(&self) -> Vec<BlockKey<D>> {
        let mut keys: Vec<_> = self.elements.keys().copied().collect();
        keys.sort_unstable();
        keys
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> usize {
        let bucket = size_of::<BlockKey<D>>() + size_of::<usize>() + 1;
        let planes = D * block_cells::<D>() * 2 * size_of::<f32>();
        self.elements.values().map(|e| e.memory_bytes()).sum::<usize>()
            + self.crossings.len() * (size_of::<BrickCrossings<D>>() + planes)
            + (self.elements.capacity() + self.crossings.capacity()) * 8 / 7 * bucket
    }
}

/// Cells along the longest axis of a box of bricks.
fn extent<'k, const D: usize>(keys: impl Iterator<Item = &'k BlockKey<D>>) -> f64 {
    let (mut low, mut high) = ([i32::MAX; D], [i32::MIN; D]);
    for key in keys {
        for k in 0..D {
            (low[k], high[k]) = (low[k].min(key.0[k]), high[k].max(key.0[k]));
        }
    }
    let bricks = (0..D).map(|k| i64::from(high[k]) - i64::from(low[k]) + 1).max();
    (bricks.unwrap_or(0).max(0) * BLOCK_EDGE as i64) as f64
}

/// The bricks of `keys` and their neighbours in all octants in the direction of `sign`, ascending.
fn around<const D: usize>(keys: &[BlockKey<D>], sign: i32) -> Vec<BlockKey<D>> {
    let octant = |key: &BlockKey<D>, o: usize| {
        BlockKey(std::array::from_fn(|k| key.0[k].wrapping_add(sign * (o >> k & 1) as i32)))
    };
    let mut all: Vec<_> = keys.iter().flat_map(|key| (0..1 << D).map(|o| octant(key, o))).collect();
    all.sort_unstable();
    all.dedup();
    all
}

fn put<T, const D: usize>(map: &mut FxHashMap<BlockKey<D>, Arc<T>>, key: BlockKey<D>, made: Option<T>) {
    match made {
        Some(made) => drop(map.insert(key, Arc::new(made))),
        None => drop(map.remove(&key)),
    }
}

/// The crossings of a brick, from the cells that use them.
fn crossings<const D: usize>(
    elements: &FxHashMap<BlockKey<D>, Arc<BrickElements<D>>>,
    key: BlockKey<D>,
) -> Option<BrickCrossings<D>> {
    let mut made: Option<BrickCrossings<D>> = None;
    for octant in 0..1usize << D {
        let below = BlockKey(std::array::from_fn(|k| key.0[k].wrapping_sub((octant >> k & 1) as i32)));
        for edge in elements.get(&below).map_or(&[][..], |e| e.used_edges(octant)) {
            let made = made.get_or_insert_with(|| BrickCrossings {
                place: std::array::from_fn(|_| vec![0.0; block_cells::<D>()].into()),
                height: std::array::from_fn(|_| vec![f32::INFINITY; block_cells::<D>()].into()),
            });
            let (axis, i) =
                (usize::from(edge.at) / block_cells::<D>(), usize::from(edge.at) % block_cells::<D>());
            made.place[axis][i] = edge.place;
            let height = &mut made.height[axis][i];
            *height = height.min(edge.height);
        }
    }
    made
}
