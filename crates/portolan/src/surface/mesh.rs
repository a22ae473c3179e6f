//! Triangle meshes and their measures.

use crate::geom::Aabb;
use crate::geom::vector::{cross3, norm, sub};
use crate::sets::Sets;

/// Triangles with shared vertices; the normal of every triangle (counter-clockwise) points to free space.
///
/// Vertices are `f32` relative to an `f64` origin near them, so that a mesh at UTM coordinates is as accurate as one at the
/// origin of the world: within 1 km of its own origin a vertex is placed to 0.06 mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// World position of the vertex (0, 0, 0) (meters).
    pub origin: [f64; 3],
    /// Positions relative to the origin (meters).
    pub vertices: Vec<[f32; 3]>,
    /// Triples of vertex indices.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normal of each vertex, toward free space; zero where undefined. Empty where not requested.
    pub normals: Vec<[f32; 3]>,
    /// Red, green, blue of each vertex. Empty where not requested or not available.
    pub colors: Vec<[u8; 3]>,
}

/// The edges of a mesh by their number of triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EdgeCounts {
    /// Edges of one triangle: the border of what was observed.
    pub border: usize,
    /// Edges between two triangles of one orientation.
    pub inner: usize,
    /// All others: edges of more than two triangles, or of two with opposite orientation. 0 in a manifold.
    pub faulty: usize,
}

impl EdgeCounts {
    /// All edges.
    pub fn total(&self) -> usize {
        self.border + self.inner + self.faulty
    }
}

impl Mesh {
    /// World position of a vertex (meters).
    pub fn vertex_world(&self, i: usize) -> [f64; 3] {
        std::array::from_fn(|k| self.origin[k] + f64::from(self.vertices[i][k]))
    }

    /// World positions of a triangle's corners (meters).
    pub fn corners_world(&self, triangle: [u32; 3]) -> [[f64; 3]; 3] {
        triangle.map(|v| self.vertex_world(v as usize))
    }

    /// Bounding box of all vertices (world); empty without vertices. O(vertices).
    pub fn bounds(&self) -> Aabb<3> {
        let mut bounds = Aabb::EMPTY;
        (0..self.vertices.len()).for_each(|i| bounds.include(self.vertex_world(i)));
        bounds
    }

    /// Area of all triangles (square meters). O(triangles).
    pub fn area(&self) -> f64 {
        0.5 * self.triangles.iter().map(|t| norm(self.area_normal(*t))).sum::<f64>()
    }

    /// Enclosed volume, on the side away from free space (cubic meters), of a closed mesh. O(triangles).
    pub fn volume(&self) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|v| self.vertices[v as usize].map(f64::from));
        let six_fold = |t: &[u32; 3]| {
            let [a, b, c] = corners(t);
            a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        self.triangles.iter().map(six_fold).sum::<f64>() / 6.0
    }

    /// Normal of a triangle, of a length twice its area.
    pub fn area_normal(&self, triangle: [u32; 3]) -> [f64; 3] {
        let [a, b, c] = triangle.map(|v| self.vertices[v as usize].map(f64::from));
        cross3(sub(b, a), sub(c, a))
    }

    /// Counts the edges by their number of triangles. O(triangles log triangles).
    pub fn edge_counts(&self) -> EdgeCounts {
        let mut counts = EdgeCounts::default();
        let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(3 * self.triangles.len());
        for t in &self.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                edges.push((a.min(b), a.max(b), a < b));
            }
        }
        edges.sort_unstable();
        for same in edges.chunk_by(|e, f| (e.0, e.1) == (f.0, f.1)) {
            match same {
                [_] => counts.border += 1,
                [e, f] if e.2 != f.2 => counts.inner += 1,
                _ => counts.faulty += 1,
            }
        }
        counts
    }

    /// Vertices - edges + triangles: 2 for every sphere, 0 for every torus. O(triangles log triangles).
    #[cfg(test)]
    pub(crate) fn euler_characteristic(&self) -> i64 {
        self.vertices.len() as i64 - self.edge_counts().total() as i64 + self.triangles.len() as i64
    }

    /// The connected component of every vertex, numbered in the order of their first vertices, and the number of
    /// components. A vertex without triangles is a component of its own. Nearly O(triangles).
    pub fn components(&self) -> (Vec<u32>, usize) {
        // The lowest vertex of a component stands for it.
        let mut sets = Sets::new(self.vertices.len() as u32);
        for t in &self.triangles {
            sets.join(t[0], t[1]);
            sets.join(t[1], t[2]);
        }
        let mut number = vec![u32::MAX; self.vertices.len()];
        let mut count = 0;
        for v in 0..self.vertices.len() as u32 {
            let r = sets.find(v);
            if r == v {
                number[v as usize] = count;
                count += 1;
            }
            number[v as usize] = number[r as usize];
        }
        (number, count as usize)
    }

    /// Memory of the arrays (bytes).
    pub fn memory_bytes(&self) -> usize {
        (self.vertices.capacity() + self.triangles.capacity() + self.normals.capacity()) * 12
            + self.colors.capacity() * 3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron with its normals outward.
    fn tetrahedron() -> Mesh {
        Mesh {
            origin: [500_000.0, 4_000_000.0, 10.0],
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_tetrahedron_is_a_sphere() {
        let mut mesh = tetrahedron();
        assert_eq!(mesh.edge_counts(), EdgeCounts { inner: 6, ..Default::default() });
        assert_eq!((mesh.euler_characteristic(), mesh.components().1), (2, 1));
        assert!((mesh.area() - (1.5 + 0.75f64.sqrt())).abs() < 1e-12);
        assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-12);
        assert_eq!(mesh.bounds().max, [500_001.0, 4_000_001.0, 11.0]);
        mesh.triangles.pop();
        assert_eq!(mesh.edge_counts(), EdgeCounts { inner: 3, border: 3, faulty: 0 });
        mesh.triangles.push([1, 3, 2]);
        assert_eq!(mesh.edge_counts(), EdgeCounts { inner: 3, border: 0, faulty: 3 });
    }

    #[test]
    fn components_are_numbered_in_order() {
        let mut mesh = tetrahedron();
        let second: Vec<_> = mesh.triangles.iter().map(|t| t.map(|v| v + 4)).collect();
        mesh.triangles.splice(0..0, second);
        mesh.vertices.extend_from_within(..);
        mesh.vertices.push([0.0; 3]);
        assert_eq!(mesh.components(), (vec![0, 0, 0, 0, 1, 1, 1, 1, 2], 3));
    }
}
