//! The building: four furnished rooms in a ring, with open windows.

use super::furniture::{Furnisher, STONE, WALL};
use super::shape::Shape;
use super::world::{Body, World3};
use crate::Random;
use std::f64::consts::FRAC_PI_2;

/// The building and the path of the sensor through it.
#[derive(Clone, Debug)]
pub struct Building {
    /// Walls and furniture.
    pub world: World3,
    /// Corners of a closed path through all rooms (x and y, meters), without a repeated first corner.
    pub path: Vec<[f64; 2]>,
}

/// Offset of the whole building (meters), so that no face lies on a lattice of centimeters.
const SHIFT: [f64; 3] = [0.0137, 0.0219, 0.0173];
/// Inner size and clear height (meters).
const SIZE: [f64; 3] = [11.373, 8.231, 2.687];
const OUTER: f64 = 0.233;
/// The walls between the rooms: a long one along x, one across on either side.
const ALONG: [f64; 2] = [4.303, 4.464];
const ACROSS_LOW: [f64; 2] = [6.107, 6.258];
const ACROSS_HIGH: [f64; 2] = [3.911, 4.059];
/// Overlap of bodies that belong together (meters).
const SINK: f64 = 0.07;
const DOOR_HEAD: f64 = 2.087;

/// A hole in a wall: from where to where along it, from which height to which (meters).
struct Opening {
    along: [f64; 2],
    height: [f64; 2],
}

const fn door(from: f64, to: f64) -> Opening {
    Opening { along: [from, to], height: [-1.0, DOOR_HEAD] }
}

const fn window(from: f64, to: f64) -> Opening {
    Opening { along: [from, to], height: [0.917, 2.143] }
}

/// The building of a seed: the walls are always the same, furniture is shifted and turned at random.
///
/// 11.4 m x 8.2 m x 2.7 m inside: living room, kitchen, hall and study, joined by four doors in a ring; a window in each
/// room, open, through which rays escape. 147 bodies: tables with tops of 3 cm and legs of 4 cm, shelves, pillars
/// round and square, a plate of 9 mm, a lamp on a cable of 12 mm.
pub fn building_world(seed: u64) -> Building {
    let mut bodies = Vec::new();
    shell(&mut bodies);
    let mut furnisher = Furnisher { random: Random::stream(seed, 0x000B_171D), bodies: &mut bodies };
    furnish(&mut furnisher);
    for body in &mut bodies {
        body.shape = moved(body.shape);
    }
    let path = [
        [3.1, 3.0],
        [5.1, 2.2],
        [6.18, 2.08],
        [7.3, 2.1],
        [8.7, 2.3],
        [9.35, 3.2],
        [9.35, 5.4],
        [7.2, 6.0],
        [5.0, 6.45],
        [3.0, 6.45],
        [1.95, 5.4],
        [1.95, 3.4],
    ];
    Building { world: World3::new(bodies), path: path.map(|[x, y]| [x + SHIFT[0], y + SHIFT[1]]).to_vec() }
}

fn moved(shape: Shape) -> Shape {
    let shift = |p: [f64; 3]| std::array::from_fn(|k| p[k] + SHIFT[k]);
    match shape {
        Shape::Box { mut world_from_box, half } => {
            world_from_box.translation = shift(world_from_box.translation);
            Shape::Box { world_from_box, half }
        }
        Shape::Cylinder { centre, radius, half_height } => {
            Shape::Cylinder { centre: shift(centre), radius, half_height }
        }
        Shape::Sphere { centre, radius } => Shape::Sphere { centre: shift(centre), radius },
    }
}

/// Floor, ceiling, walls.
fn shell(bodies: &mut Vec<Body>) {
    let [x, y, z] = SIZE;
    let slab = |name: &str, low: f64, high: f64, color| Body {
        name: name.to_owned(),
        shape: Shape::between([-OUTER, -OUTER, low], [x + OUTER, y + OUTER, high]),
        color,
    };
    bodies.push(slab("floor", -0.211, 0.0, STONE));
    bodies.push(slab("ceiling", z, z + 0.187, WALL));
    let west = [-OUTER, 0.0];
    let (south, east, north) = (west, [x, x + OUTER], [y, y + OUTER]);
    let (whole_x, whole_y) = ([-OUTER, x + OUTER], [-OUTER, y + OUTER]);
    wall(bodies, 0, south, whole_x, &[window(1.213, 3.107)]);
    wall(bodies, 0, north, whole_x, &[window(5.011, 7.789)]);
    wall(bodies, 1, west, whole_y, &[window(5.593, 7.219)]);
    wall(bodies, 1, east, whole_y, &[window(1.187, 2.913)]);
    wall(bodies, 0, ALONG, [-SINK, x + SINK], &[door(1.497, 2.411), door(8.893, 9.807)]);
    wall(bodies, 1, ACROSS_LOW, [-SINK, ALONG[1] - 0.03], &[door(1.603, 2.557)]);
    wall(bodies, 1, ACROSS_HIGH, [ALONG[0] + 0.03, y + SINK], &[door(5.987, 6.913)]);
}

