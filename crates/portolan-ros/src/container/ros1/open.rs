//! Where the messages are.

use super::super::index::FileIndex;
use super::super::reader::FileReader;
use super::by_index::by_index;
use super::record::{RecordHead, op};
use super::scan::scan;
use crate::Result;

/// The line that the file starts with.
const VERSION: &[u8] = b"#ROSBAG V2.0\n";

/// Finds the messages: by the index where there is one that agrees with itself, else by reading the whole file. Where
/// damage is allowed the whole file is read in any case, so that what the index has can be read later.
pub(crate) fn index(reader: &mut FileReader, allow_damage: bool) -> Result<FileIndex> {
    let mut line = vec![0; reader.size().min(VERSION.len() as u64) as usize];
    reader.read_at(0, &mut line, "the first line")?;
    if line != VERSION {
        let value = String::from_utf8_lossy(&line).trim_end().to_owned();
        let advice = "only version 2.0 is read: convert it by `rosbag migrate`, or record it again";
        return Err(reader.wrong(0, "the version of the bag", value, advice));
    }
    let mut record = RecordHead::read(reader, VERSION.len() as u64)?;
    let fields = record.fields();
    if fields.op() != Some(op::BAG) {
        return Err(reader.damaged(VERSION.len() as u64, "the first record", "not the bag's header"));
    }
    if let Some(name) = fields.get(b"encryptor").filter(|n| !n.is_empty()) {
        let (value, advice) = (String::from_utf8_lossy(name).into_owned(), "decrypt it by `rosbag decrypt`");
        return Err(reader.wrong(VERSION.len() as u64, "the encryptor", value, advice));
    }
    let (Some(index_at), Some(connections), Some(chunks)) =
        (fields.u64(b"index_pos"), fields.u32(b"conn_count"), fields.u32(b"chunk_count"))
    else {
        return Err(reader.damaged(VERSION.len() as u64, "the bag's header", "without its numbers"));
    };
    let start = record.end();
    let reason = match index_at {
        _ if allow_damage => None,
        0 => Some("it has no index (its recorder was stopped early)".to_owned()),
        _ => {
            reader.check(index_at, 1, "the index")?;
            match by_index(reader, &mut record, index_at, (connections, chunks))? {
                Ok(index) => return Ok(index),
                Err(reason) => Some(reason),
            }
        }
    };
    let mut index = scan(reader, start, allow_damage)?;
    if let Some(reason) = reason {
        index.notes.insert(0, format!("{reason}: the whole file was read to find its messages"));
    }
    Ok(index)
}
