//! Reading a log line by line.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use portolan::geom::Pose;

use super::message::{ScanHead, parse_scan};
use super::stats::{CarmenStats, RefusedScan, RefusedScans, ScanMessage};
use crate::bytes::{Input, Lines, open};
use crate::laser_log::{Entry, Fans, LaserLog, LaserLogStats, MOST_READINGS, MOST_SCANS, time_order};
use crate::{IoError, Result, error::shown};

/// The most message names that are counted apart.
const MOST_NAMES: usize = 64;

impl LaserLog {
    /// Reads a CARMEN log. Linear in its length.
    ///
    /// # Errors
    /// See [`LaserLog::parse_carmen`] and [`open`].
    pub fn read_carmen(path: impl AsRef<Path>) -> Result<Self> {
        Self::parse_carmen(open(path)?)
    }

    /// Reads a CARMEN log.
    ///
    /// # Errors
    /// [`IoError::NoScans`] where no line is a usable scan, [`IoError::Text`] for a line longer than 4 MiB or
    /// a log that would need gigabytes, and the errors of reading.
    pub fn parse_carmen(input: Input) -> Result<Self> {
        Reading::default().run(Lines::of(input))
    }
}

/// Scans of one kind of message.
#[derive(Default)]
struct Collected {
    entries: Vec<Entry>,
    readings: Vec<f64>,
    max_range: Option<f64>,
}

/// The state of reading a log.
#[derive(Default)]
pub(super) struct Reading {
    flaser: Collected,
    robot_laser: Collected,
    fans: Fans,
    refused: RefusedScans,
    other: BTreeMap<Vec<u8>, u64>,
    rare: u64,
}

impl Reading {
    /// Reads all lines.
    pub(super) fn run(mut self, mut lines: Lines<impl BufRead>) -> Result<LaserLog> {
        while let Some(line) = lines.next_line()? {
            let line = line.trim_ascii();
            let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
            let (word, rest) = line.split_at(end);
            let message = match word {
                b"FLASER" => ScanMessage::Flaser,
                b"ROBOTLASER1" => ScanMessage::RobotLaser1,
                _ => {
                    self.count_other(word);
                    continue;
                }
            };
            match parse_scan(message, rest, &mut self.of(message).readings) {
                Ok(head) if self.push(message, &head) => {}
                Ok(_) => {
                    let value = format!("over {MOST_READINGS} readings or {MOST_SCANS} scans");
                    let advice = "split the log into parts";
                    return Err(IoError::text(lines.path(), lines.number(), "the log so far", value, advice));
                }
                Err((fault, text)) => self.refused.count(RefusedScan { line: lines.number(), fault, text }),
            }
        }
        let (path, count) = (lines.path().to_owned(), lines.number());
        self.finish(path, count)
    }

    fn of(&mut self, message: ScanMessage) -> &mut Collected {
        match message {
            ScanMessage::Flaser => &mut self.flaser,
            ScanMessage::RobotLaser1 => &mut self.robot_laser,
        }
    }

    /// Whether there was room for the scan.
    fn push(&mut self, message: ScanMessage, head: &ScanHead) -> bool {
        let Some(fan) = self.fans.number(head.fan) else { return false };
        let into = self.of(message);
        let [x, y, theta] = head.pose;
        into.entries.push(Entry {
            world_from_laser: Pose::<2>::new(x, y, theta),
            first_reading: into.readings.len() - head.fan.beams,
            fan,
            time: head.time,
            declared: None,
            time_increment: None,
            laser: 0,
        });
        if let Some(declared) = head.max_range {
            into.max_range = Some(into.max_range.map_or(declared, |m: f64| m.min(declared)));
        }
        let scans = self.flaser.entries.len() + self.robot_laser.entries.len();
        let readings = self.flaser.readings.len() + self.robot_laser.readings.len();
        scans <= MOST_SCANS && readings <= MOST_READINGS
    }

    fn count_other(&mut self, word: &[u8]) {
        let name = match word {
            [] => return,
            [b'#', ..] => b"#",
            _ => &word[..word.len().min(32)],
        };
        if let Some(count) = self.other.get_mut(name) {
            *count += 1;
        } else if self.other.len() < MOST_NAMES {
            self.other.insert(name.to_vec(), 1);
        } else {
            self.rare += 1;
        }
    }

