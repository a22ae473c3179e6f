//! The numbering of corners, edges and faces of a cube.
//!
//! ```text
//!        6 ------- 7          corner = x + 2 y + 4 z
//!       /|        /|          edge   = 4 axis + a + 2 b, with a, b the place along the other two axes
//!      4 ------- 5 |          face   = 2 axis + side
//!      | 2 ------|-3
//!      |/        |/           z   y
//!      0 ------- 1            |  /
//!                             | /__ x
//! ```

/// Edges of a cube.
pub(super) const EDGES: u8 = 12;

/// Axis of an edge, and its lower corner.
pub(crate) const fn edge_start(edge: u8) -> (usize, u8) {
    let (axis, a, b) = (edge as usize >> 2, edge & 1, (edge >> 1) & 1);
    let corner = match axis {
        0 => a << 1 | b << 2,
        1 => a | b << 2,
        _ => a | b << 1,
    };
    (axis, corner)
}

/// The edge between two neighboring corners.
pub(super) const fn edge_between(c: u8, d: u8) -> u8 {
    let (low, axis) = (c & d, (c ^ d).trailing_zeros() as u8);
    axis << 2
        | match axis {
            0 => low >> 1,
            1 => (low & 1) | (low >> 1 & 2),
            _ => low & 3,
        }
}

/// The four corners of a face, counter-clockwise as seen from outside.
pub(super) const fn face_corners(face: u8) -> [u8; 4] {
    let (axis, side) = (face >> 1, face & 1);
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let at = side << axis;
    if side == 1 { [at, at | u, at | u | v, at | v] } else { [at, at | v, at | u | v, at | u] }
}

/// Whether two edges lie in a common face.
pub(super) const fn share_face(e: u8, f: u8) -> bool {
    faces_of(e) & faces_of(f) != 0
}

/// The two faces at an edge, a bit each.
const fn faces_of(edge: u8) -> u8 {
    let (axis, corner) = edge_start(edge);
    let mut faces = 0;
    let mut k = 0;
    while k < 3 {
        if k != axis {
            faces |= 1 << (2 * k + (corner as usize >> k & 1));
        }
        k += 1;
    }
    faces
}

/// Middle of an edge in halves of the cube's edge.
pub(super) fn middle(edge: u8) -> [f64; 3] {
    let (axis, corner) = edge_start(edge);
    std::array::from_fn(|k| if k == axis { 1.0 } else { f64::from(corner >> k & 1) * 2.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_lie_between_their_corners_and_in_two_faces() {
        for edge in 0..EDGES {
            let (axis, corner) = edge_start(edge);
            assert_eq!(edge_between(corner, corner | 1 << axis), edge);
            assert_eq!(edge_between(corner | 1 << axis, corner), edge);
            assert_eq!(faces_of(edge).count_ones(), 2);
            for face in 0..6 {
                let corners = face_corners(face);
                let held = corners.contains(&corner) && corners.contains(&(corner | 1 << axis));
                assert_eq!(faces_of(edge) >> face & 1 == 1, held);
            }
        }
    }
}
