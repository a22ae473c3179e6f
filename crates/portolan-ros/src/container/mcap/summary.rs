//! The summary at the end, and the index of messages that it leads to.

use std::collections::HashMap;

use mcap::records::{self, Record, op};

use super::super::index::{Entry, FileIndex, NO_CHUNK, too_many};
use super::super::reader::FileReader;
use super::channels::Channels;
use super::record::{RECORD_HEAD, parse, record_at, u32_at, u64_at};
use crate::Result;

/// What the end of the file says of it.
pub(super) struct Summary {
    pub(super) channels: Channels,
    chunks: Vec<records::ChunkIndex>,
    statistics: Option<records::Statistics>,
}

/// The summary that the file has; the reason where it cannot be used.
pub(super) fn summary(reader: &mut FileReader) -> Result<Result<Summary, String>> {
    let (footer_at, mut bytes) = (reader.size().saturating_sub(8 + 20 + RECORD_HEAD), Vec::new());
    reader.bytes_at(footer_at, RECORD_HEAD + 20, &mut bytes, "the footer")?;
    if bytes[0] != op::FOOTER || u64_at(&bytes, 1) != 20 {
        return Ok(Err("its footer is damaged".into()));
    }
    let (start, end_crc) = (u64_at(&bytes, 9), u32_at(&bytes, 25));
    if start == 0 {
        return Ok(Err("it has no index".into()));
    }
    if start < 8 || start > footer_at {
        return Ok(Err(format!("its index is said to be at byte {start}, which cannot be")));
    }
    // To the checksum in the footer, which covers what is before it.
    reader.bytes_at(start, footer_at + RECORD_HEAD + 16 - start, &mut bytes, "the index")?;
    if end_crc != 0 && crc32fast::hash(&bytes) != end_crc {
        return Ok(Err("its index is damaged (checksum)".into()));
    }
    bytes.truncate((footer_at - start) as usize);
    let mut channels = Channels::default();
    let (mut late, mut chunks, mut statistics) = (Vec::new(), Vec::new(), None);
    let mut place = 0;
    while place < bytes.len() {
        let Some((code, body)) = record_at(&bytes, place) else {
            return Ok(Err("its index is damaged".into()));
        };
        place = body.end;
        match parse(code, &bytes[body]) {
            Ok(Some(record @ Record::Schema { .. })) => {
                if let Err((field, value)) = channels.take(record) {
                    return Ok(Err(format!("its index is damaged ({field} is {value})")));
                }
            }
            Ok(Some(record @ Record::Channel(_))) => late.push(record.into_owned()),
            Ok(Some(Record::ChunkIndex(chunk))) => chunks.push(chunk),
            Ok(Some(Record::Statistics(s))) => statistics = Some(s),
            Ok(_) => {}
            Err(e) => return Ok(Err(format!("its index is damaged ({e})"))),
        }
    }
    for channel in late {
        if let Err((field, value)) = channels.take(channel) {
            return Ok(Err(format!("its index is damaged ({field} is {value})")));
        }
    }
    Ok(Ok(Summary { channels, chunks, statistics }))
}

impl Summary {
    /// The index that the summary gives; the reason where it contradicts itself.
    pub(super) fn index(self, reader: &mut FileReader) -> Result<Result<FileIndex, String>> {
        let Self { channels, chunks, statistics } = self;
        let Some(statistics) = statistics else { return Ok(Err("its index has no counts".into())) };
        let entries = match entries(reader, chunks)? {
            Ok(entries) => entries,
            Err(reason) => return Ok(Err(reason)),
        };
        let mut counts: HashMap<u16, u64> = HashMap::new();
        entries.iter().for_each(|e| *counts.entry(e.channel as u16).or_default() += 1);
        let said: u64 = statistics.message_count;
        if entries.len() as u64 != said {
            return Ok(Err(format!("its index has {} messages of {said}", entries.len())));
        }
        if counts.iter().any(|(id, n)| statistics.channel_message_counts.get(id).is_some_and(|m| m != n)) {
            return Ok(Err("its index contradicts its counts".into()));
        }
        if let Some(id) = counts.keys().filter(|id| !channels.records.contains_key(id)).min() {
            return Ok(Err(format!("its index lacks channel {id}")));
        }
        Ok(Ok(FileIndex { channels: channels.found, entries, notes: Vec::new() }))
    }
}

/// The messages of the chunks, by the message index after each.
fn entries(
    reader: &mut FileReader,
    mut chunks: Vec<records::ChunkIndex>,
) -> Result<Result<Vec<Entry>, String>> {
    chunks.sort_by_key(|c| c.chunk_start_offset);
    let (mut entries, mut bytes) = (Vec::new(), Vec::new());
    for chunk in chunks {
        let damaged =
            || Ok(Err(format!("its index of the chunk at byte {} is damaged", chunk.chunk_start_offset)));
        let Some(place) = chunk.chunk_start_offset.checked_add(chunk.chunk_length) else { return damaged() };
        if reader.check(place, chunk.message_index_length, "the message index").is_err() {
            return damaged();
        }
        reader.bytes_at(place, chunk.message_index_length, &mut bytes, "the message index")?;
        let (first, mut at) = (entries.len(), 0);
        if too_many(first, reader.size()) {
            return damaged();
        }
        while at < bytes.len() {
            let Some((op::MESSAGE_INDEX, body)) = record_at(&bytes, at) else { return damaged() };
            at = body.end;
            let Ok(Some(Record::MessageIndex(index))) = parse(op::MESSAGE_INDEX, &bytes[body]) else {
                return damaged();
            };
            for message in index.records {
                let within = u32::try_from(message.offset).ok().filter(|w| *w < NO_CHUNK);
                let (Some(within), Ok(log_time)) = (within, i64::try_from(message.log_time)) else {
                    return damaged();
                };
                let place = chunk.chunk_start_offset;
                entries.push(Entry { channel: index.channel_id.into(), log_time, place, within });
            }
        }
        entries[first..].sort_by_key(|e| e.within);
    }
    Ok(Ok(entries))
}
