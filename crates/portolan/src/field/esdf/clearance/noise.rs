//! Clearance from a surface that is only known as well as it was measured.

use rustc_hash::FxHashMap;

use crate::answer::Answer;
use crate::cell::SignedDistance;
use crate::field::{Clearance, ClearanceField, Esdf, UnknownSpace};
use crate::geom::{BLOCK_EDGE, BlockKey, Lattice, block_cells};
use crate::parallel;
use crate::store::Store;
use crate::uncertainty::SurfaceSigma;

/// How much of the surface's own uncertainty is taken off a clearance: k standard deviations of whatever obstacle is the nearest
/// after that. The largest margins are kept for blocks of 1, 2, 4, .. bricks along each axis, so that those that count are found by
/// looking at a few blocks. Made by [`Esdf::surface_noise`]; about 20 bytes a brick with obstacles. It does not follow a changing
/// map.
#[derive(Clone, Debug)]
pub struct SurfaceNoise<const D: usize> {
    sigmas: f64,
    lattice: Lattice<D>,
    /// The largest margin (meters) of what lies in a block, of blocks of 2^level bricks along each axis.
    levels: Vec<FxHashMap<BlockKey<D>, f64>>,
}

impl<const D: usize> SurfaceNoise<D> {
    /// So many standard deviations, k, are taken off.
    pub fn sigmas(&self) -> f64 {
        self.sigmas
    }

    /// The largest margin (meters) of the obstacles within `reach` (meters) of a point, or a little farther; 0: there are none.
    /// Looks at no more than `4^D` blocks. O(1).
    pub fn margin_within(&self, p_world: [f64; D], reach: f64) -> f64 {
        let resolution = self.lattice.resolution;
        // A crossing may lie a cell beyond the brick of the cell that it starts at.
        let reach = reach + resolution;
        let brick = BLOCK_EDGE as f64 * resolution;
        // `reach` may be infinite.
        let level = (0..self.levels.len()).find(|&level| brick * (1u64 << level) as f64 >= reach);
        let Some(level) = level else { return self.worst() };
        let size = brick * (1u64 << level) as f64;
        let origin = self.lattice.corner([0; D]);
        let block = |v: f64, k: usize| ((v - origin[k]) / size).floor() as i32;
        let low: [i32; D] = std::array::from_fn(|k| block(p_world[k] - reach, k));
        let count: [usize; D] = std::array::from_fn(|k| {
            (i64::from(block(p_world[k] + reach, k)) - i64::from(low[k]) + 1).clamp(1, 4) as usize
        });
        let mut worst = 0.0f64;
        for n in 0..count.iter().product() {
            let mut rest: usize = n;
            let key = std::array::from_fn(|k| {
                let step = rest % count[k];
                rest /= count[k];
                low[k].saturating_add(step as i32)
            });
            worst = worst.max(self.levels[level].get(&BlockKey(key)).copied().unwrap_or(0.0));
        }
        worst
    }

    /// What is left of a lower bound (meters) of the distance from a point to all obstacles if each of them is nearer by its margin:
    /// the least, over all bricks, of the larger of `lower` and the distance to the brick, less the brick's margin. Not negative.
    /// O(log bricks), where few bricks are nearly as near as the nearest.
    pub fn lower_less(&self, p_world: [f64; D], lower: f64) -> f64 {
        let mut least = lower;
        if let Some((level, blocks)) = self.levels.iter().enumerate().next_back() {
            let mut near = [None; 8];
            for (near, (key, margin)) in near.iter_mut().zip(blocks) {
                *near = Some((self.bound(level, *key, *margin, p_world, lower), *key));
            }
            self.descend(level, near, p_world, lower, &mut least);
        }
        least.max(0.0)
    }

