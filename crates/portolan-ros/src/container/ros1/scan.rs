//! Reading the whole file.

use super::super::index::{Entry, FileIndex, NO_CHUNK, told, too_many};
use super::super::reader::FileReader;
use super::chunk::load_chunk;
use super::connections::Connections;
use super::record::{Fields, RecordHead, op, record_in};
use crate::{BagError, Result};

/// Reads the whole file. Without `allow_damage` the first damage is the error; with it a damaged chunk is left out and
/// told, and a damaged record outside of chunks, whose length cannot be trusted, ends the file.
pub(super) fn scan(reader: &mut FileReader, start: u64, allow_damage: bool) -> Result<FileIndex> {
    let (mut index, mut connections) = (FileIndex::default(), Connections::default());
    let (mut place, mut data) = (start, Vec::new());
    while place < reader.size() {
        let record = match RecordHead::read(reader, place) {
            Ok(record) => record,
            Err(error @ BagError::Damaged { .. }) if allow_damage => {
                index.notes.push(told(&error, "what comes before is used"));
                break;
            }
            Err(error) => return Err(error),
        };
        let scanned = scan_record(reader, place, &record, &mut connections, &mut index.entries, &mut data);
        match scanned {
            Err(error @ BagError::Damaged { .. }) if allow_damage => {
                index.notes.push(told(&error, "the rest of this record is left out"));
            }
            scanned => scanned?,
        }
        place = record.end();
    }
    index.channels = connections.found;
    Ok(index)
}

fn scan_record(
    reader: &mut FileReader,
    place: u64,
    record: &RecordHead,
    connections: &mut Connections,
    entries: &mut Vec<Entry>,
    data: &mut Vec<u8>,
) -> Result<()> {
    let fields = record.fields();
    match fields.op() {
        Some(op::CONNECTION) => {
            record.data(reader, data)?;
            connections.take(fields, data).map_err(|value| reader.damaged(place, "a connection", value))?;
        }
        Some(op::MESSAGE) => {
            let entry = entry(fields, connections, place, NO_CHUNK);
            entries.push(entry.map_err(|value| reader.damaged(place, "a message", value))?);
        }
        Some(op::CHUNK) => {
            let chunk = load_chunk(reader, place)?;
            let mut at = 0;
            while at < chunk.len() {
                if too_many(entries.len(), reader.size()) {
                    return Err(reader.damaged(place, "the number of messages to here", entries.len()));
                }
                let walked = record_in(&chunk, at).ok_or("longer than the chunk".to_owned());
                let walked = walked.and_then(|(fields, data)| {
                    match fields.op() {
                        Some(op::CONNECTION) => connections.take(fields, &chunk[data.clone()])?,
                        Some(op::MESSAGE) => entries.push(entry(fields, connections, place, at as u32)?),
                        _ => {}
                    }
                    Ok(data.end)
                });
                at = walked.map_err(|value| {
                    reader.damaged(place, format!("the record at byte {at} of the chunk"), value)
                })?;
            }
        }
        Some(_) => {}
        None => return Err(reader.damaged(place, "the code of a record", "missing")),
    }
    Ok(())
}

fn entry(fields: Fields<'_>, connections: &Connections, place: u64, within: u32) -> Result<Entry, String> {
    let (Some(channel), Some(log_time)) = (fields.u32(b"conn"), fields.time(b"time")) else {
        return Err("without connection or time".into());
    };
    if !connections.known.contains_key(&channel) {
        return Err(format!("of connection {channel}, which is not in the file before it"));
    }
    Ok(Entry { channel, log_time, place, within })
}
