//! The closed lines in which the surface meets the faces of a cube.

use super::numbering::{EDGES, edge_between, face_corners};

/// Ambiguous faces, a bit each: their diagonal corners have equal signs, neighboring corners different ones, so that the
/// signs do not determine which diagonal is joined.
pub(super) fn ambiguous_faces(case: u8) -> u8 {
    (0..6)
        .filter(|&face| is_ambiguous(face_corners(face).map(|c| case >> c & 1 == 1)))
        .fold(0, |m, f| m | 1 << f)
}

fn is_ambiguous(inside: [bool; 4]) -> bool {
    inside[0] == inside[2] && inside[1] == inside[3] && inside[0] != inside[1]
}

/// Whether the inside corners of an ambiguous face are joined across it: the sign of the bilinear field at its saddle
/// *(Nielson & Hamann 1991)*.
///
/// `d` are the values around the face. The saddle lies inside where the product of the inside corners is the larger
/// one. Products of two f32 are exact in f64, and so is the sign of their difference: both cubes at the face decide
/// alike. A saddle of exactly zero is free.
#[inline]
pub(super) fn inside_joined(d: [f32; 4]) -> bool {
    let [a, b, c, e] = d.map(f64::from);
    if d[0] < 0.0 { a * c > b * e } else { b * e > a * c }
}

/// The loops of a cube: edges in order. `case` has the bit of every inside corner, `joined` the bit of every ambiguous
/// face whose inside corners are joined.
///
/// In every face, going counter-clockwise as seen from outside, each edge where the inside ends is joined to one where
/// it begins: to the next one where the inside is joined across the face, else to the one before. An edge where the
/// inside ends in one of its faces is one where it begins in the other, so that following goes on in circles. They run
/// from where it begins to where it ends: seen from the free side counter-clockwise.
pub(super) fn loops(case: u8, joined: u8) -> Vec<Vec<u8>> {
    let mut next = [EDGES; EDGES as usize];
    for face in 0..6 {
        let corners = face_corners(face);
        let inside = corners.map(|c| case >> c & 1 == 1);
        let edge = |n: usize| edge_between(corners[n], corners[(n + 1) % 4]);
        let begins = |n: usize| !inside[n] && inside[(n + 1) % 4];
        let step = if joined >> face & 1 == 1 { 1 } else { 3 };
        for n in (0..4).filter(|&n| inside[n] && !inside[(n + 1) % 4]) {
            let to = (1..4).map(|k| (n + k * step) % 4).find(|&m| begins(m));
            if let Some(to) = to {
                next[edge(to) as usize] = edge(n);
            }
        }
    }
    let mut all = Vec::new();
    for start in 0..EDGES {
        let mut line = Vec::new();
        let mut at = start;
        while next[at as usize] < EDGES {
            line.push(at);
            at = std::mem::replace(&mut next[at as usize], EDGES);
        }
        if !line.is_empty() {
            all.push(line);
        }
    }
    all
}

/// The region of the cube's surface that every corner belongs to, named by its lowest corner: the loops are the
/// borders between regions.
pub(super) fn regions(case: u8, joined: u8) -> [u8; 8] {
    let mut region: [u8; 8] = std::array::from_fn(|c| c as u8);
    let mut unite = |a: u8, b: u8| {
        let (ra, rb) = (region[a as usize], region[b as usize]);
        region.iter_mut().filter(|r| **r == ra.max(rb)).for_each(|r| *r = ra.min(rb));
    };
    let inside = |c: u8| case >> c & 1 == 1;
    for face in 0..6 {
        let q = face_corners(face);
        for n in 0..4 {
            let (a, b) = (q[n], q[(n + 1) % 4]);
            if inside(a) == inside(b) {
                unite(a, b);
            }
        }
        if is_ambiguous(q.map(inside)) {
            let first = usize::from(inside(q[0]) != (joined >> face & 1 == 1));
            unite(q[first], q[first + 2]);
        }
    }
    region
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_crossing_is_on_one_loop_and_loops_separate_regions() {
        for case in 0..=255u8 {
            let ambiguous = ambiguous_faces(case);
            for joined in (0..64).filter(|j| j & !ambiguous == 0) {
                let all = loops(case, joined);
                let mut edges: Vec<u8> = all.iter().flatten().copied().collect();
                edges.sort_unstable();
                let crossing: Vec<u8> = (0..EDGES)
                    .filter(|&e| {
                        let (axis, c) = super::super::numbering::edge_start(e);
                        (case >> c ^ case >> (c | 1 << axis)) & 1 == 1
                    })
                    .collect();
                assert_eq!(edges, crossing);
                let mut names = regions(case, joined).to_vec();
                names.sort_unstable();
                names.dedup();
                // A sphere cut along n closed lines has n + 1 parts.
                assert_eq!(names.len(), all.len() + 1, "case {case} joined {joined}");
            }
        }
    }

    #[test]
    fn the_saddle_decides_and_zero_is_free() {
        assert!(inside_joined([-3.0, 1.0, -3.0, 1.0]));
        assert!(!inside_joined([-1.0, 3.0, -1.0, 3.0]));
        assert!(!inside_joined([-1.0, 1.0, -1.0, 1.0]));
        assert!(!inside_joined([1.0, -1.0, 1.0, -1.0]));
        assert!(inside_joined([0.0, -1.0, 0.0, -1e-30]));
    }
}
