//! The one error of this crate.

/// What this crate returns.
pub type Result<T, E = BagError> = std::result::Result<T, E>;

/// Why a bag, or a message in it, could not be read. One line: the file, the place, the field, its value, what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BagError {
    /// The operating system refused.
    #[error("{name}: cannot {action}: {cause}")]
    Os {
        /// The file.
        name: String,
        /// What was tried: a verb.
        action: &'static str,
        /// The system's own error.
        cause: std::io::Error,
    },
    /// Something in a file is wrong.
    #[error("{name}: byte {offset}: {field} is {value}; {advice}")]
    Damaged {
        /// The file.
        name: String,
        /// Position (bytes from the start).
        offset: u64,
        /// The field.
        field: String,
        /// Its value.
        value: String,
        /// What to do.
        advice: String,
    },
    /// A message, or its definition, is wrong or of a kind that is not read.
    #[error("{topic}: {field} is {value}; {advice}")]
    Message {
        /// The topic, or the type.
        topic: String,
        /// The field.
        field: String,
        /// Its value.
        value: String,
        /// What to do.
        advice: String,
    },
    /// A file or folder that holds no bag that can be read.
    #[error("{name}: {reason}; {advice}")]
    Refused {
        /// The file or folder.
        name: String,
        /// What it is.
        reason: String,
        /// What to do.
        advice: String,
    },
}
