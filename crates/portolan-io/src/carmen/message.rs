//! One line of a log.

use std::f64::consts::{PI, TAU};

use super::stats::{ScanFault, ScanMessage};
use crate::bytes::{fields, parse_f64};
use crate::error::shown;
use crate::laser_log::FanShape;

/// More beams than this in a scan are taken for a broken line.
pub(super) const MOST_BEAMS: usize = 100_000;

/// The fan of a `FLASER` scan.
fn flaser_fan(beams: usize) -> FanShape {
    let steps = if beams.is_multiple_of(2) { beams } else { (beams - 1).max(1) };
    FanShape { start: -PI / 2.0, step: PI / steps as f64, beams }
}

/// The other values of a scan line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ScanHead {
    pub(super) fan: FanShape,
    /// x, y, theta of the laser.
    pub(super) pose: [f64; 3],
    pub(super) time: Option<f64>,
    pub(super) max_range: Option<f64>,
}

/// Why a scan line is refused, with a one-line text.
pub(super) type Refusal = (ScanFault, String);

/// Parses the rest of a scan line behind its first word; the readings are appended to `readings`, which on
/// failure holds what it held before.
pub(super) fn parse_scan(
    message: ScanMessage,
    rest: &[u8],
    readings: &mut Vec<f64>,
) -> Result<ScanHead, Refusal> {
    let before = readings.len();
    let mut words = Words { words: fields(rest), message };
    let head = match message {
        ScanMessage::Flaser => words.flaser(readings),
        ScanMessage::RobotLaser1 => words.robot_laser(readings),
    };
    if head.is_err() {
        readings.truncate(before);
    }
    head
}

/// The words of a scan line that were not read yet.
struct Words<I> {
    words: I,
    message: ScanMessage,
}

impl<'a, I: Iterator<Item = &'a [u8]>> Words<I> {
    fn flaser(&mut self, readings: &mut Vec<f64>) -> Result<ScanHead, Refusal> {
        let beams = self.beams()?;
        self.readings(beams, readings)?;
        let pose = self.pose("x y theta")?;
        for _ in 0..3 {
            self.number("odometry pose")?;
        }
        let time = self.tail()?;
        Ok(ScanHead { fan: flaser_fan(beams), pose, time, max_range: None })
    }

    fn robot_laser(&mut self, readings: &mut Vec<f64>) -> Result<ScanHead, Refusal> {
        self.number("laser_type")?;
        let start = self.number("start_angle")?;
        self.number("field_of_view")?;
        let step = self.number("angular_resolution")?;
        let max_range = self.number("maximum_range")?;
        self.number("accuracy")?;
        self.number("remission_mode")?;
        let beams = self.beams()?;
        let fan = FanShape { start, step, beams };
        // A single beam needs no resolution; more than a turn (and some rounding) is not a 2-D fan.
        let turns = step.abs() * (beams - 1) as f64 / TAU;
        if !(start.abs() <= 2.0 * TAU && step.is_finite() && (beams == 1 || (step != 0.0 && turns <= 1.01))) {
            let text = format!(
                "ROBOTLASER1 has start_angle {start} and angular_resolution {step} for {beams} beams"
            );
            return Err((ScanFault::BadFan, text));
        }
        self.readings(beams, readings)?;
        let remissions = self.count("the number of remissions")?;
        if remissions > MOST_BEAMS {
            let text = format!("ROBOTLASER1 announces {remissions} remissions, more than {MOST_BEAMS}");
            return Err((ScanFault::TooManyBeams, text));
        }
        for _ in 0..remissions {
            self.number("remission")?;
        }
        let pose = self.pose("laser_x laser_y laser_theta")?;
        for _ in 0..8 {
            self.number("robot pose, velocities, safety distances and turn axis")?;
        }
        let time = self.tail()?;
        let max_range = (max_range.is_finite() && max_range > 0.0).then_some(max_range);
        Ok(ScanHead { fan, pose, time, max_range })
    }

    #[inline(always)]
    fn number(&mut self, field: &str) -> Result<f64, Refusal> {
        match self.words.next() {
            Some(word) => parse_f64(word).ok_or_else(|| self.no_number(field, word)),
            None => Err(self.ends_before(field)),
        }
    }

    fn count(&mut self, field: &str) -> Result<usize, Refusal> {
        let Some(word) = self.words.next() else { return Err(self.ends_before(field)) };
        if word.iter().all(u8::is_ascii_digit) {
            // What overflows is too large in any case.
            return Ok(std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).unwrap_or(usize::MAX));
        }
        Err(self.no_number(field, word))
    }

    fn beams(&mut self) -> Result<usize, Refusal> {
        let word = self.message.word();
        match self.count("the number of beams")? {
            0 => Err((ScanFault::ZeroBeams, format!("{word} announces zero beams"))),
            n if n > MOST_BEAMS => {
                Err((ScanFault::TooManyBeams, format!("{word} announces {n} beams, more than {MOST_BEAMS}")))
            }
            n => Ok(n),
        }
    }

    fn readings(&mut self, beams: usize, readings: &mut Vec<f64>) -> Result<(), Refusal> {
        for i in 0..beams {
            match self.words.next() {
                Some(word) => match parse_f64(word) {
                    Some(value) => readings.push(value),
                    None => return Err(self.no_number(&format!("reading {i}"), word)),
                },
                None => {
                    let text = format!("{} announces {beams} beams and has only {i}", self.message.word());
                    return Err((ScanFault::TooFewNumbers, text));
                }
            }
        }
        Ok(())
    }

    fn pose(&mut self, names: &str) -> Result<[f64; 3], Refusal> {
        let mut pose = [0.0; 3];
        for value in &mut pose {
            *value = self.number(names)?;
        }
        if pose.iter().all(|v| v.is_finite()) {
            return Ok(pose);
        }
        let [x, y, theta] = pose;
        let text = format!("{} has the pose {x} {y} {theta}", self.message.word());
        Err((ScanFault::PoseNotFinite, text))
    }

    /// `ipc_time host logger_time`, which some writers leave out: the first of them.
    fn tail(&mut self) -> Result<Option<f64>, Refusal> {
        let time = self.words.next().and_then(parse_f64).filter(|t| t.is_finite());
        if self.words.by_ref().nth(2).is_some() {
            let word = self.message.word();
            let text =
                format!("{word} goes on behind its time stamps: the announced number of beams is wrong");
            return Err((ScanFault::TooManyNumbers, text));
        }
        Ok(time)
    }

    #[cold]
    fn no_number(&self, field: &str, word: &[u8]) -> Refusal {
        let text = format!("{field} of {} is {}, not a number", self.message.word(), shown(word));
        (ScanFault::NotANumber, text)
    }

    #[cold]
    fn ends_before(&self, field: &str) -> Refusal {
        (ScanFault::TooFewNumbers, format!("{} ends before {field}", self.message.word()))
    }
}
