//! Where the messages are.

use super::super::index::FileIndex;
use super::super::reader::FileReader;
use super::MAGIC;
use super::channels::Channels;
use super::scan::scan;
use super::summary::summary;
use crate::Result;

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
