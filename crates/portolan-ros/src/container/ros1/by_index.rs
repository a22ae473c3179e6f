//! The index at the end, and those of the chunks that it leads to.

use std::collections::HashMap;

use super::super::index::{Entry, FileIndex, NO_CHUNK, too_many};
use super::super::reader::FileReader;
use super::connections::Connections;
use super::record::{RecordHead, op, time, word};
use crate::{BagError, Result};

/// The index that the file has itself; the reason where it cannot be used.
pub(super) fn by_index(
    reader: &mut FileReader,
    record: &mut RecordHead,
    index_at: u64,
    (connection_count, chunk_count): (u32, u32),
) -> Result<Result<FileIndex, String>> {
    let mut connections = Connections::default();
    let (mut place, mut data, mut chunks) = (index_at, Vec::new(), Vec::new());
    while place < reader.size() {
        *record = RecordHead::read(reader, place)?;
        place = record.end();
        let fields = record.fields();
        match fields.op() {
            Some(op::CONNECTION) => {
                record.data(reader, &mut data)?;
                if let Err(reason) = connections.take(fields, &data) {
                    return Ok(Err(format!("its index is damaged (a connection is {reason})")));
                }
            }
            Some(op::CHUNK_INFO) => {
                let Some(at) = fields.u64(b"chunk_pos") else {
                    return Ok(Err("its index is damaged (a chunk without a place)".into()));
                };
                record.data(reader, &mut data)?;
                let counts = data.as_chunks::<8>().0.iter();
                let counts: HashMap<u32, u32> =
                    counts.map(|c| (word(c, 0), word(c, 4))).filter(|(_, n)| *n > 0).collect();
                chunks.push((at, counts));
            }
            _ => {}
        }
    }
    if (connections.known.len(), chunks.len()) != (connection_count as usize, chunk_count as usize) {
        return Ok(Err(format!(
            "its index has {} connections of {connection_count} and {} chunks of {chunk_count}",
            connections.known.len(),
            chunks.len()
        )));
    }
    chunks.sort_by_key(|(at, _)| *at);
    let mut entries = Vec::new();
    for (at, counts) in chunks {
        let first = entries.len();
        if too_many(first, reader.size()) {
            return Ok(Err("its index has more messages than can be".into()));
        }
        match chunk_entries(reader, at, &counts, &mut entries) {
            Ok(true) => {}
            Ok(false) | Err(BagError::Damaged { .. }) => {
                return Ok(Err(format!("its index of the chunk at byte {at} is damaged")));
            }
            Err(error) => return Err(error),
        }
        if entries[first..].iter().any(|e: &Entry| !connections.known.contains_key(&e.channel)) {
            return Ok(Err(format!("its index of the chunk at byte {at} names unknown connections")));
        }
        entries[first..].sort_by_key(|e| e.within);
    }
    Ok(Ok(FileIndex { channels: connections.found, entries, notes: Vec::new() }))
}

/// The messages of a chunk, by the index records after it. `false`: they do not have as many as the chunk info.
fn chunk_entries(
    reader: &mut FileReader,
    chunk_at: u64,
    counts: &HashMap<u32, u32>,
    entries: &mut Vec<Entry>,
) -> Result<bool> {
    let chunk = RecordHead::read(reader, chunk_at)?;
    if chunk.fields().op() != Some(op::CHUNK) {
        return Ok(false);
    }
    let (mut place, mut data, mut seen) = (chunk.end(), Vec::new(), HashMap::new());
    while seen.len() < counts.len() {
        let record = RecordHead::read(reader, place)?;
        place = record.end();
        let fields = record.fields();
        let (Some(op::INDEX), Some(1), Some(channel)) =
            (fields.op(), fields.u32(b"ver"), fields.u32(b"conn"))
        else {
            return Ok(false);
        };
        record.data(reader, &mut data)?;
        let (messages, rest) = data.as_chunks::<12>();
        let known = counts.get(&channel).is_some_and(|n| *n as usize == messages.len());
        if !rest.is_empty() || !known || seen.insert(channel, ()).is_some() {
            return Ok(false);
        }
        for message in messages {
            let mut stamp = [0; 8];
            stamp.copy_from_slice(&message[..8]);
            let within = word(message, 8);
            if within == NO_CHUNK {
                return Ok(false);
            }
            entries.push(Entry { channel, log_time: time(stamp), place: chunk_at, within });
        }
    }
    Ok(true)
}
