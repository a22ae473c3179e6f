//! The distance to the nearest point of a surface, by a tree of boxes.

use super::Mesh;
use crate::geom::vector::{cross3, dot, point_segment, sub};

/// Triangles or points under a tree of bounding boxes, for queries of the distance to the nearest one.
///
/// Degenerate triangles are segments or points. Corners are `f32` relative to an `f64` origin, distances are computed in
/// `f64`.
#[derive(Clone, Debug)]
pub struct NearestSurface {
    origin: [f64; 3],
    corners: Vec<[[f32; 3]; 3]>,
    nodes: Vec<Node>,
}

/// A box, and its content: an inner node has two children, the first directly after it; a leaf has triangles.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: [f32; 3],
    high: [f32; 3],
    /// Leaf: first triangle. Else: index of the second child.
    first: u32,
    /// Number of triangles of a leaf; 0 for an inner node.
    count: u32,
}

/// Largest number of triangles of a leaf.
const LEAF: usize = 4;

impl NearestSurface {
    /// The triangles of a mesh. Those with a corner that is not finite are skipped. O(n log n).
    pub fn of_mesh(mesh: &Mesh) -> Self {
        let corners = mesh.triangles.iter().map(|t| t.map(|v| mesh.vertices[v as usize]));
        Self::of(mesh.origin, corners.collect())
    }

    /// Points (meters, about `origin`). O(n log n).
    pub fn of_points(origin: [f64; 3], points: &[[f32; 3]]) -> Self {
        Self::of(origin, points.iter().map(|&p| [p; 3]).collect())
    }

    fn of(origin: [f64; 3], mut corners: Vec<[[f32; 3]; 3]>) -> Self {
        corners.retain(|c| c.as_flattened().iter().all(|v| v.is_finite()));
        let mut nodes = Vec::with_capacity(corners.len() / 2 + 1);
        if !corners.is_empty() {
            build(&mut corners, 0, &mut nodes);
        }
        Self { origin, corners, nodes }
    }

    /// Whether it has no triangles and no points.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Unsigned distance from a point (world) to the nearest triangle (meters). `None` for an empty surface, or a point that
    /// is not finite. About O(log n) near the surface.
    pub fn distance(&self, p_world: [f64; 3]) -> Option<f64> {
        let p = sub(p_world, self.origin);
        if self.corners.is_empty() || !p.iter().all(|v| v.is_finite()) {
            return None;
        }
        let mut best = f64::INFINITY;
        // Median splits of u32 many triangles are less than 40 deep.
        let mut open = Vec::with_capacity(40);
        open.push((0usize, 0.0));
        while let Some((at, least)) = open.pop() {
            if least >= best {
                continue;
            }
            let node = &self.nodes[at];
            if node.count > 0 {
                let first = node.first as usize;
                for corners in &self.corners[first..first + node.count as usize] {
                    best = best.min(point_triangle_sq(p, corners.map(|c| c.map(f64::from))));
                }
                continue;
            }
            let halves = [at + 1, node.first as usize].map(|n| (n, self.nodes[n].distance_sq(p)));
            let [near, far] = if halves[0].1 <= halves[1].1 { halves } else { [halves[1], halves[0]] };
            open.push(far);
            open.push(near);
        }
        Some(best.sqrt())
    }

    /// Memory of the tree (bytes).
    pub fn memory_bytes(&self) -> usize {
        self.corners.capacity() * size_of::<[[f32; 3]; 3]>()
            + self.nodes.capacity() * size_of::<Node>()
            + size_of::<Self>()
    }
}

impl Node {
    #[inline]
    fn distance_sq(&self, p: [f64; 3]) -> f64 {
        let outside = |k: usize| (f64::from(self.low[k]) - p[k]).max(p[k] - f64::from(self.high[k])).max(0.0);
        (0..3).map(|k| outside(k) * outside(k)).sum()
    }
}

