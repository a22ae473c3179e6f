//! What seeds the transform, and how far each brick needs to look for it.

use super::bounds::{Witness, bounds, furthest_of_cells};
use super::cell_rule::{CellRule, seeds, survey};
use super::layout::layout;
use super::outputs::Output;
use super::search::{FromCenters, Source};
use super::squared::squared_distances;
use super::stage::{Input, Stage};
use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::{BlockKey, block_cells};
use crate::parallel;
use crate::store::Bricks;

/// The seeds of one brick of the map, read when they are needed.
#[derive(Clone, Copy)]
pub(crate) struct Seeds<'a> {
    brick: &'a DistanceBrick,
    rule: &'a CellRule,
    /// Place of every cell in the layout of the first pass.
    places: &'a [u16],
}

impl Source for Seeds<'_> {
    fn values<'s>(&'s self, scratch: &'s mut [Vec<f32>; 2]) -> &'s [f32] {
        let [plain, laid_out] = scratch;
        plain.resize(self.places.len(), 0.0);
        laid_out.resize(self.places.len(), 0.0);
        seeds(self.brick.distances(), self.brick.weights(), self.rule, plain);
        for (&value, &place) in plain.iter().zip(self.places) {
            laid_out[place as usize] = value;
        }
        laid_out
    }
}

/// Every observed cell within the band is a seed, `f = (D / r)^2`.
pub(crate) struct SeedMap<'a, const D: usize> {
    store: &'a Bricks<SignedDistance, D>,
    rule: &'a CellRule,
    places: Vec<u16>,
    /// The bricks with a seed, ascending.
    seeded: Vec<BlockKey<D>>,
    /// The bricks with an observed cell, ascending, and how far each must look, in squared cells.
    pub(crate) bricks: Vec<Output<D>>,
}

impl<'a, const D: usize> SeedMap<'a, D> {
    pub(crate) fn of(store: &'a Bricks<SignedDistance, D>, rule: &'a CellRule) -> Self {
        let places = (0..block_cells::<D>()).map(|i| layout::<D>(0, i) as u16).collect();
        let farthest = furthest_of_cells::<D>();
        let keys = store.keys();
        let mut found: Vec<(bool, Option<Witness<D>>)> = vec![(false, None); keys.len()];
        // A brick is too little for a task.
        let tasks = keys.chunks(SURVEYED).zip(found.chunks_mut(SURVEYED));
        parallel::each(tasks, |(keys, found)| {
            for (&key, found) in keys.iter().zip(found) {
                if let Some(brick) = store.brick(key) {
                    *found = look(key, brick, &farthest, rule);
                }
            }
        });
        let (mut observed, mut witnesses, mut seeded) = (Vec::new(), Vec::new(), Vec::new());
        for (key, (_, witness)) in keys.into_iter().zip(found).filter(|(_, found)| found.0) {
            observed.push(key);
            seeded.extend(witness.map(|_| key));
            witnesses.push(witness);
        }
        let bounds = bounds(&observed, witnesses, rule.limit);
        let bricks = observed.into_iter().zip(bounds).map(|(key, budget)| Output { key, budget });
        let bricks = bricks.collect();
        Self { store, rule, places, seeded, bricks }
    }

    /// The bricks with a seed, ascending: sorted by lines along x.
    pub(crate) fn seeds(&self) -> impl Iterator<Item = (BlockKey<D>, Seeds<'_>)> {
        self.seeded.iter().filter_map(|&key| {
            let brick = self.store.brick(key)?;
            Some((key, Seeds { brick, rule: self.rule, places: &self.places }))
        })
    }

    /// `min over seeds p of |q - p|^2 + f(p)`, in squared cells, for all bricks with an observed cell.
    pub(crate) fn solve(&self, solved: impl Fn(BlockKey<D>, &mut [f32]) + Sync + Send) -> Stage<D> {
        let seeds: Vec<_> = self.seeds().map(|(key, source)| Input { key, source }).collect();
        squared_distances(FromCenters, &seeds, self.bricks.clone(), |_| true, solved)
    }
}

/// Bricks looked at in one task.
const SURVEYED: usize = 256;

/// Whether a brick has an observed cell, and the seed of it that is the least far from all of its cells.
fn look<const D: usize>(
    key: BlockKey<D>,
    brick: &DistanceBrick,
    farthest: &[f32],
    rule: &CellRule,
) -> (bool, Option<Witness<D>>) {
    let (observed, best) = survey(brick.distances(), brick.weights(), farthest, rule);
    if best == f32::INFINITY {
        return (observed, None);
    }
    let mut values = vec![0.0; farthest.len()];
    seeds(brick.distances(), brick.weights(), rule, &mut values);
    let at = values.iter().zip(farthest).position(|(value, far)| value + far == best);
    (observed, at.map(|i| Witness { cell: key.cell(i), offset: [0.0; D], value: values[i] }))
}
