//! Records and the messages among them.

use std::ops::Range;

use mcap::records::op;

use super::super::reader::FileReader;
use crate::Result;

/// The code and length before each record.
pub(super) const RECORD_HEAD: u64 = 9;

/// Channel, sequence, log time, publish time.
pub(super) const MESSAGE_HEAD: usize = 22;

pub(super) type Wrong = (&'static str, String);

/// Channel and log time.
pub(super) fn message_head(body: &[u8]) -> Result<(u32, i64), Wrong> {
    if body.len() < MESSAGE_HEAD {
        return Err(("the length of a message", body.len().to_string()));
    }
    let time = u64_at(body, 6);
    let log_time = i64::try_from(time).map_err(|_| ("the log time of a message", time.to_string()))?;
    Ok((u16::from_le_bytes([body[0], body[1]]).into(), log_time))
}

/// Channel, log time and bytes of the message in a chunk; `None`: there is none.
pub(crate) fn message_in(chunk: &[u8], within: u32) -> Option<(u32, i64, Range<usize>)> {
    let (op::MESSAGE, body) = record_at(chunk, within as usize)? else { return None };
    let (channel, log_time) = message_head(&chunk[body.clone()]).ok()?;
    Some((channel, log_time, body.start + MESSAGE_HEAD..body.end))
}

/// Channel and log time of the message at `place`, which is in no chunk; its bytes in `data`.
pub(crate) fn message_at(
    reader: &mut FileReader,
    place: u64,
    data: &mut Vec<u8>,
) -> Result<Option<(u32, i64)>> {
    let mut head = [0; RECORD_HEAD as usize + MESSAGE_HEAD];
    reader.read_at(place, &mut head, "a message")?;
    let Some(length) = u64_at(&head, 1).checked_sub(MESSAGE_HEAD as u64) else { return Ok(None) };
    let (op::MESSAGE, Ok(message)) = (head[0], message_head(&head[9..])) else { return Ok(None) };
    reader.bytes_at(place + head.len() as u64, length, data, "a message")?;
    Ok(Some(message))
}

/// The code and the range of the body of the record at `place`; `None`: it is longer than the bytes.
pub(super) fn record_at(bytes: &[u8], place: usize) -> Option<(u8, Range<usize>)> {
    let rest = bytes.get(place..)?;
    if rest.len() < RECORD_HEAD as usize {
        return None;
    }
    let length = usize::try_from(u64_at(rest, 1)).ok()?;
    let start = place + RECORD_HEAD as usize;
    let end = start.checked_add(length).filter(|end| *end <= bytes.len())?;
    Some((rest[0], start..end))
}

pub(super) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    let mut word = [0; 8];
    word.copy_from_slice(&bytes[at..at + 8]);
    u64::from_le_bytes(word)
}

pub(super) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    let mut word = [0; 4];
    word.copy_from_slice(&bytes[at..at + 4]);
    u32::from_le_bytes(word)
}
