//! Solid polygons.

use portolan::geom::Aabb;

/// The kind of a solid, for pictures and statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SolidKind {
    /// Part of the building.
    Wall,
    /// Fixed furniture.
    Furniture,
    /// Movable.
    Movable,
}

/// An opaque simple polygon.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// The name.
    pub name: String,
    /// The kind.
    pub kind: SolidKind,
    /// Corners counter-clockwise (world, meters).
    pub corners: Vec<[f64; 2]>,
}

impl Solid {
    /// An axis-aligned rectangle.
    pub fn rectangle(name: impl Into<String>, kind: SolidKind, min: [f64; 2], max: [f64; 2]) -> Self {
        let corners = vec![min, [max[0], min[1]], max, [min[0], max[1]]];
        Self { name: name.into(), kind, corners }
    }

    /// Start and end of every edge.
    pub fn edges(&self) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
        (0..self.corners.len()).map(|i| [self.corners[i], self.corners[(i + 1) % self.corners.len()]])
    }

    /// The bounding box.
    pub fn aabb(&self) -> Aabb<2> {
        let mut b = Aabb::EMPTY;
        self.corners.iter().for_each(|&c| b.include(c));
        b
    }

    /// Whether a point lies inside (crossing number); points on the border may count either way.
    pub fn contains(&self, p: [f64; 2]) -> bool {
        let crossings = self.edges().filter(|[a, b]| {
            (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        });
        crossings.count() % 2 == 1
    }

    /// The solid moved by an offset (meters).
    pub fn moved(&self, offset: [f64; 2]) -> Self {
        let corners = self.corners.iter().map(|c| [c[0] + offset[0], c[1] + offset[1]]).collect();
        Self { corners, ..self.clone() }
    }
}
