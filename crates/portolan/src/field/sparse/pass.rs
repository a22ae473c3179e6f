//! One pass of the separable transform over lines of bricks.

use super::min_plus::{LANES, Row, min_plus};
use super::reach::{Reach, bricks_within, line_order, same_line};
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};

/// Values of some bricks, brick by brick, in the layout of the next pass: inside a brick the pass's axis is the
/// slowest and the others follow in their order, so that lines lie side by side. Behind the last pass that is the
/// order of every brick, x fastest.
#[derive(Default)]
pub(super) struct Level<const D: usize> {
    pub(super) keys: Vec<BlockKey<D>>,
    pub(super) values: Vec<f32>,
}

/// The values of one brick, in the layout of the pass that reads them.
pub(super) trait Source: Sync {
    fn values<'s>(&'s self, scratch: &'s mut [Vec<f32>; 2]) -> &'s [f32];
}

impl Source for &[f32] {
    fn values<'s>(&'s self, _: &'s mut [Vec<f32>; 2]) -> &'s [f32] {
        self
    }
}

/// A brick that a pass reads.
#[derive(Clone, Copy)]
pub(super) struct Input<S, const D: usize> {
    pub(super) key: BlockKey<D>,
    pub(super) source: S,
}

/// Position of cell `i` of a brick in the layout of a pass along `axis`.
pub(super) fn layout<const D: usize>(axis: usize, i: usize) -> usize {
    let digit = |k: usize| (i >> (3 * k)) & 7;
    let others = (0..D).filter(|&k| k != axis);
    others.chain([axis]).enumerate().map(|(place, k)| digit(k) << (3 * place)).sum()
}

/// The bricks of several levels, sorted by lines along `axis`.
pub(super) fn inputs<'a, const D: usize>(
    levels: impl IntoIterator<Item = &'a Level<D>>,
    axis: usize,
) -> Vec<Input<&'a [f32], D>> {
    let bricks = |l: &'a Level<D>| l.keys.iter().zip(l.values.chunks_exact(block_cells::<D>()));
    let mut inputs: Vec<_> =
        levels.into_iter().flat_map(bricks).map(|(&key, source)| Input { key, source }).collect();
    inputs.sort_unstable_by_key(|i| line_order(&i.key, axis));
    inputs
}

/// Lines along `axis` of `outputs`, each with the inputs on it (which may be none). Both sorted by lines.
fn lines<'i, 'o, S, const D: usize>(
    mut inputs: &'i [Input<S, D>],
    outputs: &'o [Reach<D>],
    axis: usize,
) -> impl Iterator<Item = (&'i [Input<S, D>], &'o [Reach<D>])> {
    outputs.chunk_by(move |a, b| same_line(&a.key, &b.key, axis)).map(move |line| {
        let first = line_order(&line[0].key, axis);
        let before = inputs.iter().take_while(|i| line_order(&i.key, axis)[..D - 1] < first[..D - 1]).count();
        let here = inputs[before..].iter().take_while(|i| same_line(&i.key, &line[0].key, axis)).count();
        let (on_line, rest) = inputs[before..].split_at(here);
        inputs = rest;
        (on_line, line)
    })
}

/// The outputs that have an input within their reach, in the same order.
pub(super) fn reachable<S, const D: usize>(
    inputs: &[Input<S, D>],
    outputs: &[Reach<D>],
    axis: usize,
) -> Vec<Reach<D>> {
    let mut reachable = Vec::with_capacity(outputs.len());
    for (inputs, line) in lines(inputs, outputs, axis) {
        let mut next = 0;
        reachable.extend(line.iter().filter(|reach| {
            let at = reach.key.0[axis];
            next += inputs[next..].iter().take_while(|i| i.key.0[axis] < at).count();
            let near = &inputs[next.saturating_sub(1)..inputs.len().min(next + 1)];
            near.iter().any(|i| (i.key.0[axis] - at).abs() <= bricks_within(reach.budget))
        }));
    }
    reachable
}

/// Fills the bricks of `outputs`: the least of the inputs on a cell's line plus squared offset, as far as the brick's
/// budget reaches; infinity where there is none. In the layout of the next pass; `filled` has the last word on each.
///
/// Lines are shared out to all cores with the feature `parallel`; every value is computed by itself.
pub(super) fn pass<S: Source, const D: usize>(
    axis: usize,
    inputs: &[Input<S, D>],
    outputs: &[Reach<D>],
    values: &mut [f32],
    filled: impl Fn(BlockKey<D>, &mut [f32]) + Sync + Send,
) {
    let rows = Rows::of::<D>(axis);
    let mut tasks = Vec::new();
    let mut rest = values;
    for (inputs, outputs) in lines(inputs, outputs, axis) {
        let (here, behind) = std::mem::take(&mut rest).split_at_mut(outputs.len() * block_cells::<D>());
        rest = behind;
        tasks.push(Line { axis, inputs, outputs, values: here });
    }
    for_each(tasks, Scratch::default, |mut line, scratch| {
        line.solve(&rows, scratch);
        let bricks = line.values.chunks_exact_mut(block_cells::<D>());
        line.outputs.iter().zip(bricks).for_each(|(output, values)| filled(output.key, values));
    });
}

/// How rows of lines lie in a brick.
struct Rows {
    /// Lines through a brick.
    lines: usize,
    panels: usize,
    /// Where each cell of the next pass's layout is among the solved rows; of chunks of eight, unless they are torn
    /// apart.
    places: Vec<u16>,
    torn: bool,
}

