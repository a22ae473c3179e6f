//! Bricks into a tree and back.

use super::arena::NONE;
use super::tree::{BLOCK_HEIGHT, Tree};
use super::tree_build::expand;
use super::{Bricks, Store, StoreFull};
use crate::cell::{LogOddsBrick, LogOddsValue, Planes};
use crate::geom::{BlockKey, Lattice, block_cells};

/// Why a tree cannot become bricks.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TreeBricksError {
    /// The bricks' lattice has another resolution, or its blocks do not coincide with the tree's.
    #[error("the blocks of the tree do not coincide with those of the lattice at {0} m")]
    Lattice(f64),
    /// Too many bricks.
    #[error(transparent)]
    Full(#[from] StoreFull),
}

impl<V: LogOddsValue, const D: usize> Tree<V, D> {
    /// The cells of bricks as a tree, brick by brick. The root is the smallest whose middle is the corner of the
    /// lattice's cell 0, so that nodes lie as in the trees of OctoMap. `None` where a brick is beyond 2^27 cells from
    /// there. The tree's cell 0 is the lattice's cell `-2^(depth - 1)` along each axis. O(cells).
    pub fn from_bricks(bricks: &Bricks<V, D>) -> Option<Self> {
        // Bits of the brick index that is farthest away.
        let bits = |key: i32| i32::BITS - key.max(!key).leading_zeros();
        let largest = bricks.bricks_by_age().flat_map(|(key, _)| key.0.map(bits)).max().unwrap_or(0);
        let depth = largest + BLOCK_HEIGHT + 1;
        if depth > 28 {
            return None;
        }
        let first = -1i32 << (depth - 1);
        let lattice = bricks.lattice();
        let mut tree = Self::new(lattice.corner([first; D]), lattice.resolution, depth)?;
        let blocks = bricks.bricks_by_age();
        tree.take(
            blocks
                .map(|(key, brick)| (BlockKey(key.0.map(|v| v - (first >> BLOCK_HEIGHT))), brick))
                .collect(),
        );
        Some(tree)
    }

    /// Holds the cells of bricks. Along the tree, so that one brick's records lie beside the next one's.
    fn take(&mut self, mut bricks: Vec<(BlockKey<D>, &LogOddsBrick<V>)>) {
        bricks.sort_unstable_by_key(|(key, _)| interleaved(*key));
        for (key, brick) in bricks {
            self.set_block(key, &brick.cells());
        }
        self.compact();
    }

    /// The cells of bricks in this tree, brick by brick; those outside of its root are left out. `None` where the lattices
    /// do not coincide. O(cells).
    pub fn with_bricks(mut self, bricks: &Bricks<V, D>) -> Option<Self> {
        if *bricks.lattice() != self.lattice {
            return None;
        }
        self.take(bricks.bricks_by_age().filter(|(key, _)| self.inside(key.first_cell())).collect());
        Some(self)
    }

    /// The cells of the tree as bricks on `lattice`, which may take `limit` bytes. O(blocks with an observed cell): a
    /// leaf that is large in the tree is many bricks.
    ///
    /// # Errors
    /// [`TreeBricksError::Lattice`] unless the tree's cell 0 is the first cell of a block of the lattice (to 1e-6
    /// cells) and the resolutions are equal; [`TreeBricksError::Full`] beyond the limit.
    pub fn to_bricks(&self, lattice: Lattice<D>, limit: usize) -> Result<Bricks<V, D>, TreeBricksError> {
        let mine = self.lattice();
        let wrong = TreeBricksError::Lattice(lattice.resolution);
        let shift = lattice.to_cells(mine.origin);
        let fits = |v: f64| (v / 8.0 - (v / 8.0).round()).abs() < 1.25e-7 && v.abs() < f64::from(1 << 29);
        if mine.resolution != lattice.resolution || !shift.iter().all(|&v| fits(v)) {
            return Err(wrong);
        }
        let shift = shift.map(|v| (v / 8.0).round() as i32);
        let mut bricks = Bricks::new(lattice);
        bricks.set_limit(limit);
        let mut put = |block: [i32; D], brick: LogOddsBrick<V>| {
            bricks.insert(BlockKey(std::array::from_fn(|k| block[k] + shift[k])), brick)
        };
        self.blocks_below(self.root, self.root_value, [0; D], self.depth, &mut put)?;
        bricks.set_limit(usize::MAX);
        Ok(bricks)
    }

    fn blocks_below(
        &self,
        record: u32,
        value: V,
        block: [i32; D],
        height: u32,
        put: &mut impl FnMut([i32; D], LogOddsBrick<V>) -> Result<(), StoreFull>,
    ) -> Result<(), StoreFull> {
        if record == NONE && value.is_unobserved() {
            return Ok(());
        }
        if height == BLOCK_HEIGHT {
            let mut brick = LogOddsBrick::unobserved(block_cells::<D>());
            match record {
                NONE => brick.cells_mut().fill(value),
                _ => expand(&self.arena, record, brick.cells_mut(), 0, BLOCK_HEIGHT),
            }
            return put(block, brick);
        }
        for c in 0..1usize << D {
            let half = height - 1 - BLOCK_HEIGHT;
            let block = std::array::from_fn(|k| block[k] + (((c >> k) & 1) << half) as i32);
            match record {
                NONE => self.blocks_below(NONE, value, block, height - 1, put)?,
                _ => {
                    let below = self.record_of(record, c);
                    self.blocks_below(below, self.arena.values(record)[c], block, height - 1, put)?;
                }
            }
        }
        Ok(())
    }
}

