//! The squared distance transform of seeds in bricks.

use super::outputs::{Output, line_order, needed};
use super::pass::Pass;
use super::search::{RowSearch, Source};
use super::stage::{Input, Stage, inputs, reachable};
use crate::geom::BlockKey;
use crate::parallel;

/// The least over seeds of `f(p)` and of what the way to `p` costs by `search`, in squared cells, for all cells of the
/// bricks of `outputs`: exact wherever it is not beyond the brick's budget, too large or infinite there. Bricks in the
/// order of lines along the last axis, cells x fastest; `solved` has the last word on each. `seeds` ascending; passes fill
/// only bricks that are `wanted`.
///
/// Pass by pass along x, y, z *(Saito & Toriwaki 1994)*. The passes before the last run slab by slab of the last axis,
/// so that only what the last pass reads is held for the whole map.
pub(crate) fn squared_distances<B: Source, const D: usize>(
    search: impl RowSearch + Send,
    seeds: &[Input<B, D>],
    outputs: Vec<Output<D>>,
    wanted: impl Fn(&BlockKey<D>) -> bool + Sync + Send,
    solved: impl Fn(BlockKey<D>, &mut [f32]) + Sync + Send,
) -> Stage<D> {
    let last = D - 1;
    let outputs = outputs_of_passes(outputs);
    let slabs: Vec<_> = seeds.chunk_by(|a, b| a.key.0[last] == b.key.0[last]).collect();
    let mut stages: Vec<Stage<D>> = slabs.iter().map(|_| Stage::default()).collect();
    parallel::for_each(slabs.into_iter().zip(&mut stages), Stage::default, |(slab, stage), spare| {
        let z = slab[0].key.0[last];
        for axis in 0..last {
            let all = &outputs[axis];
            let from = all.partition_point(|r| r.key.0[last] < z);
            let to = all.partition_point(|r| r.key.0[last] <= z);
            let here: Vec<_> = all[from..to].iter().filter(|r| wanted(&r.key)).copied().collect();
            std::mem::swap(stage, spare);
            match axis {
                0 => fill(axis, search, slab, &here, stage),
                _ => fill(axis, search, &inputs([&*spare], axis), &here, stage),
            }
        }
    });
    let all = &outputs[last];
    let mut stage = Stage::default();
    stage.hold(all, false);
    let pass = Pass { axis: last, inputs: &inputs(&stages, last), outputs: all, known: &[], to: last };
    pass.run(search, stage.planes_mut(), solved);
    stage
}

/// The bricks that each pass fills, sorted by lines along its axis: the last one all of the map's, the ones before
/// what is needed behind them.
fn outputs_of_passes<const D: usize>(mut bricks: Vec<Output<D>>) -> Vec<Vec<Output<D>>> {
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
fn fill<B: Source, const D: usize>(
    axis: usize,
    search: impl RowSearch,
    inputs: &[Input<B, D>],
    outputs: &[Output<D>],
    stage: &mut Stage<D>,
) {
    let outputs = reachable(inputs, outputs, axis);
    stage.hold(&outputs, false);
    let pass = Pass { axis, inputs, outputs: &outputs, known: &[], to: axis + 1 };
    pass.run(search, stage.planes_mut(), |_, _| {});
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::DistanceBrick;
    use crate::field::esdf::transform::cell_rule::CellRule;
    use crate::field::esdf::transform::seeds::SeedMap;
    use crate::geom::Lattice;
    use crate::store::Bricks;

    /// A floor of rooms of 4 m with walls of 20 cm, 12 x 8 x 3.2 m in cells of 5 cm; `band`: only bricks near a surface.
    fn rooms(band: bool) -> Bricks<crate::cell::SignedDistance, 3> {
        let lattice = Lattice::new([0.0; 3], 0.05);
        let distance = |[x, y, z]: [f64; 3]| {
            let off = |v: f64| ((v + 2.0).rem_euclid(4.0) - 2.0).abs() - 0.1;
            off(x).min(off(y)).min(z - 0.1).min(3.1 - z)
        };
        let mut store = Bricks::new(lattice);
        for key in (0..30 * 20 * 8).map(|i| BlockKey([i % 30, i / 30 % 20, i / 600])) {
            let truth: Vec<f64> = (0..512).map(|i| distance(lattice.center(key.cell(i)))).collect();
            if band && truth.iter().all(|d| d.abs() >= 0.15) {
                continue;
            }
            let distances: Vec<f32> = truth.iter().map(|d| d.clamp(-0.15, 0.15) as f32).collect();
            let weights: Vec<f32> = truth.iter().map(|d| f32::from(u8::from(*d > -0.15))).collect();
            store.insert(key, DistanceBrick::from_parts(&distances, &weights).unwrap()).unwrap();
        }
        store
    }

    /// Bricks that all passes fill, over those of as many passes over the map's bricks alone.
    fn overhead(band: bool, max_distance: f32) -> f64 {
        let store = rooms(band);
        let limit = (max_distance / 0.05).powi(2);
        let rule = CellRule::band(0.5, 1.5, 0.05, limit);
        let survey = SeedMap::of(&store, &rule);
        let outputs = outputs_of_passes(survey.bricks.clone());
        let seeds: Vec<_> = survey.seeds().map(|(key, source)| Input { key, source }).collect();
        let stage = |bricks: Vec<Output<3>>| {
            let mut stage = Stage::default();
            stage.hold(&bricks, false);
            stage
        };
        let first = stage(reachable(&seeds, &outputs[0], 0));
        let second = stage(reachable(&inputs([&first], 1), &outputs[1], 1));
        (first.keys.len() + second.keys.len() + outputs[2].len()) as f64 / (3 * outputs[2].len()) as f64
    }

    /// Tiles with a halo of 20 cells fill, all passes together, 2.8 times the map's cells with tiles of 32 cells and 1.75
    /// times with tiles of 64, were every tile full: `(t (t + 40)^2 + t^2 (t + 40) + t^3) / 3 t^3`.
    #[test]
    fn little_is_filled_beside_the_map() {
        for (band, max_distance, most) in
            [(false, 1.0, 1.35), (true, 1.0, 1.6), (true, 5.0, 1.6), (false, 0.3, 1.2)]
        {
            let overhead = overhead(band, max_distance);
            println!("band {band}, {max_distance} m: {overhead:.2}");
            assert!((0.5..most).contains(&overhead), "{overhead}");
        }
    }
}
