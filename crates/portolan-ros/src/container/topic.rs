//! What every container has: topics, and places of messages.

/// How the bytes of a topic's messages are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// ROS 1: little endian, without padding.
    Ros1,
    /// ROS 2: CDR, whose first four bytes say in which order bytes are.
    Cdr,
}

/// In which language the definition of a message is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefinitionFormat {
    /// ROS 1 `.msg` text, with the types that it names after lines of `=`.
    Ros1Msg,
    /// ROS 2 `.msg` text, likewise.
    Ros2Msg,
    /// OMG IDL, as ROS 2 has it.
    Ros2Idl,
    /// The file has none: older sqlite3 bags.
    Missing,
}

/// A topic of one type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Its name, `/scan`.
    pub name: String,
    /// The type of its messages as the file has it, `sensor_msgs/msg/LaserScan` or `sensor_msgs/LaserScan`.
    pub type_name: String,
    /// How its messages are written.
    pub encoding: Encoding,
    /// How its definition is written.
    pub definition_format: DefinitionFormat,
    /// The definition; empty where it is missing.
    pub definition: String,
    /// Who publishes it (ROS 1's `callerid`), where the file says so.
    pub publisher: Option<String>,
    /// Whether late subscribers get the last message (`latching`, or durability "transient local").
    pub latched: bool,
}

/// Where a message is: cheap to copy, to be given to a bag again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageRef {
    /// The topic's index in the topics of its bag.
    pub topic: u32,
    /// When it was recorded (nanoseconds since 1970, or of a simulation).
    pub log_time: i64,
    /// The file of the bag that holds it.
    pub(crate) file: u32,
    /// The place in that file: of the chunk, record or row.
    pub(crate) place: u64,
    /// The place within an unpacked chunk.
    pub(crate) within: u32,
}
