//! The squared distance transform of seeds in bricks.

use super::pass::{Input, Level, Source, for_each, inputs, pass, reachable};
use super::reach::{Reach, line_order, needed};
use super::seeds::Survey;
use crate::geom::{BlockKey, block_cells};

/// `min over seeds p of |q - p|^2 + f(p)`, in squared cells, for all cells of the bricks of a survey: exact wherever it
/// is not beyond the brick's budget, too large or infinite there. Bricks in the order of lines along the last axis,
/// cells x fastest; `solved` has the last word on each.
///
/// Pass by pass along x, y, z *(Saito & Toriwaki 1994)*. The passes before the last run slab by slab of the last axis,
/// so that only what the last pass reads is held for the whole map.
pub(super) fn squared_distances<const D: usize>(
    survey: &Survey<'_, D>,
    solved: impl Fn(BlockKey<D>, &mut [f32]) + Sync + Send,
) -> Level<D> {
    let last = D - 1;
    let outputs = outputs_of_passes(survey.bricks.clone());
    let seeds: Vec<_> = survey.seeds().map(|(key, source)| Input { key, source }).collect();
    let slabs: Vec<_> = seeds.chunk_by(|a, b| a.key.0[last] == b.key.0[last]).collect();
    let mut levels: Vec<Level<D>> = slabs.iter().map(|_| Level::default()).collect();
    for_each(slabs.into_iter().zip(&mut levels).collect(), Level::default, |(slab, level), spare| {
        let z = slab[0].key.0[last];
        for axis in 0..last {
            let all = &outputs[axis];
            let from = all.partition_point(|r| r.key.0[last] < z);
            let to = all.partition_point(|r| r.key.0[last] <= z);
            std::mem::swap(level, spare);
            match axis {
                0 => fill(axis, slab, &all[from..to], level),
                _ => fill(axis, &inputs([&*spare], axis), &all[from..to], level),
            }
        }
    });
    let all = &outputs[last];
    let mut level = Level {
        keys: all.iter().map(|r| r.key).collect(),
        values: vec![0.0; all.len() * block_cells::<D>()],
    };
    pass(last, &inputs(&levels, last), all, &mut level.values, solved);
    level
}

/// The bricks that each pass fills, sorted by lines along its axis: the last one all of the map's, the ones before
/// what is needed behind them.
fn outputs_of_passes<const D: usize>(mut bricks: Vec<Reach<D>>) -> Vec<Vec<Reach<D>>> {
    bricks.sort_unstable_by_key(|r| line_order(&r.key, D - 1));
    let mut outputs = vec![bricks];
    for axis in (1..D).rev() {
        let mut before = needed(&outputs[outputs.len() - 1], axis);
        before.sort_unstable_by_key(|r| line_order(&r.key, axis - 1));
        outputs.push(before);
    }
    outputs.reverse();
    outputs
}

/// The bricks that the inputs reach, filled.
fn fill<S: Source, const D: usize>(
    axis: usize,
    inputs: &[Input<S, D>],
    outputs: &[Reach<D>],
    level: &mut Level<D>,
) {
    let outputs = reachable(inputs, outputs, axis);
    level.keys.clear();
    level.keys.extend(outputs.iter().map(|r| r.key));
    // Whatever is there from another slab is overwritten.
    level.values.resize(outputs.len() * block_cells::<D>(), 0.0);
    pass(axis, inputs, &outputs, &mut level.values, |_, _| {});
}
