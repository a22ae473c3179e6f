//! The furniture of the building, each piece in a frame of its own.

use super::shape::Shape;
use super::world::Body;
use crate::Random;
use portolan::geom::{Aabb, Pose};

pub(super) const WALL: [u8; 3] = [226, 219, 205];
pub(super) const STONE: [u8; 3] = [168, 160, 150];
const WOOD: [u8; 3] = [181, 129, 79];
const DARK: [u8; 3] = [88, 84, 92];
const RED: [u8; 3] = [186, 74, 66];
const BLUE: [u8; 3] = [72, 116, 172];
const GREEN: [u8; 3] = [104, 152, 96];
const YELLOW: [u8; 3] = [219, 180, 76];
const WHITE: [u8; 3] = [240, 240, 236];

/// Legs begin so far below the floor (meters), so that they and the floor are one solid.
const SINK: f64 = -0.06;

/// Places furniture in a building, each piece at a small random offset.
pub(super) struct Furnisher<'a> {
    pub(super) random: Random,
    pub(super) bodies: &'a mut Vec<Body>,
}

/// A piece of furniture in its own frame: x along its longer side, z up from the floor.
struct Piece<'a> {
    name: &'static str,
    world_from_piece: Pose<3>,
    bodies: &'a mut Vec<Body>,
}

impl Piece<'_> {
    fn push(&mut self, shape: Shape, color: [u8; 3]) {
        self.bodies.push(Body { name: self.name.to_owned(), shape, color });
    }

    fn block(&mut self, min: [f64; 3], max: [f64; 3], color: [u8; 3]) {
        let Aabb { min, max } = Aabb::new(min, max);
        let middle = Pose { translation: [0, 1, 2].map(|k| 0.5 * (min[k] + max[k])), ..Pose::IDENTITY };
        let half = [0, 1, 2].map(|k| 0.5 * (max[k] - min[k]));
        self.push(Shape::Box { world_from_box: self.world_from_piece * middle, half }, color);
    }

    fn round(&mut self, at: [f64; 2], height: [f64; 2], radius: f64, color: [u8; 3]) {
        let centre = self.world_from_piece.transform_point([at[0], at[1], 0.5 * (height[0] + height[1])]);
        self.push(Shape::Cylinder { centre, radius, half_height: 0.5 * (height[1] - height[0]) }, color);
    }

    fn sphere(&mut self, centre: [f64; 3], radius: f64, color: [u8; 3]) {
        let centre = self.world_from_piece.transform_point(centre);
        self.push(Shape::Sphere { centre, radius }, color);
    }

    /// Four square legs under a top, a little in from its corners.
    fn legs(&mut self, [length, width]: [f64; 2], top: f64, thick: f64, color: [u8; 3]) {
        for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let (x, y) = (sx * (0.5 * length - 0.07), sy * (0.5 * width - 0.07));
            let h = 0.5 * thick;
            self.block([x - h, y - h, SINK], [x + h, y + h, top], color);
        }
    }
}

