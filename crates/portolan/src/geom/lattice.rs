//! The mapping between cell indices and meters.

use super::Aabb;

/// An infinite regular lattice: origin (the corner of cell 0) and resolution.
///
/// The origin is `f64`, so that a map far from the origin of the world (UTM coordinates) is as accurate as one near it:
/// everything inside a map is computed relative to its own origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice<const D: usize> {
    /// World position of the lower corner of cell 0 (meters).
    pub origin: [f64; D],
    /// Edge of a cell (meters).
    pub resolution: f64,
}

impl<const D: usize> Lattice<D> {
    /// A lattice with this origin and resolution.
    pub fn new(origin: [f64; D], resolution: f64) -> Self {
        const { assert!(D == 2 || D == 3, "maps have two or three dimensions") };
        Self { origin, resolution }
    }

    /// A world point in units of cells from the origin.
    #[inline(always)]
    pub fn to_cells(&self, p_world: [f64; D]) -> [f64; D] {
        let inverse = 1.0 / self.resolution;
        std::array::from_fn(|k| (p_world[k] - self.origin[k]) * inverse)
    }

    /// The cell that contains a world point; `None` where its index is out of range.
    #[inline(always)]
    pub fn cell_of(&self, p_world: [f64; D]) -> Option<[i32; D]> {
        let c = self.to_cells(p_world);
        // Two bits are kept free, so that arithmetic on neighbors and blocks of a valid index cannot overflow.
        const LIMIT: f64 = (1u32 << 30) as f64;
        let held = c.iter().all(|v| v.abs() < LIMIT); // false for NaN
        // Truncation and a step down: on baseline x86-64 `floor` is a call.
        held.then(|| {
            c.map(|v| {
                let toward_zero = v as i32;
                toward_zero - i32::from(v < f64::from(toward_zero))
            })
        })
    }

    /// World position of the center of a cell, where its sample lies.
    #[inline(always)]
    pub fn center(&self, cell: [i32; D]) -> [f64; D] {
        std::array::from_fn(|k| self.origin[k] + (f64::from(cell[k]) + 0.5) * self.resolution)
    }

    /// World position of the lower corner of a cell.
    #[inline(always)]
    pub fn corner(&self, cell: [i32; D]) -> [f64; D] {
        std::array::from_fn(|k| self.origin[k] + f64::from(cell[k]) * self.resolution)
    }

    /// World box of the cells from `first` to `end` (exclusive).
    pub fn aabb(&self, first: [i32; D], end: [i32; D]) -> Aabb<D> {
        Aabb::new(self.corner(first), self.corner(end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_belongs_to_the_cell_above() {
        let l = Lattice::new([0.0, 0.0], 0.5);
        assert_eq!(l.cell_of([0.5, -0.5]), Some([1, -1]));
        assert_eq!(l.cell_of([0.49999, -0.50001]), Some([0, -2]));
        assert_eq!(l.center([1, -1]), [0.75, -0.25]);
    }

    #[test]
    fn far_origins_lose_nothing() {
        let l = Lattice::new([500_000.0, 4_000_000.0, 100.0], 0.05);
        for i in [0, 1, 17, 100_000] {
            assert_eq!(l.cell_of(l.center([i, i, i])), Some([i, i, i]));
        }
    }

    #[test]
    fn what_an_index_cannot_hold_is_refused() {
        let l = Lattice::new([0.0, 0.0], 0.001);
        assert_eq!(l.cell_of([1e9, 0.0]), None);
        assert_eq!(l.cell_of([f64::NAN, 0.0]), None);
        assert_eq!(l.cell_of([0.0, f64::INFINITY]), None);
    }
}
