//! Records and the messages among them.

use std::ops::Range;

use mcap::records::{Record, op};

use super::super::reader::FileReader;
use crate::Result;

/// The code and length before each record.
pub(super) const RECORD_HEAD: u64 = 9;

/// Channel, sequence, log time, publish time.
pub(super) const MESSAGE_HEAD: usize = 22;

pub(super) type Wrong = (&'static str, String);

/// A record of an index: a schema, a channel, an entry of an index, the counts; `None` for records of other kinds. The library takes as
/// much memory for a text as its length says (4 GiB at most) before it reads it, and panics at attachments that end early, so that
/// lengths are checked here first and others are not given to it.
pub(super) fn parse(code: u8, body: &[u8]) -> Result<Option<Record<'_>>, String> {
    if !matches!(code, op::SCHEMA | op::CHANNEL | op::CHUNK_INDEX | op::MESSAGE_INDEX | op::STATISTICS) {
        return Ok(None);
    }
    if texts_fit(code, body).is_none() {
        return Err("a text is longer than the record".into());
    }
    mcap::parse_record(code, body).map(Some).map_err(|e| e.to_string())
}

/// Whether every text of a record ends within it.
fn texts_fit(code: u8, body: &[u8]) -> Option<()> {
    // A length of 32 bits and so many bytes.
    let past = |rest: &[u8]| {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let length = u32::from_le_bytes(*length) as usize;
        (length <= after.len()).then_some(4 + length)
    };
    let mut at = match code {
        op::SCHEMA => 2,
        op::CHANNEL => 4,
        // Four numbers, a map, a number.
        op::CHUNK_INDEX => 32 + past(body.get(32..)?)? + 8,
        _ => return Some(()),
    };
    let texts = if code == op::CHUNK_INDEX { 1 } else { 2 };
    for _ in 0..texts {
        at += past(body.get(at..)?)?;
    }
    if code == op::CHANNEL {
        // A map of texts that should end with the record.
        at += 4;
        while body.get(at..).is_some_and(|rest| !rest.is_empty()) {
            at += past(&body[at..])?;
        }
    }
    Some(())
}

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

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Vec<u8> {
        [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
    }

    #[test]
    fn a_length_of_a_text_is_not_believed() {
        let map = text(&String::from_utf8([text("key"), text("value")].concat()).unwrap());
        let channel = [&[1, 0, 2, 0][..], &text("/scan"), &text("ros1"), &map].concat();
        let schema = [&[1, 0][..], &text("a/B"), &text("ros1msg"), &text("int32 x")].concat();
        let chunk = [&[0; 32][..], &text("0123456789"), &[0; 8], &text("zstd"), &[0; 16]].concat();
        let lengths = [
            (op::CHANNEL, channel, &[4, 13, 25, 32][..]),
            (op::SCHEMA, schema, &[2, 9, 20]),
            (op::CHUNK_INDEX, chunk, &[32, 54]),
        ];
        for (code, body, places) in lengths {
            assert!(parse(code, &body).unwrap().is_some(), "{code}");
            for &at in places {
                let mut long = body.clone();
                long[at + 3] = 0xff;
                let refused = parse(code, &long).map(|_| ()).unwrap_err();
                let whole = code == op::SCHEMA && at == 20;
                assert!(whole || refused == "a text is longer than the record", "{code} at {at}: {refused}");
            }
            for end in 0..body.len() {
                let _ = parse(code, &body[..end]);
            }
        }
        // The library panics at these.
        assert!(parse(op::ATTACHMENT, &[0; 26]).unwrap().is_none());
    }
}
