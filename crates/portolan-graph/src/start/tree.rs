//! Chaining measurements along a tree.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::components::anchors;
use crate::graph::{EdgeKind, PoseGraph};

/// Which edges a tree prefers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chain {
    /// Odometry before closures: dead reckoning, unaffected by false closures.
    Odometry,
    /// The fewest edges from the held vertex: less drift, for graphs without false closures.
    Shortest,
}

impl<const D: usize> PoseGraph<D> {
    /// Places every vertex by chaining measurements along a spanning tree from the fixed vertices (or from the first
    /// vertex of a component without one). Previous poses of other vertices are discarded. O(edges log edges).
    pub fn start_from_tree(&mut self, chain: Chain) {
        let anchors = anchors(self);
        let mut placed = anchors.held;
        let mut at: Vec<Vec<usize>> = vec![Vec::new(); self.vertices.len()];
        for (number, &[i, j]) in self.ends.iter().enumerate() {
            at[i].push(number);
            at[j].push(number);
        }
        let trust = |number: usize| match chain {
            Chain::Odometry => self.edges[number].kind,
            Chain::Shortest => EdgeKind::Odometry,
        };
        // Smallest first: trust, edges from the anchor, number. The order decides, hence it is total.
        let mut frontier = BinaryHeap::new();
        for vertex in (0..placed.len()).filter(|&k| placed[k]) {
            frontier.extend(at[vertex].iter().map(|&number| Reverse((trust(number), 1, number, vertex))));
        }
        let mut moved = Vec::new();
        while let Some(Reverse((_, hops, number, from))) = frontier.pop() {
            let [i, j] = self.ends[number];
            let to = if from == i { j } else { i };
            if placed[to] {
                continue;
            }
            placed[to] = true;
            moved.push((number, from, to));
            frontier.extend(at[to].iter().map(|&next| Reverse((trust(next), hops + 1, next, to))));
        }
        for (number, from, to) in moved {
            let i_from_j = self.edges[number].i_from_j;
            let from_from_to = if from == self.ends[number][0] { i_from_j } else { i_from_j.inverse() };
            self.vertices[to].world_from_vertex = self.vertices[from].world_from_vertex * from_from_to;
        }
    }
}
