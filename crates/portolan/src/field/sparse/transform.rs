//! The squared distance transform of seeds in bricks.

use super::pass::{Input, Level, for_each, inputs, pass, reachable};
use super::reach::{Reach, line_order, needed};
use super::seeds::Seeds;
use crate::geom::block_cells;

/// `min over seeds p of |q - p|^2 + f(p)`, in squared cells, for all cells of the bricks of `seeds`: exact wherever it
/// is not beyond the brick's budget, too large or infinite there. Bricks in the order of lines along the last axis,
/// cells x fastest.
///
/// Pass by pass along x, y, z *(Saito & Toriwaki 1994)*. The passes before the last run slab by slab of the last axis,
/// so that only what the last pass reads is held for the whole map.
pub(super) fn squared_distances<const D: usize>(seeds: Seeds<D>) -> Level<D> {
    let last = D - 1;
    let Seeds { seeds, mut bricks } = seeds;
    bricks.sort_unstable_by_key(|r| line_order(&r.key, last));
    let outputs = outputs_of_passes(bricks);
    let seeds = [seeds];
    let seeds = inputs(&seeds, 0);
    let slabs: Vec<_> = seeds.chunk_by(|a, b| a.key.0[last] == b.key.0[last]).collect();
    let mut solved: Vec<Level<D>> = slabs.iter().map(|_| Level::default()).collect();
    for_each(
        slabs.into_iter().zip(&mut solved).collect(),
        || (),
        |(slab, solved), ()| {
            let z = slab[0].key.0[last];
            for axis in 0..last {
                let all = &outputs[axis];
                let from = all.partition_point(|r| r.key.0[last] < z);
                let to = all.partition_point(|r| r.key.0[last] <= z);
                let filled = match axis {
                    0 => fill(axis, slab, &all[from..to]),
                    _ => fill(axis, &inputs(std::slice::from_ref(solved), axis), &all[from..to]),
                };
                *solved = filled;
            }
        },
    );
    let all = &outputs[last];
    let mut level = Level {
        keys: all.iter().map(|r| r.key).collect(),
        values: vec![0.0; all.len() * block_cells::<D>()],
    };
    pass(last, &inputs(&solved, last), all, &mut level.values);
    level
}

/// The bricks that each pass fills, sorted by lines along its axis: the last one all of the map's, the ones before
/// what is needed behind them.
fn outputs_of_passes<const D: usize>(bricks: Vec<Reach<D>>) -> Vec<Vec<Reach<D>>> {
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
fn fill<const D: usize>(axis: usize, inputs: &[Input<'_, D>], outputs: &[Reach<D>]) -> Level<D> {
    let outputs = reachable(inputs, outputs, axis);
    let mut values = vec![0.0; outputs.len() * block_cells::<D>()];
    pass(axis, inputs, &outputs, &mut values);
    Level { keys: outputs.into_iter().map(|r| r.key).collect(), values }
}
