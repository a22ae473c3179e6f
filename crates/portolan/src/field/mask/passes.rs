//! The passes along the axes, slab by slab.

use super::cell::MaskCell;
use super::integer::Integer;
use super::panel::{Panel, solve};
use super::scan::scan;
use crate::parallel;

/// Columns that one task of the last pass solves.
const COLUMNS: usize = 512;

/// What all passes share.
pub(super) struct Plan<L, const D: usize> {
    pub(super) shape: [usize; D],
    /// Rows on each side that may hold what is within the bound.
    pub(super) reach: usize,
    /// Squared distances beyond are infinite.
    pub(super) limit: u32,
    /// `k^2` of every offset along the longest axis.
    pub(super) squares: Vec<L>,
}

/// What a pass reads: rows of `stride` values one behind the other, and which cells they come from (empty: not asked).
#[derive(Clone, Copy)]
struct Source<'a, L> {
    value: &'a [L],
    nearest: &'a [u32],
    stride: usize,
}

/// Where some columns of a pass go, row by row.
struct Target<'a, T> {
    /// The first column.
    column: usize,
    value: Vec<&'a mut [T]>,
    nearest: Vec<&'a mut [u32]>,
}

/// Buffers of one worker.
struct Scratch<L, const N: usize> {
    panel: Panel<L, N>,
    value: Vec<L>,
    nearest: Vec<u32>,
}

impl<L: Integer, const D: usize> Plan<L, D> {
    /// Squared distances, changed by `last`, and cells; `nearest` may be empty.
    pub(super) fn run<M: MaskCell, const N: usize>(
        &self,
        mask: &[M],
        distance: &mut [f32],
        nearest: &mut [u32],
        last: impl Fn(f32) -> f32 + Sync + Send,
    ) {
        let finish = |value: L| {
            let sq = value.wide();
            // Below 2^31: the signed conversion is the cheap one.
            if sq <= self.limit { last(sq as i32 as f32) } else { f32::INFINITY }
        };
        let (before, rows) = (&self.shape[..D - 1], self.shape[D - 1]);
        let slab: usize = before.iter().product();
        if D == 1 {
            let mut value = vec![L::ZERO; rows];
            scan(mask, &self.squares, &mut value, nearest);
            distance.iter_mut().zip(&value).for_each(|(to, &value)| *to = finish(value));
        } else {
            let mut value = vec![L::ZERO; mask.len()];
            let mut cells = vec![0; nearest.len()];
            self.slabs::<M, N>(mask, slab, &mut value, &mut cells);
            let source = Source { value: &value, nearest: &cells, stride: slab };
            let scratch = || Panel::<L, N>::new(rows, !cells.is_empty());
            parallel::for_each(targets(distance, nearest, slab).into_iter(), scratch, |mut target, panel| {
                self.columns(source, &mut target, panel, finish);
            });
        }
        for (cell, distance) in nearest.iter_mut().zip(&*distance) {
            *cell = if *distance < f32::INFINITY { *cell } else { u32::MAX };
        }
    }

    /// All passes but the last, slab by slab of the last axis.
    fn slabs<M: MaskCell, const N: usize>(
        &self,
        mask: &[M],
        slab: usize,
        value: &mut [L],
        nearest: &mut [u32],
    ) {
        let nx = self.shape[0];
        let with_nearest = !nearest.is_empty();
        let mut cells = nearest.chunks_mut(slab);
        let tasks = mask
            .chunks(slab)
            .zip(value.chunks_mut(slab))
            .map(|(mask, value)| (mask, value, cells.next().unwrap_or_default()));
        let scratch = || Scratch::<L, N> {
            panel: Panel::new(if D == 3 { self.shape[1] } else { 0 }, with_nearest),
            value: vec![L::ZERO; if D == 3 { slab } else { 0 }],
            nearest: vec![0; if D == 3 && with_nearest { slab } else { 0 }],
        };
        parallel::for_each(tasks, scratch, |(mask, value, nearest), scratch| {
            if D == 2 {
                return scan(mask, &self.squares, value, nearest);
            }
            let mut cells = scratch.nearest.chunks_mut(nx);
            for (mask, value) in mask.chunks(nx).zip(scratch.value.chunks_mut(nx)) {
                scan(mask, &self.squares, value, cells.next().unwrap_or_default());
            }
            let source = Source { value: &scratch.value, nearest: &scratch.nearest, stride: nx };
            let mut target = Target {
                column: 0,
                value: value.chunks_mut(nx).collect(),
                nearest: nearest.chunks_mut(nx).collect(),
            };
            self.columns(source, &mut target, &mut scratch.panel, |value| value);
        });
    }

    /// One pass over some columns, a panel at a time.
    fn columns<T, const N: usize>(
        &self,
        source: Source<L>,
        target: &mut Target<T>,
        panel: &mut Panel<L, N>,
        finish: impl Fn(L) -> T,
    ) {
        let Source { value, nearest, stride } = source;
        let width = target.value.first().map_or(0, |row| row.len());
        for column in (0..width).step_by(N) {
            let lanes = N.min(width - column);
            let from = target.column + column;
            load(value, stride, from, lanes, &mut panel.rows);
            panel.rows.iter_mut().for_each(|row| row[lanes..].fill(L::FAR));
            load(nearest, stride, from, lanes, &mut panel.cells);
            solve(panel, self.reach, &self.squares, stride);
            for (best, to) in panel.best.iter().zip(&mut target.value) {
                let to = &mut to[column..column + lanes];
                to.iter_mut().zip(best).for_each(|(to, &best)| *to = finish(best));
            }
            for (cells, to) in panel.cells.iter().zip(&mut target.nearest) {
                to[column..column + lanes].copy_from_slice(&cells[..lanes]);
            }
        }
    }
}

/// Some columns of rows, `stride` apart, into the first lanes of a panel.
fn load<T: Copy, const N: usize>(
    from: &[T],
    stride: usize,
    column: usize,
    lanes: usize,
    rows: &mut [[T; N]],
) {
    for (row, from) in rows.iter_mut().zip(from.chunks(stride)) {
        match from[column..].first_chunk::<N>() {
            Some(whole) if lanes == N => *row = *whole,
            _ => row[..lanes].copy_from_slice(&from[column..column + lanes]),
        }
    }
}

/// Blocks of columns, with their rows.
fn targets<'a>(distance: &'a mut [f32], nearest: &'a mut [u32], stride: usize) -> Vec<Target<'a, f32>> {
    let block = |column| Target { column, value: Vec::new(), nearest: Vec::new() };
    let mut blocks: Vec<Target<f32>> = (0..stride).step_by(COLUMNS).map(block).collect();
    for row in distance.chunks_mut(stride) {
        blocks.iter_mut().zip(row.chunks_mut(COLUMNS)).for_each(|(block, part)| block.value.push(part));
    }
    for row in nearest.chunks_mut(stride) {
        blocks.iter_mut().zip(row.chunks_mut(COLUMNS)).for_each(|(block, part)| block.nearest.push(part));
    }
    blocks
}
