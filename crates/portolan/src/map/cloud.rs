//! The point cloud under a k-d tree.

use crate::geom::Pose;
use crate::scan::{Scan, ScanStats};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

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

    /// The points twice: as they came, and in the tree's leaves with their index of 4 bytes. The tree does not give
    /// its own size: its inner levels, some 3 % more, are not counted.
    pub fn memory_bytes(&self) -> usize {
        let in_tree = if self.tree.is_some() { self.points.len() * (size_of::<[f64; D]>() + 4) } else { 0 };
        self.points.capacity() * size_of::<[f64; D]>() + in_tree
    }
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
}
