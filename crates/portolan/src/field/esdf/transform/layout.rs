//! How the lines of a pass lie in a brick.

use super::min_plus::LANES;
use crate::geom::{BLOCK_EDGE, block_cells};
use multiversion::multiversion;

/// Position of cell `i` of a brick in the layout of a pass along `axis`: that axis is the slowest, the others follow in
/// their order, so that lines lie side by side.
pub(crate) fn layout<const D: usize>(axis: usize, i: usize) -> usize {
    let digit = |k: usize| (i >> (3 * k)) & 7;
    let others = (0..D).filter(|&k| k != axis);
    others.chain([axis]).enumerate().map(|(place, k)| digit(k) << (3 * place)).sum()
}

/// Where the cells of a brick are among the rows of panels that a pass reads and finds.
pub(crate) struct Layout {
    /// Lines through a brick.
    pub(super) lines: usize,
    pub(super) panels: usize,
    /// Where each cell of the outputs' layout is among the found rows; of chunks of eight, unless they are torn
    /// apart.
    places: Vec<u16>,
    way: Way,
}

/// How eight cells that follow each other in the outputs lie among the found rows.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    /// Side by side in a row.
    Row,
    /// One below the other, in a lane.
    Lane,
    /// In lanes of several panels.
    Torn,
}

impl Layout {
    /// For a pass along `axis` whose outputs have the layout of a pass along `to`.
    pub(super) fn of<const D: usize>(axis: usize, to: usize) -> Self {
        let cells = block_cells::<D>();
        let lines = cells / BLOCK_EDGE;
        let mut places = vec![0; cells];
        for i in 0..cells {
            let from = layout::<D>(axis, i);
            let (row, lane) = (from / lines, from % lines);
            places[layout::<D>(to, i)] = ((lane / LANES * BLOCK_EDGE + row) * LANES + lane % LANES) as u16;
        }
        let way = match places[1].wrapping_sub(places[0]) {
            1 => Way::Row,
            step if usize::from(step) == LANES => Way::Lane,
            _ => Way::Torn,
        };
        if way != Way::Torn {
            places = places.into_iter().step_by(BLOCK_EDGE).collect();
        }
        Self { lines, panels: lines.div_ceil(LANES), places, way }
    }

    /// A brick's plane from its found rows.
    pub(super) fn collect<T: Copy>(&self, found: &[[T; LANES]], plane: &mut [T]) {
        let flat = found.as_flattened();
        let (chunks, _) = plane.as_chunks_mut::<BLOCK_EDGE>();
        match self.way {
            Way::Row => {
                for (chunk, &place) in chunks.iter_mut().zip(&self.places) {
                    chunk.copy_from_slice(&flat[place as usize..][..BLOCK_EDGE]);
                }
            }
            Way::Lane => turn(found, &self.places, chunks),
            Way::Torn => {
                for (value, &place) in plane.iter_mut().zip(&self.places) {
                    *value = flat[place as usize];
                }
            }
        }
    }

    /// Puts a brick's plane into panels of `length` rows, from row `first` on.
    pub(super) fn spread<T: Copy>(&self, plane: &[T], first: usize, length: usize, to: &mut [[T; LANES]]) {
        for (r, row) in plane.chunks_exact(self.lines).enumerate() {
            let (whole, rest) = row.as_chunks::<LANES>();
            for (panel, lanes) in whole.iter().enumerate() {
                to[panel * length + first + r] = *lanes;
            }
            // In 2-D eight lines go through a brick.
            to[(self.panels - 1) * length + first + r][..rest.len()].copy_from_slice(rest);
        }
    }
}

/// Chunks of eight from the lanes in which they stand.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn turn<T: Copy>(found: &[[T; LANES]], places: &[u16], chunks: &mut [[T; BLOCK_EDGE]]) {
    let (panels, _) = found.as_chunks::<BLOCK_EDGE>();
    for (chunk, &place) in chunks.iter_mut().zip(places) {
        let rows = &panels[place as usize / (BLOCK_EDGE * LANES)];
        let lane = place as usize % LANES;
        *chunk = std::array::from_fn(|r| rows[r][lane]);
    }
}
