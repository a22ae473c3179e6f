//! A bag: the files of a run, their topics, and messages by place.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::cache::ChunkCache;
use super::index::NO_CHUNK;
use super::kind::ContainerKind;
use super::reader::{CUT, FileReader};
use super::source::Source;
use super::topic::{Encoding, MessageRef, Topic};
use super::unpack::{Packing, UNPACKED_LIMIT, ZSTD_MAGIC};
use super::{mcap, ros1, sqlite};
use crate::{BagError, Result};

/// How many messages a topic has, and when.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TopicCount {
    /// Messages.
    pub messages: u64,
    /// The first and the last log time (nanoseconds); `None`: it has no messages.
    pub log_times: Option<(i64, i64)>,
}

/// A bag of one file or several: MCAP, sqlite3 or ROS 1. Its index is in memory, its messages are read when they are asked
/// for, from any thread.
pub struct Bag {
    pub(super) files: Vec<BagFile>,
    pub(super) topics: Vec<Topic>,
    pub(super) counts: Vec<TopicCount>,
    /// In the order of files and of places in them.
    pub(super) messages: Vec<MessageRef>,
    pub(super) notes: Vec<String>,
    pub(super) cache: ChunkCache,
}

pub(super) struct BagFile {
    pub(super) source: Box<dyn Source>,
    pub(super) container: Container,
    pub(super) size: u64,
    /// Whether it was compressed as a whole.
    pub(super) packed: bool,
    /// The index of the topic by the file's own number of it.
    pub(super) topics: HashMap<u32, u32>,
    /// Readers that are not in use.
    pub(super) idle: Mutex<Vec<Handle>>,
}

pub(super) enum Container {
    Mcap,
    RosBag,
    Sqlite3(sqlite::Layout),
}

/// A reader and the page that it read last.
pub(super) struct Handle {
    pub(super) reader: FileReader,
    pub(super) leaf: sqlite::Leaf,
}

impl Bag {
    /// The topics that can be read, in the order in which the files have them, also those without messages. A name occurs
    /// more than once where its publishers, types or definitions differ.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Counts and times of each topic, in the order of [`Bag::topics`].
    pub fn counts(&self) -> &[TopicCount] {
        &self.counts
    }

    /// What the user should know: files that were taken or missing, an index that was not there, damage that was allowed,
    /// topics that are not read.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The container of the first file; `None`: a bag of no files.
    pub fn kind(&self) -> Option<ContainerKind> {
        self.files.first().map(|file| match file.container {
            Container::Mcap => ContainerKind::Mcap,
            Container::RosBag => ContainerKind::RosBag,
            Container::Sqlite3(_) => ContainerKind::Sqlite3,
        })
    }

    /// Name and bytes (unpacked, where a file is compressed as a whole) of each file.
    pub fn files(&self) -> impl Iterator<Item = (&str, u64)> {
        self.files.iter().map(|file| (file.source.name(), file.size))
    }

    /// The messages of these topics (indices in [`Bag::topics`]) in the order of their log times; of equal times in the
    /// order of the files. O(n log n) of the messages of the bag.
    pub fn messages(&self, topics: &[u32]) -> Vec<MessageRef> {
        let mut messages: Vec<_> = self.stored(topics).collect();
        messages.sort_by_key(|m| m.log_time);
        messages
    }

    /// The messages of these topics in the order in which the files have them, which is the fastest to read.
    pub(super) fn stored(&self, topics: &[u32]) -> impl Iterator<Item = MessageRef> {
        let mut wanted = vec![false; self.topics.len()];
        for topic in topics {
            if let Some(wanted) = wanted.get_mut(*topic as usize) {
                *wanted = true;
            }
        }
        self.messages.iter().copied().filter(move |m| wanted[m.topic as usize])
    }

    /// Reads a message into `data`, as its only content. From any thread; of messages in chunks the last used chunks are
    /// kept unpacked (64 MiB, and at least one).
    ///
    /// # Errors
    /// [`BagError::Damaged`] where the message is not what the index says, or its chunk cannot be unpacked;
    /// [`BagError::Os`].
    pub fn read(&self, message: &MessageRef, data: &mut Vec<u8>) -> Result<()> {
        let mut scratch = std::mem::take(data);
        let chunk = self.with_message(message, &mut scratch, |bytes, own| {
            // What was read into the buffer itself stays there.
            (!own).then(|| bytes.to_vec())
        })?;
        *data = chunk.unwrap_or(scratch);
        Ok(())
    }

