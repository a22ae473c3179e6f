//! How far the nearest of some cells is.

use super::TOGETHER;
use super::cell_mask::CellMask;
use super::transform::{
    Input, Output, RowSearch, Source, Witness, bounds, furthest_of_cells, layout, squared_distances,
};
use crate::geom::{BlockKey, block_cells};
use crate::parallel;
use std::sync::Arc;

/// The cells of one brick.
struct Cells<'a> {
    cells: CellMask,
    /// Place of every cell in the layout of the first pass.
    places: &'a [u16],
}

impl Source for Cells<'_> {
    fn values<'s>(&'s self, scratch: &'s mut [Vec<f32>; 2]) -> &'s [f32] {
        let values = &mut scratch[0];
        values.resize(self.places.len(), 0.0);
        for (i, &place) in self.places.iter().enumerate() {
            values[place as usize] = if self.cells.has(i) { 0.0 } else { f32::INFINITY };
        }
        values
    }
}

/// Squared distances from the centers of the cells of bricks to the nearest of some cells, in squared cells: to their centers
/// or to them as boxes, as `search` has it; infinite beyond `limit`. To a box the cost of a way is separable,
/// `max(0, |k| - 1/2)^2` per axis, so that the passes are those of any other transform.
///
/// `around` are all bricks that may matter to those of `dirty`, both ascending; `cells` says which cells of a brick count,
/// `beside` names one near a brick that has none. Passes fill only bricks that are `wanted`.
pub(super) fn cell_distances<K: RowSearch + Send, const D: usize>(
    search: K,
    around: &[BlockKey<D>],
    dirty: &[BlockKey<D>],
    limit: f32,
    cells: impl Fn(BlockKey<D>) -> CellMask + Sync,
    beside: impl Fn(BlockKey<D>) -> Option<[i32; D]> + Sync,
    wanted: impl Fn(&BlockKey<D>) -> bool + Sync + Send,
) -> Vec<(BlockKey<D>, Arc<[f32]>)> {
    let farthest = furthest_of_cells::<D>();
    let masks = parallel::map(around, TOGETHER, |&key| cells(key));
    let witnesses = around.iter().zip(&masks).map(|(&key, mask)| {
        let nearest = mask.cells().min_by(|&a, &b| farthest[a].total_cmp(&farthest[b]));
        let cell = nearest.map(|i| key.cell(i)).or_else(|| beside(key))?;
        Some(Witness { cell, offset: [0.0; D], value: 0.0 })
    });
    let budgets = bounds(around, witnesses.collect(), limit);
    let mut listed = dirty.iter().peekable();
    // Ways are half a cell shorter along each axis than those from center to center, of which bricks know.
    let outputs = around
        .iter()
        .zip(budgets)
        .filter(|(key, _)| listed.next_if_eq(key).is_some())
        .map(|(&key, bound)| Output { key, budget: (bound.sqrt() + 1.0).powi(2) })
        .collect();
    let places: Vec<u16> = (0..block_cells::<D>()).map(|i| layout::<D>(0, i) as u16).collect();
    let sources: Vec<_> = around
        .iter()
        .zip(masks)
        // Without such a cell nothing starts there, but where every brick must be on its line.
        .filter(|(_, mask)| mask.any() || K::EMPTY_BRICKS)
        .map(|(&key, cells)| Input { key, source: Cells { cells, places: &places } })
        .collect();
    let stage = squared_distances(search, &sources, outputs, wanted, |_, values| {
        values.iter_mut().for_each(|v| *v = if *v <= limit { *v } else { f32::INFINITY });
    });
    let planes: Vec<&[f32]> = stage.values.chunks_exact(block_cells::<D>()).collect();
    let planes = parallel::map(&planes, TOGETHER, |plane| Arc::<[f32]>::from(*plane));
    stage.keys.into_iter().zip(planes).collect()
}
