//! Reading the whole file.

use mcap::records::op;

use super::super::index::{Entry, FileIndex, NO_CHUNK, told, too_many};
use super::super::reader::FileReader;
use super::channels::{Channels, known};
use super::chunk::load_chunk;
use super::record::{MESSAGE_HEAD, RECORD_HEAD, Wrong, message_head, parse, record_at, u64_at};
use crate::{BagError, Result};

/// Reads the whole file. Without `allow_damage` the first damage is the error; with it a damaged chunk is left out and
/// told, and a damaged record outside of chunks, whose length cannot be trusted, ends the file.
pub(super) fn scan(reader: &mut FileReader, mut channels: Channels, allow_damage: bool) -> Result<FileIndex> {
    let mut index = FileIndex::default();
    let mut place = 8;
    let mut ended = false;
    while !ended {
        let step = scan_record(reader, place, &mut channels, &mut index.entries);
        match step {
            Ok(Step::On(next)) => place = next,
            Ok(Step::End) => ended = true,
            Ok(Step::Skip(error, next)) if allow_damage => {
                index.notes.push(told(&error, "the rest of this chunk is left out"));
                place = next;
            }
            Err(error @ BagError::Damaged { .. }) if allow_damage => {
                index.notes.push(told(&error, "what comes before is used"));
                ended = true;
            }
            Ok(Step::Skip(error, _)) | Err(error) => return Err(error),
        }
    }
    index.channels = channels.found;
    Ok(index)
}

enum Step {
    /// The place of the next record.
    On(u64),
    /// Damage within a chunk, and the place of the next record.
    Skip(BagError, u64),
    End,
}

fn scan_record(
    reader: &mut FileReader,
    place: u64,
    channels: &mut Channels,
    entries: &mut Vec<Entry>,
) -> Result<Step> {
    let mut head = [0; RECORD_HEAD as usize];
    reader.read_at(place, &mut head, "a record")?;
    let (code, length) = (head[0], u64_at(&head, 1));
    let body_at = place + RECORD_HEAD;
    reader.check(body_at, length, "a record")?;
    let next = body_at + length;
    match code {
        op::DATA_END | op::FOOTER => return Ok(Step::End),
        op::SCHEMA | op::CHANNEL => {
            let mut body = Vec::new();
            reader.bytes_at(body_at, length, &mut body, "a record")?;
            let record = parse(code, &body);
            let record = record.map_err(|e| reader.damaged(place, "a schema or channel", e))?;
            let taken = record.map_or(Ok(()), |record| channels.take(record));
            taken.map_err(|(field, value)| reader.damaged(place, field, value))?;
        }
        op::MESSAGE => {
            let mut head = [0; MESSAGE_HEAD];
            if length < head.len() as u64 {
                return Err(reader.damaged(place, "the length of a message", length));
            }
            reader.read_at(body_at, &mut head, "a message")?;
            let message = message_head(&head).map_err(|(f, v)| reader.damaged(place, f, v))?;
            known(channels, message.0).map_err(|(f, v)| reader.damaged(place, f, v))?;
            entries.push(Entry { channel: message.0, log_time: message.1, place, within: NO_CHUNK });
        }
        op::CHUNK => {
            let walked = load_chunk(reader, place).and_then(|chunk| {
                walk_chunk(&chunk, (place, reader.size()), channels, entries).map_err(|(at, field, value)| {
                    reader.damaged(place, format!("{field} at byte {at} of the chunk"), value)
                })
            });
            match walked {
                Err(error @ BagError::Damaged { .. }) => return Ok(Step::Skip(error, next)),
                walked => walked?,
            }
        }
        0 => return Err(reader.damaged(place, "the code of a record", 0)),
        _ => {}
    }
    Ok(Step::On(next))
}

fn walk_chunk(
    chunk: &[u8],
    (place, file_size): (u64, u64),
    channels: &mut Channels,
    entries: &mut Vec<Entry>,
) -> Result<(), (usize, &'static str, String)> {
    let mut at = 0;
    while at < chunk.len() {
        let Some((code, body)) = record_at(chunk, at) else {
            return Err((at, "a record", "longer than the chunk".into()));
        };
        let next = body.end;
        if too_many(entries.len(), file_size) {
            return Err((at, "the number of messages", entries.len().to_string()));
        }
        let result: Result<(), Wrong> = match code {
            op::SCHEMA | op::CHANNEL => parse(code, &chunk[body])
                .map_err(|e| ("a schema or channel", e))
                .and_then(|record| record.map_or(Ok(()), |record| channels.take(record))),
            op::MESSAGE => message_head(&chunk[body]).and_then(|(channel, log_time)| {
                known(channels, channel)?;
                entries.push(Entry { channel, log_time, place, within: at as u32 });
                Ok(())
            }),
            _ => Ok(()),
        };
        result.map_err(|(field, value)| (at, field, value))?;
        at = next;
    }
    Ok(())
}
