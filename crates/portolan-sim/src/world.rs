//! A 2-D world of solids, and its ground truth.

use crate::{Solid, SolidKind, Truth};
use portolan::geom::Aabb;
use portolan::geom::vector::{along, cross, dot, point_segment, sub, unit};

/// A piece of the boundary between free space and the union of all solids; free space lies on the right
/// (solids run counter-clockwise).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundarySegment {
    /// Start (world, meters).
    pub a: [f64; 2],
    /// End.
    pub b: [f64; 2],
    /// Index of its solid.
    pub solid: usize,
}

/// The hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Arc length (meters).
    pub range: f64,
    /// Unit normal of the surface, toward free space.
    pub normal: [f64; 2],
    /// Index of the solid.
    pub solid: usize,
}

/// A 2-D world of solids. Solids that touch or overlap act as their union, without surfaces inside.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    solids: Vec<Solid>,
    boxes: Vec<Aabb<2>>,
    boundary: Vec<BoundarySegment>,
}

/// Points this far to either side of a boundary decide what it separates (meters).
const ASIDE: f64 = 1e-7;

/// How far beyond the ends of a segment a ray still meets it, as a share of its length: a ray into the corner of a room must
/// not pass between the two faces that meet there.
const END_SLACK: f64 = 1e-9;

impl World {
    /// A world of these solids. Clockwise corners are reversed.
    ///
    /// # Panics
    /// Where a corner is not finite.
    pub fn new(mut solids: Vec<Solid>) -> Self {
        for solid in &mut solids {
            assert!(
                solid.corners.iter().flatten().all(|v| v.is_finite()),
                "solid {} has a corner that is not finite",
                solid.name
            );
            if solid.edges().map(|[a, b]| cross(a, b)).sum::<f64>() < 0.0 {
                solid.corners.reverse();
            }
        }
        let boxes: Vec<_> = solids.iter().map(|s| s.aabb().grown(2.0 * ASIDE)).collect();
        let boundary = boundary(&solids, &boxes);
        Self { solids, boxes, boundary }
    }

    /// The solids.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// The boundary of the union of all solids, in pieces.
    pub fn boundary(&self) -> &[BoundarySegment] {
        &self.boundary
    }

    /// Length of the boundary of the walls, all faces, without furniture (meters).
    pub fn wall_length(&self) -> f64 {
        let walls: Vec<_> = self.solids.iter().filter(|s| s.kind == SolidKind::Wall).cloned().collect();
        Self::new(walls).boundary.iter().map(|s| portolan::geom::vector::distance(s.a, s.b)).sum()
    }

    /// The world with one solid moved by an offset (meters).
    ///
    /// # Panics
    /// Where no solid has this name.
    pub fn with_moved(&self, name: &str, offset: [f64; 2]) -> Self {
        assert!(self.solids.iter().any(|s| s.name == name), "no solid has the name {name}");
        Self::new(
            self.solids.iter().map(|s| if s.name == name { s.moved(offset) } else { s.clone() }).collect(),
        )
    }

    /// The bounding box of all solids.
    pub fn aabb(&self) -> Aabb<2> {
        self.solids.iter().fold(Aabb::EMPTY, |b, s| b.union(s.aabb()))
    }

    /// Whether a point lies inside a solid.
    pub fn is_inside(&self, p: [f64; 2]) -> bool {
        self.solids.iter().zip(&self.boxes).any(|(s, b)| b.contains(p) && s.contains(p))
    }

    /// Signed distance to the nearest boundary (meters): positive in free space, negative inside solids.
    /// Infinite in a world without solids. O(boundary).
    pub fn signed_distance(&self, p: [f64; 2]) -> f64 {
        let d = self.boundary.iter().map(|s| point_segment(p, s.a, s.b).0).fold(f64::INFINITY, f64::min);
        if self.is_inside(p) { -d } else { d }
    }

