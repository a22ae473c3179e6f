//! MCAP *(mcap.dev/spec)*: records, some of them in compressed chunks, and a summary at the end.

use std::collections::HashMap;
use std::ops::Range;

use mcap::records::{self, Record, op};

use super::index::{Channel, Entry, FileIndex, NO_CHUNK, is_transient_local, told};
use super::reader::FileReader;
use super::topic::{DefinitionFormat, Encoding, Topic};
use super::unpack::{Packing, UNPACKED_LIMIT};
use crate::{BagError, Result};

/// What the file starts and ends with.
pub(crate) const MAGIC: &[u8] = mcap::MAGIC;

/// The code and length before each record.
const RECORD_HEAD: u64 = 9;
/// Channel, sequence, log time, publish time.
const MESSAGE_HEAD: usize = 22;

/// Finds the messages: by the summary where there is one that agrees with itself, else by reading the whole file. Where
/// damage is allowed the whole file is read in any case, so that what the index has can be read later.
pub(crate) fn index(reader: &mut FileReader, allow_damage: bool) -> Result<FileIndex> {
    if allow_damage {
        // Channels are known from there also where the chunk that introduces them is damaged.
        let known = summary(reader).ok().and_then(|s| s.ok()).map(|s| s.channels);
        return scan(reader, known.unwrap_or_default(), true);
    }
    let mut end = [0; 8];
    let end_at = reader.size().saturating_sub(8).max(8);
    reader.read_at(end_at, &mut end, "the closing magic")?;
    if end != MAGIC {
        return Err(reader.damaged(end_at, "the closing magic", format!("{:02x?}", end)));
    }
    let index = match summary(reader)? {
        Ok(summary) => summary.index(reader)?,
        Err(reason) => Err(reason),
    };
    match index {
        Ok(index) => Ok(index),
        Err(reason) => {
            let mut index = scan(reader, Channels::default(), false)?;
            index.notes.insert(0, format!("{reason}: the whole file was read to find its messages"));
            Ok(index)
        }
    }
}

/// What is known of channels so far.
#[derive(Default)]
struct Channels {
    schemas: HashMap<u16, (String, String, String)>,
    records: HashMap<u16, records::Channel>,
    found: Vec<Channel>,
}

