//! Triangles between the loops of a cube: discs over one loop, tubes between two.
//!
//! The rule by which meshes of neighboring cubes fit: **no triangle edge lies in a face of the cube, except the segments
//! of the loops.** The neighbor could have the same edge, which would then have four triangles.

use super::numbering::{middle, share_face};

/// Triangles over the crossings of a cube. Vertices 0 to 11 are the crossings of the edges, those from 12 on lie inside
/// the cube, in the middle of the crossings that `centres` lists.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Patch {
    pub(super) triangles: Vec<[u8; 3]>,
    pub(super) centres: Vec<Vec<u8>>,
}

/// Squared distance between the middles of two edges, in quarters of the cube's squared edge.
fn length(a: u8, b: u8) -> f64 {
    let (p, q) = (middle(a), middle(b));
    (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum()
}

impl Patch {
    /// Adds a disc over a loop: the triangulation of the polygon with the shortest diagonals of which none lies in a
    /// face; if no such triangulation exists, a fan around a center.
    pub(super) fn disc(&mut self, line: &[u8]) {
        let n = line.len();
        // best[i][j]: cheapest triangulation of the polygon from vertex i to vertex j, and the apex of its triangle at
        // the side i-j.
        let mut best = vec![vec![(0.0, 0); n]; n];
        let side = |i: usize, j: usize| match (j - i, share_face(line[i], line[j])) {
            (1, _) => 0.0,
            _ if (i, j) == (0, n - 1) => 0.0,
            (_, true) => f64::INFINITY,
            (_, false) => length(line[i], line[j]),
        };
        for span in 2..n {
            for i in 0..n - span {
                let j = i + span;
                let cost = |apex: usize| best[i][apex].0 + best[apex][j].0 + side(i, apex) + side(apex, j);
                let apexes = (i + 1..j).map(|apex| (cost(apex), apex));
                best[i][j] = apexes.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
            }
        }
        if best[0][n - 1].0.is_finite() {
            let mut open = vec![(0, n - 1)];
            while let Some((i, j)) = open.pop() {
                if j - i > 1 {
                    let apex = best[i][j].1;
                    self.triangles.push([line[i], line[apex], line[j]]);
                    open.extend([(i, apex), (apex, j)]);
                }
            }
        } else {
            let centre = 12 + self.centres.len() as u8;
            self.centres.push(line.to_vec());
            self.triangles.extend((0..n).map(|i| [line[i], line[(i + 1) % n], centre]));
        }
    }

    /// Adds a tube between two loops: with the shortest edges between them of which none lies in a face; if no such tube
    /// exists, with a ring of vertices inside the cube half way, one for each vertex of `a`.
    pub(super) fn tube(&mut self, a: &[u8], b: &[u8]) {
        if let Some(steps) = walk(a, b, true) {
            self.triangles.extend(steps.iter().map(|step| step.triangle(a, b)));
            return;
        }
        let Some(steps) = walk(a, b, false) else { return };
        let n = a.len();
        let first = 12 + self.centres.len() as u8;
        let ring: Vec<u8> = (first..first + n as u8).collect();
        for i in 0..n {
            let next = (i + 1) % n;
            self.triangles.extend([[a[i], a[next], ring[i]], [a[next], ring[next], ring[i]]]);
            let mut near = vec![a[i]];
            near.extend(steps.iter().filter(|s| s.a == i).map(|s| b[s.b]));
            near.sort_unstable();
            near.dedup();
            self.centres.push(near);
        }
        self.triangles.extend(steps.iter().map(|step| step.triangle(&ring, b)));
    }
}

/// One triangle of a tube: at the edge from `a[a]` to `b[b]`, going on along `a` (forward) or along `b` (backward).
struct Step {
    a: usize,
    b: usize,
    along_a: bool,
}

impl Step {
    fn triangle(&self, a: &[u8], b: &[u8]) -> [u8; 3] {
        if self.along_a {
            [a[self.a], a[(self.a + 1) % a.len()], b[self.b]]
        } else {
            [b[(self.b + b.len() - 1) % b.len()], b[self.b], a[self.a]]
        }
    }
}

/// The path once around two loops, forward along `a` and backward along `b`, with the shortest edges between them; with
/// `apart`, none of them in a face. `None` if no such path exists.
fn walk(a: &[u8], b: &[u8], apart: bool) -> Option<Vec<Step>> {
    let (n, m) = (a.len(), b.len());
    let mut shortest: Option<(f64, Vec<Step>)> = None;
    for (start_a, start_b) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let at_a = |i: usize| (start_a + i) % n;
        let at_b = |j: usize| (start_b + m - j % m) % m;
        let edge = |i: usize, j: usize| {
            let (p, q) = (a[at_a(i)], b[at_b(j)]);
            // The first step goes along `a` and the last one along `b` (every way around has such a place to start at):
            // else an edge could be met again at the end.
            let again = (i == 0 && j > 0) || (i < n && j == m) || (i, j) == (n, 0);
            if again || apart && share_face(p, q) { f64::INFINITY } else { length(p, q) }
        };
        // Cheapest way to have gone i steps along `a` and j along `b`, and whether the last was along `a`.
        let mut cost = vec![vec![(f64::INFINITY, false); m + 1]; n + 1];
        cost[0][0].0 = edge(0, 0);
        for (i, j) in (0..=n).flat_map(|i| (0..=m).map(move |j| (i, j))) {
            if i > 0 && cost[i - 1][j].0 + edge(i, j) < cost[i][j].0 {
                cost[i][j] = (cost[i - 1][j].0 + edge(i, j), true);
            }
            if j > 0 && cost[i][j - 1].0 + edge(i, j) < cost[i][j].0 {
                cost[i][j] = (cost[i][j - 1].0 + edge(i, j), false);
            }
        }
        if cost[n][m].0 < shortest.as_ref().map_or(f64::INFINITY, |s| s.0) {
            let (mut i, mut j, mut steps) = (n, m, Vec::new());
            while (i, j) != (0, 0) {
                let along_a = cost[i][j].1;
                if along_a {
                    i -= 1
                } else {
                    j -= 1
                }
                steps.push(Step { a: at_a(i), b: at_b(j), along_a });
            }
            shortest = Some((cost[n][m].0, steps));
        }
    }
    shortest.map(|(_, steps)| steps)
}
