//! What a bag holds, for people.

use std::collections::BTreeMap;

use super::bag::{Bag, Container};
use super::index::NO_CHUNK;
use super::unpack::Packing;
use super::{mcap, ros1};
use crate::Result;

/// What a bag holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagSummary {
    /// One for each of [`Bag::topics`], in their order.
    pub topics: Vec<TopicSummary>,
    /// Messages of all topics.
    pub messages: u64,
    /// The first and the last log time (nanoseconds); `None`: there are no messages.
    pub log_times: Option<(i64, i64)>,
    /// Files.
    pub files: usize,
    /// Files that are compressed as a whole.
    pub packed_files: usize,
    /// Bytes of all files; unpacked, where one is compressed as a whole.
    pub bytes: u64,
    /// How many chunks with messages are compressed how: `none`, `zstd`, `lz4`, `bz2`. Empty where there are no chunks.
    pub chunks: BTreeMap<&'static str, u64>,
}

/// How the messages of a topic come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TopicSummary {
    /// Messages.
    pub messages: u64,
    /// The first and the last log time (nanoseconds); `None`: it has no messages.
    pub log_times: Option<(i64, i64)>,
    /// Messages a second, by the median of the times between them; `None`: fewer than two messages, or no time passes
    /// between most of them.
    pub rate: Option<f64>,
    /// The log time after which no message comes for longest, and for how long (nanoseconds); `None`: fewer than two
    /// messages.
    pub largest_gap: Option<(i64, u64)>,
    /// How often a log time is before that of the message that the file has before it: the recorder's clock was set
    /// back, or a simulation started again.
    pub steps_back: u64,
    /// The largest such step (nanoseconds); 0: there is none.
    pub largest_step_back: u64,
}

impl Bag {
    /// Rates, gaps, steps of the clock and compression, from the index and the heads of chunks. O(n log n) of the
    /// messages, and one short read a chunk.
    ///
    /// # Errors
    /// As [`Bag::read`], where the head of a chunk cannot be read.
    pub fn summary(&self) -> Result<BagSummary> {
        let mut times = vec![Vec::new(); self.topics.len()];
        for message in &self.messages {
            times[message.topic as usize].push(message.log_time);
        }
        let topics: Vec<_> = times.into_iter().map(TopicSummary::of).collect();
        let all = || topics.iter().filter_map(|t| t.log_times);
        let log_times = all().map(|t| t.0).min().zip(all().map(|t| t.1).max());
        Ok(BagSummary {
            messages: self.messages.len() as u64,
            log_times,
            files: self.files.len(),
            packed_files: self.files.iter().filter(|f| f.packed).count(),
            bytes: self.files.iter().map(|f| f.size).sum(),
            chunks: self.chunks()?,
            topics,
        })
    }

    fn chunks(&self) -> Result<BTreeMap<&'static str, u64>> {
        let mut chunks = BTreeMap::new();
        let mut last = None;
        for message in self.messages.iter().filter(|m| m.within != NO_CHUNK) {
            // The messages of a chunk follow each other.
            if last.replace((message.file, message.place)) == Some((message.file, message.place)) {
                continue;
            }
            let file = &self.files[message.file as usize];
            let packing_of = match file.container {
                Container::Mcap => mcap::packing_of,
                Container::RosBag => ros1::packing_of,
                Container::Sqlite3(_) => continue,
            };
            let mut handle = file.handle()?;
            let packing = packing_of(&mut handle.reader, message.place)?;
            file.give_back(handle);
            *chunks.entry(packing.map_or("none", Packing::name)).or_default() += 1;
        }
        Ok(chunks)
    }
}

impl TopicSummary {
    /// Of log times in the order in which the files have them.
    fn of(mut times: Vec<i64>) -> Self {
        let steps = || times.windows(2).filter(|t| t[1] < t[0]).map(|t| t[0].abs_diff(t[1]));
        let (steps_back, largest_step_back) = (steps().count() as u64, steps().max().unwrap_or(0));
        times.sort_unstable();
        let log_times = times.first().copied().zip(times.last().copied());
        // The first of equal gaps.
        let gaps = times.windows(2).map(|t| (t[0], t[1].abs_diff(t[0])));
        let largest_gap = gaps.clone().reduce(|a, b| if b.1 > a.1 { b } else { a });
        let mut intervals: Vec<u64> = gaps.map(|g| g.1).collect();
        let middle = intervals.len() / 2;
        let median = (!intervals.is_empty()).then(|| *intervals.select_nth_unstable(middle).1);
        let rate = median.filter(|m| *m > 0).map(|m| 1e9 / m as f64);
        let messages = times.len() as u64;
        Self { messages, log_times, rate, largest_gap, steps_back, largest_step_back }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_and_gaps_are_of_sorted_times_and_steps_of_stored_ones() {
        let summary = TopicSummary::of(vec![0, 100, 200, 50, 1300, 1400]);
        let sorted = TopicSummary { steps_back: 0, largest_step_back: 0, ..summary };
        assert_eq!((summary.steps_back, summary.largest_step_back), (1, 150));
        assert_eq!(TopicSummary::of(vec![0, 50, 100, 200, 1300, 1400]), sorted);
        // Intervals 50, 50, 100, 1100, 100.
        assert_eq!((sorted.messages, sorted.rate, sorted.largest_gap), (6, Some(1e7), Some((200, 1100))));
        assert_eq!(TopicSummary::of(Vec::new()), TopicSummary::default());
        let one = TopicSummary { messages: 1, log_times: Some((7, 7)), ..TopicSummary::default() };
        assert_eq!(TopicSummary::of(vec![7]), one);
        assert_eq!(TopicSummary::of(vec![7; 5]).rate, None);
        let ends = TopicSummary::of(vec![i64::MAX, i64::MIN]);
        assert_eq!((ends.largest_step_back, ends.largest_gap), (u64::MAX, Some((i64::MIN, u64::MAX))));
    }
}