impl Furnisher<'_> {
    /// A frame at a place, up to 2 cm off it.
    fn piece(&mut self, name: &'static str, at: [f64; 2], turn: f64) -> Piece<'_> {
        let mut off = |size: f64| size * (2.0 * self.random.uniform() - 1.0);
        let [x, y] = [at[0] + off(0.02), at[1] + off(0.02)];
        let (sin, cos) = (libm::sin(turn), libm::cos(turn));
        let rotation = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
        let world_from_piece = Pose { rotation, translation: [x, y, 0.0] };
        Piece { name, world_from_piece, bodies: self.bodies }
    }

    /// The same, turned by up to 3 degrees as well.
    fn turned_piece(&mut self, name: &'static str, at: [f64; 2], turn: f64) -> Piece<'_> {
        let turn = turn + 0.05 * (2.0 * self.random.uniform() - 1.0);
        self.piece(name, at, turn)
    }

    pub(super) fn table(&mut self, at: [f64; 2], turn: f64, [length, width]: [f64; 2]) {
        let mut p = self.turned_piece("table", at, turn);
        p.block([-0.5 * length, -0.5 * width, 0.711], [0.5 * length, 0.5 * width, 0.742], WOOD);
        p.legs([length, width], 0.73, 0.043, WOOD);
        p.block([-0.31, -0.11, 0.731], [-0.02, 0.14, 0.807], BLUE);
        p.round([0.33, 0.07], [0.731, 0.879], 0.067, RED);
    }

    pub(super) fn round_table(&mut self, at: [f64; 2]) {
        let mut p = self.piece("round table", at, 0.0);
        p.round([0.0, 0.0], [0.713, 0.741], 0.457, WOOD);
        p.round([0.0, 0.0], [SINK, 0.73], 0.041, DARK);
        p.round([0.0, 0.0], [SINK, 0.033], 0.237, DARK);
    }

    pub(super) fn sofa(&mut self, at: [f64; 2], turn: f64) {
        let mut p = self.piece("sofa", at, turn);
        p.block([-0.44, -0.93, 0.113], [0.43, 0.93, 0.427], GREEN);
        p.block([-0.44, -0.93, 0.113], [-0.21, 0.93, 0.871], GREEN);
        for y in [-0.93, 0.77] {
            p.block([-0.44, y, 0.113], [0.39, y + 0.16, 0.609], GREEN);
        }
        p.legs([0.83, 1.83], 0.15, 0.053, DARK);
    }

    pub(super) fn shelf(&mut self, at: [f64; 2], turn: f64, [length, deep, high]: [f64; 3]) {
        let mut p = self.piece("shelf", at, turn);
        let (x, y) = (0.5 * length, 0.5 * deep);
        for side in [-x, x - 0.023] {
            p.block([side, -y, SINK], [side + 0.023, y, high], WOOD);
        }
        let boards = (high / 0.36) as usize;
        for k in 0..boards {
            let z = 0.087 + (high - 0.087) * k as f64 / (boards - 1) as f64;
            p.block([-x + 0.004, -y + 0.005, z - 0.023], [x - 0.004, y - 0.003, z - 0.002], WOOD);
            // An object on every board except the highest.
            if k + 1 < boards {
                let (from, wide) = (-0.8 * x + 0.23 * x * k as f64, 0.41 * x);
                let color = [RED, BLUE, YELLOW, GREEN][k % 4];
                p.block([from, -0.6 * y, z - 0.013], [from + wide, 0.7 * y, z + 0.217], color);
            }
        }
    }

    pub(super) fn floor_lamp(&mut self, at: [f64; 2]) {
        let mut p = self.piece("floor lamp", at, 0.0);
        p.round([0.0, 0.0], [SINK, 0.023], 0.143, DARK);
        p.round([0.0, 0.0], [SINK, 1.55], 0.013, DARK);
        p.sphere([0.0, 0.0, 1.637], 0.157, YELLOW);
    }

    pub(super) fn pendant_lamp(&mut self, at: [f64; 2], ceiling: f64) {
        let mut p = self.piece("pendant lamp", at, 0.0);
        p.round([0.0, 0.0], [1.72, ceiling + 0.06], 0.006, DARK);
        p.sphere([0.0, 0.0, 1.663], 0.133, YELLOW);
    }

    pub(super) fn stool(&mut self, at: [f64; 2]) {
        let mut p = self.turned_piece("stool", at, 0.4);
        p.round([0.0, 0.0], [0.437, 0.469], 0.187, RED);
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            p.round([0.11 * x, 0.11 * y], [SINK, 0.45], 0.017, DARK);
        }
    }

    /// Low cupboards with a worktop along a wall, and cupboards above them, from a corner.
    pub(super) fn counter(&mut self, at: [f64; 2], [length, deep]: [f64; 2]) {
        let mut p = self.piece("counter", at, 0.0);
        p.block([0.0, -0.21, SINK], [length, deep - 0.05, 0.873], WHITE);
        p.block([-0.013, -0.21, 0.861], [length + 0.011, deep, 0.903], DARK);
        p.block([0.11, -0.21, 1.463], [length - 0.31, 0.357, 2.157], WHITE);
        p.round([1.03, 0.26], [0.89, 1.117], 0.113, BLUE);
        p.block([2.13, 0.11, 0.89], [2.41, 0.43, 1.061], YELLOW);
    }

    pub(super) fn fridge(&mut self, at: [f64; 2], turn: f64) {
        let mut p = self.piece("fridge", at, turn);
        p.block([-0.297, -0.333, 0.051], [0.301, 0.327, 1.793], WHITE);
        p.legs([0.59, 0.65], 0.09, 0.047, DARK);
    }

    pub(super) fn cupboard(&mut self, at: [f64; 2], turn: f64) {
        let mut p = self.piece("cupboard", at, turn);
        p.block([-0.613, -0.211, 0.103], [0.607, 0.213, 0.957], WOOD);
        p.legs([1.2, 0.41], 0.14, 0.041, DARK);
    }

    pub(super) fn pillar(&mut self, at: [f64; 2], ceiling: f64) {
        let mut p = self.piece("pillar", at, 0.0);
        p.round([0.0, 0.0], [SINK, ceiling + 0.06], 0.187, WALL);
        p.round([0.0, 0.0], [SINK, 0.113], 0.259, STONE);
    }

    pub(super) fn square_pillar(&mut self, at: [f64; 2], turn: f64, ceiling: f64) {
        let mut p = self.turned_piece("square pillar", at, turn);
        p.block([-0.173, -0.173, SINK], [0.173, 0.173, ceiling + 0.06], YELLOW);
    }

    /// A plate of 9 mm on two feet.
    pub(super) fn plate(&mut self, at: [f64; 2], turn: f64) {
        let mut p = self.turned_piece("plate", at, turn);
        p.block([-0.717, -0.0045, 0.211], [0.709, 0.0045, 1.553], BLUE);
        for x in [-0.53, 0.51] {
            p.block([x - 0.017, -0.013, SINK], [x + 0.017, 0.013, 0.259], DARK);
            p.block([x - 0.019, -0.207, SINK], [x + 0.019, 0.207, 0.023], DARK);
        }
    }

    pub(super) fn bench(&mut self, at: [f64; 2], turn: f64) {
        let mut p = self.turned_piece("bench", at, turn);
        p.block([-0.61, -0.187, 0.419], [0.61, 0.187, 0.457], WOOD);
        for x in [-0.47, 0.47] {
            p.block([x - 0.023, -0.157, SINK], [x + 0.023, 0.157, 0.44], DARK);
        }
    }

    pub(super) fn ball(&mut self, at: [f64; 2], radius: f64) {
        let mut p = self.piece("ball", at, 0.0);
        p.sphere([0.0, 0.0, radius - 0.023], radius, RED);
    }

    pub(super) fn bin(&mut self, at: [f64; 2]) {
        let mut p = self.piece("bin", at, 0.0);
        p.round([0.0, 0.0], [SINK, 0.397], 0.151, GREEN);
    }

    /// A board that leans backward, toward +y, by 15 degrees.
    pub(super) fn leaning_board(&mut self, at: [f64; 2]) {
        let p = self.turned_piece("leaning board", at, 0.0);
        let (sin, cos) = (libm::sin(-0.26), libm::cos(-0.26));
        let lean = Pose {
            rotation: [[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]],
            translation: [0.0, 0.0, 0.5],
        };
        let shape = Shape::Box { world_from_box: p.world_from_piece * lean, half: [0.383, 0.011, 0.577] };
        let mut p = p;
        p.push(shape, WHITE);
    }
}
