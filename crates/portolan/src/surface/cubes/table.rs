//! The triangles of every cube, generated from rules when they are first needed.
//!
//! 256 sign patterns; for each, every decision about its ambiguous faces; for each of these the loops on the faces and
//! discs over them, and where two regions of the faces that hold opposite corners might be connected inside the cube,
//! the tube instead of two discs. The surface of a trilinear field in a cube has no other form: one disc per loop, or one
//! tube between two loops and discs over the rest *(Nielson 2003; Chernyaev 1995 lists the 33 patterns up to symmetry)*.
//! Nothing is copied from published tables.

use super::loops::{ambiguous_faces, inside_joined, loops, regions};
use super::numbering::{edge_start, face_corners};
use super::patch::Patch;
use super::tunnel::connected;
use std::sync::LazyLock;

/// Largest number of triangles of an unambiguous cube.
pub(super) const MOST: usize = 4;

/// An unambiguous cube: its triangles, as places in the [`local`] numbering, and their number.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plain {
    pub(super) corners: [[u16; 3]; MOST],
    pub(super) triangles: u16,
}

/// In [`Plain::triangles`]: the signs leave the cube ambiguous.
pub(super) const AMBIGUOUS: u16 = u16::MAX;

/// Place of an edge of the cube at node 0 among the edges around a brick: its axis in the bits from 10 on, then the node
/// where it starts, 9 nodes a row.
pub(super) const fn local(edge: u8) -> u16 {
    let (axis, corner) = edge_start(edge);
    let (x, y, z) = (corner & 1, corner >> 1 & 1, corner >> 2);
    (axis as u16) << 10 | (x as u16 + 9 * y as u16 + 81 * z as u16)
}

/// The triangles of a cube after its ambiguous faces were decided.
#[derive(Debug)]
struct Decided {
    discs: Patch,
    tunnels: Vec<Tunnel>,
}

/// A tube, and the two opposite corners that it connects through the cube.
#[derive(Debug)]
struct Tunnel {
    ends: [u8; 2],
    patch: Patch,
}

/// All cubes.
pub(super) struct Table {
    pub(super) plain: Box<[Plain; 256]>,
    ambiguous: [u8; 256],
    /// First entry in `decided` of each sign pattern; then one for every subset of its ambiguous faces.
    first: [u16; 256],
    decided: Vec<Decided>,
}

/// The one table.
pub(super) static TABLE: LazyLock<Table> = LazyLock::new(Table::generate);

/// The triangles of a cube with these values at its corners, all observed: the places 0 to 11 are the crossings of its
/// edges ([`edge_start`]), those from 12 on the means of the crossings in the second list.
pub(crate) fn cube_patch(d: &[f32; 8]) -> (&'static [[u8; 3]], &'static [Vec<u8>]) {
    let case = d.iter().enumerate().fold(0, |case, (c, &v)| case | u8::from(v < 0.0) << c);
    let patch = TABLE.patch(case, d);
    (&patch.triangles, &patch.centres)
}

impl Table {
    fn generate() -> Self {
        let mut table = Self {
            plain: Box::new([Plain::default(); 256]),
            ambiguous: std::array::from_fn(|case| ambiguous_faces(case as u8)),
            first: [0; 256],
            decided: Vec::new(),
        };
        for case in 0..=255u8 {
            let faces = table.ambiguous[usize::from(case)];
            table.first[usize::from(case)] = table.decided.len() as u16;
            for subset in 0..1u8 << faces.count_ones() {
                table.decided.push(Decided::new(case, spread(subset, faces), false));
            }
            let last = &table.decided[table.decided.len() - 1];
            let plain = &mut table.plain[usize::from(case)];
            let few = last.discs.triangles.len() <= MOST;
            if faces == 0 && last.tunnels.is_empty() && last.discs.centres.is_empty() && few {
                for (corners, t) in plain.corners.iter_mut().zip(&last.discs.triangles) {
                    *corners = t.map(local);
                }
                plain.triangles = last.discs.triangles.len() as u16;
            } else {
                plain.triangles = AMBIGUOUS;
            }
        }
        table
    }

