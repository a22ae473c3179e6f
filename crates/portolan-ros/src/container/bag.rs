//! A bag: the files of a run, their topics, and messages by place.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use super::cache::ChunkCache;
use super::index::{Channel, FileIndex, NO_CHUNK, told};
use super::kind::ContainerKind;
use super::reader::{CUT, FileReader, one_line};
use super::source::{FileSource, Source};
use super::topic::{Encoding, MessageRef, Topic};
use super::unpack::{Packing, UNPACKED_LIMIT, Unpacked, ZSTD_MAGIC};
use super::{folder, mcap, ros1, sqlite};
use crate::{BagError, Result};

/// How a bag is opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BagOptions {
    /// Use what can be read of a truncated or damaged bag and tell the rest in [`Bag::notes`], instead of an error. The
    /// whole bag is read at opening, so that every message of the index can be read later.
    pub allow_truncated: bool,
}

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
    files: Vec<BagFile>,
    topics: Vec<Topic>,
    counts: Vec<TopicCount>,
    /// In the order of files and of places in them.
    messages: Vec<MessageRef>,
    notes: Vec<String>,
    cache: ChunkCache,
}

struct BagFile {
    source: Box<dyn Source>,
    container: Container,
    size: u64,
    /// The index of the topic by the file's own number of it.
    topics: HashMap<u32, u32>,
    /// Readers that are not in use.
    idle: Mutex<Vec<Handle>>,
}

enum Container {
    Mcap,
    RosBag,
    Sqlite3(sqlite::Layout),
}

/// A reader and the page that it read last.
struct Handle {
    reader: FileReader,
    leaf: sqlite::Leaf,
}

impl Bag {
    /// Opens a file (`.mcap`, `.db3`, `.bag`; its first bytes decide, not its name; compressed by zstd or not), a folder of
    /// rosbag2 or its `metadata.yaml`, or a folder of bags that belong together. The files that the description of a
    /// folder names are read in its order; else all that are there, by the numbers in their names.
    ///
    /// A file that is compressed as a whole is unpacked to a temporary file without a name.
    ///
    /// # Errors
    /// [`BagError::Os`], [`BagError::Damaged`] for what is wrong in a file, [`BagError::Refused`] for what holds no bag.
    /// Cost: that of the index; of reading everything where a file has none.
    pub fn open(path: impl AsRef<Path>, options: &BagOptions) -> Result<Self> {
        let files = folder::files(path.as_ref())?;
        let mut notes = files.notes;
        for path in &files.paths {
            notes.extend(unwritten(path, options.allow_truncated)?);
        }
        let sources = files.paths.into_iter().map(|p| Box::new(FileSource::new(p)) as Box<dyn Source>);
        let mut bag = Self::from_sources(sources.collect(), options)?;
        notes.append(&mut bag.notes);
        if !files.described {
            notes.extend(bag.overlaps());
        }
        bag.notes = notes;
        Ok(bag)
    }

    /// Opens files from wherever their bytes are, in the order given: topics that are alike in all of what [`Topic`] says
    /// are one.
    ///
    /// # Errors
    /// As [`Bag::open`].
    pub fn from_sources(sources: Vec<Box<dyn Source>>, options: &BagOptions) -> Result<Self> {
        let mut bag = Self {
            files: Vec::new(),
            topics: Vec::new(),
            counts: Vec::new(),
            messages: Vec::new(),
            notes: Vec::new(),
            cache: ChunkCache::default(),
        };
        for source in sources {
            bag.add(source, options)?;
        }
        if options.allow_truncated {
            bag.keep_readable()?;
        }
        for message in &bag.messages {
            let count = &mut bag.counts[message.topic as usize];
            let (first, last) = count.log_times.unwrap_or((message.log_time, message.log_time));
            count.log_times = Some((first.min(message.log_time), last.max(message.log_time)));
            count.messages += 1;
        }
        Ok(bag)
    }

