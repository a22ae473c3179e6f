//! The times of the points of a cloud: drivers agree neither on the field's name, nor its unit, nor what it counts from.
//!
//! | driver | field | meaning |
//! |---|---|---|
//! | Ouster | `t` u32 | nanoseconds after the stamp |
//! | Velodyne | `time` f32 | seconds after the stamp, or before it (negative) |
//! | Hesai, RoboSense | `timestamp` f64 | seconds since 1970 |
//! | Livox | `timestamp` f64, `offset_time` u32 | nanoseconds since 1970, after the stamp |
//!
//! So the unit is found from how long the scan lasts: units are a factor of a thousand apart, scans are not.

use super::cloud::{PointCloud, PointField};

/// A unit of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // Their names say it.
pub enum TimeUnit {
    Seconds,
    Milliseconds,
    Microseconds,
    Nanoseconds,
}

impl TimeUnit {
    /// All, from the longest.
    const ALL: [Self; 4] = [Self::Seconds, Self::Milliseconds, Self::Microseconds, Self::Nanoseconds];

    /// Seconds of one.
    pub fn seconds(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Milliseconds => 1e-3,
            Self::Microseconds => 1e-6,
            Self::Nanoseconds => 1e-9,
        }
    }

    /// Its name.
    pub fn word(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        }
    }
}

/// What the times of points count from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeBase {
    /// The stamp of the message.
    Stamp,
    /// The zero of the clock that stamps messages.
    Clock,
    /// The zero of another clock: the earliest point of a cloud is taken to be at its stamp.
    OtherClock,
}

/// How the times of a topic's points are read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PointTimes {
    /// The name of the field.
    pub field: String,
    /// Its unit.
    pub unit: TimeUnit,
    /// What it counts from.
    pub base: TimeBase,
}

/// Names of fields with times.
const NAMES: [&str; 7] = ["t", "time", "timestamp", "time_stamp", "offset_time", "timeoffset", "gps_time"];
/// The longest scan where nothing says how far apart scans are (seconds).
const LONGEST_SCAN: f64 = 1.0;
/// Clocks nearer than this to the stamps are the stamps' own (seconds): a scan and its delay.
const SAME_CLOCK: f64 = 2.0;

impl PointTimes {
    /// Finds out how a cloud's times are to be read, given how far its topic's messages are apart (seconds). `None`: it has
    /// no field of a name that means times. `Err`: it has, and why they cannot be used.
    pub fn infer(cloud: &PointCloud<'_>, period: Option<f64>) -> Option<Result<Self, String>> {
        let field = cloud.field(&NAMES)?;
        let (first, last) = span(cloud, field);
        Some(Self::of_span(&field.name, first, last, cloud.header.stamp as f64 * 1e-9, period))
    }

    /// [`PointTimes::infer`] of the earliest and the latest value.
    fn of_span(name: &str, first: f64, last: f64, stamp: f64, period: Option<f64>) -> Result<Self, String> {
        let span = last - first;
        if !span.is_finite() {
            return Err(format!("the times of its points (field {name}) are not finite"));
        }
        if span == 0.0 {
            return Err(format!("the times of its points (field {name}) are all {first}"));
        }
        // Half a period more: the last point of a scan and the first of the next but one are not of one scan.
        let longest = period.filter(|p| *p > 0.0).map_or(LONGEST_SCAN, |p| 1.5 * p);
        let fits = |u: &TimeUnit| span * u.seconds() <= longest && span * u.seconds() > 1e-3 * longest;
        let Some(unit) = TimeUnit::ALL.into_iter().find(fits) else {
            return Err(format!(
                "the times of its points (field {name}) span {span}, which is no scan in any unit"
            ));
        };
        let start = first * unit.seconds();
        let base = if start.abs() <= 10.0 * longest {
            TimeBase::Stamp
        } else if (start - stamp).abs() <= SAME_CLOCK {
            TimeBase::Clock
        } else {
            TimeBase::OtherClock
        };
        Ok(Self { field: name.to_owned(), unit, base })
    }

    /// Seconds of each point after the stamp of its cloud, in the order of [`PointCloud::points`]. Empty where this cloud
    /// does not have the field.
    pub fn after_stamp(&self, cloud: &PointCloud<'_>) -> Vec<f64> {
        let Some(field) = cloud.field(&[&self.field]) else { return Vec::new() };
        let unit = self.unit.seconds();
        let zero = match self.base {
            TimeBase::Stamp => 0.0,
            TimeBase::Clock => cloud.header.stamp as f64 * 1e-9 / unit,
            TimeBase::OtherClock => span(cloud, field).0,
        };
        cloud.points().map(|p| (field.read(p).to_f64() - zero) * unit).collect()
    }

    /// In words.
    pub fn describe(&self) -> String {
        let base = match self.base {
            TimeBase::Stamp => "after the stamp",
            TimeBase::Clock => "of the clock of the stamps",
            TimeBase::OtherClock => "of a clock of its own, whose first is taken to be at the stamp",
        };
        format!("{} in {} {base}", self.field, self.unit.word())
    }
}

/// The earliest and the latest finite value of a field; infinite where there is none.
fn span(cloud: &PointCloud<'_>, field: &PointField) -> (f64, f64) {
    let all = cloud.points().map(|p| field.read(p).to_f64()).filter(|t| t.is_finite());
    all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use TimeBase::*;
    use TimeUnit::*;

    #[test]
    fn the_units_of_drivers() {
        let now = 1.7e9;
        for (name, first, last, period, unit, base) in [
            ("t", 0.0, 99_990_000.0, Some(0.1), Nanoseconds, Stamp), // Ouster
            ("t", 12_000.0, 48_000_000.0, Some(0.05), Nanoseconds, Stamp),
            ("time", 0.0, 0.0995, Some(0.1), Seconds, Stamp), // Velodyne
            ("time", -0.0995, 0.0, Some(0.1), Seconds, Stamp),
            ("timestamp", now, now + 0.0998, Some(0.1), Seconds, Clock), // Hesai
            ("timestamp", now * 1e9, now * 1e9 + 9.9e7, Some(0.1), Nanoseconds, Clock), // Livox
            ("timestamp", 5e12, 5e12 + 9.9e7, Some(0.1), Nanoseconds, OtherClock),
            ("offset_time", 0.0, 9.9e7, None, Nanoseconds, Stamp),
            ("t", 0.0, 99_000.0, Some(0.1), Microseconds, Stamp),
            ("t", 0.0, 99.0, Some(0.1), Milliseconds, Stamp),
            ("t", 0.0, 1e6, Some(0.001), Nanoseconds, Stamp),
            ("t", 0.0, 9.9e7, Some(1.0), Nanoseconds, Stamp), // every tenth scan
        ] {
            let found = PointTimes::of_span(name, first, last, now, period).unwrap();
            assert_eq!((found.unit, found.base), (unit, base), "{name} {first} {last} {period:?}");
        }
        for (first, last, part) in [
            (5.0, 5.0, "are all 5"),
            (0.0, 7e12, "no scan in any unit"),
            (f64::INFINITY, f64::NEG_INFINITY, "not finite"),
        ] {
            let why = PointTimes::of_span("t", first, last, now, Some(0.1)).unwrap_err();
            assert!(why.contains(part), "{why}");
        }
    }
}
