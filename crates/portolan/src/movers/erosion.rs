//! Bits of cells that are set together with those of all their neighbors.

use crate::geom::BlockKey;
use crate::parallel;

/// Rows of eight cells: the bits of their first and of their last.
const FIRST: u64 = 0x0101_0101_0101_0101;
const LAST: u64 = FIRST << 7;
/// Blocks that one task goes through.
const TOGETHER: usize = 256;

/// Bits of blocks, 64 cells a word: one word in 2-D, eight in 3-D.
pub(super) type Words = [u64; 8];

/// Clears the bit of every cell that has a neighbor, diagonals included, whose bit is not set; what lies in no block has none.
/// `keys` are ascending, each once; `bits` are theirs. O(blocks).
pub(super) fn erode<const D: usize>(keys: &[BlockKey<D>], bits: &mut Vec<Words>) {
    for axis in 0..D {
        let before = beside(keys, axis, -1);
        let after = beside(keys, axis, 1);
        let all = &*bits;
        let at = |i: Option<u32>| i.map_or([0; 8], |i| all[i as usize]);
        let places: Vec<usize> = (0..keys.len()).collect();
        *bits = parallel::map(&places, TOGETHER, |&i| along(axis, &all[i], &at(before[i]), &at(after[i])));
    }
}

/// The bits of cells whose neighbors before and after them along an axis are set, too.
fn along(axis: usize, bits: &Words, before: &Words, after: &Words) -> Words {
    std::array::from_fn(|w| {
        let (lower, higher) = match axis {
            0 => (
                (bits[w] << 1) & !FIRST | (before[w] >> 7) & FIRST,
                (bits[w] >> 1) & !LAST | (after[w] << 7) & LAST,
            ),
            1 => (bits[w] << 8 | before[w] >> 56, bits[w] >> 8 | after[w] << 56),
            _ => (if w == 0 { before[7] } else { bits[w - 1] }, if w == 7 { after[0] } else { bits[w + 1] }),
        };
        bits[w] & lower & higher
    })
}

/// The place of the block beside each, so many along an axis. Keys that are moved keep their order, so that one pass finds all.
fn beside<const D: usize>(keys: &[BlockKey<D>], axis: usize, by: i32) -> Vec<Option<u32>> {
    let mut next = 0;
    let place = |key: &BlockKey<D>| {
        let mut wanted = *key;
        wanted.0[axis] = wanted.0[axis].checked_add(by)?;
        while keys.get(next).is_some_and(|key| *key < wanted) {
            next += 1;
        }
        (keys.get(next) == Some(&wanted)).then_some(next as u32)
    };
    keys.iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    /// Cells of a box that reaches over the corners of blocks, in blocks and one by one.
    fn is_eroded<const D: usize>(marks: &[bool]) {
        const EDGE: i32 = 6;
        let cell =
            |i: usize| -> [i32; D] { std::array::from_fn(|k| (i as i32 / EDGE.pow(k as u32)) % EDGE + 5) };
        let set: HashSet<[i32; D]> =
            (0..marks.len().min(EDGE.pow(D as u32) as usize)).filter(|&i| marks[i]).map(cell).collect();
        let mut keys: Vec<BlockKey<D>> = set.iter().map(|c| BlockKey::of_cell(*c)).collect();
        keys.sort_unstable();
        keys.dedup();
        let mut bits = vec![[0; 8]; keys.len()];
        for c in &set {
            let at = keys.binary_search(&BlockKey::of_cell(*c)).unwrap();
            let i = BlockKey::offset(*c);
            bits[at][i >> 6] |= 1 << (i & 63);
        }
        erode(&keys, &mut bits);
        let kept: HashSet<[i32; D]> = keys
            .iter()
            .zip(&bits)
            .flat_map(|(key, bits)| {
                (0..512).filter(|i| bits[i >> 6] >> (i & 63) & 1 == 1).map(|i| key.cell(i))
            })
            .collect();
        let near = |n: usize, c: &[i32; D]| -> [i32; D] {
            std::array::from_fn(|k| c[k] + (n as i32 / 3i32.pow(k as u32)) % 3 - 1)
        };
        let whole = |c: &[i32; D]| (0..3usize.pow(D as u32)).all(|n| set.contains(&near(n, c)));
        let expected: HashSet<[i32; D]> = set.iter().filter(|c| whole(c)).copied().collect();
        assert_eq!(kept, expected);
    }

    proptest! {
        #[test]
        fn a_cell_stays_with_all_its_neighbours_2d_and_3d(
            holes in prop::collection::vec(0usize..216, 0..12), few in prop::collection::vec(any::<bool>(), 216),
        ) {
            let mut marks = vec![true; 216];
            holes.iter().for_each(|i| marks[*i] = false);
            is_eroded::<2>(&marks);
            is_eroded::<3>(&marks);
            is_eroded::<2>(&few);
            is_eroded::<3>(&few);
        }
    }
}
