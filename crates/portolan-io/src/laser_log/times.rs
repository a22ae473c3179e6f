//! Whether stamps can be used as time.

use super::log::Entry;

/// Whether the stamps of the scans can be used as time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeOrder {
    /// Some scan has no stamp, or all stamps are equal (zero in many logs).
    Absent,
    /// From scan to scan the stamps grow or stay.
    Ascending,
    /// Somewhere the stamps go back: they wrap, or lines are out of order.
    NotAscending,
}

/// The order of the stamps of these scans.
pub(crate) fn time_order(entries: &[Entry]) -> TimeOrder {
    let mut times = entries.iter().map(|e| e.time);
    let Some(Some(first)) = times.next() else { return TimeOrder::Absent };
    let (mut last, mut ascending, mut constant) = (first, true, true);
    for time in times {
        let Some(time) = time else { return TimeOrder::Absent };
        ascending &= last <= time;
        constant &= time == first;
        last = time;
    }
    match (constant && entries.len() > 1, ascending) {
        (true, _) => TimeOrder::Absent,
        (_, true) => TimeOrder::Ascending,
        (_, false) => TimeOrder::NotAscending,
    }
}
