//! What a file is, by its first bytes.

use std::fmt;

/// A container of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ContainerKind {
    /// MCAP: ROS 2, or ROS 1 that was converted.
    Mcap,
    /// rosbag2's sqlite3, `.db3`.
    Sqlite3,
    /// ROS 1 `.bag`.
    RosBag,
}

impl ContainerKind {
    /// First bytes that suffice for [`ContainerKind::recognise`].
    pub const HEAD: usize = 16;

    /// The container that starts with these bytes, at least [`ContainerKind::HEAD`] of them where the file has them;
    /// `None`: none of the three. That an sqlite3 database holds a bag is known when it is opened. A file that is
    /// compressed as a whole (`.db3.zstd`, `.mcap.zstd`) is recognised once it is unpacked, which [`Bag::open`] does.
    ///
    /// [`Bag::open`]: super::Bag::open
    pub fn recognise(head: &[u8]) -> Option<Self> {
        match head {
            _ if head.starts_with(super::mcap::MAGIC) => Some(Self::Mcap),
            _ if head.starts_with(super::sqlite::MAGIC) => Some(Self::Sqlite3),
            _ if head.starts_with(b"#ROSBAG V") || head.starts_with(b"#ROSRECORD V") => Some(Self::RosBag),
            _ => None,
        }
    }

    /// Whether the bytes start a file that is compressed with zstd as a whole, as rosbag2 does by `compression_mode:
    /// FILE`.
    pub fn is_zstd(head: &[u8]) -> bool {
        head.starts_with(super::unpack::ZSTD_MAGIC)
    }
}

impl fmt::Display for ContainerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mcap => "MCAP",
            Self::Sqlite3 => "sqlite3 bag",
            Self::RosBag => "ROS 1 bag",
        })
    }
}