    /// The first boundary that a ray meets from its free side. O(boundary).
    pub fn cast_ray(&self, origin: [f64; 2], direction: [f64; 2]) -> Option<RayHit> {
        let mut best: Option<(f64, &BoundarySegment)> = None;
        for s in &self.boundary {
            let edge = sub(s.b, s.a);
            let facing = cross(direction, edge);
            // Only from free space, which is on the right of the edge, into the solid.
            if facing >= 0.0 {
                continue;
            }
            let to = sub(s.a, origin);
            let range = cross(to, edge) / facing;
            let t = cross(to, direction) / facing;
            if range >= 0.0 && (-END_SLACK..=1.0 + END_SLACK).contains(&t) && best.is_none_or(|b| range < b.0)
            {
                best = Some((range, s));
            }
        }
        best.map(|(range, s)| {
            let [x, y] = unit(sub(s.b, s.a)).unwrap_or([1.0, 0.0]);
            RayHit { range, normal: [y, -x], solid: s.solid }
        })
    }
}

impl Truth<2> for World {
    fn signed_distance(&self, p_world: [f64; 2]) -> f64 {
        self.signed_distance(p_world)
    }
}

/// Fractions of the edge from `a` of solid `i` at which edges of other solids cross or touch its line, ascending, both ends
/// included.
fn cuts(solids: &[Solid], i: usize, a: [f64; 2], edge: [f64; 2]) -> Vec<f64> {
    let length_sq = dot(edge, edge);
    let mut cuts = vec![0.0, 1.0];
    for [c, d] in solids.iter().enumerate().filter(|(j, _)| *j != i).flat_map(|(_, s)| s.edges()) {
        let other = sub(d, c);
        let turn = cross(edge, other);
        if turn.abs() > 1e-12 {
            cuts.push(cross(sub(c, a), other) / turn);
        } else {
            cuts.extend([c, d].map(|p| dot(sub(p, a), edge) / length_sq));
        }
    }
    cuts.retain(|t| (0.0..=1.0).contains(t));
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|p, q| (*p - *q).abs() * length_sq.sqrt() < 10.0 * ASIDE);
    cuts
}