    fn add(&mut self, mut source: Box<dyn Source>, options: &BagOptions) -> Result<()> {
        let mut reader = FileReader::open(source.as_ref())?;
        let mut head = read_head(&mut reader)?;
        if ContainerKind::is_zstd(&head) {
            let (unpacked, damage) = Unpacked::new(source.as_ref(), options.allow_truncated)?;
            self.notes.extend(damage);
            source = Box::new(unpacked);
            reader = FileReader::open(source.as_ref())?;
            head = read_head(&mut reader)?;
        }
        let refused = |reason: &str, advice: &str| {
            Err(BagError::Refused {
                name: source.name().to_owned(),
                reason: reason.into(),
                advice: advice.into(),
            })
        };
        let allow = options.allow_truncated;
        let (index, container) = match ContainerKind::recognise(&head) {
            Some(ContainerKind::Mcap) => (mcap::index(&mut reader, allow)?, Container::Mcap),
            Some(ContainerKind::RosBag) => (ros1::index(&mut reader, allow)?, Container::RosBag),
            Some(ContainerKind::Sqlite3) => {
                let (index, layout) = sqlite::index(&mut reader, allow)?;
                (index, Container::Sqlite3(layout))
            }
            None if head.is_empty() => return refused("is empty", "record it again"),
            None => return refused("is no MCAP, sqlite3 or ROS 1 bag", "give a .mcap, .db3 or .bag file"),
        };
        let size = reader.size();
        let idle = Mutex::new(vec![Handle { reader, leaf: sqlite::Leaf::default() }]);
        let mut file = BagFile { source, container, size, topics: HashMap::new(), idle };
        self.take_index(&mut file, index);
        self.files.push(file);
        Ok(())
    }

    fn take_index(&mut self, file: &mut BagFile, index: FileIndex) {
        let name = file.source.name();
        self.notes.extend(index.notes.into_iter().map(|note| format!("{name}: {}", one_line(&note))));
        let mut refused = HashMap::new();
        for Channel { id, topic } in index.channels {
            match topic {
                Ok(topic) => drop(file.topics.insert(id, self.topic(topic))),
                Err(reason) => drop(refused.insert(id, (reason, 0u64))),
            }
        }
        let number = self.files.len() as u32;
        self.messages.reserve_exact(index.entries.len());
        for entry in index.entries {
            let Some(&topic) = file.topics.get(&entry.channel) else {
                refused.entry(entry.channel).and_modify(|(_, n)| *n += 1);
                continue;
            };
            let (log_time, place, within) = (entry.log_time, entry.place, entry.within);
            self.messages.push(MessageRef { topic, log_time, file: number, place, within });
        }
        let mut refused: Vec<_> = refused.into_iter().collect();
        refused.sort_by_key(|(id, _)| *id);
        let notes = refused
            .into_iter()
            .map(|(_, (reason, n))| format!("{name}: {} ({n} messages left out)", one_line(&reason)));
        self.notes.extend(notes);
    }

    /// Takes messages that cannot be read out of the index and tells how many.
    fn keep_readable(&mut self) -> Result<()> {
        let (mut first, mut lost, mut scratch) = (None, 0, Vec::new());
        let mut kept = Vec::with_capacity(self.messages.len());
        for message in &self.messages {
            match self.with_message(message, &mut scratch, |_, _| ()) {
                Ok(()) => kept.push(*message),
                Err(error @ BagError::Damaged { .. }) => {
                    lost += 1;
                    first.get_or_insert(error);
                }
                Err(error) => return Err(error),
            }
        }
        self.messages = kept;
        if let Some(error) = first {
            let name = if let BagError::Damaged { name, .. } = &error { name } else { "" };
            let what = format!("{lost} messages like it are left out");
            self.notes.push(format!("{name}: {}", one_line(&told(&error, &what))));
        }
        Ok(())
    }