    /// The triangles of a cube with these values at its corners; `case` has the bit of every corner below zero.
    pub(super) fn patch(&self, case: u8, d: &[f32; 8]) -> &Patch {
        let faces = self.ambiguous[usize::from(case)];
        let (mut subset, mut bit, mut left) = (0usize, 1, faces);
        while left != 0 {
            let corners = face_corners(left.trailing_zeros() as u8);
            if inside_joined(corners.map(|c| d[usize::from(c)])) {
                subset |= bit;
            }
            bit <<= 1;
            left &= left - 1;
        }
        let decided = &self.decided[usize::from(self.first[usize::from(case)]) + subset];
        let tunnel = decided.tunnels.iter().find(|t| connected(d, t.ends[0], t.ends[1]));
        tunnel.map_or(&decided.discs, |t| &t.patch)
    }
}

/// The bits of `subset`, one after the other, at the bits that are set in `mask`.
fn spread(mut subset: u8, mask: u8) -> u8 {
    let mut out = 0;
    for bit in (0..8).filter(|b| mask >> b & 1 == 1) {
        out |= (subset & 1) << bit;
        subset >>= 1;
    }
    out
}

impl Decided {
    /// With `anywhere`, also with tunnels that the trilinear field cannot have (for tests).
    fn new(case: u8, joined: u8, anywhere: bool) -> Self {
        let faces = ambiguous_faces(case);
        let lines = loops(case, joined);
        let region = regions(case, joined);
        let count = |r: u8| region.iter().filter(|&&other| other == r).count();
        let mut discs = Patch::default();
        lines.iter().for_each(|line| discs.disc(line));
        // Every loop is the border between the regions of the two ends of any of its edges.
        let borders: Vec<[u8; 2]> = lines
            .iter()
            .map(|line| {
                let (axis, corner) = edge_start(line[0]);
                [corner, corner | 1 << axis].map(|c| region[usize::from(c)])
            })
            .collect();
        let mut tunnels: Vec<Tunnel> = Vec::new();
        for (a, b) in (0..8u8).flat_map(|a| (a + 1..8).map(move |b| (a, b))) {
            let [ra, rb] = [a, b].map(|c| region[usize::from(c)]);
            // Every pair of regions once, by their lowest corners.
            if (case >> a ^ case >> b) & 1 == 1 || ra == rb || (ra, rb) != (a, b) {
                continue;
            }
            // Only regions that hold opposite corners are ever connected inside, and where the signs alternate a region
            // of one corner with one of three; `tunnels_are_where_they_are_looked_for` tries all others.
            let opposite =
                (0..8).any(|c: u8| region[usize::from(c)] == ra && region[usize::from(c ^ 7)] == rb);
            let one_and_three = faces == 0b11_1111 && lines.len() == 3 && count(ra) != count(rb);
            if !(opposite || one_and_three || anywhere) {
                continue;
            }
            // The two loops between which a tube would run have one region between them.
            let across = |line: usize, from: u8| {
                let [p, q] = borders[line];
                if p == from { Some(q) } else { (q == from).then_some(p) }
            };
            let pairs = (0..lines.len()).flat_map(|i| (0..lines.len()).map(move |j| (i, j)));
            let tube =
                pairs.filter(|&(i, j)| i != j && across(i, ra).is_some() && across(i, ra) == across(j, rb));
            for (i, j) in tube {
                let (i, j) = if lines[i].len() <= lines[j].len() { (i, j) } else { (j, i) };
                let mut patch = Patch::default();
                patch.tube(&lines[i], &lines[j]);
                (0..lines.len()).filter(|&k| k != i && k != j).for_each(|k| patch.disc(&lines[k]));
                tunnels.push(Tunnel { ends: [a, b], patch });
            }
        }
        Self { discs, tunnels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::cubes::numbering::share_face;
    use crate::surface::cubes::testing::random_cube;
    use crate::testing::Random;
    use std::collections::{BTreeMap, BTreeSet};

    fn all_patches() -> Vec<(u8, u8, bool, Patch)> {
        let mut all = Vec::new();
        for case in 0..=255u8 {
            let faces = ambiguous_faces(case);
            for joined in (0..64).filter(|j| j & !faces == 0) {
                let decided = Decided::new(case, joined, true);
                all.push((case, joined, false, decided.discs));
                all.extend(decided.tunnels.into_iter().map(|t| (case, joined, true, t.patch)));
            }
        }
        all
    }

    /// Components and Euler characteristic of a patch, asserting that it is a manifold bounded by the loops.
    fn check(case: u8, joined: u8, patch: &Patch) -> (usize, i64) {
        let mut directed = BTreeMap::new();
        for t in &patch.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                assert!(a != b && directed.insert((a, b), ()).is_none(), "case {case}: edge {a}-{b} twice");
            }
        }
        let mut border = BTreeSet::new();
        for (a, b) in loops(case, joined).iter().flat_map(|l| l.iter().zip(l.iter().cycle().skip(1))) {
            border.insert((*a, *b));
        }
        for (a, b) in directed.keys() {
            let on_border = border.contains(&(*a, *b)) || border.contains(&(*b, *a));
            assert_eq!(directed.contains_key(&(*b, *a)), !on_border, "case {case}: edge {a}-{b} is open");
            let in_face = *a < 12 && *b < 12 && share_face(*a, *b);
            assert!(on_border || !in_face, "case {case}: edge {a}-{b} lies in a face");
        }
        assert!(border.iter().all(|e| directed.contains_key(e)), "case {case}: a loop is not covered");
        let mut part: Vec<u8> = (0..12 + patch.centres.len() as u8).collect();
        for (a, b) in directed.keys() {
            let (low, high) =
                (part[*a as usize].min(part[*b as usize]), part[*a as usize].max(part[*b as usize]));
            part.iter_mut().filter(|p| **p == high).for_each(|p| *p = low);
        }
        let used: BTreeSet<u8> = patch.triangles.iter().flatten().copied().collect();
        assert!((0..patch.centres.len() as u8).all(|k| used.contains(&(12 + k))));
        let edges: BTreeSet<_> = directed.keys().map(|(a, b)| (*a.min(b), *a.max(b))).collect();
        let parts: BTreeSet<_> = used.iter().map(|v| part[*v as usize]).collect();
        (parts.len(), used.len() as i64 - edges.len() as i64 + patch.triangles.len() as i64)
    }