impl Channels {
    /// Takes a schema or a channel; what is wrong with it.
    fn take(&mut self, record: Record<'_>) -> Result<(), (&'static str, String)> {
        match record {
            Record::Schema { header, data } => {
                let text = String::from_utf8_lossy(&data).into_owned();
                let schema = (header.name, header.encoding, text);
                match self.schemas.insert(header.id, schema.clone()) {
                    Some(old) if old != schema => {
                        Err(("the schema", format!("number {} again and different", header.id)))
                    }
                    _ => Ok(()),
                }
            }
            Record::Channel(channel) => {
                match self.records.get(&channel.id) {
                    Some(old) if *old == channel => return Ok(()),
                    Some(_) => {
                        return Err(("the channel", format!("number {} again and different", channel.id)));
                    }
                    None => {}
                }
                let schema = self.schemas.get(&channel.schema_id);
                if schema.is_none() && channel.schema_id != 0 {
                    let value = format!("schema {}, which is not in the file", channel.schema_id);
                    return Err(("the channel's schema", value));
                }
                let topic = topic(&channel, schema);
                self.found.push(Channel { id: channel.id.into(), topic });
                self.records.insert(channel.id, channel);
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

fn topic(channel: &records::Channel, schema: Option<&(String, String, String)>) -> Result<Topic, String> {
    let (type_name, language, definition) = match schema {
        Some((name, language, text)) => (name.as_str(), language.as_str(), text.as_str()),
        None => Default::default(),
    };
    let name = &channel.topic;
    let encoding = match channel.message_encoding.as_str() {
        "cdr" => Encoding::Cdr,
        "ros1" => Encoding::Ros1,
        other => return Err(format!("{name}: its messages are encoded as {other:?}, which is not read")),
    };
    let definition_format = match (encoding, language) {
        _ if definition.trim().is_empty() => DefinitionFormat::Missing,
        (Encoding::Ros1, "ros1msg") => DefinitionFormat::Ros1Msg,
        (Encoding::Cdr, "ros2msg") => DefinitionFormat::Ros2Msg,
        (Encoding::Cdr, "ros2idl") => DefinitionFormat::Ros2Idl,
        (_, other) => {
            return Err(format!("{name}: its definition is written as {other:?}, which is not read"));
        }
    };
    let has = |key: &str| channel.metadata.get(key);
    Ok(Topic {
        name: name.clone(),
        type_name: type_name.to_owned(),
        encoding,
        definition_format,
        definition: if definition_format == DefinitionFormat::Missing { "" } else { definition }.to_owned(),
        publisher: has("callerid").cloned(),
        latched: has("latching").is_some_and(|v| v == "1")
            || has("offered_qos_profiles").is_some_and(|p| is_transient_local(p)),
    })
}

/// What the end of the file says of it.
struct Summary {
    channels: Channels,
    chunks: Vec<records::ChunkIndex>,
    statistics: Option<records::Statistics>,
}

/// The summary that the file has; the reason where it cannot be used.
fn summary(reader: &mut FileReader) -> Result<Result<Summary, String>> {
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
        match mcap::parse_record(code, &bytes[body]) {
            Ok(record @ Record::Schema { .. }) => {
                if let Err((field, value)) = channels.take(record) {
                    return Ok(Err(format!("its index is damaged ({field} is {value})")));
                }
            }
            Ok(record @ Record::Channel(_)) => late.push(record.into_owned()),
            Ok(Record::ChunkIndex(chunk)) => chunks.push(chunk),
            Ok(Record::Statistics(s)) => statistics = Some(s),
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
    fn index(self, reader: &mut FileReader) -> Result<Result<FileIndex, String>> {
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
        while at < bytes.len() {
            let Some((op::MESSAGE_INDEX, body)) = record_at(&bytes, at) else { return damaged() };
            at = body.end;
            let Ok(Record::MessageIndex(index)) = mcap::parse_record(op::MESSAGE_INDEX, &bytes[body]) else {
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

/// Reads the whole file. Without `allow_damage` the first damage is the error; with it a damaged chunk is left out and
/// told, and a damaged record outside of chunks, whose length cannot be trusted, ends the file.
fn scan(reader: &mut FileReader, mut channels: Channels, allow_damage: bool) -> Result<FileIndex> {
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
            let record = mcap::parse_record(code, &body);
            let record = record.map_err(|e| reader.damaged(place, "a schema or channel", e))?;
            channels.take(record).map_err(|(field, value)| reader.damaged(place, field, value))?;
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
                walk_chunk(&chunk, place, channels, entries).map_err(|(at, field, value)| {
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

type Wrong = (&'static str, String);

fn walk_chunk(
    chunk: &[u8],
    place: u64,
    channels: &mut Channels,
    entries: &mut Vec<Entry>,
) -> Result<(), (usize, &'static str, String)> {
    let mut at = 0;
    while at < chunk.len() {
        let Some((code, body)) = record_at(chunk, at) else {
            return Err((at, "a record", "longer than the chunk".into()));
        };
        let next = body.end;
        let result: Result<(), Wrong> = match code {
            op::SCHEMA | op::CHANNEL => mcap::parse_record(code, &chunk[body])
                .map_err(|e| ("a schema or channel", e.to_string()))
                .and_then(|record| channels.take(record)),
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

fn known(channels: &Channels, id: u32) -> Result<(), Wrong> {
    match channels.records.contains_key(&(id as u16)) {
        true => Ok(()),
        false => Err(("the channel of a message", format!("{id}, which is not in the file before it"))),
    }
}

/// Channel and log time.
fn message_head(body: &[u8]) -> Result<(u32, i64), Wrong> {
    if body.len() < MESSAGE_HEAD {
        return Err(("the length of a message", body.len().to_string()));
    }
    let time = u64_at(body, 6);
    let log_time = i64::try_from(time).map_err(|_| ("the log time of a message", time.to_string()))?;
    Ok((u16::from_le_bytes([body[0], body[1]]).into(), log_time))
}

/// Reads, unpacks and checks the chunk at `place`.
pub(crate) fn load_chunk(reader: &mut FileReader, place: u64) -> Result<Vec<u8>> {
    let mut head = [0; 9 + 32];
    reader.read_at(place, &mut head, "a chunk")?;
    let (record_length, size) = (u64_at(&head, 1), u64_at(&head, 9 + 16));
    let (crc, name_length) = (u32_at(&head, 9 + 24), u32_at(&head, 9 + 28));
    if head[0] != op::CHUNK {
        return Err(reader.damaged(place, "the code of a chunk", head[0]));
    }
    if name_length > 64 {
        return Err(reader.damaged(place, "the length of a chunk's compression", name_length));
    }
    let mut bytes = Vec::new();
    let name_at = place + head.len() as u64;
    reader.bytes_at(name_at, u64::from(name_length) + 8, &mut bytes, "a chunk")?;
    let packed_size = u64_at(&bytes, name_length as usize);
    let before = 32 + u64::from(name_length) + 8;
    if record_length.checked_sub(before).is_none_or(|rest| packed_size > rest) {
        return Err(reader.damaged(place, "the packed size of a chunk", packed_size));
    }
    let packing = match &bytes[..name_length as usize] {
        b"" | b"none" => None,
        b"zstd" => Some(Packing::Zstd),
        b"lz4" => Some(Packing::Lz4),
        name => {
            let (value, advice) = (format!("{:?}", String::from_utf8_lossy(name)), "pack it by zstd or lz4");
            return Err(reader.wrong(place, "the compression of a chunk", value, advice));
        }
    };
    if packing.is_none() && size != packed_size {
        return Err(reader.damaged(place, "the size of a chunk", format!("{size} and {packed_size}")));
    }
    if size > UNPACKED_LIMIT {
        let advice = "such chunks are not read: write the bag with smaller ones";
        return Err(reader.wrong(place, "the size of a chunk", format!("{size} bytes"), advice));
    }
    reader.bytes_at(name_at + u64::from(name_length) + 8, packed_size, &mut bytes, "a chunk")?;
    let chunk = match packing {
        None => bytes,
        Some(packing) => {
            packing.unpack(&bytes, size).map_err(|reason| reader.damaged(place, "a chunk", reason))?
        }
    };
    if crc != 0 {
        let found = crc32fast::hash(&chunk);
        if found != crc {
            let value = format!("{found:08x} instead of {crc:08x}");
            return Err(reader.damaged(place, "the checksum of a chunk", value));
        }
    }
    Ok(chunk)
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
fn record_at(bytes: &[u8], place: usize) -> Option<(u8, Range<usize>)> {
    let rest = bytes.get(place..)?;
    if rest.len() < RECORD_HEAD as usize {
        return None;
    }
    let length = usize::try_from(u64_at(rest, 1)).ok()?;
    let start = place + RECORD_HEAD as usize;
    let end = start.checked_add(length).filter(|end| *end <= bytes.len())?;
    Some((rest[0], start..end))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    let mut word = [0; 8];
    word.copy_from_slice(&bytes[at..at + 8]);
    u64::from_le_bytes(word)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    let mut word = [0; 4];
    word.copy_from_slice(&bytes[at..at + 4]);
    u32::from_le_bytes(word)
}
