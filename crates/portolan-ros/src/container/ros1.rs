//! ROS 1 bags, version 2.0 *(wiki.ros.org/Bags/Format/2.0)*: records of named fields, messages in chunks, an index at the
//! end that a recorder which was killed has not written.

use std::collections::HashMap;
use std::ops::Range;

use super::index::{Channel, Entry, FileIndex, NO_CHUNK, told};
use super::reader::FileReader;
use super::topic::{DefinitionFormat, Encoding, Topic};
use super::unpack::{Packing, UNPACKED_LIMIT};
use crate::{BagError, Result};

/// The line that the file starts with.
const VERSION: &[u8] = b"#ROSBAG V2.0\n";

mod op {
    pub(super) const MESSAGE: u8 = 2;
    pub(super) const BAG: u8 = 3;
    pub(super) const INDEX: u8 = 4;
    pub(super) const CHUNK: u8 = 5;
    pub(super) const CHUNK_INFO: u8 = 6;
    pub(super) const CONNECTION: u8 = 7;
}

/// A header of more bytes is damage: it holds a few numbers and the name of a topic.
const HEADER_LIMIT: u64 = 1 << 20;

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

/// The start of a record: its fields, and where its data is.
struct RecordHead {
    header: Vec<u8>,
    data_at: u64,
    data_length: u64,
}

impl RecordHead {
    fn read(reader: &mut FileReader, place: u64) -> Result<Self> {
        let mut word = [0; 4];
        reader.read_at(place, &mut word, "a record")?;
        let length = u64::from(u32::from_le_bytes(word));
        if length > HEADER_LIMIT {
            return Err(reader.damaged(place, "the length of a record's header", length));
        }
        let mut header = Vec::new();
        reader.bytes_at(place + 4, length, &mut header, "the header of a record")?;
        if !Fields(&header).valid() {
            return Err(reader.damaged(place, "the header of a record", "not a list of fields"));
        }
        reader.read_at(place + 4 + length, &mut word, "a record")?;
        let (data_at, data_length) = (place + 8 + length, u64::from(u32::from_le_bytes(word)));
        reader.check(data_at, data_length, "a record")?;
        Ok(Self { header, data_at, data_length })
    }

    fn fields(&self) -> Fields<'_> {
        Fields(&self.header)
    }

    fn end(&self) -> u64 {
        self.data_at + self.data_length
    }

    fn data(&self, reader: &mut FileReader, data: &mut Vec<u8>) -> Result<()> {
        reader.bytes_at(self.data_at, self.data_length, data, "a record")
    }
}

/// Fields `length name=value`, one after the other.
#[derive(Clone, Copy)]
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn next(&mut self) -> Option<(&'a [u8], &'a [u8])> {
        let (length, rest) = self.0.split_first_chunk::<4>()?;
        let field = rest.get(..u32::from_le_bytes(*length) as usize)?;
        let equals = field.iter().position(|b| *b == b'=')?;
        self.0 = &rest[field.len()..];
        Some((&field[..equals], &field[equals + 1..]))
    }

    fn valid(mut self) -> bool {
        while self.next().is_some() {}
        self.0.is_empty()
    }

    fn get(mut self, name: &[u8]) -> Option<&'a [u8]> {
        while let Some((key, value)) = self.next() {
            if key == name {
                return Some(value);
            }
        }
        None
    }

    fn text(self, name: &[u8]) -> Option<String> {
        self.get(name).map(|v| String::from_utf8_lossy(v).into_owned())
    }

    fn u32(self, name: &[u8]) -> Option<u32> {
        Some(u32::from_le_bytes(self.get(name)?.try_into().ok()?))
    }

    fn u64(self, name: &[u8]) -> Option<u64> {
        Some(u64::from_le_bytes(self.get(name)?.try_into().ok()?))
    }

    fn op(self) -> Option<u8> {
        match self.get(b"op")? {
            [op] => Some(*op),
            _ => None,
        }
    }

    fn time(self, name: &[u8]) -> Option<i64> {
        Some(time(self.get(name)?.try_into().ok()?))
    }
}

/// Seconds and nanoseconds.
fn time(bytes: [u8; 8]) -> i64 {
    let ticks = u64::from_le_bytes(bytes);
    (ticks & 0xffff_ffff) as i64 * 1_000_000_000 + (ticks >> 32) as i64
}

/// Connections that were met.
#[derive(Default)]
struct Connections {
    known: HashMap<u32, (Vec<u8>, Vec<u8>)>,
    found: Vec<Channel>,
}