    /// Calls `visit` for each message of these topics, in the order in which the files have them: one pass at the speed
    /// of the disk and of unpacking.
    ///
    /// # Errors
    /// As [`Bag::read`], and those of `visit`, which end the pass.
    pub fn for_each<E: From<BagError>>(
        &self,
        topics: &[u32],
        mut visit: impl FnMut(MessageRef, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut scratch = Vec::new();
        for message in self.stored(topics) {
            self.with_message(&message, &mut scratch, |bytes, _| visit(message, bytes))??;
        }
        Ok(())
    }

    /// Calls `f` with the bytes of a message, and whether they are those of `scratch`.
    pub(super) fn with_message<T>(
        &self,
        message: &MessageRef,
        scratch: &mut Vec<u8>,
        f: impl FnOnce(&[u8], bool) -> T,
    ) -> Result<T> {
        let file = self.files.get(message.file as usize).ok_or_else(|| BagError::Refused {
            name: format!("file {}", message.file),
            reason: "is not of this bag".into(),
            advice: "give messages to the bag that they come from".into(),
        })?;
        let is_it = |channel: u32, time: i64| {
            file.topics.get(&channel) == Some(&message.topic) && time == message.log_time
        };
        let chunk = match file.container {
            Container::Mcap if message.within != NO_CHUNK => {
                Some(self.chunk(file, message, mcap::load_chunk)?)
            }
            Container::RosBag if message.within != NO_CHUNK => {
                Some(self.chunk(file, message, ros1::load_chunk)?)
            }
            _ => None,
        };
        let packed = |bytes: &[u8]| {
            bytes.starts_with(ZSTD_MAGIC)
                && self.topics.get(message.topic as usize).is_some_and(|t| t.encoding == Encoding::Cdr)
        };
        if let Some(chunk) = chunk {
            let found = match file.container {
                Container::Mcap => mcap::message_in(&chunk, message.within),
                _ => ros1::message_in(&chunk, message.within),
            };
            let found = found.filter(|(channel, time, _)| is_it(*channel, *time));
            let (.., range) = found.ok_or_else(|| contradicts(file, message))?;
            if packed(&chunk[range.clone()]) {
                let bytes = unpack_message(file, message, &chunk[range])?;
                return Ok(f(&bytes, false));
            }
            return Ok(f(&chunk[range], false));
        }
        let mut handle = file.handle()?;
        let Handle { reader, leaf } = &mut handle;
        let found = match &file.container {
            Container::Mcap => mcap::message_at(reader, message.place, scratch)?,
            Container::RosBag => ros1::message_at(reader, message.place, scratch)?,
            Container::Sqlite3(layout) => {
                Some(layout.read(reader, leaf, message.place, message.within, scratch)?)
            }
        };
        file.give_back(handle);
        if !found.is_some_and(|(channel, time)| is_it(channel, time)) {
            return Err(contradicts(file, message));
        }
        if packed(scratch) {
            *scratch = unpack_message(file, message, scratch)?;
        }
        Ok(f(scratch, true))
    }

    fn chunk(
        &self,
        file: &BagFile,
        message: &MessageRef,
        load: impl FnOnce(&mut FileReader, u64) -> Result<Vec<u8>>,
    ) -> Result<Arc<Vec<u8>>> {
        self.cache.get((message.file, message.place), || {
            let mut handle = file.handle()?;
            let chunk = load(&mut handle.reader, message.place)?;
            file.give_back(handle);
            Ok(chunk)
        })
    }
}

impl BagFile {
    /// A reader that no other thread uses.
    pub(super) fn handle(&self) -> Result<Handle> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        match idle {
            Some(handle) => Ok(handle),
            None => {
                let reader = FileReader::open(self.source.as_ref())?;
                Ok(Handle { reader, leaf: sqlite::Leaf::default() })
            }
        }
    }

    pub(super) fn give_back(&self, handle: Handle) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(handle);
    }
}

fn contradicts(file: &BagFile, message: &MessageRef) -> BagError {
    BagError::Damaged {
        name: file.source.name().to_owned(),
        offset: message.place,
        field: format!("the message at {}", message.within),
        value: format!("not the one of the index (log time {})", message.log_time),
        advice: CUT.into(),
    }
}

/// A message that rosbag2 compressed alone (`compression_mode: MESSAGE`): CDR starts with a zero byte, so the magic of
/// zstd cannot be the message itself.
fn unpack_message(file: &BagFile, message: &MessageRef, packed: &[u8]) -> Result<Vec<u8>> {
    Packing::Zstd.unpack_up_to(packed, 0, UNPACKED_LIMIT).map_err(|value| BagError::Damaged {
        name: file.source.name().to_owned(),
        offset: message.place,
        field: "a compressed message".into(),
        value,
        advice: CUT.into(),
    })
}