/// A wall along an axis (0: x, 1: y), in pieces around its openings, which ascend.
fn wall(bodies: &mut Vec<Body>, axis: usize, across: [f64; 2], along: [f64; 2], openings: &[Opening]) {
    let mut piece = |along: [f64; 2], height: [f64; 2]| {
        let (mut min, mut max) = ([0.0, 0.0, height[0]], [0.0, 0.0, height[1]]);
        (min[axis], max[axis]) = (along[0], along[1]);
        (min[1 - axis], max[1 - axis]) = (across[0], across[1]);
        bodies.push(Body { name: "wall".to_owned(), shape: Shape::between(min, max), color: WALL });
    };
    let (low, high) = (-SINK, SIZE[2] + SINK);
    let mut from = along[0];
    for opening in openings {
        let [left, right] = opening.along;
        piece([from, left], [low, high]);
        let wide = [left - SINK, right + SINK];
        piece(wide, [opening.height[1], high]);
        if opening.height[0] > 0.0 {
            piece(wide, [low, opening.height[0]]);
        }
        from = right;
    }
    piece([from, along[1]], [low, high]);
}

fn furnish(f: &mut Furnisher<'_>) {
    // Living room.
    f.table([3.35, 1.25], 0.21, [1.43, 0.83]);
    f.sofa([0.56, 1.75], 0.0);
    f.shelf([4.55, 4.06], 0.0, [1.91, 0.31, 1.83]);
    f.floor_lamp([5.55, 0.47]);
    f.stool([2.35, 0.62]);
    f.stool([4.47, 1.53]);
    // Kitchen.
    f.counter([6.62, 0.12], [3.91, 0.61]);
    f.fridge([10.83, 0.53], 0.0);
    f.round_table([10.1, 3.15]);
    f.pendant_lamp([10.1, 3.15], SIZE[2]);
    f.stool([10.83, 3.55]);
    f.stool([7.05, 3.55]);
    f.cupboard([7.3, 4.05], 0.0);
    // Hall.
    f.pillar([5.67, 7.33], SIZE[2]);
    f.pillar([8.13, 7.33], SIZE[2]);
    f.square_pillar([10.41, 6.63], 0.61, SIZE[2]);
    f.plate([6.93, 4.98], 0.13);
    f.bench([10.55, 5.27], FRAC_PI_2);
    f.ball([4.83, 5.21], 0.307);
    f.ball([9.47, 7.61], 0.193);
    // Study.
    f.table([0.63, 6.43], FRAC_PI_2, [1.61, 0.77]);
    f.shelf([3.07, 7.98], 0.0, [1.53, 0.29, 2.07]);
    f.shelf([0.21, 4.86], FRAC_PI_2, [0.61, 0.29, 1.57]);
    f.stool([1.33, 6.87]);
    f.bin([0.37, 7.83]);
    f.leaning_board([1.71, 7.93]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_is_clear_for_any_seed() {
        for seed in 0..20 {
            let building = building_world(seed);
            let corners = building.path.len();
            for i in 0..corners {
                let (a, b) = (building.path[i], building.path[(i + 1) % corners]);
                for k in 0..40 {
                    let t = f64::from(k) / 40.0;
                    let p = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), 1.15];
                    let d = building.world.signed_distance(p);
                    assert!(d > 0.3, "seed {seed}: {d} at {p:?}");
                }
            }
        }
    }

    #[test]
    fn no_wall_lies_on_the_lattice_of_five_centimetres() {
        let world = building_world(1).world;
        println!("{} bodies", world.bodies().len());
        for body in world.bodies() {
            let Shape::Box { world_from_box, half } = body.shape else { continue };
            if !["wall", "floor", "ceiling"].contains(&body.name.as_str()) {
                continue;
            }
            for k in 0..3 {
                for face in [-half[k], half[k]].map(|h| world_from_box.translation[k] + h) {
                    let off = (face / 0.05 - (face / 0.05).round()).abs() * 0.05;
                    assert!(off > 3e-4, "{} has a face at {face}", body.name);
                }
            }
        }
    }

    #[test]
    fn rays_escape_through_windows_and_nowhere_else() {
        let building = building_world(1);
        let mut random = Random::stream(3, 3);
        let (mut escaped, rays) = (0, 20_000);
        for i in 0..rays {
            let [x, y] = building.path[i % building.path.len()];
            let direction = portolan::geom::vector::unit([0; 3].map(|_: i32| random.normal())).unwrap();
            escaped += usize::from(building.world.cast_ray([x, y, 1.15], direction).is_none());
        }
        let share = escaped as f64 / rays as f64;
        println!("{:.1} % of all rays leave through a window", 100.0 * share);
        assert!((0.01..0.1).contains(&share));
    }
}
