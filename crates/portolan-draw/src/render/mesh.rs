//! The mesh to render.

use super::vector::{cross, sub, unit_or};

/// Triangles over shared vertices, borrowed.
///
/// Triangles are counter-clockwise as seen from free space. Coordinates are relative to a nearby point, common to the whole
/// picture: far from zero an `f32` loses millimeters. Triangles with an index out of range or a coordinate that is not
/// finite are skipped.
#[derive(Clone, Copy, Debug)]
pub struct MeshView<'a> {
    /// Positions (meters).
    pub vertices: &'a [[f32; 3]],
    /// Vertex indices.
    pub triangles: &'a [[u32; 3]],
    /// Normals toward free space, one per vertex. Empty: the mean of the triangles around a vertex.
    pub normals: &'a [[f32; 3]],
    /// Red, green, blue, one per vertex. Empty, or the same for all: colored by height.
    pub colors: &'a [[u8; 3]],
}

impl MeshView<'_> {
    /// The corners of a triangle, if its indices are in range.
    pub(super) fn corners(&self, triangle: usize) -> Option<[[f32; 3]; 3]> {
        let [a, b, c] = self.triangles[triangle].map(|i| self.vertices.get(i as usize).copied());
        Some([a?, b?, c?])
    }

    /// The mesh without colors if they are all the same.
    pub(super) fn without_constant_color(self) -> Self {
        let vary = self.colors.len() == self.vertices.len() && self.colors.windows(2).any(|w| w[0] != w[1]);
        if vary { self } else { Self { colors: &[], ..self } }
    }

    /// Unit normals of vertices, weighted by the areas of the triangles around them. O(triangles).
    pub(super) fn smooth_normals(&self) -> Vec<[f32; 3]> {
        let mut sums = vec![[0.0f32; 3]; self.vertices.len()];
        for (t, corners) in self.triangles.iter().enumerate() {
            let Some([a, b, c]) = self.corners(t) else { continue };
            let normal = cross(sub(b, a), sub(c, a));
            if normal.iter().all(|v| v.is_finite()) {
                for &i in corners {
                    (0..3).for_each(|k| sums[i as usize][k] += normal[k]);
                }
            }
        }
        sums.into_iter().map(|n| unit_or(n, [0.0, 0.0, 1.0])).collect()
    }
}
