//! The squared distance transform of seeds in bricks.

use super::level::{Input, Level, inputs, reachable};
use super::pass::{Pass, Planes, Search, Source};
use super::reach::{Reach, line_order, needed};
use crate::geom::BlockKey;
use crate::parallel;

/// The least over seeds of `f(p)` and of what the way to `p` costs by `search`, in squared cells, for all cells of the
/// bricks of `outputs`: exact wherever it is not beyond the brick's budget, too large or infinite there. Bricks in the
/// order of lines along the last axis, cells x fastest; `solved` has the last word on each. `seeds` ascending; passes fill
/// only bricks that are `wanted`.
///
/// Pass by pass along x, y, z *(Saito & Toriwaki 1994)*. The passes before the last run slab by slab of the last axis,
/// so that only what the last pass reads is held for the whole map.
pub(super) fn squared_distances<B: Source, S, const D: usize>(
    search: S,
    seeds: &[Input<B, D>],
    outputs: Vec<Reach<D>>,
    wanted: impl Fn(&BlockKey<D>) -> bool + Sync + Send,
    solved: impl Fn(BlockKey<D>, &mut [f32]) + Sync + Send,
) -> Level<D>
where
    S: Search<B, D> + for<'a> Search<Planes<'a>, D> + Copy + Send,
{
    let last = D - 1;
    let outputs = outputs_of_passes(outputs);
    let slabs: Vec<_> = seeds.chunk_by(|a, b| a.key.0[last] == b.key.0[last]).collect();
    let mut levels: Vec<Level<D>> = slabs.iter().map(|_| Level::default()).collect();
    parallel::for_each(slabs.into_iter().zip(&mut levels), Level::default, |(slab, level), spare| {
        let z = slab[0].key.0[last];
        for axis in 0..last {
            let all = &outputs[axis];
            let from = all.partition_point(|r| r.key.0[last] < z);
            let to = all.partition_point(|r| r.key.0[last] <= z);
            let here: Vec<_> = all[from..to].iter().filter(|r| wanted(&r.key)).copied().collect();
            std::mem::swap(level, spare);
            match axis {
                0 => fill(axis, search, slab, &here, level),
                _ => fill(axis, search, &inputs([&*spare], axis), &here, level),
            }
        }
    });
    let all = &outputs[last];
    let mut level = Level::default();
    level.hold(all, false);
    let pass = Pass { axis: last, inputs: &inputs(&levels, last), outputs: all, known: &[], to: last };
    pass.run(search, &mut level.values, &mut [], |_, key, values, _| solved(key, values));
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
fn fill<B: Sync, const D: usize>(
    axis: usize,
    search: impl Search<B, D>,
    inputs: &[Input<B, D>],
    outputs: &[Reach<D>],
    level: &mut Level<D>,
) {
    let outputs = reachable(inputs, outputs, axis);
    level.hold(&outputs, false);
    let pass = Pass { axis, inputs, outputs: &outputs, known: &[], to: axis + 1 };
    pass.run(search, &mut level.values, &mut [], |_, _, _, _| {});
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::DistanceBrick;
    use crate::field::sparse::kernels::CellRule;
    use crate::field::sparse::seeds::Survey;
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
        let survey = Survey::of(&store, &rule);
        let outputs = outputs_of_passes(survey.bricks.clone());
        let seeds: Vec<_> = survey.seeds().map(|(key, source)| Input { key, source }).collect();
        let level = |bricks: Vec<Reach<3>>| {
            let mut level = Level::default();
            level.hold(&bricks, false);
            level
        };
        let first = level(reachable(&seeds, &outputs[0], 0));
        let second = level(reachable(&inputs([&first], 1), &outputs[1], 1));
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