/// The bits of the indices in turn: the order in which a depth-first walk meets the blocks.
fn interleaved<const D: usize>(key: BlockKey<D>) -> u128 {
    let mut word = 0;
    for bit in (0..28).rev() {
        for k in (0..D).rev() {
            word = word << 1 | u128::from(key.0[k] as u32 >> bit & 1);
        }
    }
    word
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Evidence, HitMiss, LogOdds8, LogOdds32, LogOddsRule, OccupancyModel};
    use proptest::prelude::*;

    /// Bricks and a tree take the same scans; the tree of the bricks is that tree, and its bricks are those bricks.
    fn same_both_ways<V: LogOddsValue, const D: usize>(scans: &[(Vec<i32>, u64)], rule: &V::Rule) {
        let lattice = Lattice::new([1.0; D], 0.5);
        let mut bricks = Bricks::<V, D>::new(lattice);
        // The same scans in a tree from cell -64 on.
        let mut direct = Tree::<V, D>::new(lattice.corner([-64; D]), 0.5, 7).unwrap();
        for (blocks, seed) in scans {
            let mut e = HitMiss::silent(block_cells::<D>());
            for i in 0..block_cells::<D>() {
                match seed % 3 {
                    0 => e.mark_miss(i),
                    _ if (seed.wrapping_mul(i as u64 * 2 + 1) >> 7) % 3 == 0 => e.mark_hit(i),
                    _ => e.mark_miss(i),
                }
            }
            for b in blocks {
                let key: [i32; D] = std::array::from_fn(|k| ((b >> (2 * k)) & 3) - 2);
                bricks.apply(BlockKey(key), &e, rule).unwrap();
                direct.apply(BlockKey(key.map(|v| v + 8)), &e, rule).unwrap();
            }
        }
        let tree = Tree::from_bricks(&bricks).unwrap();
        tree.check_invariants();
        let half = 1i32 << (tree.depth() - 1);
        let direct = direct.moved_to([64 - half; D], tree.depth()).unwrap();
        // As text: the mark of unobserved floats does not equal itself.
        assert_eq!(format!("{:?}", tree.records()), format!("{:?}", direct.records()));
        let back = tree.to_bricks(lattice, usize::MAX).unwrap();
        assert_eq!(back.keys(), bricks.keys());
        for key in bricks.keys() {
            let (a, b) = (back.brick(key).unwrap().cells(), bricks.brick(key).unwrap().cells());
            assert!(a.iter().zip(b.iter()).all(|(a, b)| a.same(*b)));
        }
    }

    fn scans() -> impl Strategy<Value = Vec<(Vec<i32>, u64)>> {
        prop::collection::vec((prop::collection::vec(0..64i32, 1..20), any::<u64>()), 0..12)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn a_tree_of_bricks_is_the_tree_that_was_fused(s in scans()) {
            let model = OccupancyModel::default();
            let (bytes, floats) =
                (LogOddsRule::<i8>::new(&model).unwrap(), LogOddsRule::<f32>::new(&model).unwrap());
            same_both_ways::<LogOdds8, 2>(&s, &bytes);
            same_both_ways::<LogOdds8, 3>(&s, &bytes);
            same_both_ways::<LogOdds32, 3>(&s, &floats);
        }
    }

    #[test]
    fn far_bricks_and_other_lattices_are_refused() {
        let lattice = Lattice::new([0.0; 3], 0.1);
        let mut bricks = Bricks::<LogOdds8, 3>::new(lattice);
        let full = || {
            let mut brick = LogOddsBrick::unobserved(512);
            brick.cells_mut().fill(LogOdds8(3));
            brick
        };
        bricks.insert(BlockKey([-(1 << 24), 0, (1 << 24) - 1]), full()).unwrap();
        let tree = Tree::from_bricks(&bricks).unwrap();
        assert_eq!((tree.depth(), tree.nodes()), (28, 26));
        bricks.insert(BlockKey([1 << 24, 0, 0]), full()).unwrap();
        assert!(Tree::from_bricks(&bricks).is_none());
        assert_eq!(
            tree.to_bricks(Lattice::new([0.0; 3], 0.2), usize::MAX).unwrap_err(),
            TreeBricksError::Lattice(0.2)
        );
        assert!(tree.to_bricks(Lattice::new([0.1; 3], 0.1), usize::MAX).is_err());
        assert!(tree.to_bricks(Lattice::new([0.8; 3], 0.1), usize::MAX).is_ok());
        // A leaf of 2^24 cells along each edge would be 2^63 bricks.
        let mut records = crate::store::TreeRecords::<LogOdds8>::new();
        records.set_root(crate::store::Slot::Leaf(LogOdds8(1)));
        let huge = Tree::<LogOdds8, 3>::from_records([0.0; 3], 0.1, 24, &records).unwrap();
        assert!(matches!(huge.to_bricks(lattice, 1 << 20), Err(TreeBricksError::Full(_))));
    }
}
