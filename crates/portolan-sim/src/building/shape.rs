//! Boxes, cylinders and spheres: rays, distances, surfaces, in closed form.

use portolan::geom::vector::{along, dot, norm, scale, sub};
use portolan::geom::{Aabb, Pose};

/// A solid with a signed distance in closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A box centered at the origin of its own frame.
    Box {
        /// The frame of the box.
        world_from_box: Pose<3>,
        /// Half the edge lengths (meters).
        half: [f64; 3],
    },
    /// A cylinder whose axis is vertical.
    Cylinder {
        /// Middle of the axis (meters).
        centre: [f64; 3],
        /// Meters.
        radius: f64,
        /// Half its height (meters).
        half_height: f64,
    },
    /// A sphere.
    Sphere {
        /// Meters.
        centre: [f64; 3],
        /// Meters.
        radius: f64,
    },
}

/// The entry of a ray into a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    /// Arc length (meters).
    pub(super) range: f64,
    /// Outward unit normal of the surface there.
    pub(super) normal: [f64; 3],
}

impl Shape {
    /// An axis-aligned box between two corners.
    pub fn between(min: [f64; 3], max: [f64; 3]) -> Self {
        let centre = std::array::from_fn(|k| 0.5 * (min[k] + max[k]));
        let world_from_box = Pose { translation: centre, ..Pose::IDENTITY };
        Self::Box { world_from_box, half: std::array::from_fn(|k| 0.5 * (max[k] - min[k])) }
    }

    /// The axis-aligned bounding box.
    pub fn aabb(&self) -> Aabb<3> {
        let (centre, reach) = match *self {
            Self::Box { world_from_box, half } => {
                let row = |k: usize| (0..3).map(|j| (world_from_box.rotation[k][j] * half[j]).abs()).sum();
                (world_from_box.translation, std::array::from_fn(row))
            }
            Self::Cylinder { centre, radius, half_height } => (centre, [radius, radius, half_height]),
            Self::Sphere { centre, radius } => (centre, [radius; 3]),
        };
        Aabb::new(along(centre, reach, -1.0), along(centre, reach, 1.0))
    }

    /// Signed distance to the surface (meters): positive outside. Exact.
    pub fn signed_distance(&self, p_world: [f64; 3]) -> f64 {
        match *self {
            Self::Box { world_from_box, half } => {
                let p = to_local(&world_from_box, sub(p_world, world_from_box.translation));
                beyond::<3>(std::array::from_fn(|k| p[k].abs() - half[k]))
            }
            Self::Cylinder { centre, radius, half_height } => {
                let p = sub(p_world, centre);
                beyond([norm([p[0], p[1]]) - radius, p[2].abs() - half_height])
            }
            Self::Sphere { centre, radius } => norm(sub(p_world, centre)) - radius,
        }
    }

    /// Where a ray (unit direction) enters the shape from outside; `None` if it misses, or starts inside or beyond.
    pub(super) fn enter(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<Entry> {
        match *self {
            Self::Box { world_from_box, half } => {
                let o = to_local(&world_from_box, sub(origin, world_from_box.translation));
                let d = to_local(&world_from_box, direction);
                let entry = enter_box(o, d, half)?;
                Some(Entry { normal: world_from_box.rotate(entry.normal), ..entry })
            }
            Self::Cylinder { centre, radius, half_height } => {
                enter_cylinder(sub(origin, centre), direction, radius, half_height)
            }
            Self::Sphere { centre, radius } => {
                let o = sub(origin, centre);
                let (near, _) = roots(1.0, dot(o, direction), dot(o, o) - radius * radius)?;
                let normal = scale(along(o, direction, near), 1.0 / radius);
                (near >= 0.0).then_some(Entry { range: near, normal })
            }
        }
    }
}

/// Where a ray from `o` enters an axis-aligned box about the origin.
fn enter_box(o: [f64; 3], d: [f64; 3], half: [f64; 3]) -> Option<Entry> {
    let (mut near, mut far, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    for k in 0..3 {
        if d[k] == 0.0 {
            if o[k].abs() > half[k] {
                return None;
            }
            continue;
        }
        let (a, b) = ((-half[k] - o[k]) / d[k], (half[k] - o[k]) / d[k]);
        if a.min(b) > near {
            (near, axis) = (a.min(b), k);
        }
        far = far.min(a.max(b));
    }
    let mut normal = [0.0; 3];
    normal[axis] = -d[axis].signum();
    (near >= 0.0 && near <= far).then_some(Entry { range: near, normal })
}

/// Where a ray from `o` enters a vertical cylinder about the origin.
fn enter_cylinder(o: [f64; 3], d: [f64; 3], radius: f64, half_height: f64) -> Option<Entry> {
    // Between the planes of its ends, and inside the round wall.
    let (mut near, mut far, mut cap) = (f64::NEG_INFINITY, f64::INFINITY, true);
    if d[2] != 0.0 {
        let (a, b) = ((-half_height - o[2]) / d[2], (half_height - o[2]) / d[2]);
        (near, far) = (a.min(b), a.max(b));
    } else if o[2].abs() > half_height {
        return None;
    }
    let a = d[0] * d[0] + d[1] * d[1];
    let c = o[0] * o[0] + o[1] * o[1] - radius * radius;
    if a > 0.0 {
        let (low, high) = roots(a, o[0] * d[0] + o[1] * d[1], c)?;
        if low > near {
            (near, cap) = (low, false);
        }
        far = far.min(high);
    } else if c > 0.0 {
        return None;
    }
    (near >= 0.0 && near <= far).then(|| {
        let p = along(o, d, near);
        let normal =
            if cap { [0.0, 0.0, -d[2].signum()] } else { scale([p[0], p[1], 0.0], 1.0 / norm([p[0], p[1]])) };
        Entry { range: near, normal }
    })
}

/// A displacement in the axes of a frame.
#[inline(always)]
fn to_local(world_from_local: &Pose<3>, v: [f64; 3]) -> [f64; 3] {
    let m = &world_from_local.rotation;
    std::array::from_fn(|k| m[0][k] * v[0] + m[1][k] * v[1] + m[2][k] * v[2])
}

/// Signed distance from the excess of a point beyond each of several perpendicular pairs of faces.
#[inline(always)]
fn beyond<const N: usize>(excess: [f64; N]) -> f64 {
    let deepest = excess.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if deepest <= 0.0 { deepest } else { norm(excess.map(|v| v.max(0.0))) }
}

/// Real roots of `a t^2 + 2 b t + c`, ascending (`a > 0`).
fn roots(a: f64, b: f64, c: f64) -> Option<(f64, f64)> {
    let disc = b * b - a * c;
    (disc >= 0.0).then(|| ((-b - disc.sqrt()) / a, (-b + disc.sqrt()) / a))
}