    /// Looks at these blocks, those first that may take off the most, and at what is in them.
    fn descend(
        &self,
        level: usize,
        mut blocks: [Option<(f64, BlockKey<D>)>; 8],
        p_world: [f64; D],
        lower: f64,
        least: &mut f64,
    ) {
        blocks.sort_unstable_by(|a, b| {
            let bound = |block: &Option<(f64, BlockKey<D>)>| block.map_or(f64::INFINITY, |(bound, _)| bound);
            bound(a).total_cmp(&bound(b))
        });
        for (bound, key) in blocks.into_iter().flatten() {
            if bound >= *least {
                break;
            }
            let Some(finer) = level.checked_sub(1) else {
                *least = bound;
                break;
            };
            let mut children = [None; 8];
            for (n, child) in children.iter_mut().enumerate().take(1 << D) {
                let key = BlockKey(std::array::from_fn(|k| (key.0[k] << 1) + (n >> k & 1) as i32));
                let margin = self.levels[finer].get(&key);
                *child = margin.map(|margin| (self.bound(finer, key, *margin, p_world, lower), key));
            }
            self.descend(finer, children, p_world, lower, least);
        }
    }

    /// How near anything in a block may be, which is not nearer than `lower` (meters), less the block's margin.
    fn bound(&self, level: usize, key: BlockKey<D>, margin: f64, p_world: [f64; D], lower: f64) -> f64 {
        let resolution = self.lattice.resolution;
        let size = BLOCK_EDGE as f64 * resolution * (1u64 << level) as f64;
        let origin = self.lattice.corner([0; D]);
        // A crossing may lie a cell beyond the brick of the cell that it starts at.
        let gap = |k: usize| {
            let low = origin[k] + f64::from(key.0[k]) * size - p_world[k];
            (low - resolution).max(-low - size - resolution).max(0.0)
        };
        lower.max((0..D).map(|k| gap(k) * gap(k)).sum::<f64>().sqrt()) - margin
    }

    /// The largest margin of all (meters).
    fn worst(&self) -> f64 {
        self.levels.last().map_or(0.0, |blocks| blocks.values().copied().fold(0.0, f64::max))
    }
}

impl<const D: usize> Esdf<D> {
    /// The margins of `sigmas` standard deviations, k, not negative, of this field's obstacles, by the weights of the map that it
    /// was made of: of the cells at both ends of each crossing of the surface, the less certain one counts; of an obstacle that is a
    /// point, its own cell, and where nothing is known of its distance the least certain cell of all. O(cells).
    pub fn surface_noise(
        &self,
        map: &(impl Store<SignedDistance, D> + Sync),
        sigma: &SurfaceSigma,
        sigmas: f64,
    ) -> SurfaceNoise<D> {
        let min_weight = self.min_weight();
        let observed = |cell| map.cell(cell).filter(|c: &SignedDistance| c.weight >= min_weight);
        let least_in = |key: &BlockKey<D>| {
            let mut least = f32::INFINITY;
            for cell in (0..block_cells::<D>()).map(|i| key.cell(i)) {
                let Some(here) = observed(cell) else { continue };
                for axis in 0..D {
                    let mut next = cell;
                    next[axis] = next[axis].saturating_add(1);
                    if let Some(there) = observed(next)
                        && (here.distance < 0.0) != (there.distance < 0.0)
                    {
                        least = least.min(here.weight).min(there.weight);
                    }
                }
            }
            least
        };
        let keys = self.keys();
        let mut weights: FxHashMap<BlockKey<D>, f32> = FxHashMap::default();
        for (key, least) in keys.iter().zip(parallel::map(&keys, 16, least_in)) {
            if least.is_finite() {
                weights.insert(*key, least);
            }
        }
        // Where there are points alone, of which nothing is known, the least that the field believes.
        let least_of_all = weights.values().copied().min_by(f32::total_cmp).unwrap_or(min_weight);
        for (cell, _) in self.point_obstacles() {
            let weight = map.cell(cell).map_or(least_of_all, |c: SignedDistance| c.weight);
            let least = weights.entry(BlockKey::of_cell(cell)).or_insert(f32::INFINITY);
            *least = least.min(weight.max(min_weight));
        }
        let margin = |weight: f32| sigmas * sigma.of(f64::from(weight.max(f32::MIN_POSITIVE)));
        let mut levels: Vec<FxHashMap<BlockKey<D>, f64>> =
            vec![weights.into_iter().map(|(key, weight)| (key, margin(weight))).collect()];
        // Blocks on either side of zero never become one; all others do, for keys have so many bits at most.
        while let Some(last) = levels.last().filter(|last| last.len() > 1 << D) {
            let mut coarser: FxHashMap<BlockKey<D>, f64> = FxHashMap::default();
            for (key, margin) in last {
                let worst = coarser.entry(BlockKey(key.0.map(|v| v >> 1))).or_insert(0.0);
                *worst = worst.max(*margin);
            }
            levels.push(coarser);
        }
        SurfaceNoise { sigmas, lattice: *self.lattice(), levels }
    }

