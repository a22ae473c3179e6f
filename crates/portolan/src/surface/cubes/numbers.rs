//! The vertex numbers of one brick.

use super::table::{MOST, Plain};

/// Vertex numbers by place of the edge ([`local`]), and the triangles of one layer; reused from brick to brick.
pub(super) struct Numbers {
    edges: Box<[u16; 4096]>,
    pub(super) triangles: Box<[[u16; 3]; 64 * MOST]>,
}

impl Numbers {
    pub(super) fn new() -> Self {
        Self { edges: Box::new([0; 4096]), triangles: Box::new([[0; 3]; 64 * MOST]) }
    }

    #[inline(always)]
    pub(super) fn at(&mut self, axis: usize, node: usize) -> &mut u16 {
        &mut self.edges[(axis << 10 | node) & 4095]
    }

    #[inline(always)]
    pub(super) fn get(&self, node: usize, edge: u16) -> u16 {
        self.edges[(node + usize::from(edge)) & 4095]
    }

    /// Writes the triangles of a cube from place `at` on. Always [`MOST`] of them: the next cube overwrites the excess, and
    /// no branch depends on their number.
    #[inline(always)]
    pub(super) fn put(&mut self, at: usize, node: usize, plain: &Plain) {
        if let Some(out) = self.triangles.get_mut(at..at + MOST) {
            for k in 0..MOST {
                for v in 0..3 {
                    out[k][v] = self.edges[(node + usize::from(plain.corners[k][v])) & 4095];
                }
            }
        }
    }
}