    #[test]
    fn every_patch_is_a_manifold_over_its_loops() {
        for (case, joined, tunnel, patch) in all_patches() {
            let lines = loops(case, joined).len();
            let (parts, euler) = check(case, joined, &patch);
            // A disc has characteristic 1, a tube 0 and two loops.
            let tubes = usize::from(tunnel);
            assert_eq!(
                (parts, euler),
                (lines - tubes, (lines - 2 * tubes) as i64),
                "case {case} joined {joined}"
            );
        }
    }

    #[test]
    fn half_of_all_sign_patterns_tell_all() {
        assert_eq!(TABLE.plain.iter().filter(|p| p.triangles != AMBIGUOUS).count(), 128);
        assert_eq!(TABLE.decided.len(), 656);
        assert!(TABLE.plain.iter().all(|p| p.triangles == AMBIGUOUS || p.triangles <= 5));
    }

    fn case_and_joined(d: &[f32; 8]) -> (u8, u8) {
        let case = (0..8).fold(0u8, |case, c| case | u8::from(d[c] < 0.0) << c);
        let faces = (0..6).filter(|f| ambiguous_faces(case) >> f & 1 == 1);
        let joined = faces.filter(|&f| inside_joined(face_corners(f).map(|c| d[usize::from(c)])));
        (case, joined.fold(0, |j, f| j | 1 << f))
    }

