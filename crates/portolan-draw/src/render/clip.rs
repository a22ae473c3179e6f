//! Cuts triangles at planes (Sutherland & Hodgman 1974).

/// Corners of a triangle cut at two planes: five at most.
const CORNERS: usize = 8;

/// What is left of a convex polygon where `inside` is not negative.
pub(super) struct Polygon {
    corners: [[f32; 3]; CORNERS],
    count: usize,
}

impl Polygon {
    pub(super) fn new(triangle: [[f32; 3]; 3]) -> Self {
        let mut corners = [[0.0; 3]; CORNERS];
        corners[..3].copy_from_slice(&triangle);
        Self { corners, count: 3 }
    }

    pub(super) fn cut(self, inside: impl Fn([f32; 3]) -> f32) -> Self {
        let mut left = Self { corners: [[0.0; 3]; CORNERS], count: 0 };
        for i in 0..self.count {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % self.count]);
            let (da, db) = (inside(a), inside(b));
            if da >= 0.0 {
                left.push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                let t = da / (da - db);
                left.push(std::array::from_fn(|k| a[k] + t * (b[k] - a[k])));
            }
        }
        left
    }

    fn push(&mut self, corner: [f32; 3]) {
        if self.count < CORNERS {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }

    /// As triangles about the first corner.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [[f32; 3]; 3]> + '_ {
        (2..self.count).map(|i| [self.corners[0], self.corners[i - 1], self.corners[i]])
    }
}
