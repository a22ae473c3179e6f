//! The bricks between two passes.

use super::outputs::{Output, bricks_within, line_order, same_line};
use super::planes_mut::PlanesMut;
use super::search::Planes;
use crate::geom::{BlockKey, block_cells};

/// Values of some bricks, brick by brick, in the layout of the next pass: inside a brick the pass's axis is the
/// slowest and the others follow in their order, so that lines lie side by side. Behind the last pass that is the
/// order of every brick, x fastest.
#[derive(Default)]
pub(crate) struct Stage<const D: usize> {
    pub(crate) keys: Vec<BlockKey<D>>,
    pub(crate) values: Vec<f32>,
    /// Empty where none are carried.
    pub(crate) features: Vec<u32>,
}

/// A brick that a pass reads.
#[derive(Clone, Copy)]
pub(crate) struct Input<S, const D: usize> {
    pub(crate) key: BlockKey<D>,
    pub(crate) source: S,
}

impl<const D: usize> Stage<D> {
    /// The planes of the brick at a place.
    pub(crate) fn planes(&self, n: usize) -> Planes<'_> {
        let cells = n * block_cells::<D>()..(n + 1) * block_cells::<D>();
        Planes { features: self.features.get(cells.clone()).unwrap_or_default(), values: &self.values[cells] }
    }

    /// Where a pass fills them.
    pub(super) fn planes_mut(&mut self) -> PlanesMut<'_> {
        PlanesMut { values: &mut self.values, features: &mut self.features }
    }

    /// Makes room for bricks; whatever is there from before is to be overwritten.
    pub(crate) fn hold(&mut self, bricks: &[Output<D>], features: bool) {
        self.keys.clear();
        self.keys.extend(bricks.iter().map(|r| r.key));
        let cells = bricks.len() * block_cells::<D>();
        if self.values.capacity() < cells {
            // Zeroed by the system, where growing would write them.
            self.values = vec![0.0; cells];
        }
        self.values.resize(cells, 0.0);
        let features = if features { cells } else { 0 };
        if self.features.capacity() < features {
            self.features = vec![0; features];
        }
        self.features.resize(features, 0);
    }
}

/// The bricks of several stages, sorted by lines along `axis`.
pub(crate) fn inputs<'a, const D: usize>(
    stages: impl IntoIterator<Item = &'a Stage<D>>,
    axis: usize,
) -> Vec<Input<Planes<'a>, D>> {
    let bricks = |l: &'a Stage<D>| {
        l.keys.iter().enumerate().map(|(n, &key)| Input { key, source: l.planes(n) }).collect::<Vec<_>>()
    };
    let mut inputs: Vec<_> = stages.into_iter().flat_map(bricks).collect();
    inputs.sort_unstable_by_key(|i| line_order(&i.key, axis));
    inputs
}

/// Lines along `axis` of `outputs`, each with the inputs on it (which may be none). Both sorted by lines.
pub(crate) fn lines<'i, 'o, S, const D: usize>(
    mut inputs: &'i [Input<S, D>],
    outputs: &'o [Output<D>],
    axis: usize,
) -> impl Iterator<Item = (&'i [Input<S, D>], &'o [Output<D>])> {
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
pub(crate) fn reachable<S, const D: usize>(
    inputs: &[Input<S, D>],
    outputs: &[Output<D>],
    axis: usize,
) -> Vec<Output<D>> {
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