impl Rows {
    fn of<const D: usize>(axis: usize) -> Self {
        let cells = block_cells::<D>();
        let lines = cells / BLOCK_EDGE;
        let next = (axis + 1).min(D - 1);
        let mut places = vec![0; cells];
        for i in 0..cells {
            let from = layout::<D>(axis, i);
            let (row, lane) = (from / lines, from % lines);
            places[layout::<D>(next, i)] = ((lane / LANES * BLOCK_EDGE + row) * LANES + lane % LANES) as u16;
        }
        // Only the pass along x has to turn rows into columns; behind it x stays the fastest.
        let torn = axis == 0;
        if !torn {
            places = places.into_iter().step_by(BLOCK_EDGE).collect();
        }
        Self { lines, panels: lines.div_ceil(LANES), places, torn }
    }

    /// A brick's values from its solved rows.
    fn collect(&self, solved: &[Row], values: &mut [f32]) {
        let solved = solved.as_flattened();
        if self.torn {
            for (value, &place) in values.iter_mut().zip(&self.places) {
                *value = solved[place as usize];
            }
        } else {
            for (chunk, &place) in values.chunks_exact_mut(BLOCK_EDGE).zip(&self.places) {
                chunk.copy_from_slice(&solved[place as usize..][..BLOCK_EDGE]);
            }
        }
    }
}

/// One line of bricks.
struct Line<'a, S, const D: usize> {
    axis: usize,
    inputs: &'a [Input<S, D>],
    outputs: &'a [Reach<D>],
    values: &'a mut [f32],
}

#[derive(Default)]
struct Scratch {
    /// Panels of rows of a run of bricks.
    rows: Vec<Row>,
    /// Eight rows of each panel.
    solved: Vec<Row>,
    /// Of a source.
    brick: [Vec<f32>; 2],
}

impl<S: Source, const D: usize> Line<'_, S, D> {
    fn solve(&mut self, rows: &Rows, scratch: &mut Scratch) {
        let cells = block_cells::<D>();
        let axis = self.axis;
        let at = |key: &BlockKey<D>| key.0[axis];
        let far = self.outputs.iter().map(|o| bricks_within(o.budget)).max().unwrap_or(0);
        let mut done = 0;
        // Runs of inputs that no output sees two of: lines may be long and nearly empty.
        for run in self.inputs.chunk_by(|a, b| at(&b.key) - at(&a.key) <= 2 * far) {
            let (first, last) = (at(&run[0].key), at(&run[run.len() - 1].key));
            let from = self.outputs.partition_point(|o| at(&o.key) < first - far);
            let to = self.outputs.partition_point(|o| at(&o.key) <= last + far);
            self.values[done * cells..from * cells].fill(f32::INFINITY);
            done = to;
            let outputs = &self.outputs[from..to];
            let (Some(lowest), Some(highest)) = (outputs.first(), outputs.last()) else { continue };
            let start = first.min(at(&lowest.key));
            let length = (last.max(at(&highest.key)) - start + 1) as usize * BLOCK_EDGE;
            scratch.clear(rows, length);
            for input in run {
                let row = (at(&input.key) - start) as usize * BLOCK_EDGE;
                scratch.put(&input.source, row, rows, length);
            }
            let values = self.values[from * cells..to * cells].chunks_exact_mut(cells);
            for (output, values) in outputs.iter().zip(values) {
                let reach = output.budget.sqrt() as usize;
                let row = (at(&output.key) - start) as usize * BLOCK_EDGE;
                min_plus(&scratch.rows, length, row, reach, &mut scratch.solved);
                rows.collect(&scratch.solved, values);
            }
        }
        self.values[done * cells..].fill(f32::INFINITY);
    }
}

impl Scratch {
    /// Rows for `length` cells of the lines, empty.
    fn clear(&mut self, rows: &Rows, length: usize) {
        // Lanes without a line are done at once.
        let blank: Row = std::array::from_fn(|lane| if lane < rows.lines { f32::INFINITY } else { 0.0 });
        self.rows.clear();
        self.rows.resize(rows.panels * length, blank);
        self.solved.resize(rows.panels * BLOCK_EDGE, blank);
    }

    /// Puts a brick's values into the panels, from row `first` on.
    fn put(&mut self, source: &impl Source, first: usize, rows: &Rows, length: usize) {
        let Self { rows: to, brick, .. } = self;
        for (r, row) in source.values(brick).chunks_exact(rows.lines).enumerate() {
            let (whole, rest) = row.as_chunks::<LANES>();
            for (panel, lanes) in whole.iter().enumerate() {
                to[panel * length + first + r] = *lanes;
            }
            // In the plane eight lines go through a brick.
            to[(rows.panels - 1) * length + first + r][..rest.len()].copy_from_slice(rest);
        }
    }
}

/// Every task by itself, on all cores with the feature `parallel`.
#[cfg(feature = "parallel")]
pub(super) fn for_each<T: Send, S>(
    tasks: Vec<T>,
    scratch: impl Fn() -> S + Sync + Send,
    work: impl Fn(T, &mut S) + Sync + Send,
) {
    use rayon::prelude::*;
    if rayon::current_num_threads() == 1 {
        return one_by_one(tasks, scratch, work);
    }
    tasks.into_par_iter().for_each_init(scratch, |scratch, task| work(task, scratch));
}

/// Every task by itself.
#[cfg(not(feature = "parallel"))]
pub(super) fn for_each<T, S>(tasks: Vec<T>, scratch: impl Fn() -> S, work: impl Fn(T, &mut S)) {
    one_by_one(tasks, scratch, work);
}

fn one_by_one<T, S>(tasks: Vec<T>, scratch: impl Fn() -> S, work: impl Fn(T, &mut S)) {
    let mut scratch = scratch();
    tasks.into_iter().for_each(|task| work(task, &mut scratch));
}
