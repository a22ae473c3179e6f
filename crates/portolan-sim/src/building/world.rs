//! A 3-D world of bodies, and its ground truth.

use super::shape::Shape;
use super::tree::Tree;
use portolan::geom::Aabb;
use portolan::geom::vector::{along, distance, scale, sub, unit};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// A solid with a name and a color.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// The name.
    pub name: String,
    /// The shape, at its position.
    pub shape: Shape,
    /// Red, green, blue of its light squares; see [`World3::color`].
    pub color: [u8; 3],
}

/// The hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit3 {
    /// Arc length (meters).
    pub range: f64,
    /// Unit normal of the surface, toward free space.
    pub normal: [f64; 3],
    /// Index of the body.
    pub body: usize,
}

/// A 3-D world of bodies. Bodies that overlap act as their union, without surfaces inside.
///
/// Bodies that belong together must overlap by centimeters, and not merely touch, so that rays cannot pass between them and
/// hidden faces lie far from visible ones.
#[derive(Clone, Debug, PartialEq)]
pub struct World3 {
    bodies: Vec<Body>,
    shapes: Vec<Shape>,
    tree: Tree,
}

/// Edge of the squares of the painted checkerboard (meters).
pub const CHECKER: f64 = 0.4;
/// A point of the lattice of the checkerboard, off any wall (meters).
const CHECKER_ORIGIN: [f64; 3] = [0.137, 0.171, 0.259];
/// Accuracy of depths inside unions (meters).
pub const DEPTH_TOLERANCE: f64 = 1e-4;
/// Largest number of cells in the search for them.
const DEPTH_CELLS: usize = 400_000;

