//! Evidence for log odds: one bit for "a beam ended here", one for "a beam passed".

use super::Evidence;

/// What a scan says about one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Endpoint {
    /// A beam ended here. Wins over beams that passed.
    Hit,
    /// Beams passed and none ended here.
    Miss,
}

/// Hit and miss bits of a block of at most 512 cells. A bit says that at least one beam did it: however many
/// beams of a scan cross a cell, the cell gets one observation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HitMiss {
    hit: [u64; 8],
    miss: [u64; 8],
    words: usize,
}

impl HitMiss {
    /// A beam ended in cell `i` of the block.
    #[inline(always)]
    pub fn mark_hit(&mut self, i: usize) {
        self.hit[(i >> 6) & 7] |= 1 << (i & 63);
    }

    /// A beam passed through cell `i` of the block.
    #[inline(always)]
    pub fn mark_miss(&mut self, i: usize) {
        self.miss[(i >> 6) & 7] |= 1 << (i & 63);
    }

    /// The bits of a block of 512 cells: hits, then misses, 64 cells a word.
    #[inline(always)]
    pub fn from_words(hit: [u64; 8], miss: [u64; 8]) -> Self {
        Self { hit, miss, words: 8 }
    }

    /// Hits and misses that no hit overrules, of cells `64 * w .. 64 * w + 64`.
    #[inline(always)]
    pub fn word(&self, w: usize) -> (u64, u64) {
        (self.hit[w], self.miss[w] & !self.hit[w])
    }

    /// Eight bits each of hits and of misses that no hit overrules, for cells `from .. from + 8`; `from` must
    /// be a multiple of eight.
    #[inline(always)]
    pub fn row(&self, from: usize) -> (u8, u8) {
        let shift = from & 63;
        let hit = (self.hit[(from >> 6) & 7] >> shift) as u8;
        (hit, (self.miss[(from >> 6) & 7] >> shift) as u8 & !hit)
    }
}

impl Evidence for HitMiss {
    type One = Endpoint;

    fn silent(cells: usize) -> Self {
        assert!(cells <= 512, "a block has at most 512 cells");
        Self { hit: [0; 8], miss: [0; 8], words: cells.div_ceil(64) }
    }

    fn clear(&mut self) {
        self.hit = [0; 8];
        self.miss = [0; 8];
    }

    #[inline(always)]
    fn one(&self, i: usize) -> Option<Endpoint> {
        let (word, bit) = ((i >> 6) & 7, 1 << (i & 63));
        if self.hit[word] & bit != 0 {
            Some(Endpoint::Hit)
        } else {
            (self.miss[word] & bit != 0).then_some(Endpoint::Miss)
        }
    }

    fn observed(&self) -> usize {
        (0..self.words).map(|w| (self.hit[w] | self.miss[w]).count_ones() as usize).sum()
    }

    fn keep(&mut self, inside: impl Fn(usize) -> bool) {
        for i in (0..64 * self.words).filter(|&i| !inside(i)) {
            self.hit[i >> 6] &= !(1 << (i & 63));
            self.miss[i >> 6] &= !(1 << (i & 63));
        }
    }
}