    /// The index of a topic, which is added where there is none like it.
    fn topic(&mut self, topic: Topic) -> u32 {
        let known = self.topics.iter().position(|t| *t == topic);
        known.unwrap_or_else(|| {
            self.topics.push(topic);
            self.counts.push(TopicCount::default());
            self.topics.len() - 1
        }) as u32
    }

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
    fn stored(&self, topics: &[u32]) -> impl Iterator<Item = MessageRef> {
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
    fn with_message<T>(
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
    ) -> Result<std::sync::Arc<Vec<u8>>> {
        self.cache.get((message.file, message.place), || {
            let mut handle = file.handle()?;
            let chunk = load(&mut handle.reader, message.place)?;
            file.give_back(handle);
            Ok(chunk)
        })
    }

    /// What is told of files that nothing says belong together and that have a topic at the same time.
    fn overlaps(&self) -> Vec<String> {
        let mut ranges: HashMap<(u32, u32), (i64, i64)> = HashMap::new();
        for m in &self.messages {
            let range = ranges.entry((m.topic, m.file)).or_insert((m.log_time, m.log_time));
            *range = (range.0.min(m.log_time), range.1.max(m.log_time));
        }
        let mut notes = Vec::new();
        for (topic, about) in self.topics.iter().enumerate() {
            let mut last: Option<(i64, u32)> = None;
            for file in 0..self.files.len() as u32 {
                let Some(&(start, end)) = ranges.get(&(topic as u32, file)) else { continue };
                if let Some((before, other)) = last
                    && start < before
                {
                    let names = [other, file].map(|f| self.files[f as usize].source.name());
                    let (topic, seconds) = (&about.name, (before.min(end) - start) as f64 * 1e-9);
                    notes.push(format!(
                        "{} and {} both have {topic} for {seconds:.3} s: are they parts of one run?",
                        names[0], names[1]
                    ));
                }
                if last.is_none_or(|(before, _)| end > before) {
                    last = Some((end, file));
                }
            }
        }
        notes
    }
}

impl BagFile {
    /// A reader that no other thread uses.
    fn handle(&self) -> Result<Handle> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        match idle {
            Some(handle) => Ok(handle),
            None => {
                let reader = FileReader::open(self.source.as_ref())?;
                Ok(Handle { reader, leaf: sqlite::Leaf::default() })
            }
        }
    }

    fn give_back(&self, handle: Handle) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(handle);
    }
}

fn read_head(reader: &mut FileReader) -> Result<Vec<u8>> {
    let mut head = vec![0; reader.size().min(ContainerKind::HEAD as u64) as usize];
    reader.read_at(0, &mut head, "the first bytes")?;
    Ok(head)
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

/// Changes of a database that are in a file beside it.
fn unwritten(path: &Path, allowed: bool) -> Result<Option<String>> {
    let beside = |suffix: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(suffix);
        std::path::PathBuf::from(name)
    };
    // A journal that was finished is emptied or its first bytes are zero.
    let starts = |path: &Path, magic: &[u8]| {
        let mut head = Vec::new();
        let read = std::fs::File::open(path).and_then(|file| file.take(8).read_to_end(&mut head));
        read.is_ok() && !head.is_empty() && head.starts_with(magic)
    };
    let (wal, journal) = (beside("-wal"), beside("-journal"));
    let found = if starts(&wal, &[]) {
        wal
    } else if starts(&journal, &[0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7]) {
        journal
    } else {
        return Ok(None);
    };
    let (name, found) = (path.display().to_string(), found.display().to_string());
    let reason = format!("has changes in {found} that are not in it yet (its recorder was stopped early)");
    if allowed {
        return Ok(Some(format!("{name}: {reason}: they are left out")));
    }
    let advice =
        "finish it by `sqlite3 FILE 'PRAGMA wal_checkpoint'`, or leave them out by --allow-truncated".into();
    Err(BagError::Refused { name, reason, advice })
}