impl Connections {
    fn take(&mut self, header: Fields<'_>, data: &[u8]) -> Result<(), String> {
        let fields = Fields(data);
        let (Some(id), Some(name)) = (header.u32(b"conn"), header.text(b"topic")) else {
            return Err("without number or topic".into());
        };
        let Some(type_name) = fields.text(b"type").filter(|_| fields.valid()) else {
            return Err("without a type".into());
        };
        let record = (header.get(b"topic").unwrap_or_default().to_vec(), data.to_vec());
        match self.known.get(&id) {
            Some(old) if *old == record => return Ok(()),
            Some(_) => return Err(format!("number {id} again and different")),
            None => {}
        }
        let definition = fields.text(b"message_definition").unwrap_or_default();
        let missing = definition.is_empty() && fields.get(b"message_definition").is_none();
        let format = if missing { DefinitionFormat::Missing } else { DefinitionFormat::Ros1Msg };
        let topic = Topic {
            name,
            type_name,
            encoding: Encoding::Ros1,
            definition_format: format,
            definition,
            publisher: fields.text(b"callerid").filter(|p| !p.is_empty()),
            latched: fields.get(b"latching") == Some(b"1"),
        };
        self.found.push(Channel { id, topic: Ok(topic) });
        self.known.insert(id, record);
        Ok(())
    }
}

/// The index that the file has itself; the reason where it cannot be used.
fn by_index(
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

/// Reads the whole file. Without `allow_damage` the first damage is the error; with it a damaged chunk is left out and
/// told, and a damaged record outside of chunks, whose length cannot be trusted, ends the file.
fn scan(reader: &mut FileReader, start: u64, allow_damage: bool) -> Result<FileIndex> {
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

/// Reads and unpacks the chunk at `place`.
pub(crate) fn load_chunk(reader: &mut FileReader, place: u64) -> Result<Vec<u8>> {
    let record = RecordHead::read(reader, place)?;
    let fields = record.fields();
    let (Some(op::CHUNK), Some(size)) = (fields.op(), fields.u32(b"size")) else {
        return Err(reader.damaged(place, "a chunk", "a record of another kind"));
    };
    let packing = match fields.get(b"compression") {
        Some(b"none") => None,
        Some(b"bz2") => Some(Packing::Bz2),
        Some(b"lz4") => Some(Packing::Lz4),
        name => {
            let value = format!("{:?}", String::from_utf8_lossy(name.unwrap_or_default()));
            let advice = "only none, bz2 and lz4 are read: `rosbag decompress` unpacks it";
            return Err(reader.wrong(place, "the compression of a chunk", value, advice));
        }
    };
    if u64::from(size) > UNPACKED_LIMIT {
        let advice = "such chunks are not read: write the bag with smaller ones";
        return Err(reader.wrong(place, "the size of a chunk", format!("{size} bytes"), advice));
    }
    let mut bytes = Vec::new();
    record.data(reader, &mut bytes)?;
    match packing {
        None if bytes.len() as u64 == u64::from(size) => Ok(bytes),
        None => Err(reader.damaged(place, "the size of a chunk", format!("{size} and {}", bytes.len()))),
        Some(packing) => {
            packing.unpack(&bytes, size.into()).map_err(|reason| reader.damaged(place, "a chunk", reason))
        }
    }
}

/// Connection, log time and bytes of the message in a chunk; `None`: there is none.
pub(crate) fn message_in(chunk: &[u8], within: u32) -> Option<(u32, i64, Range<usize>)> {
    let (fields, data) = record_in(chunk, within as usize)?;
    (fields.op()? == op::MESSAGE).then_some(())?;
    Some((fields.u32(b"conn")?, fields.time(b"time")?, data))
}

/// Connection and log time of the message at `place`, which is in no chunk; its bytes in `data`.
pub(crate) fn message_at(
    reader: &mut FileReader,
    place: u64,
    data: &mut Vec<u8>,
) -> Result<Option<(u32, i64)>> {
    let record = RecordHead::read(reader, place)?;
    record.data(reader, data)?;
    let fields = record.fields();
    Ok((fields.op() == Some(op::MESSAGE)).then(|| fields.u32(b"conn").zip(fields.time(b"time"))).flatten())
}

/// The fields of the record at `place` and the range of its data; `None`: it is longer than the bytes.
fn record_in(bytes: &[u8], place: usize) -> Option<(Fields<'_>, Range<usize>)> {
    let (length, rest) = bytes.get(place..)?.split_first_chunk::<4>()?;
    let length = u32::from_le_bytes(*length) as usize;
    let fields = Fields(rest.get(..length)?);
    let (data_length, rest) = rest[length..].split_first_chunk::<4>()?;
    let data_length = u32::from_le_bytes(*data_length) as usize;
    let start = place + 8 + length;
    (fields.valid() && data_length <= rest.len()).then(|| (fields, start..start + data_length))
}

fn word(bytes: &[u8], at: usize) -> u32 {
    let mut word = [0; 4];
    word.copy_from_slice(&bytes[at..at + 4]);
    u32::from_le_bytes(word)
}
