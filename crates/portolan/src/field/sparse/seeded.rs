//! The fields of cells: seeded within a band, and of a mask.

use super::TOGETHER;
use super::kernels::{CellRule, mask, sign};
use super::level::Level;
use super::planes::{EsdfBrick, Sides};
use super::seeds::Survey;
use super::settings::EsdfMethod;
use super::sparse_esdf::SparseEsdf;
use crate::cell::SignedDistance;
use crate::geom::block_cells;
use crate::parallel;
use crate::store::Bricks;
use std::sync::{Arc, OnceLock};

impl<const D: usize> SparseEsdf<D> {
    /// Solves the whole map by one of the methods whose seeds are cells.
    pub(super) fn solve_cells(&mut self, store: &Bricks<SignedDistance, D>) {
        let resolution = self.lattice.resolution as f32;
        let min_weight = self.settings.min_weight;
        let reach = self.settings.reach_cells(self.lattice.resolution);
        let level = match self.settings.method {
            EsdfMethod::Seeded { band_cells } => {
                let rule = CellRule::band(min_weight, band_cells, resolution, (reach * reach) as f32);
                Survey::of(store, &rule).solve(|key, values| {
                    if let Some(brick) = store.brick(key) {
                        sign(values, brick.distances(), brick.weights(), &rule);
                    }
                })
            }
            EsdfMethod::Mask | EsdfMethod::Accurate => {
                let limit = (reach + 0.5).powi(2) as f32;
                let [occupied, free] = CellRule::sides(min_weight, resolution, limit);
                let to_occupied = Survey::of(store, &occupied).solve(|_, _| {});
                let mut to_free = Survey::of(store, &free).solve(|_, _| {});
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
        self.hold(store, &level);
        if self.settings.unknown {
            self.solve_unknown(store, &self.keys());
        }
    }

    fn hold(&mut self, store: &Bricks<SignedDistance, D>, level: &Level<D>) {
        self.clear();
        let planes: Vec<_> = level.keys.iter().zip(level.values.chunks_exact(block_cells::<D>())).collect();
        let min_weight = self.settings.min_weight;
        let bricks = parallel::map(&planes, TOGETHER, |&(&key, plane)| {
            let sides = store.brick(key).map_or(Sides::default(), |brick| Sides::of(brick, min_weight));
            EsdfBrick { distance: Arc::new(OnceLock::from(Box::from(plane))), ..EsdfBrick::new(sides) }
        });
        for (&key, brick) in level.keys.iter().zip(bricks) {
            self.add(key, brick);
        }
    }
}
