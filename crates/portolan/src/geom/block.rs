//! Blocks of `8^D` cells: the unit in which sweeps pass evidence to stores.

/// Edge of a block in cells.
pub const BLOCK_EDGE: usize = 8;

/// Number of cells of a block: 64 in 2-D, 512 in 3-D.
pub const fn block_cells<const D: usize>() -> usize {
    BLOCK_EDGE.pow(D as u32)
}

/// Index of a block: the cell index divided by eight, rounded down. Ordered by the last axis first, the order of a dense
/// array in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockKey<const D: usize>(pub [i32; D]);

impl<const D: usize> BlockKey<D> {
    /// The block that contains `cell`.
    #[inline(always)]
    pub fn of_cell(cell: [i32; D]) -> Self {
        Self(cell.map(|v| v >> 3))
    }

    /// The lowest cell of the block.
    #[inline(always)]
    pub fn first_cell(self) -> [i32; D] {
        self.0.map(|v| v << 3)
    }

    /// Position of `cell` inside its block, x fastest.
    #[inline(always)]
    pub fn offset(cell: [i32; D]) -> usize {
        let mut i = 0;
        for k in (0..D).rev() {
            i = i * BLOCK_EDGE + (cell[k] & 7) as usize;
        }
        i
    }

    /// The cell at position `i` of the block: the inverse of [`BlockKey::offset`].
    #[inline(always)]
    pub fn cell(self, i: usize) -> [i32; D] {
        std::array::from_fn(|k| (self.0[k] << 3) + ((i >> (3 * k)) & 7) as i32)
    }
}

/// One word for the hasher; the derived implementation writes a length and each index separately.
impl<const D: usize> std::hash::Hash for BlockKey<D> {
    #[inline(always)]
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        let mut word = 0u64;
        for k in 0..D {
            word = word.rotate_left(21) ^ u64::from(self.0[k] as u32);
        }
        state.write_u64(word);
    }
}

impl<const D: usize> Ord for BlockKey<D> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.iter().rev().cmp(other.0.iter().rev())
    }
}

impl<const D: usize> PartialOrd for BlockKey<D> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip<const D: usize>(cell: [i32; D]) {
        let key = BlockKey::of_cell(cell);
        assert_eq!(key.cell(BlockKey::offset(cell)), cell);
        assert!(BlockKey::offset(cell) < block_cells::<D>());
    }

    #[test]
    fn cells_and_offsets_are_inverse_also_below_zero() {
        for x in -17..17 {
            for y in -9..9 {
                round_trip([x, y]);
                round_trip([x, y, x - y]);
            }
        }
        assert_eq!(BlockKey::of_cell([-1, 8]), BlockKey([-1, 1]));
    }

    #[test]
    fn order_follows_memory() {
        assert!(BlockKey([5, 0]) < BlockKey([0, 1]));
        assert!(BlockKey([-1, 0]) < BlockKey([0, 0]));
    }
}
