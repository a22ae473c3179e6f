//! The fields of cells: seeded within a band, and of a mask.

use super::TOGETHER;
use super::bricks::{EsdfBrick, Sides};
use super::field::Esdf;
use super::settings::EsdfMethod;
use super::transform::{CellRule, SeedMap, Stage, mask, sign};
use crate::cell::SignedDistance;
use crate::geom::block_cells;
use crate::parallel;
use crate::store::Bricks;
use std::sync::{Arc, OnceLock};

impl<const D: usize> Esdf<D> {
    /// Solves the whole map by one of the methods whose seeds are cells.
    pub(super) fn solve_cells(&mut self, store: &Bricks<SignedDistance, D>) {
        let resolution = self.lattice.resolution as f32;
        let min_weight = self.min_weight();
        let reach = self.reach_cells();
        let stage = match self.settings().method {
            EsdfMethod::Seeded { band_cells } => {
                let rule = CellRule::band(min_weight, band_cells, resolution, (reach * reach) as f32);
                SeedMap::of(store, &rule).solve(|key, values| {
                    if let Some(brick) = store.brick(key) {
                        sign(values, brick.distances(), brick.weights(), &rule);
                    }
                })
            }
            EsdfMethod::Mask | EsdfMethod::Accurate => {
                let limit = (reach + 0.5).powi(2) as f32;
                let [occupied, free] = CellRule::sides(min_weight, resolution, limit);
                let to_occupied = SeedMap::of(store, &occupied).solve(|_, _| {});
                let mut to_free = SeedMap::of(store, &free).solve(|_, _| {});
                // Both hold all bricks with an observed cell in one order.
                let cells = block_cells::<D>();
                let bricks =
                    to_free.values.chunks_exact_mut(cells).zip(to_occupied.values.chunks_exact(cells));
                for (&key, (to_free, to_occupied)) in to_free.keys.iter().zip(bricks) {
                    if let Some(brick) = store.brick(key) {
                        mask(to_free, to_occupied, brick.distances(), brick.weights(), &free);
                    }
                }
                to_free
            }
        };
        self.epoch = store.epoch();
        self.hold(store, &stage);
        if self.settings().unknown {
            self.solve_unknown(&self.keys());
        }
    }

    fn hold(&mut self, store: &Bricks<SignedDistance, D>, stage: &Stage<D>) {
        self.clear();
        let planes: Vec<_> = stage.keys.iter().zip(stage.values.chunks_exact(block_cells::<D>())).collect();
        let min_weight = self.min_weight();
        let bricks = parallel::map(&planes, TOGETHER, |&(&key, plane)| {
            let sides = store.brick(key).map_or(Sides::default(), |brick| Sides::of(brick, min_weight));
            EsdfBrick { distance: Arc::new(OnceLock::from(Box::from(plane))), ..EsdfBrick::new(sides) }
        });
        for (&key, brick) in stage.keys.iter().zip(bricks) {
            self.add(key, brick);
        }
    }
}
