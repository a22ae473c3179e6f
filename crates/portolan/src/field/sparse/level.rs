//! The bricks between two passes.

use super::pass::Planes;
use super::reach::{Reach, bricks_within, line_order, same_line};
use crate::geom::{BlockKey, block_cells};

/// Values of some bricks, brick by brick, in the layout of the next pass: inside a brick the pass's axis is the
/// slowest and the others follow in their order, so that lines lie side by side. Behind the last pass that is the
/// order of every brick, x fastest.
#[derive(Default)]
pub(super) struct Level<const D: usize> {
    pub(super) keys: Vec<BlockKey<D>>,
    pub(super) values: Vec<f32>,
    /// Empty where none are carried.
    pub(super) words: Vec<u32>,
}

/// A brick that a pass reads.
#[derive(Clone, Copy)]
pub(super) struct Input<S, const D: usize> {
    pub(super) key: BlockKey<D>,
    pub(super) source: S,
}

impl<const D: usize> Level<D> {
    /// The planes of the brick at a place.
    pub(super) fn planes(&self, n: usize) -> Planes<'_> {
        let cells = n * block_cells::<D>()..(n + 1) * block_cells::<D>();
        Planes { words: self.words.get(cells.clone()).unwrap_or_default(), values: &self.values[cells] }
    }

    /// Makes room for bricks; whatever is there from before is to be overwritten.
    pub(super) fn hold(&mut self, bricks: &[Reach<D>], words: bool) {
        self.keys.clear();
        self.keys.extend(bricks.iter().map(|r| r.key));
        let cells = bricks.len() * block_cells::<D>();
        if self.values.capacity() < cells {
            // Zeroed by the system, where growing would write them.
            self.values = vec![0.0; cells];
        }
        self.values.resize(cells, 0.0);
        let words = if words { cells } else { 0 };
        if self.words.capacity() < words {
            self.words = vec![0; words];
        }
        self.words.resize(words, 0);
    }
}

/// The bricks of several levels, sorted by lines along `axis`.
pub(super) fn inputs<'a, const D: usize>(
    levels: impl IntoIterator<Item = &'a Level<D>>,
    axis: usize,
) -> Vec<Input<Planes<'a>, D>> {
    let bricks = |l: &'a Level<D>| {
        l.keys.iter().enumerate().map(|(n, &key)| Input { key, source: l.planes(n) }).collect::<Vec<_>>()
    };
    let mut inputs: Vec<_> = levels.into_iter().flat_map(bricks).collect();
    inputs.sort_unstable_by_key(|i| line_order(&i.key, axis));
    inputs
}

/// Lines along `axis` of `outputs`, each with the inputs on it (which may be none). Both sorted by lines.
pub(super) fn lines<'i, 'o, S, const D: usize>(
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
