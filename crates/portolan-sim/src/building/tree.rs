//! A tree of bounding boxes over shapes, so that rays and distances evaluate few of them.

use super::shape::{Entry, Shape};
use portolan::geom::{Aabb, vector};

/// Largest number of shapes in a leaf.
const LEAF: usize = 2;
/// Boxes are a little larger than what is in them: rounding must not hide an edge (meters).
const SLACK: f64 = 1e-9;
/// Trees are cut at the median, so that thousands of millions of shapes would not be deeper.
const DEPTH: usize = 64;

/// Nodes in depth-first order: the first child follows its parent.
#[derive(Clone, Debug, PartialEq)]
struct Node {
    bounds: Aabb<3>,
    /// Leaf: first place in `order`. Inner node: index of the second child.
    link: u32,
    /// Number of shapes; 0: an inner node.
    shapes: u32,
}

/// The tree. It stores indices of shapes; every call takes the same shapes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl Tree {
    /// Builds the tree, split at the median of the centers along the longest axis. O(n log^2 n).
    pub(super) fn new(shapes: &[Shape]) -> Self {
        let boxes: Vec<_> = shapes.iter().map(|s| s.aabb().grown(SLACK)).collect();
        let mut tree = Self { nodes: Vec::new(), order: Vec::new() };
        if !shapes.is_empty() {
            tree.build(&boxes, &mut (0..shapes.len() as u32).collect::<Vec<_>>());
        }
        tree
    }

    fn build(&mut self, boxes: &[Aabb<3>], members: &mut [u32]) {
        let bounds = members.iter().fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize]));
        let at = self.nodes.len();
        self.nodes.push(Node { bounds, link: self.order.len() as u32, shapes: members.len() as u32 });
        if members.len() <= LEAF {
            self.order.extend_from_slice(members);
            return;
        }
        let extent = bounds.extent();
        let axis = (1..3).fold(0, |best, k| if extent[k] > extent[best] { k } else { best });
        let middle = |i: u32| boxes[i as usize].min[axis] + boxes[i as usize].max[axis];
        members.sort_by(|&a, &b| middle(a).total_cmp(&middle(b)).then(a.cmp(&b)));
        let (left, right) = members.split_at_mut(members.len() / 2);
        self.build(boxes, left);
        self.nodes[at] = Node { bounds, link: self.nodes.len() as u32, shapes: 0 };
        self.build(boxes, right);
    }

    /// The first shape that a ray enters; of several at one place that with the lowest index.
    pub(super) fn cast(
        &self,
        shapes: &[Shape],
        origin: [f64; 3],
        direction: [f64; 3],
    ) -> Option<(usize, Entry)> {
        let inverse = direction.map(|v| 1.0 / v);
        let mut best: Option<(usize, Entry)> = None;
        let mut reach = f64::INFINITY;
        let mut stack = [(0u32, 0.0f64); DEPTH];
        let mut height = 0;
        if let Some(root) = self.nodes.first().and_then(|n| meets(&n.bounds, origin, inverse)) {
            stack[0].1 = root;
            height = 1;
        }
        while height > 0 {
            height -= 1;
            let (at, from) = stack[height];
            if from > reach {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.shapes > 0 {
                for &i in &self.order[node.link as usize..(node.link + node.shapes) as usize] {
                    let i = i as usize;
                    let Some(entry) = shapes[i].enter(origin, direction) else { continue };
                    if entry.range < reach || (entry.range == reach && best.is_some_and(|b| i < b.0)) {
                        reach = entry.range;
                        best = Some((i, entry));
                    }
                }
                continue;
            }
            let children = [at + 1, node.link];
            let t = children.map(|c| meets(&self.nodes[c as usize].bounds, origin, inverse));
            // The nearer child is visited first, so it goes on top of the stack.
            let first = usize::from(t[1].unwrap_or(f64::INFINITY) < t[0].unwrap_or(f64::INFINITY));
            for c in [1 - first, first] {
                if let Some(from) = t[c].filter(|&from| from <= reach) {
                    stack[height] = (children[c], from);
                    height += 1;
                }
            }
        }
        best
    }

    /// The shape with the least signed distance: the nearest one, or that in which a point lies deepest; of several the
    /// one with the lowest index.
    pub(super) fn nearest(&self, shapes: &[Shape], p: [f64; 3]) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        let mut stack = [(0u32, 0.0f64); DEPTH];
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 {
            height -= 1;
            let (at, apart) = stack[height];
            // A box that contains the point may have a shape that contains it deeper.
            if apart > 0.0 && best.is_some_and(|b| apart > b.1) {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.shapes > 0 {
                for &i in &self.order[node.link as usize..(node.link + node.shapes) as usize] {
                    let d = shapes[i as usize].signed_distance(p);
                    let i = i as usize;
                    if best.is_none_or(|b| d < b.1 || (d == b.1 && i < b.0)) {
                        best = Some((i, d));
                    }
                }
                continue;
            }
            let children = [at + 1, node.link];
            let apart = children.map(|c| to_box(&self.nodes[c as usize].bounds, p));
            let first = usize::from(apart[1] < apart[0]);
            for c in [1 - first, first] {
                stack[height] = (children[c], apart[c]);
                height += 1;
            }
        }
        best
    }
}

/// Arc length at which a ray enters a box, 0 if it starts inside.
#[inline(always)]
fn meets(bounds: &Aabb<3>, origin: [f64; 3], inverse: [f64; 3]) -> Option<f64> {
    let (mut near, mut far) = (0.0f64, f64::INFINITY);
    for k in 0..3 {
        let a = (bounds.min[k] - origin[k]) * inverse[k];
        let b = (bounds.max[k] - origin[k]) * inverse[k];
        // Where the ray runs in the plane of a face, 0 * infinity is NaN, which `min` and `max` ignore.
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    (near <= far).then_some(near)
}

#[inline(always)]
fn to_box(bounds: &Aabb<3>, p: [f64; 3]) -> f64 {
    vector::norm(std::array::from_fn::<f64, 3, _>(|k| {
        (bounds.min[k] - p[k]).max(p[k] - bounds.max[k]).max(0.0)
    }))
}
