//! Hit and miss bits of the bricks that a scan touches.

use crate::geom::BlockKey;
use rustc_hash::FxHashMap;

/// No slot.
const NONE: u32 = u32::MAX;
/// Bricks of the window in which slots are found without hashing: 16 MiB of slots.
const WINDOW: u64 = 1 << 22;

/// The bits of one brick: 64 cells a word, x fastest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bits {
    pub(crate) miss: [u64; 8],
    pub(crate) hit: [u64; 8],
}

/// Bits by brick. Bricks in a window around the scan are found by one index where the window is small enough, by
/// hashing otherwise. Buffers are kept from scan to scan.
#[derive(Clone, Debug, Default)]
pub(crate) struct BrickMasks {
    window: Option<Window>,
    dense: Vec<u32>,
    hashed: FxHashMap<BlockKey<3>, u32>,
    keys: Vec<BlockKey<3>>,
    bits: Vec<Bits>,
}

/// A box of bricks.
#[derive(Clone, Copy, Debug)]
struct Window {
    first: [i32; 3],
    shape: [u32; 3],
}

impl Window {
    #[inline(always)]
    fn index(&self, key: BlockKey<3>) -> Option<usize> {
        let at: [u32; 3] = std::array::from_fn(|k| key.0[k].wrapping_sub(self.first[k]) as u32);
        let inside = at[0] < self.shape[0] && at[1] < self.shape[1] && at[2] < self.shape[2];
        inside.then(|| {
            (at[2] as usize * self.shape[1] as usize + at[1] as usize) * self.shape[0] as usize
                + at[0] as usize
        })
    }
}

impl BrickMasks {
    /// Forgets everything and expects bricks from `first` to `last`, both included. Others work, too, but slower.
    pub(crate) fn begin(&mut self, first: BlockKey<3>, last: BlockKey<3>) {
        if let Some(window) = self.window {
            // Only what was used: the window may be much larger than what the rays touched.
            for &key in &self.keys {
                if let Some(i) = window.index(key) {
                    self.dense[i] = NONE;
                }
            }
        }
        self.hashed.clear();
        self.keys.clear();
        self.bits.clear();
        let shape = [0, 1, 2].map(|k| (i64::from(last.0[k]) - i64::from(first.0[k]) + 1).max(0) as u64);
        let volume = shape.iter().try_fold(1u64, |n, s| n.checked_mul(*s)).unwrap_or(u64::MAX);
        self.window = (volume <= WINDOW).then(|| Window { first: first.0, shape: shape.map(|s| s as u32) });
        if self.window.is_some() && self.dense.len() < volume as usize {
            self.dense.resize(volume as usize, NONE);
        }
    }

    /// Number of bricks.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.keys.len()
    }

    /// The slot of a brick, made where it is missing.
    #[inline(always)]
    pub(crate) fn slot(&mut self, key: BlockKey<3>) -> usize {
        match self.window.and_then(|w| w.index(key)) {
            Some(i) => {
                let slot = self.dense[i];
                if slot != NONE {
                    return slot as usize;
                }
                self.dense[i] = self.keys.len() as u32;
            }
            None => {
                let next = self.keys.len() as u32;
                let slot = *self.hashed.entry(key).or_insert(next);
                if slot != next {
                    return slot as usize;
                }
            }
        }
        self.keys.push(key);
        self.bits.push(Bits::default());
        self.keys.len() - 1
    }

    #[inline(always)]
    pub(crate) fn bits_mut(&mut self, slot: usize) -> &mut Bits {
        &mut self.bits[slot]
    }

    /// A beam ended in `cell`.
    #[inline(always)]
    pub(crate) fn mark_hit(&mut self, cell: [i32; 3]) {
        let slot = self.slot(BlockKey::of_cell(cell));
        let i = BlockKey::offset(cell);
        self.bits[slot].hit[i >> 6] |= 1 << (i & 63);
    }

    /// Takes the bits of another scan's part in. The result does not depend on the order of parts, except for the order
    /// of slots, which nobody sees.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (&key, theirs) in other.keys.iter().zip(&other.bits) {
            let slot = self.slot(key);
            let ours = &mut self.bits[slot];
            for w in 0..8 {
                ours.miss[w] |= theirs.miss[w];
                ours.hit[w] |= theirs.hit[w];
            }
        }
    }

    /// Keys and slots in ascending order of keys.
    pub(crate) fn sorted(&self) -> Vec<(BlockKey<3>, u32)> {
        let mut order: Vec<_> = self.keys.iter().copied().zip(0..).collect();
        order.sort_unstable_by_key(|e: &(BlockKey<3>, u32)| e.0);
        order
    }

    /// The bits of a slot.
    pub(crate) fn bits(&self, slot: u32) -> &Bits {
        &self.bits[slot as usize]
    }
}
