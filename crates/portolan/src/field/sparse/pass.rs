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

/// A brick's values from the pass before.
#[derive(Clone, Copy)]
pub(super) struct Input<'a, const D: usize> {
    pub(super) key: BlockKey<D>,
    values: &'a [f32],
}

/// Position of cell `i` of a brick in the layout of a pass along `axis`.
pub(super) fn layout<const D: usize>(axis: usize, i: usize) -> usize {
    let digit = |k: usize| (i >> (3 * k)) & 7;
    let others = (0..D).filter(|&k| k != axis);
    others.chain([axis]).enumerate().map(|(place, k)| digit(k) << (3 * place)).sum()
}

/// The bricks of several levels, sorted by lines along `axis`.
pub(super) fn inputs<const D: usize>(levels: &[Level<D>], axis: usize) -> Vec<Input<'_, D>> {
    let bricks = levels.iter().flat_map(|l| l.keys.iter().zip(l.values.chunks_exact(block_cells::<D>())));
    let mut inputs: Vec<_> = bricks.map(|(&key, values)| Input { key, values }).collect();
    inputs.sort_unstable_by_key(|i| line_order(&i.key, axis));
    inputs
}

/// Lines along `axis` of `outputs`, each with the inputs on it (which may be none). Both sorted by lines.
fn lines<'i, 'v, 'o, const D: usize>(
    mut inputs: &'i [Input<'v, D>],
    outputs: &'o [Reach<D>],
    axis: usize,
) -> impl Iterator<Item = (&'i [Input<'v, D>], &'o [Reach<D>])> {
    outputs.chunk_by(move |a, b| same_line(&a.key, &b.key, axis)).map(move |line| {
        let first = line_order(&line[0].key, axis);
        let before = inputs.partition_point(|i| line_order(&i.key, axis)[..D - 1] < first[..D - 1]);
        let here = inputs[before..].iter().take_while(|i| same_line(&i.key, &line[0].key, axis)).count();
        let (on_line, rest) = inputs[before..].split_at(here);
        inputs = rest;
        (on_line, line)
    })
}

/// The outputs that have an input within their reach, in the same order.
pub(super) fn reachable<const D: usize>(
    inputs: &[Input<'_, D>],
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
/// budget reaches; infinity where there is none. In the layout of the next pass.
///
/// Lines are shared out to all cores with the feature `parallel`; every value is computed by itself.
pub(super) fn pass<const D: usize>(
    axis: usize,
    inputs: &[Input<'_, D>],
    outputs: &[Reach<D>],
    values: &mut [f32],
) {
    let next = (axis + 1).min(D - 1);
    let mut places = vec![0u16; block_cells::<D>()];
    for i in 0..block_cells::<D>() {
        let from = layout::<D>(axis, i);
        let (row, lane) = (from / LINES[D], from % LINES[D]);
        places[layout::<D>(next, i)] = ((lane / LANES * BLOCK_EDGE + row) * LANES + lane % LANES) as u16;
    }
    let mut tasks = Vec::new();
    let mut rest = values;
    for (inputs, outputs) in lines(inputs, outputs, axis) {
        let (here, behind) = std::mem::take(&mut rest).split_at_mut(outputs.len() * block_cells::<D>());
        rest = behind;
        tasks.push(Line { axis, inputs, outputs, values: here });
    }
    for_each(tasks, Scratch::default, |line, scratch| line.solve(&places, scratch));
}

/// Lines of cells that go through a brick, by dimension.
const LINES: [usize; 4] = [0, 1, BLOCK_EDGE, BLOCK_EDGE * BLOCK_EDGE];

/// One line of bricks.
struct Line<'a, const D: usize> {
    axis: usize,
    inputs: &'a [Input<'a, D>],
    outputs: &'a [Reach<D>],
    values: &'a mut [f32],
}

#[derive(Default)]
struct Scratch {
    /// Panels of rows of a run of bricks.
    rows: Vec<Row>,
    /// Eight rows of each panel.
    solved: Vec<Row>,
}

impl<const D: usize> Line<'_, D> {
    fn solve(self, places: &[u16], scratch: &mut Scratch) {
        let cells = block_cells::<D>();
        let at = |key: &BlockKey<D>| key.0[self.axis];
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
            let rows = (last.max(at(&highest.key)) - start + 1) as usize * BLOCK_EDGE;
            gather(run.iter().map(|i| ((at(&i.key) - start) as usize, i.values)), rows, LINES[D], scratch);
            let solved = self.values[from * cells..to * cells].chunks_exact_mut(cells);
            for (output, values) in outputs.iter().zip(solved) {
                let reach = output.budget.sqrt() as usize;
                let row = (at(&output.key) - start) as usize * BLOCK_EDGE;
                min_plus(&scratch.rows, rows, row, reach, &mut scratch.solved);
                let solved = scratch.solved.as_flattened();
                for (value, &place) in values.iter_mut().zip(places) {
                    *value = solved[place as usize];
                }
            }
        }
        self.values[done * cells..].fill(f32::INFINITY);
    }
}

/// Puts the values of bricks, each at its position on the line, into panels of rows.
fn gather<'a>(
    bricks: impl Iterator<Item = (usize, &'a [f32])>,
    rows: usize,
    lines: usize,
    scratch: &mut Scratch,
) {
    let panels = lines.div_ceil(LANES);
    // Lanes without a line are done at once.
    let blank: Row = std::array::from_fn(|lane| if lane < lines { f32::INFINITY } else { 0.0 });
    scratch.rows.clear();
    scratch.rows.resize(panels * rows, blank);
    scratch.solved.resize(panels * BLOCK_EDGE, blank);
    for (at, values) in bricks {
        for (r, row) in values.chunks_exact(lines).enumerate() {
            for (panel, lanes) in row.chunks(LANES).enumerate() {
                scratch.rows[panel * rows + at * BLOCK_EDGE + r][..lanes.len()].copy_from_slice(lanes);
            }
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
    tasks.into_par_iter().for_each_init(scratch, |scratch, task| work(task, scratch));
}

/// Every task by itself.
#[cfg(not(feature = "parallel"))]
pub(super) fn for_each<T: Send, S>(
    tasks: Vec<T>,
    scratch: impl Fn() -> S + Sync + Send,
    work: impl Fn(T, &mut S) + Sync + Send,
) {
    let mut scratch = scratch();
    tasks.into_iter().for_each(|task| work(task, &mut scratch));
}
