//! Opening a bag: its files, their containers, one index.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;
use std::sync::Mutex;

use super::bag::{Bag, BagFile, Container, Handle, TopicCount};
use super::cache::ChunkCache;
use super::index::{Channel, FileIndex, told};
use super::kind::ContainerKind;
use super::reader::{FileReader, one_line};
use super::source::{FileSource, Source};
use super::topic::{MessageRef, Topic};
use super::unpack::Unpacked;
use super::{folder, mcap, ros1, sqlite};
use crate::{BagError, Result};

/// How a bag is opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BagOptions {
    /// Use what can be read of a truncated or damaged bag and tell the rest in [`Bag::notes`], instead of an error. The
    /// whole bag is read at opening, so that every message of the index can be read later.
    pub allow_truncated: bool,
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
        let packed = ContainerKind::is_zstd(&head);
        if packed {
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
        let mut file = BagFile { source, container, size, packed, topics: HashMap::new(), idle };
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

fn read_head(reader: &mut FileReader) -> Result<Vec<u8>> {
    let mut head = vec![0; reader.size().min(ContainerKind::HEAD as u64) as usize];
    reader.read_at(0, &mut head, "the first bytes")?;
    Ok(head)
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
