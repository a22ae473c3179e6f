//! Connected components, and the vertex of each that is held.

use crate::graph::PoseGraph;

/// The connected components of a graph and the vertices that are not moved.
pub(crate) struct Anchors {
    /// Whether each vertex is held: fixed by the caller, or the first of a component without a fixed vertex.
    pub(crate) held: Vec<bool>,
    /// The vertices held that the caller did not fix, ascending.
    pub(crate) chosen: Vec<usize>,
    /// Number of components.
    pub(crate) components: usize,
}

/// Finds the components (union-find with path halving) and holds one vertex of each. O(vertices + edges).
pub(crate) fn anchors<const D: usize>(graph: &PoseGraph<D>) -> Anchors {
    let n = graph.vertices.len();
    let mut parent: Vec<usize> = (0..n).collect();
    let root = |parent: &mut Vec<usize>, mut k: usize| {
        while parent[k] != k {
            parent[k] = parent[parent[k]];
            k = parent[k];
        }
        k
    };
    for &[i, j] in &graph.ends {
        let (a, b) = (root(&mut parent, i), root(&mut parent, j));
        // The smaller index wins: the root of a component is its first vertex.
        parent[a.max(b)] = a.min(b);
    }
    let mut held: Vec<bool> = graph.vertices.iter().map(|v| v.fixed).collect();
    let mut anchored = vec![false; n];
    for k in 0..n {
        if held[k] {
            let part = root(&mut parent, k);
            anchored[part] = true;
        }
    }
    let roots: Vec<usize> = (0..n).filter(|&k| parent[k] == k).collect();
    let chosen: Vec<usize> = roots.iter().copied().filter(|&k| !anchored[k]).collect();
    for &k in &chosen {
        held[k] = true;
    }
    Anchors { held, chosen, components: roots.len() }
}