impl World3 {
    /// A world of these bodies.
    ///
    /// # Panics
    /// Where a body is not finite.
    pub fn new(bodies: Vec<Body>) -> Self {
        let shapes: Vec<_> = bodies.iter().map(|b| b.shape).collect();
        for body in &bodies {
            let Aabb { min, max } = body.shape.aabb();
            assert!(min.iter().chain(&max).all(|v| v.is_finite()), "body {} is not finite", body.name);
        }
        Self { tree: Tree::new(&shapes), shapes, bodies }
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The bounding box of all bodies.
    pub fn aabb(&self) -> Aabb<3> {
        self.shapes.iter().fold(Aabb::EMPTY, |b, s| b.union(s.aabb()))
    }

    /// The first surface hit by a ray (unit direction) from free space. Exact; usually O(log bodies).
    pub fn cast_ray(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<RayHit3> {
        let (body, entry) = self.tree.cast(&self.shapes, origin, direction)?;
        Some(RayHit3 { range: entry.range, normal: entry.normal, body })
    }

    /// Whether a point lies inside a body.
    pub fn is_inside(&self, p: [f64; 3]) -> bool {
        self.tree.nearest(&self.shapes, p).is_some_and(|(_, d)| d < 0.0)
    }

    /// Signed distance to the surface of the union of all bodies (meters): positive in free space, negative inside.
    /// Infinite in a world without bodies.
    ///
    /// Exact in free space, and inside wherever the nearest face of the body in which the point lies deepest is part of
    /// the surface of the union. Elsewhere, where bodies overlap, a search finds it to [`DEPTH_TOLERANCE`], which takes
    /// milliseconds instead of less than a microsecond.
    pub fn signed_distance(&self, p: [f64; 3]) -> f64 {
        let Some((body, d)) = self.tree.nearest(&self.shapes, p) else { return f64::INFINITY };
        if d >= 0.0 { d } else { -self.depth(p, body, -d) }
    }

    /// The color of the surface of a body near a point: that of the body, darker on every other cube of a 3-D checkerboard
    /// of [`CHECKER`] meters.
    pub fn color(&self, body: usize, p: [f64; 3]) -> [u8; 3] {
        let square =
            |k: usize| if ((p[k] - CHECKER_ORIGIN[k]) / CHECKER).floor() as i64 & 1 == 0 { 0 } else { 1 };
        let odd = (square(0) + square(1) + square(2)) & 1 == 1;
        let light = self.bodies[body].color;
        if odd { light.map(|v| (u16::from(v) * 7 / 10) as u8) } else { light }
    }

    /// The color of the surface nearest to a point in free space, or of the body that contains the point; black in a world
    /// without bodies.
    pub fn color_near(&self, p: [f64; 3]) -> [u8; 3] {
        self.tree.nearest(&self.shapes, p).map_or([0; 3], |(body, _)| self.color(body, p))
    }

    /// The least signed distance of any body: 1-Lipschitz, positive exactly in free space.
    fn least(&self, p: [f64; 3]) -> f64 {
        self.tree.nearest(&self.shapes, p).map_or(f64::INFINITY, |(_, d)| d)
    }

    /// Distance from a point inside to free space; `body` is that in which it lies deepest, by `deepest`.
    fn depth(&self, p: [f64; 3], body: usize, deepest: f64) -> f64 {
        // One step out of this body along its steepest way: in free space, or in another body?
        if let Some(way) = self.way_out(p, body)
            && self.least(along(p, way, deepest + 1e-9)) > 0.0
        {
            return deepest;
        }
        self.search_depth(p, deepest)
    }

    /// Unit vector from a point inside a body to the nearest point of that body's own surface.
    fn way_out(&self, p: [f64; 3], body: usize) -> Option<[f64; 3]> {
        let shape = &self.shapes[body];
        let step = 1e-6;
        let slope = |k: usize| {
            let mut q = [p, p];
            q[0][k] -= step;
            q[1][k] += step;
            shape.signed_distance(q[1]) - shape.signed_distance(q[0])
        };
        unit([slope(0), slope(1), slope(2)])
    }

    /// Best first over a tree of cubes about the point: the nearest cube that may hold free space is looked at next.
    fn search_depth(&self, p: [f64; 3], at_least: f64) -> f64 {
        let Aabb { min, max } = self.aabb();
        // Beyond the box around all bodies there is free space.
        let mut found = (0..3).map(|k| (p[k] - min[k]).min(max[k] - p[k])).fold(f64::INFINITY, f64::min);
        let mut queue = BinaryHeap::new();
        let mut cells = 0;
        queue.push(Reverse(Cube { nearest: 0.0, centre: p, half: found }));
        while let Some(Reverse(cube)) = queue.pop() {
            cells += 1;
            if cube.nearest.max(at_least) >= found - DEPTH_TOLERANCE || cells > DEPTH_CELLS {
                break;
            }
            let d = self.least(cube.centre);
            if d + cube.half * 3f64.sqrt() <= 0.0 {
                continue;
            }
            if d > 0.0 {
                found = found.min(self.first_free(p, cube.centre));
            }
            for octant in 0..8usize {
                let half = 0.5 * cube.half;
                let side = |k: usize| if octant >> k & 1 == 0 { -half } else { half };
                let centre = std::array::from_fn(|k| cube.centre[k] + side(k));
                let gap: [f64; 3] = std::array::from_fn(|k| ((centre[k] - p[k]).abs() - half).max(0.0));
                let nearest = portolan::geom::vector::norm(gap);
                if nearest < found - DEPTH_TOLERANCE {
                    queue.push(Reverse(Cube { nearest, centre, half }));
                }
            }
        }
        found.max(at_least)
    }

    /// Where the segment from inside to a point of free space leaves the bodies for the last time (meters from `p`).
    fn first_free(&self, p: [f64; 3], free: [f64; 3]) -> f64 {
        let whole = distance(p, free);
        let back = scale(sub(p, free), 1.0 / whole);
        // Sphere tracing from the free end: steps of the distance never pass a surface.
        let mut walked = 0.0;
        while walked < whole {
            let d = self.least(along(free, back, walked));
            if d < 1e-7 {
                break;
            }
            walked += d;
        }
        whole - walked.min(whole)
    }
}

/// A cube of the search for depths, ordered by how near it comes to the point.
struct Cube {
    nearest: f64,
    centre: [f64; 3],
    half: f64,
}

impl PartialEq for Cube {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Cube {}

impl PartialOrd for Cube {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cube {
    fn cmp(&self, other: &Self) -> Ordering {
        self.nearest.total_cmp(&other.nearest).then(self.half.total_cmp(&other.half))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Random;
    use crate::building::building_world;
    use portolan::geom::Pose;
    use portolan::geom::vector::{dot, norm};

    fn body(shape: Shape) -> Body {
        Body { name: String::new(), shape, color: [200; 3] }
    }

    fn direction(random: &mut Random) -> [f64; 3] {
        unit([0; 3].map(|_: i32| random.normal())).unwrap()
    }

    /// Overlapping shapes of every kind, turned anyhow.
    fn heap(seed: u64, count: usize) -> World3 {
        let mut r = Random::stream(seed, 0);
        let mut bodies = Vec::new();
        for i in 0..count {
            let centre = [0; 3].map(|_: i32| 4.0 * r.uniform());
            let mut size = || 0.05 + 0.6 * r.uniform();
            let shape = match i % 3 {
                0 => {
                    let (half, xyzw) = ([size(), size(), size()], [0; 4].map(|_: i32| r.normal()));
                    Shape::Box { world_from_box: Pose::from_quaternion(centre, xyzw).unwrap(), half }
                }
                1 => Shape::Cylinder { centre, radius: size(), half_height: size() },
                _ => Shape::Sphere { centre, radius: size() },
            };
            bodies.push(body(shape));
        }
        World3::new(bodies)
    }

    #[test]
    fn the_tree_answers_as_all_bodies_one_by_one() {
        for (seed, count) in [(1, 1), (2, 2), (3, 17), (4, 90)] {
            let world = heap(seed, count);
            let mut random = Random::stream(seed, 1);
            for _ in 0..2000 {
                let p = [0; 3].map(|_: i32| 6.0 * random.uniform() - 1.0);
                let d = direction(&mut random);
                let least = world.shapes.iter().map(|s| s.signed_distance(p)).fold(f64::INFINITY, f64::min);
                assert_eq!(world.least(p), least);
                let first = world
                    .shapes
                    .iter()
                    .filter_map(|s| s.enter(p, d))
                    .map(|e| e.range)
                    .fold(f64::INFINITY, f64::min);
                assert_eq!(world.cast_ray(p, d).map_or(f64::INFINITY, |h| h.range), first);
            }
        }
    }

    #[test]
    fn rays_end_where_the_distance_is_zero() {
        for world in [heap(7, 60), building_world(1).world] {
            let mut random = Random::stream(9, 0);
            let Aabb { min, .. } = world.aabb();
            let extent = world.aabb().extent();
            let mut met = 0;
            while met < 2000 {
                let p = [0, 1, 2].map(|k| min[k] + extent[k] * random.uniform());
                let clearance = world.signed_distance(p);
                if clearance <= 0.0 {
                    continue;
                }
                let d = direction(&mut random);
                // An independent way to the same place: sphere tracing.
                let mut walked = 0.0;
                while walked < 50.0 {
                    let step = world.least(along(p, d, walked));
                    if step < 1e-10 {
                        break;
                    }
                    walked += step;
                }
                let hit = world.cast_ray(p, d);
                let Some(hit) = hit else {
                    assert!(walked >= 50.0, "{p:?} {d:?} {walked}");
                    continue;
                };
                met += 1;
                assert!(hit.range >= clearance - 1e-12);
                // Where the ray grazes an edge sphere tracing gives up early, never late.
                let end = along(p, d, hit.range);
                assert!(walked <= hit.range + 1e-9);
                assert!(world.least(along(p, d, walked)) < 1e-6);
                assert!(world.least(end).abs() < 1e-9, "{}", world.least(end));
                assert!(dot(hit.normal, d) < 0.0 && (norm(hit.normal) - 1.0).abs() < 1e-9);
                assert!(world.least(along(end, hit.normal, 1e-6)) > 0.0);
            }
        }
    }

    #[test]
    fn depths_are_those_of_the_union() {
        // Two boxes that share a hidden face: the middle of the union is 0.5 deep, however near to that face.
        let two = World3::new(vec![
            body(Shape::between([-2.0, -0.5, -1.0], [0.1, 0.5, 1.0])),
            body(Shape::between([-0.1, -0.5, -1.0], [2.0, 0.5, 1.0])),
        ]);
        for (p, depth) in [
            ([0.0, 0.0, 0.0], 0.5),
            ([0.05, 0.2, 0.1], 0.3),
            ([-0.09, 0.0, 0.9], 0.1),
            ([1.0, 0.0, 0.0], 0.5),
        ] {
            assert!((two.signed_distance(p) + depth).abs() <= 2.0 * DEPTH_TOLERANCE, "{p:?}");
        }
        // The distance inside is that of the nearest free point: all points nearer are inside.
        let world = heap(11, 60);
        let mut random = Random::stream(12, 0);
        let mut inside = 0;
        while inside < 60 {
            let p = [0; 3].map(|_: i32| 4.0 * random.uniform());
            let d = world.signed_distance(p);
            if d >= -1e-3 {
                continue;
            }
            inside += 1;
            let free_at = |reach: f64, random: &mut Random| {
                (0..4000).any(|_| world.least(along(p, direction(random), reach)) > 0.0)
            };
            assert!(!free_at((-d - DEPTH_TOLERANCE).max(0.0), &mut random), "{p:?} {d}");
            // And in free space a little further out, somewhere.
            assert!(free_at(-d + 0.03, &mut random), "{p:?} {d}");
        }
    }

    #[test]
    fn squares_are_painted_and_off_the_walls() {
        let world = building_world(1).world;
        let light = world.bodies()[0].color;
        let [dark] = [light.map(|v| (u16::from(v) * 7 / 10) as u8)];
        let at = |x: f64| world.color(0, [x, 3.0, 0.0]);
        assert!([light, dark].contains(&at(1.0)));
        assert_ne!(at(1.0), at(1.0 + CHECKER));
        assert_eq!(at(1.0), at(1.0 + 2.0 * CHECKER));
        assert_eq!(World3::new(Vec::new()).color_near([0.0; 3]), [0; 3]);
        assert_eq!(World3::new(Vec::new()).signed_distance([0.0; 3]), f64::INFINITY);
    }
}
