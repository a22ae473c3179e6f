//! Room in the page's buffers: pieces of the mesh grow, shrink and go, and one buffer holds them all.

use std::collections::BTreeMap;

/// Rooms are no smaller than this.
const LEAST: u32 = 32;
/// A buffer holds no more than this: three of each are still counted by 32 bits.
const MOST: u32 = 1 << 28;

/// Where something lies in a buffer, and how much room it has there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Range {
    pub(super) start: u32,
    pub(super) capacity: u32,
}

/// Rooms of one buffer. Their sizes are few, so that one that was given back fits what comes next.
#[derive(Debug, Default)]
pub(super) struct Ranges {
    end: u32,
    free: BTreeMap<u32, Vec<u32>>,
}

impl Ranges {
    /// Room for `count`, a fifth too large at most (from 64 on); `None`: the buffer would pass its limit.
    pub(super) fn take(&mut self, count: u32) -> Option<Range> {
        let capacity = capacity(count)?;
        if let Some(start) = self.free.get_mut(&capacity).and_then(Vec::pop) {
            return Some(Range { start, capacity });
        }
        let end = self.end.checked_add(capacity).filter(|&end| end <= MOST)?;
        let start = std::mem::replace(&mut self.end, end);
        Some(Range { start, capacity })
    }

    /// Room that is not needed any more.
    pub(super) fn give(&mut self, range: Range) {
        if range.capacity > 0 {
            self.free.entry(range.capacity).or_default().push(range.start);
        }
    }

    /// Everything that was ever taken lies before this.
    pub(super) fn end(&self) -> u32 {
        self.end
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.free.values().map(|starts| starts.capacity() * 4 + 32).sum()
    }
}

/// The smallest of the sizes 32, 40, 48, 56, 64, 80, 96, 112, 128, 160 ... that holds `count`.
fn capacity(count: u32) -> Option<u32> {
    if count > MOST {
        return None;
    }
    let count = count.max(LEAST);
    let quarter = (1u32 << (31 - count.leading_zeros())) / 4;
    Some(count.next_multiple_of(quarter.max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn sizes_are_few_and_near() {
        for count in 1..10_000 {
            let c = capacity(count).unwrap();
            assert!(c >= count && (count < LEAST || c <= count + count / 4 + 1), "{count}: {c}");
        }
        let mut sizes: Vec<_> = (1..=1 << 16).filter_map(capacity).collect();
        sizes.dedup();
        assert_eq!(sizes.len(), 4 * 11 + 1);
        assert_eq!(capacity(MOST + 1), None);
    }

    proptest! {
        /// Whatever is taken and given back, no two rooms overlap.
        #[test]
        fn rooms_do_not_overlap(ops in prop::collection::vec((any::<bool>(), 1u32..3000), 1..200)) {
            let (mut ranges, mut held) = (Ranges::default(), Vec::<Range>::new());
            for (take, n) in ops {
                if take || held.is_empty() {
                    held.push(ranges.take(n).unwrap());
                } else {
                    ranges.give(held.swap_remove(n as usize % held.len()));
                }
                let mut sorted = held.clone();
                sorted.sort_by_key(|r| r.start);
                prop_assert!(sorted.windows(2).all(|w| w[0].start + w[0].capacity <= w[1].start));
                prop_assert!(sorted.last().is_none_or(|r| r.start + r.capacity <= ranges.end()));
            }
        }
    }

    #[test]
    fn a_full_buffer_says_so() {
        let mut ranges = Ranges::default();
        assert!(ranges.take(MOST).is_some());
        assert!(ranges.take(1).is_none());
        ranges.give(Range { start: 0, capacity: MOST });
        assert_eq!(ranges.take(MOST), Some(Range { start: 0, capacity: MOST }));
    }
}
