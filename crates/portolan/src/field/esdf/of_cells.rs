//! Distances to obstacle cells alone, in a world of which nothing else is known.

use super::field::Esdf;
use super::obstacles::ObstacleCells;
use super::settings::{EsdfMethod, EsdfSettings};
use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::{BLOCK_EDGE, BlockKey, Lattice, block_cells};
use crate::store::{Bricks, StoreFull};
use std::collections::BTreeSet;

impl<const D: usize> Esdf<D> {
    /// Distances (meters, never negative) to the centers of cells of which a map says that something is there, in all bricks
    /// within `max_distance` of one: of points without rays, which have no surface and know no free space.
    ///
    /// **It says nothing of what is free**: every cell in reach counts as looked at, which none was, so that only what
    /// [`UnknownSpace::Optimistic`](crate::field::UnknownSpace::Optimistic) asks for means something. Always by the accurate
    /// method. O(bricks within reach); no more than `memory` bytes of cells.
    ///
    /// # Errors
    /// [`StoreFull`] where they would take more.
    ///
    /// # Panics
    /// Where `max_distance` is not positive, or the cells are of another lattice.
    pub fn of_obstacles(
        lattice: Lattice<D>,
        cells: &ObstacleCells<D>,
        settings: &EsdfSettings,
        memory: usize,
    ) -> Result<Self, StoreFull> {
        let settings = EsdfSettings { method: EsdfMethod::Accurate, unknown: false, ..*settings };
        let reach = settings.reach_cells(lattice.resolution);
        let bricks = (reach / BLOCK_EDGE as f64).ceil() as i32;
        let around = (2 * bricks as usize + 1).pow(D as u32);
        let bytes = block_cells::<D>() * size_of::<f32>();
        let mut keys = BTreeSet::new();
        for key in cells.keys() {
            for n in 0..around {
                let edge = 2 * bricks as usize + 1;
                keys.insert(BlockKey(std::array::from_fn(|k| {
                    key.0[k].saturating_add((n / edge.pow(k as u32) % edge) as i32 - bricks)
                })));
            }
            if keys.len().saturating_mul(bytes) > memory {
                return Err(StoreFull { limit: memory, bytes: keys.len() * bytes });
            }
        }
        let mut store = Bricks::<SignedDistance, D>::new(lattice);
        let tau = lattice.resolution as f32;
        let planes = (vec![tau; block_cells::<D>()], vec![1.0; block_cells::<D>()]);
        // One brick, shared by all; positive weights and finite distances are always one.
        if let Some(brick) = DistanceBrick::from_parts(&planes.0, &planes.1) {
            for key in keys {
                store.insert(key, brick.clone())?;
            }
        }
        Ok(Self::with_obstacles(&store, cells, &settings))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Cell, LogOdds8, Planes};
    use crate::geom::vector::distance;
    use crate::testing::Random;

    #[test]
    fn distances_are_those_to_the_nearest_center() {
        let lattice = Lattice::new([0.3, -0.2, 5.0], 0.1);
        let mut map = Bricks::<LogOdds8, 3>::new(lattice);
        let mut rng = Random(7);
        let mut centers = Vec::new();
        for _ in 0..12 {
            let cell: [i32; 3] = std::array::from_fn(|_| (rng.unit() * 40.0) as i32 - 20);
            let key = BlockKey::of_cell(cell);
            let whole = <LogOdds8 as Cell>::Brick::unobserved(block_cells::<3>());
            let mut brick = map.brick(key).cloned().unwrap_or(whole);
            brick.set(BlockKey::offset(cell), Some(LogOdds8(40)));
            map.insert(key, brick).unwrap();
            centers.push(lattice.center(cell));
        }
        let cells = ObstacleCells::of_occupancy(&map);
        let settings = EsdfSettings { max_distance: 1.0, ..EsdfSettings::default() };
        let field = Esdf::of_obstacles(lattice, &cells, &settings, 1 << 30).unwrap();
        let mut known = 0;
        for _ in 0..2000 {
            let cell: [i32; 3] = std::array::from_fn(|_| (rng.unit() * 60.0) as i32 - 30);
            let p = lattice.center(cell);
            let nearest = centers.iter().map(|&c| distance(c, p)).fold(f64::INFINITY, f64::min);
            let answer = field.cell(cell);
            if let Some(d) = answer.known() {
                known += 1;
                assert!((f64::from(d) - nearest).abs() < 1e-5, "{cell:?}: {d} {nearest}");
            } else {
                assert!(nearest > 0.99, "{cell:?}: {answer:?} {nearest}");
            }
        }
        assert!(known > 300, "{known}");
        assert!(Esdf::of_obstacles(lattice, &cells, &settings, 10_000).is_err());
    }
}
