//! Normals: from the gradient of the field, or from the triangles where that is zero.

use crate::surface::Mesh;

/// A gradient scaled to length one; zero where undefined.
#[inline(always)]
pub(super) fn unit(gradient: [f32; 3]) -> [f32; 3] {
    let square = gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2];
    if square > f32::MIN_POSITIVE && square.is_finite() {
        let scale = 1.0 / square.sqrt();
        gradient.map(|v| v * scale)
    } else {
        [0.0; 3]
    }
}

/// Gives vertices without a normal the mean of their triangles' normals, weighted by area.
pub(super) fn complete(mesh: &mut Mesh) {
    if !mesh.normals.contains(&[0.0; 3]) {
        return;
    }
    let missing: Vec<bool> = mesh.normals.iter().map(|n| *n == [0.0; 3]).collect();
    let mut sums = vec![[0.0f64; 3]; mesh.normals.len()];
    for t in mesh.triangles.iter().filter(|t| t.iter().any(|&v| missing[v as usize])) {
        let n = mesh.area_normal(*t);
        for v in t {
            (0..3).for_each(|k| sums[*v as usize][k] += n[k]);
        }
    }
    for (i, sum) in sums.iter().enumerate().filter(|(i, _)| missing[*i]) {
        if let Some(n) = crate::geom::vector::unit(*sum) {
            mesh.normals[i] = n.map(|v| v as f32);
        }
    }
}
