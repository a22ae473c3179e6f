//! An opened bag: the kinds of its topics, and its tree of frames.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use portolan_ros::container::{Bag, BagOptions, ContainerKind, MessageRef};
use portolan_ros::message::{Decoder, MessageKind, Record, transforms};
use portolan_ros::transforms::{FrameTree, FrameTreeBuilder};

use super::{BagChoice, BagLogStats};
use crate::{IoError, Result};

/// A bag with what its topics are.
pub(crate) struct Contents {
    pub(crate) path: PathBuf,
    pub(crate) bag: Bag,
    /// Of each topic; `None`: its messages are not read.
    pub(crate) kinds: Vec<Option<MessageKind>>,
    /// Messages so far with bytes behind their end.
    longer: AtomicU64,
}

/// The file that describes a folder of rosbag2.
const METADATA: &str = "metadata.yaml";

/// Whether a file or folder is a bag, by its first bytes or the names in it.
pub(crate) fn is_bag(path: &Path) -> bool {
    let named = |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let name = [".zstd", ".zst"].iter().find_map(|e| name.strip_suffix(e)).unwrap_or(&name);
        !name.starts_with('.') && [".mcap", ".db3", ".bag"].iter().any(|e| name.ends_with(e))
    };
    if path.is_dir() {
        let Ok(entries) = std::fs::read_dir(path) else { return false };
        return entries.take(1 << 16).flatten().any(|e| named(&e.path()) && e.path().is_file());
    }
    if path.file_name().is_some_and(|n| n == METADATA) {
        // A map_server yaml may have any name.
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let text = std::fs::read(path).unwrap_or_default();
        let start = &text[..text.len().min(4096)];
        let word = b"rosbag2_bagfile_information";
        return start.windows(word.len()).any(|w| w == word) && is_bag(folder);
    }
    let mut head = Vec::new();
    let read = std::fs::File::open(path)
        .and_then(|file| std::io::Read::read_to_end(&mut std::io::Read::take(file, 64), &mut head));
    let recognised = read.is_ok()
        && (ContainerKind::recognise(&head).is_some() || (ContainerKind::is_zstd(&head) && named(path)));
    // A bag whose first bytes are damaged, or that is empty, is still named like one: its reader says what is wrong.
    recognised || named(path)
}

impl Contents {
    /// Opens a bag as a log of scans of this dimension: which topics they are, and what is to be said so far. `advice`: what to do
    /// where they are of the other dimension.
    ///
    /// # Errors
    /// Those of opening it and of choosing topics; [`IoError::Layout`] where these are of the other dimension.
    pub(super) fn of_scans(
        path: &Path,
        choice: &BagChoice,
        dimension: usize,
        advice: &str,
    ) -> Result<(Self, Vec<String>, BagLogStats)> {
        let contents = Self::open(path, choice)?;
        let sensors = contents.sensors(choice)?;
        if sensors.dimension != dimension {
            return Err(IoError::layout(path, "the topics of scans", sensors.names.join(", "), advice));
        }
        let stats = BagLogStats {
            topics: sensors.names.clone(),
            guesses: sensors.guesses,
            notes: contents.bag.notes().to_vec(),
            ..BagLogStats::default()
        };
        Ok((contents, sensors.names, stats))
    }

    /// Whether these topics are clouds, all of them.
    pub(super) fn are_clouds(&self, mut numbers: impl Iterator<Item = u32>) -> bool {
        numbers.all(|n| matches!(self.kind(n), Some(MessageKind::PointCloud2 | MessageKind::Livox)))
    }

    /// Opens a bag. Messages are not read.
    pub(crate) fn open(path: &Path, choice: &BagChoice) -> Result<Self> {
        let bag_error = IoError::bag(path);
        // A missing path gets the system's own error.
        std::fs::metadata(path).map_err(|e| IoError::os(path, "open it", e))?;
        let options = BagOptions { allow_truncated: choice.allow_truncated };
        let bag = Bag::open(path, &options).map_err(bag_error)?;
        let kinds = bag.topics().iter().map(|t| MessageKind::of(&t.type_name)).collect();
        Ok(Self { path: path.into(), bag, kinds, longer: AtomicU64::new(0) })
    }

    /// The numbers of the topics of a name: a topic of several publishers has several.
    pub(crate) fn numbers(&self, name: &str) -> Vec<u32> {
        let slash = |n: &str| n.trim_start_matches('/').to_owned();
        let wanted = slash(name);
        let all = self.bag.topics().iter().enumerate();
        all.filter(|(_, t)| slash(&t.name) == wanted).map(|(i, _)| i as u32).collect()
    }

    /// The kind of a topic's messages.
    pub(crate) fn kind(&self, number: u32) -> Option<MessageKind> {
        self.kinds.get(number as usize).copied().flatten()
    }

