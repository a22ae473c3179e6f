//! Bits of words, and disjoint sets of numbers.

/// The places of a word's bits, ascending.
#[inline(always)]
pub(crate) fn bits(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = word.trailing_zeros() as usize;
        let some = word != 0;
        word &= word.wrapping_sub(1);
        some.then_some(bit)
    })
}

/// The places of all bits of some words, one word after the other.
pub(crate) fn bits_of(words: &[u64]) -> impl Iterator<Item = usize> {
    words.iter().enumerate().flat_map(|(w, &word)| bits(word).map(move |bit| 64 * w + bit))
}

/// Disjoint sets; the representative of a set is its lowest member.
pub(crate) struct Sets(Vec<u32>);

impl Sets {
    /// Each number below `count` in a set of its own.
    pub(crate) fn new(count: u32) -> Self {
        Self((0..count).collect())
    }

    pub(crate) fn find(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            // Halves the way for the next one.
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
