//! Records, their fields, and the messages among them.

use std::ops::Range;

use super::super::reader::FileReader;
use crate::Result;

pub(super) mod op {
    pub(in super::super) const MESSAGE: u8 = 2;
    pub(in super::super) const BAG: u8 = 3;
    pub(in super::super) const INDEX: u8 = 4;
    pub(in super::super) const CHUNK: u8 = 5;
    pub(in super::super) const CHUNK_INFO: u8 = 6;
    pub(in super::super) const CONNECTION: u8 = 7;
}

/// A header of more bytes is damage: it holds a few numbers and the name of a topic.
const HEADER_LIMIT: u64 = 1 << 20;

/// The start of a record: its fields, and where its data is.
pub(super) struct RecordHead {
    header: Vec<u8>,
    data_at: u64,
    data_length: u64,
}

impl RecordHead {
    pub(super) fn read(reader: &mut FileReader, place: u64) -> Result<Self> {
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

    pub(super) fn fields(&self) -> Fields<'_> {
        Fields(&self.header)
    }

    pub(super) fn end(&self) -> u64 {
        self.data_at + self.data_length
    }

    pub(super) fn data(&self, reader: &mut FileReader, data: &mut Vec<u8>) -> Result<()> {
        reader.bytes_at(self.data_at, self.data_length, data, "a record")
    }
}

/// Fields `length name=value`, one after the other.
#[derive(Clone, Copy)]
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    fn next(&mut self) -> Option<(&'a [u8], &'a [u8])> {
        let (length, rest) = self.0.split_first_chunk::<4>()?;
        let field = rest.get(..u32::from_le_bytes(*length) as usize)?;
        let equals = field.iter().position(|b| *b == b'=')?;
        self.0 = &rest[field.len()..];
        Some((&field[..equals], &field[equals + 1..]))
    }

    pub(super) fn valid(mut self) -> bool {
        while self.next().is_some() {}
        self.0.is_empty()
    }

    pub(super) fn get(mut self, name: &[u8]) -> Option<&'a [u8]> {
        while let Some((key, value)) = self.next() {
            if key == name {
                return Some(value);
            }
        }
        None
    }

    pub(super) fn text(self, name: &[u8]) -> Option<String> {
        self.get(name).map(|v| String::from_utf8_lossy(v).into_owned())
    }

    pub(super) fn u32(self, name: &[u8]) -> Option<u32> {
        Some(u32::from_le_bytes(self.get(name)?.try_into().ok()?))
    }

    pub(super) fn u64(self, name: &[u8]) -> Option<u64> {
        Some(u64::from_le_bytes(self.get(name)?.try_into().ok()?))
    }

    pub(super) fn op(self) -> Option<u8> {
        match self.get(b"op")? {
            [op] => Some(*op),
            _ => None,
        }
    }

    pub(super) fn time(self, name: &[u8]) -> Option<i64> {
        Some(time(self.get(name)?.try_into().ok()?))
    }
}

/// Seconds and nanoseconds.
pub(super) fn time(bytes: [u8; 8]) -> i64 {
    let ticks = u64::from_le_bytes(bytes);
    (ticks & 0xffff_ffff) as i64 * 1_000_000_000 + (ticks >> 32) as i64
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
pub(super) fn record_in(bytes: &[u8], place: usize) -> Option<(Fields<'_>, Range<usize>)> {
    let (length, rest) = bytes.get(place..)?.split_first_chunk::<4>()?;
    let length = u32::from_le_bytes(*length) as usize;
    let fields = Fields(rest.get(..length)?);
    let (data_length, rest) = rest[length..].split_first_chunk::<4>()?;
    let data_length = u32::from_le_bytes(*data_length) as usize;
    let start = place + 8 + length;
    (fields.valid() && data_length <= rest.len()).then(|| (fields, start..start + data_length))
}

pub(super) fn word(bytes: &[u8], at: usize) -> u32 {
    let mut word = [0; 4];
    word.copy_from_slice(&bytes[at..at + 4]);
    u32::from_le_bytes(word)
}
