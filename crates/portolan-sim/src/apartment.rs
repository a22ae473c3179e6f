//! The Apartment: 12 m x 9 m, ten rooms on a corridor.

use crate::{Solid, SolidKind, World};

/// The Apartment and the path of the robot through it.
#[derive(Clone, Debug)]
pub struct Apartment {
    /// Walls, furniture, and the movable solid `chair`.
    pub world: World,
    /// Corners of the path of one lap (world, meters); the last is the first.
    pub path: Vec<[f64; 2]>,
}

/// Displacement of the chair when it is moved (meters).
pub const CHAIR_MOVE: [f64; 2] = [1.38, -1.62];

/// Thickness of every wall (meters).
const WALL: f64 = 0.3;
const DOOR: f64 = 0.9;
const SIZE: [f64; 2] = [12.0, 9.0];
/// Middle of the corridor; the rooms on either side mirror each other's measures.
const CORRIDOR: f64 = 4.5;
/// Faces of the rooms: the outer wall and the corridor's.
const BACK: f64 = 0.3;
const FRONT: f64 = 3.6;
/// The low end of the wall that reaches into each room.
const STUB: f64 = 1.75;

/// A room below the corridor, or its mirror image above.
struct Room {
    name: &'static str,
    above: bool,
    width: f64,
    /// A wall of this length reaches from one side into the room and leaves a passage on the other.
    stub: f64,
    from_left: bool,
    /// Along the outer wall: name, from which distance of the stub's side, how wide, how deep.
    back: (&'static str, f64, f64, f64),
    /// Beside the stub's side near the corridor: name, width, and from where to where along the side.
    front: (&'static str, f64, [f64; 2]),
}

const fn room(
    (name, above): (&'static str, bool),
    (width, stub, from_left): (f64, f64, bool),
    back: (&'static str, f64, f64, f64),
    front: (&'static str, f64, [f64; 2]),
) -> Room {
    Room { name, above, width, stub, from_left, back, front }
}

/// From left to right, first below the corridor, then above it. Widths sum to 10.2 m on each side.
const ROOMS: [Room; 10] = [
    room(("living room", false), (3.0, 1.4, true), ("sofa", 0.3, 1.8, 0.6), ("cupboard", 0.45, [2.3, 3.3])),
    room(("kitchen", false), (2.1, 1.0, true), ("counter", 0.0, 1.9, 0.55), ("fridge", 0.5, [2.1, 2.7])),
    room(("bath", false), (1.5, 0.5, false), ("tub", 0.0, 1.5, 0.55), ("basin", 0.35, [2.2, 2.7])),
    room(("bedroom", false), (2.1, 1.0, false), ("bed", 0.0, 1.9, 0.6), ("wardrobe", 0.5, [2.1, 3.2])),
    room(("study", false), (1.5, 0.5, true), ("desk", 0.0, 1.2, 0.55), ("shelf", 0.3, [2.1, 3.1])),
    room(
        ("large bedroom", true),
        (2.4, 1.2, false),
        ("double bed", 0.2, 1.8, 0.6),
        ("dresser", 0.45, [2.2, 3.2]),
    ),
    room(("shower", true), (1.5, 0.5, true), ("shower tray", 0.0, 0.8, 0.5), ("washer", 0.45, [2.2, 2.8])),
    room(("store", true), (1.5, 0.6, true), ("rack", 0.0, 1.5, 0.4), ("boxes", 0.4, [2.4, 3.1])),
    room(("dining room", true), (2.7, 1.4, true), ("sideboard", 0.4, 1.6, 0.45), ("piano", 0.55, [2.1, 3.3])),
    room(("office", true), (2.1, 1.0, false), ("long desk", 0.0, 1.7, 0.6), ("cabinet", 0.45, [2.2, 3.0])),
];

/// Builds the Apartment. Its lower left outer corner is the origin of the world; its area is 108 square meters.
pub fn apartment() -> Apartment {
    let wall = |name: &str, min, max| Solid::rectangle(name, SolidKind::Wall, min, max);
    let [width, height] = SIZE;
    let mut solids = vec![
        wall("outer wall, south", [0.0, 0.0], [width, WALL]),
        wall("outer wall, north", [0.0, height - WALL], [width, height]),
        wall("outer wall, west", [0.0, 0.0], [WALL, height]),
        wall("outer wall, east", [width - WALL, 0.0], [width, height]),
    ];
    let mut visits = Vec::new();
    for above in [false, true] {
        let mut x = WALL;
        let mut corridor_wall = WALL;
        for room in ROOMS.iter().filter(|r| r.above == above) {
            let place = Placed { room, left: x, right: x + room.width };
            let door = place.passage();
            solids.push(place.solid(
                "corridor wall",
                SolidKind::Wall,
                [corridor_wall, FRONT],
                [door - 0.5 * DOOR, FRONT + WALL],
            ));
            corridor_wall = door + 0.5 * DOOR;
            place.furnish(&mut solids);
            visits.push((door, place.visit()));
            x += room.width;
            if x < width - 2.0 * WALL {
                solids.push(place.solid("dividing wall", SolidKind::Wall, [x, BACK], [x + WALL, FRONT]));
                x += WALL;
            } else {
                solids.push(place.solid(
                    "corridor wall",
                    SolidKind::Wall,
                    [corridor_wall, FRONT],
                    [width - WALL, FRONT + WALL],
                ));
            }
        }
    }
    solids.push(Solid::rectangle("chair", SolidKind::Movable, [1.42, 2.6], [1.87, 3.05]));
    // Room by room along the corridor and straight back.
    visits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let start = [0.9, CORRIDOR];
    let mut path = vec![start];
    path.extend(visits.into_iter().flat_map(|v| v.1));
    path.extend([[width - 0.9, CORRIDOR], start]);
    Apartment { world: World::new(solids), path }
}

/// A room at its place, measured as if it were below the corridor.
struct Placed<'a> {
    room: &'a Room,
    left: f64,
    right: f64,
}

impl Placed<'_> {
    fn mirror(&self, p: [f64; 2]) -> [f64; 2] {
        if self.room.above { [p[0], SIZE[1] - p[1]] } else { p }
    }

    fn solid(&self, what: &str, kind: SolidKind, min: [f64; 2], max: [f64; 2]) -> Solid {
        let (a, b) = (self.mirror(min), self.mirror(max));
        let (low, high) = ([a[0], a[1].min(b[1])], [b[0], a[1].max(b[1])]);
        Solid::rectangle(format!("{what}, {}", self.room.name), kind, low, high)
    }

    /// From distances from the stub's side to x, ascending.
    fn across(&self, from: f64, to: f64) -> [f64; 2] {
        if self.room.from_left {
            [self.left + from, self.left + to]
        } else {
            [self.right - to, self.right - from]
        }
    }

    /// Middle of the door (x): that of the passage beside the stub, as far as both jambs stay inside the room.
    fn passage(&self) -> f64 {
        let [a, b] = self.across(self.room.stub, self.room.width);
        let jamb = 0.5 * DOOR + 0.05;
        (0.5 * (a + b)).clamp(self.left + jamb, self.right - jamb)
    }

    fn furnish(&self, solids: &mut Vec<Solid>) {
        let room = self.room;
        let [x0, x1] = self.across(0.0, room.stub);
        solids.push(self.solid("stub", SolidKind::Wall, [x0, STUB], [x1, STUB + WALL]));
        let (name, from, wide, deep) = room.back;
        let [x0, x1] = self.across(from, from + wide);
        solids.push(self.solid(name, SolidKind::Furniture, [x0, BACK], [x1, BACK + deep]));
        let (name, wide, [low, high]) = room.front;
        let [x0, x1] = self.across(0.0, wide);
        solids.push(self.solid(name, SolidKind::Furniture, [x0, low], [x1, high]));
    }

    /// Into the room, behind its stub, and out again.
    fn visit(&self) -> Vec<[f64; 2]> {
        let door = self.passage();
        let [behind, _] = self.across(0.55, 0.55);
        let deep = BACK + 1.02;
        let turn = self.mirror([door, deep]);
        let way = [[door, CORRIDOR], turn, self.mirror([behind, deep]), turn, [door, CORRIDOR]];
        way.to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wall_faces_are_180_6_metres() {
        let length = apartment().world.wall_length();
        println!("wall faces: {length:.2} m");
        assert!((length - 180.6).abs() < 0.01 * 180.6, "{length}");
        assert_eq!(apartment().world.aabb().extent(), SIZE);
    }

    #[test]
    fn furniture_stands_in_rooms_and_not_in_walls() {
        let world = apartment().world;
        for solid in world.solids().iter().filter(|s| s.kind != SolidKind::Wall) {
            let b = solid.aabb();
            let middle = [0.5 * (b.min[0] + b.max[0]), 0.5 * (b.min[1] + b.max[1])];
            let inside = world.solids().iter().filter(|s| s.contains(middle)).count();
            assert_eq!(inside, 1, "{}", solid.name);
        }
        let moved = world.with_moved("chair", CHAIR_MOVE);
        let chair = moved.solids().iter().find(|s| s.name == "chair").unwrap().aabb();
        for corner in [chair.min, chair.max, [chair.min[0], chair.max[1]], [chair.max[0], chair.min[1]]] {
            assert!(!world.is_inside(corner), "the chair's new place is taken at {corner:?}");
        }
    }
}
