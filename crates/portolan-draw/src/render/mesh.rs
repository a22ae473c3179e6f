//! The mesh to be shown.

use super::vector::{cross, sub, unit_or};

/// Triangles over shared vertices, borrowed from whoever has them.
///
/// Triangles run counter-clockwise as seen from free space. Coordinates are relative to a point nearby, which all of a
/// picture shares: far from zero an `f32` loses millimeters. Triangles with an index or a coordinate that is no good are
/// not drawn.
#[derive(Clone, Copy, Debug)]
pub struct MeshView<'a> {
    /// Meters.
    pub vertices: &'a [[f32; 3]],
    /// Indices of vertices.
    pub triangles: &'a [[u32; 3]],
    /// Towards free space, one per vertex. Empty: the mean of the triangles around a vertex.
    pub normals: &'a [[f32; 3]],
    /// Red, green, blue, one per vertex. Empty, or one color for all, which says nothing: tinted by height.
    pub colors: &'a [[u8; 3]],
}

impl MeshView<'_> {
    /// The corners of a triangle, if its indices are good.
    pub(super) fn corners(&self, triangle: usize) -> Option<[[f32; 3]; 3]> {
        let [a, b, c] = self.triangles[triangle].map(|i| self.vertices.get(i as usize).copied());
        Some([a?, b?, c?])
    }

    /// The same without colors that say nothing.
    pub(super) fn with_telling_colors(self) -> Self {
        let told = self.colors.len() == self.vertices.len() && self.colors.windows(2).any(|w| w[0] != w[1]);
        if told { self } else { Self { colors: &[], ..self } }
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
