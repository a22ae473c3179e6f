//! Clearance from a surface that is only known as well as it was measured.

use crate::answer::Answer;
use crate::cell::SignedDistance;
use crate::field::{Clearance, ClearanceField, Esdf, UnknownSpace};
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};
use crate::store::{Bricks, Store};

/// How much of the surface's own uncertainty is taken off a clearance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceNoise {
    /// So many standard deviations; not negative.
    pub sigmas: f64,
    /// Standard deviation of one observation of weight 1 (meters); not negative.
    pub sigma_of_one: f64,
}

impl SurfaceNoise {
    /// What is taken off where the filter holds a weight: `sigmas * sigma_of_one / sqrt(W)` (meters), the fused estimate's
    /// deviation if observations err independently. What they have in common (poses, grazing looks) is not in it.
    pub fn margin(&self, weight: f32) -> f64 {
        self.sigmas * self.sigma_of_one / f64::from(weight).sqrt()
    }
}

impl<const D: usize> Esdf<D> {
    /// [`ClearanceField::clearance`] with the lower bound moved in by the margin of the least certain piece of surface that
    /// could be the nearest, by the weights of the map that the field was made of. Had every crossing of the surface moved by
    /// no more than its margin, `lower` would still hold; the upper bound and unknown space are as they were.
    ///
    /// O(cells of the bricks within the upper bound): not for inner loops.
    pub fn clearance_less_noise(
        &self,
        map: &Bricks<SignedDistance, D>,
        p_world: [f64; D],
        unknown: UnknownSpace,
        noise: &SurfaceNoise,
    ) -> Answer<Clearance> {
        let less = |c: Clearance| {
            // What lies further than this cannot come nearer than the upper bound.
            let reach = c.upper.min(f64::from(self.max_distance()));
            let worst = noise.margin(self.min_weight().max(f32::MIN_POSITIVE));
            let weight = least_weight(map, p_world, reach + worst, self.min_weight());
            let margin = weight.map_or(0.0, |w| noise.margin(w));
            Clearance { lower: (c.lower - margin).max(0.0), ..c }
        };
        self.clearance(p_world, unknown).map(less)
    }
}

/// The least weight among the cells beside which the surface runs, in the bricks within `reach` (meters) of a point.
fn least_weight<const D: usize>(
    map: &Bricks<SignedDistance, D>,
    p_world: [f64; D],
    reach: f64,
    min_weight: f32,
) -> Option<f32> {
    let edge = BLOCK_EDGE as f64 * map.lattice().resolution;
    let near = |key: &BlockKey<D>| {
        let low = map.lattice().corner(key.first_cell());
        let gap = |k: usize| (low[k] - p_world[k]).max(p_world[k] - low[k] - edge).max(0.0);
        // A crossing may lie a cell beyond the brick of the cell that it starts at.
        (0..D).map(|k| gap(k) * gap(k)).sum::<f64>().sqrt() <= reach + map.lattice().resolution
    };
    let mut least: Option<f32> = None;
    for (key, _) in map.bricks_by_age().filter(|(key, _)| near(key)) {
        for cell in (0..block_cells::<D>()).map(|i| key.cell(i)) {
            let observed = |cell| map.cell(cell).filter(|c: &SignedDistance| c.weight >= min_weight);
            let Some(here) = observed(cell) else { continue };
            for axis in 0..D {
                let mut next = cell;
                next[axis] += 1;
                if let Some(there) = observed(next)
                    && (here.distance < 0.0) != (there.distance < 0.0)
                {
                    let weight = here.weight.min(there.weight);
                    least = Some(least.map_or(weight, |l| l.min(weight)));
                }
            }
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::EsdfSettings;
    use crate::geom::Lattice;
    use crate::testing::brick;

    /// Free space between a wall at x = 0.53 that was seen four times and one at x = 3.07 that was seen once.
    fn between_two_walls<const D: usize>() {
        let lattice = Lattice::new([0.0; D], 0.1);
        let mut map = Bricks::new(lattice);
        for x in 0..5 {
            let key = BlockKey(std::array::from_fn(|k| if k == 0 { x } else { 0 }));
            let at = |i| lattice.center(key.cell(i))[0];
            let distance = |i| (at(i) - 0.53).min(3.07 - at(i)) as f32;
            let brick = brick::<D>(|i| Some((distance(i), if at(i) < 1.8 { 4.0 } else { 1.0 })));
            map.insert(key, brick).unwrap();
        }
        let esdf =
            Esdf::of(&map, &EsdfSettings { min_weight: Some(0.5), max_distance: 3.0, ..Default::default() });
        let noise = SurfaceNoise { sigmas: 3.0, sigma_of_one: 0.02 };
        let ask = |x: f64| {
            let p = std::array::from_fn(|k| if k == 0 { x } else { 0.41 });
            let plain = esdf.clearance(p, UnknownSpace::Optimistic).known().unwrap();
            let less = esdf.clearance_less_noise(&map, p, UnknownSpace::Optimistic, &noise).known().unwrap();
            assert_eq!((less.upper, less.inside), (plain.upper, plain.inside));
            plain.lower - less.lower
        };
        // Near the first wall the second is out of reach; near the second only that counts.
        assert!((ask(0.9) - 0.03).abs() < 1e-9);
        assert!((ask(2.8) - 0.06).abs() < 1e-9);
        // Half way the less certain of both does, and a bound is never negative.
        assert!((ask(1.8) - 0.06).abs() < 1e-9);
        let p = std::array::from_fn(|k| if k == 0 { 0.54 } else { 0.41 });
        let at_wall = esdf.clearance_less_noise(&map, p, UnknownSpace::Optimistic, &noise);
        assert_eq!(at_wall.known().unwrap().lower, 0.0);
    }

    #[test]
    fn uncertain_walls_are_nearer_2d_and_3d() {
        between_two_walls::<2>();
        between_two_walls::<3>();
    }
}