    #[test]
    fn tunnels_are_where_they_are_looked_for() {
        let mut all = BTreeMap::new();
        for case in 0..=255u8 {
            let faces = ambiguous_faces(case);
            for joined in (0..64).filter(|j| j & !faces == 0) {
                all.insert((case, joined), Decided::new(case, joined, true));
            }
        }
        let mut random = Random(3);
        let mut found = 0;
        for n in 0..1_000_000 {
            let d = random_cube(&mut random, n);
            let (case, joined) = case_and_joined(&d);
            let decided = &all[&(case, joined)];
            let tunnels: Vec<_> =
                decided.tunnels.iter().filter(|t| connected(&d, t.ends[0], t.ends[1])).collect();
            assert!(tunnels.len() <= 1, "two tunnels in {d:?}");
            let expected = tunnels.first().map_or(&decided.discs, |t| &t.patch);
            assert_eq!(TABLE.patch(case, &d), expected, "{d:?}");
            found += tunnels.len();
        }
        assert!(found > 3000, "{found}");
    }

    /// Parts of each sign of the trilinear field, by union of neighboring samples on a grid of `n` per edge.
    fn parts(d: &[f32; 8], n: usize) -> [usize; 2] {
        let at = |i: usize| i as f64 / (n - 1) as f64;
        let value = |x: f64, y: f64, z: f64| {
            let w = |c: usize, k: usize, t: f64| if c >> k & 1 == 1 { t } else { 1.0 - t };
            (0..8).map(|c| f64::from(d[c]) * w(c, 0, x) * w(c, 1, y) * w(c, 2, z)).sum::<f64>()
        };
        let inside: Vec<bool> =
            (0..n * n * n).map(|i| value(at(i % n), at(i / n % n), at(i / n / n)) < 0.0).collect();
        let mut seen = vec![false; inside.len()];
        let mut counts = [0, 0];
        for start in 0..inside.len() {
            if std::mem::replace(&mut seen[start], true) {
                continue;
            }
            counts[usize::from(inside[start])] += 1;
            let mut open = vec![start];
            while let Some(i) = open.pop() {
                for (k, stride) in [1, n, n * n].into_iter().enumerate() {
                    let c = [i % n, i / n % n, i / n / n][k];
                    let below = (c > 0).then(|| i - stride);
                    let above = (c + 1 < n).then(|| i + stride);
                    for j in below.into_iter().chain(above) {
                        if inside[j] == inside[start] && !std::mem::replace(&mut seen[j], true) {
                            open.push(j);
                        }
                    }
                }
            }
        }
        counts
    }

    #[test]
    fn cubes_have_the_topology_of_the_trilinear_field() {
        let mut random = Random(11);
        let (mut compared, mut tubes, mut unsure, mut thin) = (0, 0, 0, 0);
        for n in 0..6000 {
            let d = random_cube(&mut random, n);
            let (case, joined) = case_and_joined(&d);
            if TABLE.plain[usize::from(case)].triangles != AMBIGUOUS {
                continue;
            }
            let (components, euler) = check(case, joined, TABLE.patch(case, &d));
            // A surface of n components cuts the cube into n + 1 parts. Necks may be thinner than a grid shows.
            let agrees = |n: usize| parts(&d, n).iter().sum::<usize>() == components + 1;
            if !agrees(24) {
                unsure += 1;
                if !agrees(140) {
                    thin += 1;
                }
            }
            compared += 1;
            tubes += usize::from(euler != loops(case, joined).len() as i64);
        }
        assert!(compared > 2000 && tubes > 5 && thin == 0, "{compared} {tubes} {unsure} {thin}");
    }
}
