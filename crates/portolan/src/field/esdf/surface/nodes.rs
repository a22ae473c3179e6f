//! The nodes that the cells of a brick have as corners.

use crate::cell::DistanceBrick;
use crate::cell::SignedDistance;
use crate::geom::{BLOCK_EDGE, BlockKey};
use crate::store::Bricks;

/// Nodes along each axis: the brick's and the first of the next.
const EDGE: usize = BLOCK_EDGE + 1;

/// Values at the `9^D` nodes of a brick's cells, x fastest; NaN where nothing was observed.
#[derive(Clone, Debug)]
pub(super) struct Nodes<const D: usize> {
    values: Vec<f32>,
}

/// A row of cells: those with surface, a bit each.
pub(super) struct Row {
    /// Index of the row: `y + 8 z`.
    pub(super) row: usize,
    pub(super) active: u8,
}

impl<const D: usize> Nodes<D> {
    pub(super) fn new() -> Self {
        Self { values: vec![f32::NAN; EDGE.pow(D as u32)] }
    }

    /// Reads the nodes of a brick and of its upper neighbours; whether there are any on both sides of the surface.
    pub(super) fn read(
        &mut self,
        store: &Bricks<SignedDistance, D>,
        key: BlockKey<D>,
        threshold: f32,
    ) -> bool {
        let Some(own) = store.brick(key) else { return false };
        let octants: [Option<&DistanceBrick>; 8] = std::array::from_fn(|o| match o {
            0 => Some(own),
            _ if o >> D == 0 => {
                store.brick(BlockKey(std::array::from_fn(|k| key.0[k] + (o >> k & 1) as i32)))
            }
            _ => None,
        });
        let planes = octants.map(|b| b.map_or((&[][..], &[][..]), |b| (b.distances(), b.weights())));
        let (mut inside, mut free) = (false, false);
        for (r, row) in self.values.chunks_exact_mut(EDGE).enumerate() {
            let (y, z) = (r % EDGE, r / EDGE);
            let octant = (y >> 3) << 1 | (z >> 3) << 2;
            let at = (y & 7) << 3 | (z & 7) << 6;
            let value = |d: f32, w: f32| if w >= threshold { d } else { f32::NAN };
            let (low, high) = row.split_at_mut(BLOCK_EDGE);
            let (d, w) = planes[octant];
            match (d.get(at..at + BLOCK_EDGE), w.get(at..at + BLOCK_EDGE)) {
                (Some(d), Some(w)) => {
                    for i in 0..BLOCK_EDGE {
                        low[i] = value(d[i], w[i]);
                    }
                }
                _ => low.fill(f32::NAN),
            }
            let (d, w) = planes[octant | 1];
            high[0] = d.get(at).zip(w.get(at)).map_or(f32::NAN, |(&d, &w)| value(d, w));
            for v in row.iter() {
                inside |= *v < 0.0;
                free |= *v >= 0.0;
            }
        }
        inside && free
    }

    /// The rows of cells that have any surface, in order.
    pub(super) fn rows(&self) -> impl Iterator<Item = Row> + '_ {
        let bits = |r: usize| {
            let row = &self.values[r * EDGE..][..EDGE];
            let bit = |has: fn(f32) -> bool| {
                row.iter().enumerate().fold(0u16, |bits, (i, &v)| bits | u16::from(has(v)) << i)
            };
            (bit(|v| v < 0.0), bit(|v| v >= 0.0))
        };
        (0..BLOCK_EDGE.pow(D as u32 - 1)).filter_map(move |row| {
            let first = (row & 7) + (row >> 3) * EDGE;
            // A cell with a node that was not observed has neither sign everywhere.
            let (mut any_inside, mut any_free, mut all) = (0, 0, u16::MAX);
            for c in 0..1usize << (D - 1) {
                let (inside, free) = bits(first + (c & 1) + (c >> 1) * EDGE);
                any_inside |= inside | inside >> 1;
                any_free |= free | free >> 1;
                all &= (inside | free) & (inside | free) >> 1;
            }
            let active = (any_inside & any_free & all) as u8;
            (active != 0).then_some(Row { row, active })
        })
    }

    /// Values at the corners of a cell, x fastest.
    #[inline]
    pub(super) fn corners(&self, x: usize, row: usize) -> [f32; 8] {
        let first = x + EDGE * ((row & 7) + (row >> 3) * EDGE);
        let at = |c: usize| first + (c & 1) + EDGE * ((c >> 1 & 1) + EDGE * (c >> 2));
        std::array::from_fn(|c| if c >> D == 0 { self.values[at(c)] } else { 0.0 })
    }
}
