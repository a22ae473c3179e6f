//! The passes along the axes, slab by slab.

use super::cell::Cells;
use super::number::Number;
use super::panel::{Panel, solve};
use crate::parallel;

/// Columns that one task of the last pass solves.
const COLUMNS: usize = 512;

/// What all passes share.
pub(super) struct Plan<L, const D: usize> {
    pub(super) shape: [usize; D],
    /// Spacing along each axis, of which the least is 1.
    pub(super) unit: [f64; D],
    /// Cells on each side along each axis that may hold what is within the bound.
    pub(super) reach: [usize; D],
    /// Squared distances beyond are infinite.
    pub(super) limit: L,
    /// The squared length of every offset along each axis.
    pub(super) squares: [Vec<L>; D],
    /// Threads at most.
    pub(super) workers: usize,
}

/// What becomes of squared distances in units of the least spacing.
#[derive(Clone, Copy)]
pub(super) struct Last {
    /// Distances, not squared.
    pub(super) root: bool,
    /// The least spacing.
    pub(super) scale: f64,
}

impl Last {
    /// Writes results; beyond `limit` they are infinite.
    #[inline(always)]
    fn write<L: Number>(self, limit: L, from: &[L], to: &mut [f32]) {
        let scale = self.scale;
        match (self.root, scale == 1.0) {
            (false, true) => put(limit, from, to, |sq| sq),
            (true, true) => put(limit, from, to, f32::sqrt),
            (false, false) => put(limit, from, to, |sq| (f64::from(sq) * (scale * scale)) as f32),
            (true, false) => put(limit, from, to, |sq| (f64::from(sq).sqrt() * scale) as f32),
        }
    }
}

#[inline(always)]
fn put<L: Number>(limit: L, from: &[L], to: &mut [f32], last: impl Fn(f32) -> f32) {
    for (to, &value) in to.iter_mut().zip(from) {
        *to = if value <= limit { last(value.real()) } else { f32::INFINITY };
    }
}

/// What a pass reads: rows of `stride` values one behind the other, and which cells they come from (empty: not asked).
#[derive(Clone, Copy)]
struct Source<'a, L> {
    axis: usize,
    /// The cell of the first value.
    first: usize,
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

impl<L: Number, const D: usize> Plan<L, D> {
    /// Squared distances, changed by `last`, and cells; `nearest` may be empty.
    pub(super) fn run<C: Cells, const N: usize>(
        &self,
        cells: C,
        distance: &mut [f32],
        nearest: &mut [u32],
        last: Last,
    ) {
        let finish = |from: &[L], to: &mut [f32]| last.write(self.limit, from, to);
        let (before, rows) = (&self.shape[..D - 1], self.shape[D - 1]);
        let slab: usize = before.iter().product();
        if D == 1 {
            let mut value = vec![L::ZERO; rows];
            cells.scan(0, &self.squares[0], &mut value, nearest);
            finish(&value, distance);
        } else {
            let mut value = vec![L::ZERO; cells.len()];
            let mut from = vec![0; nearest.len()];
            self.slabs::<C, N>(cells, slab, &mut value, &mut from);
            let source = Source { axis: D - 1, first: 0, value: &value, nearest: &from, stride: slab };
            let scratch = || Panel::<L, N>::new(rows, !from.is_empty());
            let targets = targets(distance, nearest, slab).into_iter();
            parallel::for_each_on(self.workers, targets, scratch, |mut target, panel| {
                self.columns(cells, source, &mut target, panel, finish);
            });
        }
        for (cell, distance) in nearest.iter_mut().zip(&*distance) {
            *cell = if *distance < f32::INFINITY { *cell } else { u32::MAX };
        }
    }

    /// All passes but the last, slab by slab of the last axis.
    fn slabs<C: Cells, const N: usize>(&self, cells: C, slab: usize, value: &mut [L], nearest: &mut [u32]) {
        let nx = self.shape[0];
        let with_nearest = !nearest.is_empty();
        let mut from = nearest.chunks_mut(slab);
        let tasks = value
            .chunks_mut(slab)
            .enumerate()
            .map(|(i, value)| (i * slab, value, from.next().unwrap_or_default()));
        let scratch = || Scratch::<L, N> {
            panel: Panel::new(if D == 3 { self.shape[1] } else { 0 }, with_nearest),
            value: vec![L::ZERO; if D == 3 { slab } else { 0 }],
            nearest: vec![0; if D == 3 && with_nearest { slab } else { 0 }],
        };
        parallel::for_each_on(self.workers, tasks, scratch, |(first, value, nearest), scratch| {
            if D == 2 {
                return cells.scan(first, &self.squares[0], value, nearest);
            }
            let mut from = scratch.nearest.chunks_mut(nx);
            for (y, value) in scratch.value.chunks_mut(nx).enumerate() {
                cells.scan(first + y * nx, &self.squares[0], value, from.next().unwrap_or_default());
            }
            let source =
                Source { axis: 1, first, value: &scratch.value, nearest: &scratch.nearest, stride: nx };
            let mut target = Target {
                column: 0,
                value: value.chunks_mut(nx).collect(),
                nearest: nearest.chunks_mut(nx).collect(),
            };
            self.columns(cells, source, &mut target, &mut scratch.panel, |from, to| to.copy_from_slice(from));
        });
    }

    /// One pass over some columns, a panel at a time.
    fn columns<C: Cells, T, const N: usize>(
        &self,
        cells: C,
        source: Source<L>,
        target: &mut Target<T>,
        panel: &mut Panel<L, N>,
        finish: impl Fn(&[L], &mut [T]),
    ) {
        let Source { axis, first, value, nearest, stride } = source;
        let width = target.value.first().map_or(0, |row| row.len());
        for column in (0..width).step_by(N) {
            let lanes = N.min(width - column);
            let from = target.column + column;
            load(value, stride, from, lanes, &mut panel.rows);
            panel.rows.iter_mut().for_each(|row| row[lanes..].fill(L::FAR));
            load(nearest, stride, from, lanes, &mut panel.cells);
            solve(panel, self.reach[axis], &self.squares[axis], stride);
            if cells.has_ends() {
                cells.ends(first + from, stride, self.unit[axis], &mut panel.best);
            }
            for (best, to) in panel.best.iter().zip(&mut target.value) {
                finish(&best[..lanes], &mut to[column..column + lanes]);
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