/// Cuts every edge where it enters or leaves another solid and keeps the pieces with free space outside.
fn boundary(solids: &[Solid], boxes: &[Aabb<2>]) -> Vec<BoundarySegment> {
    let mut pieces = Vec::new();
    for (i, solid) in solids.iter().enumerate() {
        for [a, b] in solid.edges() {
            let edge = sub(b, a);
            let Some([x, y]) = unit(edge) else { continue };
            let outward = [y, -x];
            let cuts = cuts(solids, i, a, edge);
            let mut open: Option<[f64; 2]> = None;
            for w in cuts.windows(2) {
                let middle = along(a, edge, 0.5 * (w[0] + w[1]));
                let (outside, inside) = (along(middle, outward, ASIDE), along(middle, outward, -ASIDE));
                let covered = |p: [f64; 2], j: usize| boxes[j].contains(p) && solids[j].contains(p);
                let hidden = (0..solids.len()).any(|j| j != i && covered(outside, j));
                // Two solids may share a part of their border; it belongs to the first of them.
                let owned_by_another = (0..i).any(|j| {
                    covered(inside, j) && !covered(outside, j) && {
                        solids[j].edges().any(|[c, d]| point_segment(middle, c, d).0 < ASIDE)
                    }
                });
                match (&mut open, hidden || owned_by_another) {
                    (None, false) => open = Some([w[0], w[1]]),
                    (Some(stretch), false) => stretch[1] = w[1],
                    (_, true) => pieces.extend(open.take().map(|t| (t, a, edge, i))),
                }
            }
            pieces.extend(open.take().map(|t| (t, a, edge, i)));
        }
    }
    let piece = |(t, a, edge, solid): ([f64; 2], [f64; 2], [f64; 2], usize)| BoundarySegment {
        a: along(a, edge, t[0]),
        b: along(a, edge, t[1]),
        solid,
    };
    pieces.into_iter().map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Random;

    fn wall(name: &str, min: [f64; 2], max: [f64; 2]) -> Solid {
        Solid::rectangle(name, SolidKind::Wall, min, max)
    }

    #[test]
    fn overlapping_solids_are_their_union() {
        // A cross of two bars: outline of 12 edges, 4 * (2 * 1 + 1) = 12 long ... bars 3 long, 1 wide.
        let world = World::new(vec![wall("x", [0.0, 1.0], [3.0, 2.0]), wall("y", [1.0, 0.0], [2.0, 3.0])]);
        assert!((world.wall_length() - 12.0).abs() < 1e-9);
        assert!((world.signed_distance([1.5, 1.5]) + 0.5f64.hypot(0.5)).abs() < 1e-9);
        // Touching end to end, and one on top of the other.
        let world = World::new(vec![wall("a", [0.0, 0.0], [2.0, 1.0]), wall("b", [2.0, 0.0], [4.0, 1.0])]);
        assert!((world.wall_length() - 10.0).abs() < 1e-9);
        let world = World::new(vec![wall("a", [0.0, 0.0], [2.0, 1.0]), wall("b", [0.0, 0.0], [2.0, 1.0])]);
        assert!((world.wall_length() - 6.0).abs() < 1e-9);
        // A T: the stem hides a piece of the bar and has no end of its own.
        let world =
            World::new(vec![wall("bar", [0.0, 0.0], [4.0, 1.0]), wall("stem", [1.0, 1.0], [2.0, 3.0])]);
        assert!((world.wall_length() - (10.0 - 1.0 + 4.0 + 1.0)).abs() < 1e-9);
    }

    #[test]
    fn rays_and_distances_agree_with_brute_force() {
        let world = crate::apartment().world;
        let mut random = Random::stream(3, 0);
        for _ in 0..300 {
            let p = [12.0 * random.uniform(), 9.0 * random.uniform()];
            let d = world.signed_distance(p);
            assert_eq!(d < 0.0, world.is_inside(p));
            // No point of the other sign is nearer than the distance.
            for k in 0..64 {
                let angle = std::f64::consts::TAU * f64::from(k) / 64.0;
                let q = along(p, [angle.cos(), angle.sin()], 0.999 * d.abs());
                assert_eq!(world.is_inside(q), d < 0.0, "{p:?} {d}");
            }
            if d > 0.0 {
                let angle = std::f64::consts::TAU * random.uniform();
                let direction = [angle.cos(), angle.sin()];
                if let Some(hit) = world.cast_ray(p, direction) {
                    let end = along(p, direction, hit.range);
                    assert!(world.signed_distance(end).abs() < 1e-9);
                    assert!(dot(hit.normal, direction) < 0.0);
                    for k in 1..200 {
                        let q = along(p, direction, (hit.range - 1e-6) * f64::from(k) / 200.0);
                        assert!(!world.is_inside(q));
                    }
                }
            }
        }
    }

    #[test]
    fn rays_into_corners_do_not_slip_through() {
        let world = crate::apartment().world;
        let mut random = Random::stream(5, 5);
        let mut rays = 0;
        for s in world.boundary() {
            for _ in 0..200 {
                let p = [12.0 * random.uniform(), 9.0 * random.uniform()];
                let Some(direction) = unit(sub(s.a, p)) else { continue };
                let reach = portolan::geom::vector::distance(p, s.a);
                // A corner that stands in the way: solid behind it, free space up to it.
                let free = |range: f64| !world.is_inside(along(p, direction, range));
                let blocked = !free(reach + 1e-4);
                if !blocked || (0..500).any(|k| !free((reach - 1e-6) * f64::from(k) / 500.0)) {
                    continue;
                }
                rays += 1;
                let range = world.cast_ray(p, direction).map(|h| h.range);
                assert!(range.is_some_and(|r| r < reach + 1e-6), "{p:?} to {:?}: {range:?}", s.a);
            }
        }
        assert!(rays > 500, "{rays}");
    }

    #[test]
    fn moving_a_solid_moves_only_it() {
        let a = crate::apartment();
        let moved = a.world.with_moved("chair", crate::CHAIR_MOVE);
        let differing = a.world.solids().iter().zip(moved.solids()).filter(|(x, y)| x != y).count();
        assert_eq!(differing, 1);
    }
}
