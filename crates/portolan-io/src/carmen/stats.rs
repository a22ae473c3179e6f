//! What was found in a log: all that is dropped is counted.

use std::collections::BTreeMap;
use std::fmt;

use crate::laser_log::TimeOrder;

/// The two messages that carry scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScanMessage {
    /// `FLASER`: 180 degrees, the fan follows from the number of beams.
    Flaser,
    /// `ROBOTLASER1`: brings its own fan and maximum range.
    RobotLaser1,
}

impl ScanMessage {
    /// The word at the start of the line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Flaser => "FLASER",
            Self::RobotLaser1 => "ROBOTLASER1",
        }
    }
}

/// Why a scan line cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum ScanFault {
    /// The line ends before all announced numbers came.
    TooFewNumbers,
    /// More words follow than the message has, so that the announced number of beams is wrong.
    TooManyNumbers,
    /// A word that should be a number cannot be read as one.
    NotANumber,
    /// No beams.
    ZeroBeams,
    /// More beams than any 2-D laser has.
    TooManyBeams,
    /// A pose that is NaN or infinite.
    PoseNotFinite,
    /// A start angle or a resolution that cannot be.
    BadFan,
}

impl fmt::Display for ScanFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooFewNumbers => "too few numbers",
            Self::TooManyNumbers => "too many numbers",
            Self::NotANumber => "not a number",
            Self::ZeroBeams => "zero beams",
            Self::TooManyBeams => "too many beams",
            Self::PoseNotFinite => "pose not finite",
            Self::BadFan => "bad bearings",
        })
    }
}

/// A scan line that was refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RefusedScan {
    /// Line number, from 1.
    pub line: u64,
    /// Why.
    pub fault: ScanFault,
    /// What is wrong: one line.
    pub text: String,
}

impl fmt::Display for RefusedScan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.text)
    }
}

/// Scan lines that were refused.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RefusedScans {
    /// Number of lines by cause.
    pub by_fault: BTreeMap<ScanFault, u64>,
    /// The first of them.
    pub first: Option<RefusedScan>,
}

impl RefusedScans {
    /// All refused lines.
    pub fn total(&self) -> u64 {
        self.by_fault.values().sum()
    }

    pub(super) fn count(&mut self, scan: RefusedScan) {
        *self.by_fault.entry(scan.fault).or_default() += 1;
        self.first.get_or_insert(scan);
    }
}

/// Counts of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct CarmenStats {
    /// Lines of the file.
    pub lines: u64,
    /// The message that the scans come from.
    pub message: ScanMessage,
    /// Usable `ROBOTLASER1` scans that were left out because the log has `FLASER` scans.
    pub skipped_scans: u64,
    /// Scan lines that cannot be used.
    pub refused: RefusedScans,
    /// Lines that carry no scan, by first word; comments under `#`, rare words together under `(other)`.
    pub other_messages: BTreeMap<String, u64>,
    /// The smallest maximum range that the scans declare (meters); `None` for `FLASER` scans, which declare nothing.
    pub declared_max_range: Option<f64>,
    /// Whether the stamps ascend.
    pub times: TimeOrder,
}