    fn finish(self, path: PathBuf, lines: u64) -> Result<LaserLog> {
        let mut other_messages = BTreeMap::new();
        for (name, count) in self.other {
            let quoted = shown(&name);
            *other_messages.entry(quoted.trim_matches('"').to_owned()).or_default() += count;
        }
        if self.rare > 0 {
            other_messages.insert("(other)".to_owned(), self.rare);
        }
        let (message, used, skipped) = match (self.flaser, self.robot_laser) {
            (f, r) if !f.entries.is_empty() => (ScanMessage::Flaser, f, r.entries.len()),
            (_, r) => (ScanMessage::RobotLaser1, r, 0),
        };
        if used.entries.is_empty() {
            return Err(IoError::NoScans { path, lines, found: found(&self.refused, &other_messages) });
        }
        let stats = CarmenStats {
            lines,
            message,
            skipped_scans: skipped as u64,
            refused: self.refused,
            other_messages,
            declared_max_range: used.max_range,
            times: time_order(&used.entries),
        };
        Ok(LaserLog {
            path,
            entries: used.entries,
            fans: self.fans.into_all(),
            readings: used.readings,
            trajectories: Vec::new(),
            fates: Some(Arc::default()),
            stats: LaserLogStats::Carmen(Box::new(stats)),
        })
    }
}