/// Appends the tree of `corners`, the first of which has the index `first`, split at the median of the longest axis.
fn build(corners: &mut [[[f32; 3]; 3]], first: usize, nodes: &mut Vec<Node>) {
    let mut node =
        Node { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3], first: first as u32, count: 0 };
    for corner in corners.as_flattened() {
        node.low = std::array::from_fn(|k| node.low[k].min(corner[k]));
        node.high = std::array::from_fn(|k| node.high[k].max(corner[k]));
    }
    let at = nodes.len();
    if corners.len() <= LEAF {
        node.count = corners.len() as u32;
        nodes.push(node);
        return;
    }
    nodes.push(node);
    let length = |k: usize| node.high[k] - node.low[k];
    let axis = (1..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
    let middle = |c: &[[f32; 3]; 3]| c[0][axis] + c[1][axis] + c[2][axis];
    let half = corners.len() / 2;
    corners.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
    let (low, high) = corners.split_at_mut(half);
    build(low, first, nodes);
    nodes[at].first = nodes.len() as u32;
    build(high, first + half, nodes);
}

/// Squared distance from a point to a triangle *(Ericson 2005, section 5.1.5)*; to the nearest side of a degenerate one.
pub(crate) fn point_triangle_sq(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let normal = cross3(ab, ac);
    let area_sq = dot(normal, normal);
    if !(area_sq > 1e-20 * dot(ab, ab) * dot(ac, ac)) {
        let side = |a, b| point_segment(p, a, b).0;
        return side(a, b).min(side(b, c)).min(side(c, a)).powi(2);
    }
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return dot(ap, ap);
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return dot(bp, bp);
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return dot(cp, cp);
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let side = |a, b| point_segment(p, a, b).0.powi(2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return side(a, b);
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return side(a, c);
    }
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return side(b, c);
    }
    dot(ap, normal).powi(2) / area_sq
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::{add, distance, scale};
    use proptest::prelude::*;

    /// The nearest of many points of the triangle: an upper bound that lies within `reach` of the truth.
    fn sampled(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
        let n = 60;
        let mut best = f64::INFINITY;
        for i in 0..=n {
            for j in 0..=n - i {
                let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let q = add(a, add(scale(sub(b, a), u), scale(sub(c, a), v)));
                best = best.min(distance(p, q));
            }
        }
        best
    }

    fn corner() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3(prop_oneof![-1.0..1.0f64, Just(0.0), Just(0.5)])
    }

    proptest! {
        #[test]
        fn triangles_are_as_far_as_their_nearest_point(p in corner(), a in corner(), b in corner(), c in corner()) {
            let got = point_triangle_sq(p, [a, b, c]).sqrt();
            let want = sampled(p, [a, b, c]);
            // Samples are a sixtieth of a side apart.
            let reach = (distance(a, b) + distance(a, c)) / 60.0;
            prop_assert!(got <= want + 1e-9 && got >= want - reach, "{} {}", got, want);
        }

        #[test]
        fn the_tree_finds_what_a_scan_finds(
            corners in prop::collection::vec((corner(), prop::array::uniform2(prop::array::uniform3(-0.1..0.1f64))), 1..60),
            probes in prop::collection::vec(prop::array::uniform3(-3.0..3.0f64), 1..10),
        ) {
            let corners: Vec<[[f32; 3]; 3]> =
                corners.iter().map(|(a, e)| [*a, add(*a, e[0]), add(*a, e[1])].map(|c| c.map(|v| v as f32))).collect();
            let index = NearestSurface::of([500_000.0; 3], corners.clone());
            for p in probes {
                let world = p.map(|v| v + 500_000.0);
                let local = world.map(|v| v - 500_000.0);
                let want = corners.iter().map(|t| point_triangle_sq(local, t.map(|c| c.map(f64::from))));
                let want = want.fold(f64::INFINITY, f64::min).sqrt();
                prop_assert_eq!(index.distance(world), Some(want));
            }
        }
    }

    #[test]
    fn equal_points_and_nothing_at_all() {
        let many = NearestSurface::of_points([0.0; 3], &[[1.0, 2.0, 3.0]; 1000]);
        assert_eq!(many.distance([1.0, 2.0, 5.0]), Some(2.0));
        let none = NearestSurface::of_points([0.0; 3], &[[f32::NAN; 3]]);
        assert!(none.is_empty() && none.distance([0.0; 3]).is_none());
        assert_eq!(many.distance([f64::NAN, 0.0, 0.0]), None);
    }
}
