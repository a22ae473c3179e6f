//! Which readings of a log mean "no echo".

use super::LaserLog;

/// Readings of SICK scanners that mean "no echo" whatever else the log holds: 0x1FF7 and above in centimeters,
/// and 0x7FFF in millimeters (meters; first, last).
const CODES: [[f64; 2]; 2] = [[81.82, 81.93], [32.755, 32.77]];

/// The fewest readings that make a pile.
const FEWEST: usize = 10;

/// The reading (meters) at and above which a log means "no echo", for
/// [`RangeLimits::no_return`](portolan::scan::RangeLimits); `None` where the log has no such readings, so that
/// every reading is a surface.
///
/// A scanner reports the missing echo as one code or a few, at the top of its range: a pile of equal readings.
/// Real surfaces never pile up like that, however far away. From the largest reading down (a few stray
/// readings above are passed over), the rule accepts
/// 1. the codes of the SICK scanners,
/// 2. a pile: within 0.2 % of the top at least ten readings, ten times as dense as just below, and nearly all
///    of them equal or spread over many beams,
/// 3. a broad pile: within 3 % of the top, with nothing below it for a fifth of its range, and spread over a
///    quarter of the beams and half a percent of all readings.
///
/// A maximum range that the log declares (`ROBOTLASER1`) is believed where readings reach it, however many do. Only where most
/// readings exceed it and differ from each other is it a mistake. Scans of bags bring their range themselves
/// ([`RawLaserScan::declared`](super::RawLaserScan::declared)): nothing is guessed for them.
///
/// The returned value lies slightly below the pile. Unit free: a log in centimeters gives centimeters. Linear in the number
/// of readings.
pub fn detect_no_return(log: &LaserLog) -> Option<f64> {
    if log.raw_scans().any(|scan| scan.declared.is_some()) {
        return None;
    }
    let tail = Tail::of(log);
    // Where most beams read one value, and others read less, it is no surface: walls are not round about the sensor. A reading
    // that all have may be one.
    let pile = tail.pile().filter(|&from| {
        let count = tail.count_from(from);
        count <= tail.all / 2 || (tail.equal(0, count) >= 0.9 && count <= tail.all - tail.all / 100)
    });
    let declared = log.declared_max_range().map(|max| 0.9985 * max).filter(|&from| {
        let beyond: Vec<f64> = readings(log).map(|(r, _)| r).filter(|r| *r >= from).collect();
        !beyond.is_empty() && (beyond.len() <= tail.all / 2 || most_frequent(beyond) >= 0.5)
    });
    match (pile, declared) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// The share of the value that most of these have.
fn most_frequent(mut all: Vec<f64>) -> f64 {
    all.sort_unstable_by(f64::total_cmp);
    let most = all.chunk_by(|a, b| a == b).map(<[_]>::len).max();
    most.unwrap_or(0) as f64 / all.len().max(1) as f64
}

/// The readings of a log that are positive and finite, with their beam numbers.
fn readings(log: &LaserLog) -> impl Iterator<Item = (f64, u32)> + '_ {
    let all = log.raw_scans().flat_map(|s| s.readings.iter().copied().zip(0u32..));
    all.filter(|(r, _)| *r > 0.0 && r.is_finite())
}

/// The largest readings of a log.
struct Tail {
    /// Reading and beam index, largest reading first.
    top: Vec<(f64, u32)>,
    /// All readings that are positive and finite.
    all: usize,
    /// Beams of the widest scan.
    beams: usize,
}

impl Tail {
    fn of(log: &LaserLog) -> Self {
        let mut all = 0;
        // Stray readings may lie far above all others: the pile is looked for below the largest few.
        let mut largest = [0.0f64; STRAYS + 1];
        for (reading, _) in readings(log) {
            all += 1;
            if reading > largest[STRAYS] {
                largest[STRAYS] = reading;
                let mut k = STRAYS;
                while k > 0 && largest[k - 1] < largest[k] {
                    largest.swap(k - 1, k);
                    k -= 1;
                }
            }
        }
        let floor = 0.75 * largest.iter().copied().rfind(|r| *r > 0.0).unwrap_or(0.0);
        let mut top: Vec<_> = readings(log).filter(|(r, _)| *r >= floor).collect();
        top.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let beams = log.raw_scans().map(|s| s.readings.len()).max().unwrap_or(0);
        Self { top, all, beams }
    }

    /// Number of top readings at or above a value.
    fn count_from(&self, value: f64) -> usize {
        self.top.partition_point(|(r, _)| *r >= value)
    }

    /// A value between the last of the first `end` readings and the next.
    fn below(&self, end: usize) -> Option<f64> {
        let lowest = self.top.get(end.checked_sub(1)?)?.0;
        let next = self.top.get(end).map_or(0.0, |(r, _)| *r);
        Some(lowest - (0.0005 * lowest).min(0.5 * (lowest - next)))
    }

