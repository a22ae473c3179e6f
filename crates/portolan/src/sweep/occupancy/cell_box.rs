//! The box of cells that a map may change.

use crate::geom::{Aabb, BlockKey, Lattice};

/// Cells from `first` to `last`, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CellBox {
    first: [i32; 3],
    last: [i32; 3],
}

impl CellBox {
    /// The cells that hold the two corners of a world box and all between them; corners beyond all cell indices are
    /// brought to the last ones. Holds nothing where the box is empty or not a number.
    pub(crate) fn of(bounds: &Aabb<3>, lattice: &Lattice<3>) -> Self {
        const LIMIT: f64 = (1u32 << 29) as f64;
        let cell = |p: [f64; 3]| lattice.to_cells(p).map(|v| v.floor().clamp(-LIMIT, LIMIT) as i32);
        if bounds.is_empty() {
            return Self { first: [0; 3], last: [-1; 3] };
        }
        Self { first: cell(bounds.min), last: cell(bounds.max) }
    }

    /// World box of the cells.
    pub(crate) fn aabb(&self, lattice: &Lattice<3>) -> Aabb<3> {
        lattice.aabb(self.first, self.last.map(|v| v + 1))
    }

    #[cfg(test)]
    pub(crate) fn contains(&self, cell: [i32; 3]) -> bool {
        (0..3).all(|k| self.first[k] <= cell[k] && cell[k] <= self.last[k])
    }

    /// The cells of a brick that are inside, a bit each; `None`: all of them.
    pub(crate) fn mask(&self, key: BlockKey<3>) -> Option<[u64; 8]> {
        let low = key.first_cell();
        // Bits from the first to the last of eight that are inside, 0 where none is.
        let run = |k: usize| -> u64 {
            let from = (i64::from(self.first[k]) - i64::from(low[k])).clamp(0, 8);
            let to = (i64::from(self.last[k]) - i64::from(low[k]) + 1).clamp(0, 8);
            if from < to { (1 << to) - (1 << from) } else { 0 }
        };
        let (x, y, z) = (run(0), run(1), run(2));
        if (x, y, z) == (0xff, 0xff, 0xff) {
            return None;
        }
        let layer = (0..8).filter(|row| y >> row & 1 != 0).fold(0, |m, row| m | x << (8 * row));
        Some(std::array::from_fn(|w| if z >> w & 1 != 0 { layer } else { 0 }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_say_what_contains_says() {
        let lattice = Lattice::new([0.0; 3], 0.5);
        let b = CellBox::of(&Aabb::new([-1.2, 0.0, 3.9], [2.0, 5.1, 4.0]), &lattice);
        for key in (0..64).map(|i| BlockKey([i % 4 - 2, i / 4 % 4 - 1, i / 16 - 1])) {
            let mask = b.mask(key).unwrap_or([u64::MAX; 8]);
            for i in 0..512 {
                assert_eq!(mask[i >> 6] >> (i & 63) & 1 != 0, b.contains(key.cell(i)));
            }
        }
        assert_eq!(CellBox::of(&Aabb::EMPTY, &lattice).mask(BlockKey([0; 3])), Some([0; 8]));
        let all = CellBox::of(&Aabb::new([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]), &lattice);
        assert_eq!(all.mask(BlockKey([9, -7, 0])), None);
    }
}
