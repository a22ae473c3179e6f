//! How far each brick needs to look: upper bounds that bricks hand on to their neighbours.

use crate::field::esdf::surface::BrickCrossings;
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};
use rustc_hash::FxHashMap;

/// Something of a brick from which no cell is further away than it says.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Witness<const D: usize> {
    pub(crate) cell: [i32; D],
    /// Where it is, in cells from the cell's center.
    pub(crate) offset: [f32; D],
    /// Of the seed, or the height of the crossing.
    pub(crate) value: f32,
}

impl<const D: usize> Witness<D> {
    /// No least squared distance in a brick exceeds this.
    fn bound(&self, key: BlockKey<D>) -> f32 {
        let first = key.first_cell();
        let at = |k: usize| (self.cell[k] - first[k]) as f32 + self.offset[k];
        self.value + furthest_sq(std::array::from_fn::<_, D, _>(at))
    }

    /// The crossing of a brick that is the least far from all of its cells; `None`: there is none.
    pub(crate) fn of_crossings(key: BlockKey<D>, crossings: &BrickCrossings<D>) -> Option<Self> {
        let mut best: Option<(f32, Self)> = None;
        for axis in 0..D {
            if crossings.height[axis].iter().fold(true, |none, h| none & (*h == f32::INFINITY)) {
                continue;
            }
            let planes = crossings.place[axis].iter().zip(&crossings.height[axis]);
            for (i, (&place, &height)) in planes.enumerate().filter(|(_, (_, h))| **h < f32::INFINITY) {
                let offset = std::array::from_fn(|k| if k == axis { place } else { 0.0 });
                let witness = Self { cell: key.cell(i), offset, value: height };
                let bound = witness.bound(key);
                if best.is_none_or(|(b, _)| bound < b) {
                    best = Some((bound, witness));
                }
            }
        }
        best.map(|(_, witness)| witness)
    }
}

/// Squared distance of the cell of the brick at 0 that is the farthest from a point.
fn furthest_sq<const D: usize>(p: [f32; D]) -> f32 {
    let far = p.map(|c| c.abs().max((BLOCK_EDGE as f32 - 1.0 - c).abs()));
    far.iter().map(|f| f * f).sum()
}

/// Of each cell of a brick: squared distance of the cell that is the farthest from it.
pub(crate) fn furthest_of_cells<const D: usize>() -> Vec<f32> {
    let of = |i| furthest_sq(BlockKey([0; D]).cell(i).map(|c| c as f32));
    (0..block_cells::<D>()).map(of).collect()
}

/// For each brick, what no least squared distance in it exceeds: by an witness of its own, or by one that its neighbours
/// handed on, from face to face. `limit` where that is less; a little more than either, for what rounding takes away.
pub(crate) fn bounds<const D: usize>(
    keys: &[BlockKey<D>],
    mut witnesses: Vec<Option<Witness<D>>>,
    limit: f32,
) -> Vec<f32> {
    let slots: FxHashMap<BlockKey<D>, usize> = keys.iter().enumerate().map(|(i, &key)| (key, i)).collect();
    let bound = |witness: &Option<Witness<D>>, i: usize| {
        witness.as_ref().map_or(limit, |a| a.bound(keys[i]).min(limit)) * 1.001 + 0.01
    };
    let mut bounds: Vec<f32> = witnesses.iter().enumerate().map(|(i, a)| bound(a, i)).collect();
    let mut since: Vec<u32> = witnesses.iter().map(|a| if a.is_some() { 0 } else { u32::MAX }).collect();
    let mut frontier: Vec<usize> = (0..keys.len()).filter(|&i| witnesses[i].is_some()).collect();
    let mut round = 0;
    while !frontier.is_empty() {
        round += 1;
        let mut next = Vec::new();
        for &i in &frontier {
            for (k, step) in (0..D).flat_map(|k| [(k, -1), (k, 1)]) {
                let mut key = keys[i];
                key.0[k] += step;
                let Some(&j) = slots.get(&key) else { continue };
                let handed = bound(&witnesses[i], j);
                if since[j] < round || handed >= bounds[j] {
                    continue;
                }
                if since[j] == u32::MAX {
                    since[j] = round;
                    next.push(j);
                }
                (bounds[j], witnesses[j]) = (handed, witnesses[i]);
            }
        }
        frontier = next;
    }
    bounds
}
