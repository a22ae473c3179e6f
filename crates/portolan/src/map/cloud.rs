//! The point cloud under a k-d tree.

use crate::geom::Pose;
use crate::scan::{Scan, ScanStats};
use kiddo::kd_tree::KdTreeAccessor;
use kiddo::{Eytzinger, ImmutableKdTree, LeafStrategy, SquaredEuclidean, VecOfArenas};

/// All end points of all scans, and a k-d tree over them: the log made searchable, not a map. It grows without
/// bound, cannot be carved, and knows nothing of free space.
#[derive(Debug, Default)]
pub struct Cloud<const D: usize> {
    points: Vec<[f64; D]>,
    tree: Option<ImmutableKdTree<f64, D>>,
}

impl<const D: usize> Cloud<D> {
    /// A cloud without points.
    pub fn new() -> Self {
        Self { points: Vec::new(), tree: None }
    }

    /// A cloud of these points (world, meters), with its tree built. Points that are not finite are left out.
    pub fn from_points(points: impl IntoIterator<Item = [f64; D]>) -> Self {
        let mut cloud = Self::new();
        cloud.points.extend(points.into_iter().filter(|p| p.iter().all(|v| v.is_finite())));
        cloud.rebuild();
        cloud
    }

    /// Adds the end points of a scan; they are found after the next [`Cloud::rebuild`].
    pub fn integrate(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> ScanStats {
        if !world_from_sensor.is_rigid() {
            return ScanStats { refused_poses: 1, ..Default::default() };
        }
        let before = self.points.len();
        self.points.extend(scan.hits_world(world_from_sensor));
        ScanStats {
            scans: 1,
            beams: scan.counts(),
            refused: scan.refused(),
            cells: (self.points.len() - before) as u64,
            ..Default::default()
        }
    }

    /// Builds the tree over all points so far. O(n log n).
    pub fn rebuild(&mut self) {
        // The tree refuses coordinates that are not finite, and there are none.
        let built = || ImmutableKdTree::new_from_slice(&self.points).expect("points are finite");
        self.tree = (!self.points.is_empty()).then(built);
    }

    /// The points (world, meters), in the order in which they came.
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// Distance from a point to the nearest end point (meters), unsigned; `None` without a tree. O(log n) in
    /// the mean.
    pub fn nearest_distance(&self, p_world: impl Into<[f64; D]>) -> Option<f64> {
        let p = p_world.into();
        let tree = self.tree.as_ref().filter(|_| p.iter().all(|v| v.is_finite()))?;
        Some(tree.query(&p).nearest_one::<SquaredEuclidean<f64>>().execute().distance.sqrt())
    }

    /// Bytes of the points as they came and of the tree over them, which holds them again: measured, not estimated. What
    /// allocations are larger than what they hold is counted for the points, not for the tree, which does not tell. O(leaves).
    pub fn memory_bytes(&self) -> usize {
        self.points.capacity() * size_of::<[f64; D]>() + self.tree.as_ref().map_or(0, tree_bytes)
    }
}

/// Bytes of a tree's planes between points, of where its leaves begin and end, and of the leaves: points with their index,
/// each leaf aligned to a coordinate.
fn tree_bytes<const D: usize>(tree: &ImmutableKdTree<f64, D>) -> usize {
    let (planes, leaves) = (tree.stems(), tree.leaves());
    let of_leaf = |i: usize| leaf_len(leaves, i) * (size_of::<[f64; D]>() + size_of::<u32>());
    let held = (0..tree.leaf_count()).map(|i| of_leaf(i).next_multiple_of(align_of::<f64>()));
    size_of_val(planes) + tree.leaf_count() * size_of::<(usize, usize)>() + held.sum::<usize>()
}

/// Points in a leaf.
fn leaf_len<const D: usize>(leaves: &VecOfArenas<f64, u32, D, 32>, leaf: usize) -> usize {
    LeafStrategy::<f64, u32, Eytzinger, D, 32>::leaf_len(leaves, leaf)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::distance;
    use proptest::prelude::*;

    fn matches_brute_force<const D: usize>(points: &[[f64; D]], probes: &[[f64; D]]) {
        let cloud = Cloud::from_points(points.iter().copied());
        for &p in probes {
            let want = points.iter().map(|&q| distance(p, q)).min_by(f64::total_cmp);
            match (cloud.nearest_distance(p), want) {
                (Some(got), Some(want)) => assert!((got - want).abs() <= 1e-12 * (1.0 + want)),
                (got, want) => assert_eq!(got, want),
            }
        }
    }

    proptest! {
        #[test]
        fn matches_brute_force_2d(
            points in prop::collection::vec(prop::array::uniform2(-9.0..9.0f64), 0..400),
            probes in prop::collection::vec(prop::array::uniform2(-12.0..12.0f64), 20),
        ) {
            matches_brute_force(&points, &probes);
        }
        #[test]
        fn matches_brute_force_3d(
            points in prop::collection::vec(prop::array::uniform3(-9.0..9.0f64), 0..400),
            probes in prop::collection::vec(prop::array::uniform3(-12.0..12.0f64), 20),
        ) {
            matches_brute_force(&points, &probes);
        }
    }

    #[test]
    fn ten_thousand_identical_points() {
        let mut points = vec![[1.0, 2.0]; 10_000];
        matches_brute_force(&points, &[[1.0, 2.0], [4.0, 6.0]]);
        points.extend((0..1000).map(|i| [f64::from(i % 10), 2.0])); // many on one line, too
        matches_brute_force(&points, &[[1.0, 2.0], [4.2, 6.0], [100.0, 0.0]]);
        let cloud = Cloud::from_points([[f64::NAN, 0.0]]);
        assert_eq!(cloud.nearest_distance([0.0, 0.0]), None);
    }

    /// Against what the tree says of its leaves, and what its planes and leaves must at least be.
    fn memory_is_what_is_held<const D: usize>() {
        for n in [0, 1, 31, 33, 1000, 5003] {
            let points = (0..n).map(|i| {
                std::array::from_fn(|k| (f64::from(i) * [0.618_034, 0.414_214, 0.302_776][k]).fract())
            });
            let cloud = Cloud::<D>::from_points(points);
            let own = cloud.points.capacity() * 8 * D;
            let Some(tree) = &cloud.tree else {
                assert_eq!((n, cloud.memory_bytes()), (0, own));
                continue;
            };
            // "VecOfArenas { .., arena_bytes: 20 }"
            let said = format!("{:?}", tree.leaves());
            let arena: usize =
                said.rsplit("arena_bytes: ").next().unwrap().trim_end_matches(" }").parse().unwrap();
            // Behind the last leaf nothing is aligned.
            let leaves = arena.next_multiple_of(8);
            assert!(arena >= n as usize * (8 * D + 4), "{said}");
            let rest = tree.stems().len() * 8 + tree.leaf_count() * 16;
            assert_eq!(cloud.memory_bytes(), own + leaves + rest, "{n}");
            assert!(
                n < 33 || tree.leaf_count() * 32 >= n as usize && tree.stems().len() + 1 >= tree.leaf_count()
            );
        }
    }

    #[test]
    fn memory_is_what_is_held_2d_and_3d() {
        memory_is_what_is_held::<2>();
        memory_is_what_is_held::<3>();
    }
}