    fn pile(&self) -> Option<f64> {
        (0..self.top.len().min(STRAYS + 1)).find_map(|start| {
            let top = self.top[start].0;
            let mut end = self.code(top).or_else(|| self.narrow(start)).or_else(|| self.broad(start))?;
            // A scanner with several codes makes several piles.
            while self.top.get(end).is_some_and(|(r, _)| *r >= 0.97 * top) {
                let Some(next) = self.narrow(end) else { break };
                end = next;
            }
            self.below(end)
        })
    }

    /// End of the readings that are codes of a SICK scanner.
    fn code(&self, top: f64) -> Option<usize> {
        let [first, _] = CODES.into_iter().find(|[first, last]| (*first..=*last).contains(&top))?;
        Some(self.count_from(first))
    }

    /// End of a narrow pile that starts at reading `start`.
    fn narrow(&self, start: usize) -> Option<usize> {
        let top = self.top[start].0;
        let end = self.count_from(0.998 * top);
        let count = end - start;
        let below = self.count_from(0.948 * top) - end;
        let dense = count >= FEWEST && count as f64 >= 10.0 * (below as f64 / 25.0 + 1.0);
        (dense && (self.equal(start, end) >= 0.9 || self.spread(start, end) >= 0.05)).then_some(end)
    }

    /// End of a broad pile that starts at reading `start`.
    fn broad(&self, start: usize) -> Option<usize> {
        let end = self.count_from(0.97 * self.top[start].0);
        let count = end - start;
        let lowest = self.top[end - 1].0;
        let lonely = self.count_from(0.8 * lowest) == end;
        let many = count >= 2 * FEWEST && count as f64 >= 0.005 * self.all as f64;
        (lonely && many && self.spread(start, end) >= 0.25).then_some(end)
    }

    /// Share of the most frequent value.
    fn equal(&self, start: usize, end: usize) -> f64 {
        let runs = self.top[start..end].chunk_by(|a, b| a.0 == b.0);
        runs.map(<[_]>::len).max().unwrap_or(0) as f64 / (end - start) as f64
    }

    /// Share of the beam numbers that occur.
    fn spread(&self, start: usize, end: usize) -> f64 {
        let mut seen = vec![false; self.beams];
        self.top[start..end].iter().for_each(|(_, beam)| seen[*beam as usize] = true);
        seen.iter().filter(|s| **s).count() as f64 / self.beams as f64
    }
}

