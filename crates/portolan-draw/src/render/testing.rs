//! Meshes for tests.

type Mesh = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// A ball of radius 1, seen from outside, in slices and stacks.
pub(super) fn ball(slices: u32, stacks: u32) -> Mesh {
    let mut vertices = Vec::new();
    for i in 0..=stacks {
        let (sin, cos) = (std::f32::consts::PI * i as f32 / stacks as f32).sin_cos();
        for j in 0..slices {
            let (y, x) = (std::f32::consts::TAU * j as f32 / slices as f32).sin_cos();
            vertices.push([sin * x, sin * y, cos]);
        }
    }
    let mut triangles = Vec::new();
    for i in 0..stacks {
        for j in 0..slices {
            let (a, b) = (i * slices + j, i * slices + (j + 1) % slices);
            let (c, d) = (a + slices, b + slices);
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    (vertices, triangles)
}

/// The inner faces of a box with a corner at zero, each in 20 x 20 squares.
pub(super) fn room(size: [f32; 3]) -> Mesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for far in [false, true] {
            let first = vertices.len() as u32;
            for i in 0..=20 {
                for j in 0..=20 {
                    let mut p = [0.0; 3];
                    p[axis] = if far { size[axis] } else { 0.0 };
                    p[u] = size[u] * i as f32 / 20.0;
                    p[v] = size[v] * j as f32 / 20.0;
                    vertices.push(p);
                }
            }
            for k in 0..20 * 20 {
                let a = first + k / 20 * 21 + k % 20;
                let (b, c, d) = (a + 21, a + 1, a + 22);
                // Toward the inside.
                let both = if far { [[a, c, d], [a, d, b]] } else { [[a, d, c], [a, b, d]] };
                triangles.extend(both);
            }
        }
    }
    (vertices, triangles)
}
