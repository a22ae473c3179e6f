//! The one error of this crate.

use std::fmt::Display;
use std::path::{Path, PathBuf};

/// What readers and writers return.
pub type Result<T, E = IoError> = std::result::Result<T, E>;

/// Why a file could not be read or written. Every message is one line that names the file, the place, the
/// field, its value and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IoError {
    /// The operating system refused.
    #[error("{}: cannot {action}: {cause}; {}", shown_path(path), advice_for(cause))]
    Os {
        /// The file.
        path: PathBuf,
        /// What was tried: a verb.
        action: &'static str,
        /// The system's own error.
        cause: std::io::Error,
    },
    /// A folder stands where a file was expected.
    #[error("{}: is a folder, not a file; name a file inside it", shown_path(path))]
    IsFolder {
        /// The folder.
        path: PathBuf,
    },
    /// Compressed data ends early or is damaged.
    #[error(
        "{}: byte {offset} of the unpacked data: the {kind} stream {reason}; copy or download the file again",
        shown_path(path)
    )]
    Compression {
        /// The file.
        path: PathBuf,
        /// `gzip`, `bzip2` or `zstd`.
        kind: &'static str,
        /// How much could be unpacked (bytes).
        offset: u64,
        /// What is wrong with the stream.
        reason: String,
    },
    /// A field of a text file is wrong.
    #[error("{}: line {line}: {field} is {value}; {advice}", shown_path(path))]
    Text {
        /// The file.
        path: PathBuf,
        /// Line number, from 1.
        line: u64,
        /// The field.
        field: String,
        /// Its value, as far as it fits.
        value: String,
        /// What to do.
        advice: String,
    },
    /// A map of sums does not fit those that it is to be added to, or taken out of.
    #[error("{}: {cause}", shown_path(path))]
    Ledger {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: portolan::ledger::LedgerError,
    },
    /// A field of a binary file is wrong.
    #[error("{}: byte {offset}: {field} is {value}; {advice}", shown_path(path))]
    Binary {
        /// The file.
        path: PathBuf,
        /// Position of the field (bytes from the start).
        offset: u64,
        /// The field.
        field: String,
        /// Its value.
        value: String,
        /// What to do.
        advice: String,
    },
    /// A log without a single scan that can be used.
    #[error(
        "{}: no usable laser scan in {lines} lines: {found}; give a CARMEN log with FLASER or ROBOTLASER1 lines",
        shown_path(path)
    )]
    NoScans {
        /// The file.
        path: PathBuf,
        /// Lines read.
        lines: u64,
        /// What was found instead.
        found: String,
    },
    /// Files of a log do not fit together, or something is missing between them.
    #[error("{}: {field} is {value}; {advice}", shown_path(path))]
    Layout {
        /// The file or folder.
        path: PathBuf,
        /// What does not fit.
        field: String,
        /// Its value.
        value: String,
        /// What to do.
        advice: String,
    },
    /// A bag of ROS, or a message in it, cannot be read.
    #[error("{}{cause}", named(path, cause))]
    Bag {
        /// The bag.
        path: PathBuf,
        /// What is wrong.
        cause: Box<portolan_ros::BagError>,
    },
    /// The format cannot hold what the caller wants to write or to combine.
    #[error("{}: {field} is {value}; {advice}", shown_path(path))]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The field.
        field: String,
        /// Its value.
        value: String,
        /// What to do.
        advice: String,
    },
}

impl IoError {
    pub(crate) fn text(
        path: &Path,
        line: u64,
        field: impl Display,
        value: impl Display,
        advice: impl Display,
    ) -> Self {
        let [field, value, advice] = [field.to_string(), value.to_string(), advice.to_string()];
        Self::Text { path: path.into(), line, field, value, advice }
    }

    /// Refuses one more thing where `count` are the most that a file may have.
    pub(crate) fn unless_full(
        path: &Path,
        line: u64,
        count: usize,
        most: usize,
        what: &str,
        of: &str,
    ) -> Result<()> {
        if count < most {
            return Ok(());
        }
        let (field, value) = (format!("the number of {what}"), format!("more than {most}"));
        Err(Self::text(path, line, field, value, format!("split the {of}")))
    }

    pub(crate) fn binary(
        path: &Path,
        offset: u64,
        field: impl Display,
        value: impl Display,
        advice: impl Display,
    ) -> Self {
        let [field, value, advice] = [field.to_string(), value.to_string(), advice.to_string()];
        Self::Binary { path: path.into(), offset, field, value, advice }
    }

    pub(crate) fn unwritable(
        path: &Path,
        field: impl Display,
        value: impl Display,
        advice: impl Display,
    ) -> Self {
        let [field, value, advice] = [field.to_string(), value.to_string(), advice.to_string()];
        Self::Unwritable { path: path.into(), field, value, advice }
    }

    pub(crate) fn layout(
        path: &Path,
        field: impl Display,
        value: impl Display,
        advice: impl Display,
    ) -> Self {
        let [field, value, advice] = [field.to_string(), value.to_string(), advice.to_string()];
        Self::Layout { path: path.into(), field, value, advice }
    }

    pub(crate) fn bag(path: &Path) -> impl Fn(portolan_ros::BagError) -> Self + Copy + '_ {
        move |cause| Self::Bag { path: path.into(), cause: Box::new(cause) }
    }

    pub(crate) fn os(path: &Path, action: &'static str, cause: std::io::Error) -> Self {
        Self::Os { path: path.into(), action, cause }
    }

    /// The file that the error is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::Os { path, .. }
            | Self::IsFolder { path }
            | Self::Compression { path, .. }
            | Self::Text { path, .. }
            | Self::Binary { path, .. }
            | Self::Ledger { path, .. }
            | Self::NoScans { path, .. }
            | Self::Layout { path, .. }
            | Self::Bag { path, .. }
            | Self::Unwritable { path, .. } => path,
        }
    }
}

/// The bag before an error that does not name its file.
fn named(path: &Path, cause: &portolan_ros::BagError) -> String {
    match cause {
        portolan_ros::BagError::Message { .. } => format!("{}: ", shown_path(path)),
        _ => String::new(),
    }
}

fn advice_for(cause: &std::io::Error) -> &'static str {
    use std::io::ErrorKind::*;
    match cause.kind() {
        NotFound => "check the path",
        PermissionDenied | ReadOnlyFilesystem => "check the permissions",
        StorageFull | QuotaExceeded => "free some space",
        _ => "check the file and the disk",
    }
}

/// A path on one line.
fn shown_path(path: &Path) -> String {
    path.to_string_lossy().chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}

/// Bytes of a file as a short quoted word on one line.
pub(crate) fn shown(bytes: impl AsRef<[u8]>) -> String {
    const LONGEST: usize = 48;
    let bytes = bytes.as_ref();
    let head = &bytes[..bytes.len().min(LONGEST)];
    let text: String =
        String::from_utf8_lossy(head).chars().map(|c| if c.is_control() { '?' } else { c }).collect();
    if bytes.is_empty() {
        "missing".into()
    } else if bytes.len() > LONGEST {
        format!("\"{text}...\" ({} bytes)", bytes.len())
    } else {
        format!("\"{text}\"")
    }
}