/// So many readings may lie above the pile.
const STRAYS: usize = 10;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, real_data};
    use std::fmt::Write;

    /// A log of `scans` scans of 180 beams in a room: readings up to `room`, rounded to 1 cm; a share of the
    /// beams replaced by `special`.
    fn log(
        room: f64,
        scans: usize,
        mut special: impl FnMut(&mut Random, usize, usize) -> Option<f64>,
    ) -> LaserLog {
        let mut random = Random(3);
        let mut text = String::new();
        for scan in 0..scans {
            text.push_str("FLASER 180");
            for beam in 0..180 {
                // Far readings are rarer than near ones.
                let wall = room * (0.02 + 0.98 * random.unit() * random.unit());
                let reading = special(&mut random, scan, beam).unwrap_or(wall);
                write!(text, " {reading:.2}").unwrap();
            }
            text.push_str(" 0 0 0 0 0 0 0 h 0\n");
        }
        parse(text)
    }

    fn parse(text: String) -> LaserLog {
        let input = crate::Input::from_reader(std::io::Cursor::new(text), "x".as_ref()).unwrap();
        LaserLog::parse_carmen(input).unwrap()
    }

    fn sometimes(random: &mut Random, share: f64, values: &[f64]) -> Option<f64> {
        (random.unit() < share).then(|| values[random.below(values.len())])
    }

    #[track_caller]
    fn between(low: f64, high: f64, log: &LaserLog) {
        let found = detect_no_return(log);
        assert!(found.is_some_and(|t| low < t && t < high), "{found:?} is not in {low}..{high}");
    }

    #[test]
    fn codes_and_clamped_ranges_are_found() {
        between(81.7, 81.83, &log(25.0, 100, |r, _, _| sometimes(r, 0.02, &[81.83, 81.91, 81.87])));
        between(32.7, 32.76, &log(30.0, 100, |r, _, _| sometimes(r, 0.02, &[32.76])));
        between(49.9, 50.0, &log(30.0, 100, |r, _, _| sometimes(r, 0.001, &[50.0])));
        between(51.1, 51.2, &log(30.0, 100, |r, _, _| sometimes(r, 0.02, &[51.2])));
        // Real readings reach up to the pile.
        between(49.9, 50.0, &log(49.9, 200, |r, _, _| sometimes(r, 0.02, &[50.0])));
        // Two codes, two per cent apart, and a broad pile.
        between(49.9, 50.0, &log(30.0, 100, |r, _, _| sometimes(r, 0.02, &[50.0, 51.2])));
        let broad = log(30.0, 100, |r, _, _| (r.unit() < 0.02).then(|| 50.0 + 1.2 * r.unit()));
        between(49.8, 50.01, &broad);
        // One single code is enough where the code is known.
        let one = log(25.0, 100, |_, scan, beam| (scan == 3 && beam == 5).then_some(81.91));
        between(81.8, 81.91, &one);
    }

    #[test]
    fn units_do_not_matter() {
        between(8170.0, 8183.0, &log(2500.0, 100, |r, _, _| sometimes(r, 0.02, &[8183.0, 8191.0])));
        assert_eq!(detect_no_return(&log(2500.0, 100, |_, _, _| None)), None);
    }

    #[test]
    fn stray_readings_above_are_passed_over() {
        let strays = log(25.0, 100, |r, scan, beam| {
            if beam == 7 && scan % 40 == 0 { Some(655.35 + scan as f64) } else { sometimes(r, 0.02, &[50.0]) }
        });
        between(49.9, 50.0, &strays);
    }

    #[test]
    fn large_real_readings_are_no_pile() {
        assert_eq!(detect_no_return(&log(25.0, 100, |_, _, _| None)), None);
        assert_eq!(detect_no_return(&log(79.0, 1000, |_, _, _| None)), None);
        // A far wall behind a door, seen by a robot that stands still.
        let door = |r: &mut Random, _, beam| (90..94).contains(&beam).then(|| 40.0 + 0.02 * r.unit());
        assert_eq!(detect_no_return(&log(12.0, 100, door)), None);
        // The end of a corridor, seen while driving towards it.
        let end = |r: &mut Random, scan, beam| {
            (85..95).contains(&beam).then(|| 30.0 - 0.2 * scan as f64 + 0.01 * r.unit())
        };
        assert_eq!(detect_no_return(&log(12.0, 100, end)), None);
        // One outlier.
        let one = log(25.0, 100, |_, scan, beam| (scan == 3 && beam == 5).then_some(77.0));
        assert_eq!(detect_no_return(&one), None);
        for nothing in
            ["FLASER 1 0 0 0 0 0 0 0", "FLASER 2 nan inf 0 0 0 0 0 0", "FLASER 2 -1 -2 0 0 0 0 0 0"]
        {
            assert_eq!(detect_no_return(&parse(nothing.into())), None);
        }
    }

    #[test]
    fn declared_ranges_count_where_readings_reach_them() {
        let robot = |max: f64, readings: &str| {
            parse(format!("ROBOTLASER1 0 -1 2 0.5 {max} 0 0 5 {readings} 0 0 0 0 0 0 0 0 0 0 0 0 0 h 0"))
        };
        between(29.9, 30.0, &robot(30.0, "1 2 3 30 7"));
        between(29.9, 30.0, &robot(30.0, "1 2 3 45.5 7"));
        between(81.7, 81.91, &robot(81.92, "1 2 81.91 4 7"));
        assert_eq!(detect_no_return(&robot(30.0, "1 2 3 4 7")), None);
        assert_eq!(detect_no_return(&robot(1.5, "1 2 3 4 7")), None);
        assert_eq!(detect_no_return(&robot(0.0, "1 2 3 4 7")), None);
    }

    /// A declared maximum is believed and a pile is no surface, whatever the share of beams without echo.
    #[test]
    fn the_share_of_beams_without_echo_does_not_matter() {
        for share in [0.3, 0.45, 0.55, 0.7, 0.97] {
            for code in [5.6, 81.91] {
                between(0.99 * code, code, &log(2.5, 50, |r, _, _| sometimes(r, share, &[code])));
            }
            // Readings without echo lie beyond the declared maximum.
            let mut random = Random(7);
            let mut text = String::new();
            for _ in 0..50 {
                text.push_str("ROBOTLASER1 0 -1.57 3.12 0.0174 5.6 0.01 0 180");
                for _ in 0..180 {
                    let reading = sometimes(&mut random, share, &[6.6]).unwrap_or(2.0 + 0.05 * random.unit());
                    write!(text, " {reading:.2}").unwrap();
                }
                text.push_str(" 0 0 0 0 0 0 0 0 0 0 0 0 0 h 0\n");
            }
            between(5.5, 5.6, &parse(text));
        }
        // What all beams read may be a surface: a round room.
        assert_eq!(detect_no_return(&log(2.5, 50, |_, _, _| Some(3.0))), None);
    }

    #[test]
    fn real_logs_are_understood() {
        for (name, real, code) in [
            ("intel-corrected.log.gz", 25.4, 81.83),
            ("freiburg-079-corrected.log.gz", 36.7, 81.91),
            ("intel.clf.bz2", 79.0, 81.83),
        ] {
            let Some(path) = real_data(&format!("lidar2d_carmen/{name}")) else { continue };
            between(real, code, &LaserLog::read_carmen(path).unwrap());
        }
    }
}
