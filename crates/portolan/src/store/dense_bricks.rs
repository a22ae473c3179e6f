//! An array of signed distances in bricks.

use super::{Bricks, Dense, Store};
use crate::cell::{DistanceBrick, SignedDistance};
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};

/// The cells of an array in bricks, for what is derived from bricks; those without an observed cell are left out.
/// O(cells).
impl<const D: usize> From<&Dense<SignedDistance, D>> for Bricks<SignedDistance, D> {
    fn from(dense: &Dense<SignedDistance, D>) -> Self {
        let shape = dense.grid().shape;
        let mut bricks = Bricks::new(*dense.lattice());
        if dense.grid().is_empty() {
            return bricks;
        }
        let counts: [usize; D] = std::array::from_fn(|k| shape[k].div_ceil(BLOCK_EDGE));
        let planes = dense.planes();
        let (mut distance, mut weight) = (vec![0.0; block_cells::<D>()], vec![0.0; block_cells::<D>()]);
        for n in 0..counts.iter().product() {
            let mut rest = n;
            let key = BlockKey(std::array::from_fn(|k| {
                let at = rest % counts[k];
                rest /= counts[k];
                at as i32
            }));
            let first = key.first_cell();
            weight.fill(0.0);
            let width = (shape[0] - first[0] as usize).min(BLOCK_EDGE);
            for row in 0..block_cells::<D>() / BLOCK_EDGE {
                let cell = key.cell(row * BLOCK_EDGE);
                if let Some(from) = dense.grid().index(cell) {
                    let to = row * BLOCK_EDGE..row * BLOCK_EDGE + width;
                    distance[to.clone()].copy_from_slice(&planes.distances()[from..from + width]);
                    weight[to].copy_from_slice(&planes.weights()[from..from + width]);
                }
            }
            if weight.iter().any(|w| *w > 0.0)
                && let Some(brick) = DistanceBrick::from_parts(&distance, &weight)
            {
                // There is no limit.
                let _ = bricks.insert(key, brick);
            }
        }
        bricks
    }
}
