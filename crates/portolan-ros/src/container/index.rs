//! What a container tells about a file.

use super::topic::Topic;
use crate::BagError;

/// What a file holds.
#[derive(Default)]
pub(crate) struct FileIndex {
    /// In the order in which the file has them.
    pub(crate) channels: Vec<Channel>,
    /// In the order of their places.
    pub(crate) entries: Vec<Entry>,
    /// What the user should know, without the file's name.
    pub(crate) notes: Vec<String>,
}

/// A stream of messages of a file.
pub(crate) struct Channel {
    /// What messages of the file name it by.
    pub(crate) id: u32,
    /// What it is, or why it is not read.
    pub(crate) topic: Result<Topic, String>,
}

/// A message of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    /// The id of its channel.
    pub(crate) channel: u32,
    pub(crate) log_time: i64,
    pub(crate) place: u64,
    pub(crate) within: u32,
}

/// `within` of a message that lies in no chunk.
pub(crate) const NO_CHUNK: u32 = u32::MAX;

/// Whether a file of `size` bytes says that it has more messages than can be true: one for every two of its bytes, and a
/// million, as those of a compressed chunk may be many. Bytes made for it could ask for any memory otherwise.
pub(crate) fn too_many(messages: usize, size: u64) -> bool {
    messages as u64 > size / 2 + (1 << 20)
}

/// What is told where damage is allowed.
pub(crate) fn told(error: &BagError, consequence: &str) -> String {
    match error {
        BagError::Damaged { offset, field, value, .. } => {
            format!("byte {offset}: {field} is {value}; {consequence}")
        }
        error => format!("{error}; {consequence}"),
    }
}

/// Whether one of the publishers' profiles (rosbag2's `offered_qos_profiles`, YAML) keeps messages for late subscribers.
/// Older files have the number of the policy, newer its name.
pub(crate) fn is_transient_local(profiles: &str) -> bool {
    profiles.split("durability:").skip(1).any(|rest| {
        let value = rest.trim_start().split(|c: char| !c.is_alphanumeric() && c != '_').next();
        matches!(value, Some("1" | "transient_local"))
    })
}

#[cfg(test)]
mod tests {
    use super::is_transient_local;

    #[test]
    fn durability_is_found_as_number_and_as_word() {
        let profile =
            |d: &str| format!("- history: 3\n  depth: 0\n  durability: {d}\n  deadline:\n    sec: 1\n");
        assert!(is_transient_local(&profile("1")) && is_transient_local(&profile("transient_local")));
        assert!(is_transient_local(&(profile("2") + &profile("1"))));
        for volatile in ["2", "volatile", "0", "12", ""] {
            assert!(!is_transient_local(&profile(volatile)), "{volatile}");
        }
        assert!(!is_transient_local("") && is_transient_local("[{durability: 1, depth: 1}]"));
    }
}