/// What a log without scans holds instead.
fn found(refused: &RefusedScans, other: &BTreeMap<String, u64>) -> String {
    let mut parts = Vec::new();
    if let Some(first) = &refused.first {
        parts.push(format!("{} scan lines refused, first {first}", refused.total()));
    }
    let mut counts: Vec<_> = other.iter().collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
    parts.extend(counts.iter().take(6).map(|(name, count)| format!("{count} {name}")));
    if counts.len() > 6 {
        parts.push(format!("{} other kinds", counts.len() - 6));
    }
    if parts.is_empty() { "the file is empty".into() } else { parts.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laser_log::TimeOrder;
    use crate::testing::{no_panic, real_data, says};
    use crate::{Input, ScanFault};
    use portolan::scan::RangeLimits;
    use std::f64::consts::PI;
    use std::path::Path;

    fn parse(text: impl Into<Vec<u8>>) -> Result<LaserLog> {
        LaserLog::parse_carmen(
            Input::from_reader(std::io::Cursor::new(text.into()), Path::new("a.log")).unwrap(),
        )
    }

    impl LaserLog {
        fn carmen(&self) -> &CarmenStats {
            match self.stats() {
                LaserLogStats::Carmen(stats) => stats,
                LaserLogStats::Bag(_) => panic!("no CARMEN log"),
            }
        }
    }

    const ROBOT: &str =
        "ROBOTLASER1 0 -0.5 1.0 0.25 30.0 0.01 0 5 1 2 3 4 30 2 7 8 10 20 0.5 9 9 9 0 0 0 0 0 77.5 h 0";

    #[test]
    fn flaser_uses_the_pose_of_the_laser_and_the_fan_of_its_size() {
        let log = parse(
            "# comment\nPARAM a b\r\nODOM 1 2\nFLASER 4 1.5 2 nan 81.83 1 2 0.5 7 8 9 100.25 host 3\r\n\nFLASER 3 1 1 1 0 0 0 0 0 0",
        )
        .unwrap();
        let [even, odd] = [log.raw(0), log.raw(1)];
        assert_eq!(even.world_from_laser, Pose::<2>::new(1.0, 2.0, 0.5));
        assert_eq!(even.bearings, [-PI / 2.0, -PI / 4.0, 0.0, PI / 4.0]);
        assert_eq!(odd.bearings, [-PI / 2.0, 0.0, PI / 2.0]);
        assert_eq!((even.time, odd.time), (Some(100.25), None));
        assert!(even.readings[2].is_nan() && even.readings[3] == 81.83);
        assert_eq!(
            log.carmen().other_messages,
            [("#", 1), ("ODOM", 1), ("PARAM", 1)].map(|(n, c)| (n.to_owned(), c)).into()
        );
        assert_eq!((log.carmen().lines, log.carmen().times), (6, TimeOrder::Absent));
        let limits = RangeLimits { no_return: 80.0, ..RangeLimits::default() };
        let (_, scan) = log.scans(&limits).next().unwrap();
        assert_eq!((scan.counts().hit, scan.counts().no_return, scan.refused().not_finite), (2, 1, 1));
        assert_eq!(scan.time(), Some(100.25));
    }

    #[test]
    fn robotlaser1_brings_its_own_fan() {
        let log = parse(ROBOT).unwrap();
        let scan = log.raw(0);
        assert_eq!(scan.bearings, [-0.5, -0.25, 0.0, 0.25, 0.5]);
        assert_eq!(scan.readings, [1.0, 2.0, 3.0, 4.0, 30.0]);
        assert_eq!(scan.world_from_laser, Pose::<2>::new(10.0, 20.0, 0.5));
        assert_eq!(scan.time, Some(77.5));
        assert_eq!(
            (log.carmen().message, log.carmen().declared_max_range),
            (ScanMessage::RobotLaser1, Some(30.0))
        );
    }

    #[test]
    fn flaser_wins_over_robotlaser1() {
        let log =
            parse(format!("{ROBOT}\nFLASER 1 5 0 0 0 0 0 0 2 h 2\n{ROBOT}\nFLASER 1 5 0 0 0 0 0 0 1 h 1\n"))
                .unwrap();
        assert_eq!(
            (log.len(), log.carmen().skipped_scans, log.carmen().message),
            (2, 2, ScanMessage::Flaser)
        );
        assert_eq!(log.carmen().times, TimeOrder::NotAscending);
        assert_eq!(log.carmen().declared_max_range, None);
    }

    #[test]
    fn broken_scan_lines_are_counted_by_cause() {
        let lines = [
            ("FLASER", ScanFault::TooFewNumbers),
            ("FLASER 3 1 2", ScanFault::TooFewNumbers),
            ("FLASER 3 1 2 3 0 0", ScanFault::TooFewNumbers),
            ("FLASER 3 1 2 x 0 0 0 0 0 0 1 h 1", ScanFault::NotANumber),
            ("FLASER -3 1 2 3 0 0 0 0 0 0 1 h 1", ScanFault::NotANumber),
            ("FLASER 0 0 0 0 0 0 0 1 h 1", ScanFault::ZeroBeams),
            ("FLASER 1152921504606846976 1 2", ScanFault::TooManyBeams),
            ("FLASER 99999999999999999999999999 1 2", ScanFault::TooManyBeams),
            ("FLASER 1 1 0 nan 0 0 0 0 1 h 1", ScanFault::PoseNotFinite),
            ("FLASER 1 1 inf 0 0 0 0 0 1 h 1", ScanFault::PoseNotFinite),
            ("FLASER 1 1 2 3 0 0 0 0 0 0 1 h 1", ScanFault::TooManyNumbers),
            ("ROBOTLASER1 0 0 1 0 30 0 0 2 1 1 0 0 0 0 0 0 0 0 0 0 0 0 0 h 0", ScanFault::BadFan),
            ("ROBOTLASER1 0 0 1 9 30 0 0 2 1 1 0 0 0 0 0 0 0 0 0 0 0 0 0 h 0", ScanFault::BadFan),
        ];
        for (line, fault) in lines {
            let log = parse(format!("{line}\nFLASER 1 5 0 0 0 0 0 0 2 h 2\n")).unwrap();
            let refused = &log.carmen().refused;
            assert_eq!(refused.by_fault, [(fault, 1)].into(), "{line}");
            assert_eq!((log.len(), refused.first.as_ref().unwrap().line), (1, 1));
            says(parse(line), "1 scan lines refused, first line 1:");
        }
    }

    #[test]
    fn logs_without_scans_say_what_they_hold() {
        let error = parse("").unwrap_err().to_string();
        assert_eq!(
            error,
            "a.log: no usable laser scan in 0 lines: the file is empty; give a CARMEN log with FLASER or ROBOTLASER1 lines"
        );
        says(parse("ODOM 1\nODOM 2\nPARAM\n"), "in 3 lines: 2 ODOM, 1 PARAM;");
        let words: String = (0..5000).map(|i| format!("w{i}\n")).collect();
        assert!(parse(words).unwrap_err().to_string().len() < 400);
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let good = format!("PARAM x\n{ROBOT}\nFLASER 4 1.5 2 3 81.83 1 2 0.5 7 8 9 100.25 host 3\n");
        let check = |log: LaserLog| assert!(log.raw_scans().all(|s| s.bearings.len() == s.readings.len()));
        no_panic(good, 1, 4000, |bytes| parse(bytes).map(check));
    }

    #[test]
    fn external_poses_must_match_in_number() {
        let log = parse("FLASER 1 5 0 0 0 0 0 0 2 h 2\n").unwrap();
        let pose = Pose::<2>::new(1.0, 2.0, 3.0);
        assert_eq!(log.clone().with_poses(&[pose]).unwrap().raw(0).world_from_laser, pose);
        says(log.with_poses(&[pose, pose]), "external poses is 2;");
    }

    #[test]
    fn real_logs_have_the_published_sizes() {
        for (name, scans, beams, other) in [
            ("intel-corrected.log.gz", 910, 180, 14541 + 910 + 2 + 2),
            ("freiburg-079-corrected.log.gz", 4791, 360, 9725 + 4791 + 187 + 2),
            ("intel.clf.bz2", 13631, 180, 26915 + 9 + 2),
        ] {
            let Some(path) = real_data(&format!("lidar2d_carmen/{name}")) else { continue };
            let log = LaserLog::read_carmen(path).unwrap();
            assert_eq!((log.len(), log.carmen().refused.total()), (scans, 0));
            assert!(log.raw_scans().all(|s| s.readings.len() == beams));
            assert_eq!(log.carmen().other_messages.values().sum::<u64>(), other);
        }
    }
}