    /// Names and numbers of messages of the topics of some kinds, most messages first. Topics without messages are left out.
    pub(crate) fn topics_of(&self, wanted: impl Fn(MessageKind) -> bool) -> Vec<(String, u64)> {
        let mut found: Vec<(String, u64)> = Vec::new();
        for ((topic, count), kind) in self.bag.topics().iter().zip(self.bag.counts()).zip(&self.kinds) {
            if !kind.is_some_and(&wanted) || count.messages == 0 {
                continue;
            }
            match found.iter_mut().find(|(name, _)| *name == topic.name) {
                Some((_, messages)) => *messages += count.messages,
                None => found.push((topic.name.clone(), count.messages)),
            }
        }
        found.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
        found
    }

    /// What reads the messages of a topic.
    pub(crate) fn decoder(&self, number: u32) -> Result<Decoder> {
        let topic = self.bag.topics().get(number as usize).ok_or_else(|| {
            IoError::layout(&self.path, "the number of a topic", number, "give one of the bag's own")
        })?;
        Decoder::new(topic).map_err(IoError::bag(&self.path))
    }

    /// What reads the messages of all topics of a name, by number.
    pub(crate) fn decoders(&self, numbers: &[u32]) -> Result<Decoders> {
        numbers.iter().map(|n| Ok((*n, self.decoder(*n)?))).collect::<Result<_>>().map(Decoders)
    }

    /// Reads one message.
    pub(crate) fn read<T>(
        &self,
        message: &MessageRef,
        decoders: &Decoders,
        with: impl FnOnce(&Record<'_>) -> portolan_ros::Result<T>,
    ) -> Result<T> {
        let mut bytes = Vec::new();
        let bag_error = IoError::bag(&self.path);
        self.bag.read(message, &mut bytes).map_err(bag_error)?;
        let decoder = decoders.of(message.topic, &self.path)?;
        self.decode(decoder, &bytes).and_then(|record| with(&record)).map_err(bag_error)
    }

    /// The fields of a message. Bytes behind its end are counted.
    pub(crate) fn decode<'a>(
        &self,
        decoder: &'a Decoder,
        bytes: &'a [u8],
    ) -> portolan_ros::Result<Record<'a>> {
        let message = decoder.decode(bytes)?;
        if message.trailing > 0 {
            self.longer.fetch_add(1, Ordering::Relaxed);
        }
        Ok(message.record)
    }

    /// What is to be told of messages that were longer than their definition.
    pub(crate) fn note_of_longer(&self) -> Option<String> {
        let longer = self.longer.load(Ordering::Relaxed);
        (longer > 0).then(|| {
            format!(
                "{longer} messages have bytes behind their end: they may be of another version of their type"
            )
        })
    }

    /// The tree of all transforms, with what it brought up. A message that cannot be read is left out and told.
    pub(crate) fn tree(&self, notes: &mut Vec<String>) -> Result<FrameTree> {
        let all = 0..self.kinds.len() as u32;
        let numbers: Vec<u32> = all.filter(|n| self.kind(*n) == Some(MessageKind::Transforms)).collect();
        let decoders = self.decoders(&numbers)?;
        decoders.notes(notes);
        let mut builder = FrameTreeBuilder::default();
        let (mut bad, mut first) = (0u64, None);
        let bag_error = IoError::bag(&self.path);
        let visited = self.bag.for_each(&numbers, |message, bytes| {
            let topic = &self.bag.topics()[message.topic as usize];
            let is_static = topic.name.ends_with("tf_static");
            let source = match &topic.publisher {
                Some(publisher) => format!("{} by {publisher}", topic.name),
                None => topic.name.clone(),
            };
            let found = decoders
                .find(message.topic)
                .map(|d| self.decode(d, bytes).and_then(|record| transforms(&record)));
            match found {
                Some(Ok(found)) => found.iter().for_each(|t| builder.add(t, is_static, &source)),
                Some(Err(error)) => {
                    bad += 1;
                    first.get_or_insert(error);
                }
                None => {}
            }
            Ok::<(), portolan_ros::BagError>(())
        });
        visited.map_err(bag_error)?;
        if let Some(first) = first {
            notes.push(format!("{bad} messages with transforms could not be read (first: {first})"));
        }
        let tree = builder.finish().map_err(bag_error)?;
        notes.extend(tree.notes().iter().cloned());
        Ok(tree)
    }
}

/// What reads the messages of some topics.
pub(crate) struct Decoders(Vec<(u32, Decoder)>);

impl Decoders {
    pub(crate) fn find(&self, topic: u32) -> Option<&Decoder> {
        self.0.iter().find(|(n, _)| *n == topic).map(|(_, decoder)| decoder)
    }

    fn of(&self, topic: u32, path: &Path) -> Result<&Decoder> {
        let missing =
            || IoError::layout(path, "the topic of a message", topic, "give a message of these topics");
        self.find(topic).ok_or_else(missing)
    }

    /// Adds what definitions brought up, each once.
    pub(crate) fn notes(&self, notes: &mut Vec<String>) {
        for note in self.0.iter().flat_map(|(_, decoder)| decoder.notes()) {
            if !notes.contains(note) {
                notes.push(note.clone());
            }
        }
    }
}