    /// This field with every clearance less what its obstacles are uncertain by. `noise`: of this field.
    pub fn less_noise<'a>(&'a self, noise: &'a SurfaceNoise<D>) -> LessNoise<'a, D> {
        LessNoise { field: self, noise }
    }
}

/// A field whose lower bounds hold even where every piece of its obstacles is k standard deviations nearer than it was measured;
/// upper bounds and unknown space are as they were. Made by [`Esdf::less_noise`]. A clearance costs what the field's does, a
/// pessimistic one twice that.
#[derive(Clone, Copy, Debug)]
pub struct LessNoise<'a, const D: usize> {
    field: &'a Esdf<D>,
    noise: &'a SurfaceNoise<D>,
}

impl<const D: usize> LessNoise<'_, D> {
    fn less(&self, p_world: [f64; D], c: Clearance) -> Clearance {
        Clearance { lower: self.noise.lower_less(p_world, c.lower), ..c }
    }
}

impl<const D: usize> ClearanceField<D> for LessNoise<'_, D> {
    fn clearance(&self, p_world: [f64; D], unknown: UnknownSpace) -> Answer<Clearance> {
        let all = self.field.clearance(p_world, unknown);
        match unknown {
            UnknownSpace::Optimistic => all.map(|c| self.less(p_world, c)),
            // Unknown space does not come nearer.
            UnknownSpace::Pessimistic => all.map(|c| {
                let obstacles = self.field.clearance(p_world, UnknownSpace::Optimistic).value();
                let lower = obstacles.map_or(0.0, |of| self.less(p_world, of).lower);
                Clearance { lower: c.lower.min(lower), ..c }
            }),
        }
    }

    fn distance_and_gradient(&self, p_world: [f64; D]) -> Answer<(f64, [f64; D])> {
        self.field.distance_and_gradient(p_world)
    }

    fn resolution(&self) -> f64 {
        self.field.lattice().resolution
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::EsdfSettings;
    use crate::store::Bricks;
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
        let settings = EsdfSettings { min_weight: Some(0.5), max_distance: 3.0, ..Default::default() };
        let esdf = Esdf::of(&map, &settings);
        let sigma = SurfaceSigma::through([[1.0, 0.02], [100.0, 0.002]]).unwrap();
        let noise = esdf.surface_noise(&map, &sigma, 3.0);
        let ask = |x: f64| {
            let p = std::array::from_fn(|k| if k == 0 { x } else { 0.41 });
            let plain = esdf.clearance(p, UnknownSpace::Optimistic).known().unwrap();
            let less = esdf.less_noise(&noise).clearance(p, UnknownSpace::Optimistic).known().unwrap();
            assert_eq!((less.upper, less.inside), (plain.upper, plain.inside));
            plain.lower - less.lower
        };
        let [near, far] = [4.0, 1.0].map(|weight| 3.0 * sigma.of(weight));
        // Near the first wall the second is out of reach; near the second only that counts.
        assert!((ask(0.9) - near).abs() < 1e-9, "{}", ask(0.9));
        assert!((ask(2.8) - far).abs() < 1e-9, "{}", ask(2.8));
        // Half way the less certain of both does, and a bound is never negative.
        assert!((ask(1.8) - far).abs() < 1e-9);
        let p = std::array::from_fn(|k| if k == 0 { 0.54 } else { 0.41 });
        let at_wall = esdf.less_noise(&noise).clearance(p, UnknownSpace::Optimistic);
        assert_eq!(at_wall.known().unwrap().lower, 0.0);
        // Unknown space beside is as near as it was.
        let p = std::array::from_fn(|k| if k == 0 { 1.4 } else { 0.75 });
        let [plain, less] = [&esdf as &dyn ClearanceField<D>, &esdf.less_noise(&noise)]
            .map(|field| field.clearance(p, UnknownSpace::Pessimistic).known().unwrap());
        assert!(plain.lower < 0.1 && plain == less, "{plain:?} {less:?}");
    }

    #[test]
    fn uncertain_walls_are_nearer_2d_and_3d() {
        between_two_walls::<2>();
        between_two_walls::<3>();
    }

    /// Obstacles that are points are as doubtful as their cells.
    #[test]
    fn points_come_nearer_as_well() {
        let lattice = Lattice::new([0.0; 2], 0.1);
        let mut map = Bricks::<SignedDistance, 2>::new(lattice);
        let key = BlockKey([0; 2]);
        // Inside by its own estimate, and nothing is known around it.
        map.insert(key, brick::<2>(|i| (i == 27).then_some((-0.05, 2.0)))).unwrap();
        let settings = EsdfSettings { min_weight: Some(0.5), max_distance: 2.0, ..Default::default() };
        let esdf = Esdf::of(&map, &settings);
        assert_eq!(esdf.point_obstacles().count(), 1);
        let sigma = SurfaceSigma::through([[1.0, 0.02], [100.0, 0.002]]).unwrap();
        let noise = esdf.surface_noise(&map, &sigma, 3.0);
        assert_eq!(noise.margin_within(lattice.center(key.cell(27)), 0.1), 3.0 * sigma.of(2.0));
    }

    /// The largest margin of all cells at crossings within a distance is never more than what is said, which is that of some
    /// crossing not much farther.
    fn margins_are_those_of_what_is_near<const D: usize>(spots: i32) {
        let lattice = Lattice::new([-3.3; D], 0.1);
        let mut map = Bricks::new(lattice);
        let mut crossings = Vec::new();
        for n in 0..spots {
            // Balls here and there, each with a weight of its own.
            let key = BlockKey(std::array::from_fn(|k| (n * [7, 5, 3][k]).rem_euclid(23) - 11));
            let weight = 1.0 + n as f32;
            let center = lattice.center(key.cell(block_cells::<D>() / 2));
            let distance = |i| {
                let p = lattice.center(key.cell(i));
                ((0..D).map(|k| (p[k] - center[k]).powi(2)).sum::<f64>().sqrt() - 0.21) as f32
            };
            if map.insert(key, brick::<D>(|i| Some((distance(i), weight)))).is_ok() {
                crossings.push((center, weight));
            }
        }
        let settings = EsdfSettings { min_weight: Some(0.5), max_distance: 3.0, ..Default::default() };
        let esdf = Esdf::of(&map, &settings);
        let sigma = SurfaceSigma::through([[1.0, 0.1], [1000.0, 0.001]]).unwrap();
        let noise = esdf.surface_noise(&map, &sigma, 2.0);
        for n in 0..200 {
            let p: [f64; D] = std::array::from_fn(|k| f64::from((n * [37, 101, 61][k]) % 200) / 10.0 - 12.0);
            for reach in [0.05, 0.4, 0.9, 3.0, 40.0, f64::INFINITY] {
                let within = |grown: f64| {
                    let near = crossings
                        .iter()
                        .filter(|(center, _)| (0..D).all(|k| (center[k] - p[k]).abs() <= grown));
                    near.map(|(_, weight)| 2.0 * sigma.of(f64::from(*weight))).fold(0.0, f64::max)
                };
                let said = noise.margin_within(p, reach);
                assert!(said >= within(reach - 0.21) - 1e-12, "{p:?} {reach}: {said}");
                assert!(said <= within(3.0 * reach + 2.5) + 1e-12, "{p:?} {reach}: {said}");
            }
            // Against a look at every brick.
            for lower in [0.0, 0.3, 1.1, 5.0] {
                let all = noise.levels[0].iter().map(|(key, m)| noise.bound(0, *key, *m, p, lower));
                let expected = all.fold(lower, f64::min).max(0.0);
                assert_eq!(noise.lower_less(p, lower), expected, "{p:?} {lower}");
            }
        }
    }

    #[test]
    fn margins_are_those_of_what_is_near_2d_and_3d() {
        margins_are_those_of_what_is_near::<2>(20);
        margins_are_those_of_what_is_near::<3>(20);
    }
}
