//! What is in a bag, without mapping it.

use std::path::Path;

use portolan_ros::container::TopicSummary;
use portolan_ros::message::Header;
use portolan_ros::transforms::FrameTree;

use super::pose_source::{PoseSource, SensorFrames};
use super::{BagLogStats, Contents};
use crate::scan_log::ScanLogOptions;
use crate::{IoError, Result};

/// How many messages of a topic are looked at for frames and delays.
const LOOKED_AT: usize = 24;

/// A topic of a bag; one of several publishers is listed for each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TopicOfBag {
    /// Its name.
    pub name: String,
    /// The type of its messages.
    pub type_name: String,
    /// Messages.
    pub messages: u64,
    /// Who publishes it, where the bag says so.
    pub publisher: Option<String>,
    /// The first and the last log time (seconds); `None` without messages.
    pub log_times: Option<[f64; 2]>,
    /// Messages a second: by the median time between two; `None` for fewer than two.
    pub rate: Option<f64>,
    /// The longest time between two messages (seconds).
    pub longest_gap: f64,
    /// How often the recorder's clock steps back, and by how much at most (seconds).
    pub steps_back: (u64, f64),
    /// The frames of its headers, of the messages that were looked at.
    pub frames: Vec<String>,
    /// Log time less stamp of the messages that were looked at: the least and the largest (seconds); `None`: no header.
    pub delay: Option<[f64; 2]>,
    /// Whether its messages are read: as scans, poses, transforms or cameras.
    pub is_read: bool,
}

/// An edge of the tree of frames.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeOfBag {
    /// The parent's frame.
    pub parent: String,
    /// The child's frame.
    pub child: String,
    /// Whether it is static.
    pub is_static: bool,
    /// Transforms.
    pub messages: u64,
    /// The first and the last stamp (seconds), where it moves.
    pub stamps: Option<[f64; 2]>,
    /// The median time between transforms (seconds), where it moves.
    pub interval: f64,
    /// The longest time between transforms (seconds), where it moves.
    pub longest_gap: f64,
}

/// What is in a bag.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagInfo {
    /// The container, in words.
    pub container: String,
    /// Files and their bytes.
    pub files: Vec<(String, u64)>,
    /// How many chunks are compressed how; empty for containers without chunks.
    pub chunks: Vec<(&'static str, u64)>,
    /// The first and the last log time (seconds); `None` without messages.
    pub log_times: Option<[f64; 2]>,
    /// All topics, by name.
    pub topics: Vec<TopicOfBag>,
    /// The tree of frames.
    pub edges: Vec<EdgeOfBag>,
    /// The frames without a parent.
    pub roots: Vec<String>,
    /// What `map` would choose, a sentence each; empty where it would refuse the bag.
    pub choices: Vec<String>,
    /// Options for `map` that say what it would choose; `None` where it would refuse the bag, whose reason is in `notes`.
    pub map_options: Option<Vec<String>>,
    /// 2 or 3: the dimension of the map; `None` where there are no scans.
    pub dimension: Option<usize>,
    /// What should be known.
    pub notes: Vec<String>,
}

impl BagInfo {
    /// Looks into a bag. Of [`ScanLogOptions`] `bag` and `time_tolerance` count. Reads all transforms and poses, and some messages of
    /// every other topic.
    ///
    /// # Errors
    /// Those of opening the bag. What `map` would refuse is a note.
    pub fn read(path: impl AsRef<Path>, options: &ScanLogOptions) -> Result<Self> {
        let contents = Contents::open(path.as_ref(), &options.bag)?;
        let bag = &contents.bag;
        let summary = bag.summary().map_err(IoError::bag(path.as_ref()))?;
        let mut info = Self {
            container: bag.kind().map_or("no file".into(), |kind| kind.to_string()),
            files: bag.files().map(|(name, bytes)| (name.to_owned(), bytes)).collect(),
            log_times: summary.log_times.map(|(a, b)| [a, b].map(seconds)),
            chunks: summary.chunks.into_iter().collect(),
            notes: bag.notes().to_vec(),
            ..Self::default()
        };
        info.topics =
            (0u32..).zip(&summary.topics).map(|(number, about)| topic(&contents, number, about)).collect();
        info.topics.sort_by(|a, b| (&a.name, &a.publisher).cmp(&(&b.name, &b.publisher)));
        let tree = info.choose(&contents, options)?;
        info.roots = tree.roots().into_iter().map(str::to_owned).collect();
        info.edges = tree
            .edges()
            .map(|e| EdgeOfBag {
                parent: e.parent.to_owned(),
                child: e.child.to_owned(),
                is_static: e.is_static,
                messages: e.messages,
                stamps: e.span.map(|(a, b)| [seconds(a), seconds(b)]),
                interval: e.usual_interval,
                longest_gap: e.largest_gap,
            })
            .collect();
        Ok(info)
    }

    /// What `map` would choose; the tree on the way.
    fn choose(&mut self, contents: &Contents, options: &ScanLogOptions) -> Result<FrameTree> {
        let sensors = match contents.sensors(&options.bag) {
            Ok(sensors) => sensors,
            Err(error) => {
                self.notes.push(error.to_string());
                return contents.tree(&mut self.notes);
            }
        };
        self.dimension = Some(sensors.dimension);
        let mut frames: Vec<String> = sensors
            .names
            .iter()
            .flat_map(|name| self.topics.iter().filter(move |t| t.name == *name))
            .flat_map(|t| t.frames.clone())
            .collect();
        frames.dedup();
        let mut stats = BagLogStats { guesses: sensors.guesses, ..BagLogStats::default() };
        let clouds = contents.are_clouds(sensors.names.iter().flat_map(|name| contents.numbers(name)));
        let of = SensorFrames { names: &frames, clouds };
        match PoseSource::choose(contents, &options.bag, options.time_tolerance, of, &mut stats) {
            Ok(source) => {
                let mut words: Vec<String> =
                    sensors.names.iter().flat_map(|name| ["--topic".to_owned(), name.clone()]).collect();
                if let Some(topic) = source.topic() {
                    words.extend(["--pose-topic".into(), topic.to_owned()]);
                }
                if !stats.fixed_frame.is_empty() {
                    words.extend(["--fixed-frame".into(), stats.fixed_frame.clone()]);
                }
                self.map_options = Some(words);
                self.choices = vec![format!("scans of {}, poses: {}", sensors.names.join(", "), stats.poses)];
                self.choices.extend(stats.guesses);
                self.notes.extend(stats.notes);
                Ok(source.tree().clone())
            }
            Err(error) => {
                let tree = contents.tree(&mut self.notes)?;
                self.notes.push(error.to_string());
                Ok(tree)
            }
        }
    }
}

fn seconds(nanoseconds: i64) -> f64 {
    nanoseconds as f64 * 1e-9
}

fn topic(contents: &Contents, number: u32, summary: &TopicSummary) -> TopicOfBag {
    let about = &contents.bag.topics()[number as usize];
    let mut topic = TopicOfBag {
        name: about.name.clone(),
        type_name: about.type_name.clone(),
        messages: summary.messages,
        publisher: about.publisher.clone(),
        log_times: summary.log_times.map(|(a, b)| [a, b].map(seconds)),
        rate: summary.rate,
        longest_gap: summary.largest_gap.map_or(0.0, |(_, gap)| gap as f64 * 1e-9),
        steps_back: (summary.steps_back, summary.largest_step_back as f64 * 1e-9),
        is_read: contents.kind(number).is_some(),
        ..TopicOfBag::default()
    };
    // Topics of other types may have headers, too; those without, or whose definition is not there, have nothing to show.
    if let Ok(decoders) = contents.decoders(&[number]) {
        let own = contents.bag.messages(&[number]);
        for message in own.iter().step_by(own.len().div_ceil(LOOKED_AT).max(1)) {
            let Ok(header) = contents.read(message, &decoders, Header::of) else { break };
            if !topic.frames.contains(&header.frame) {
                topic.frames.push(header.frame);
            }
            if header.stamp != 0 {
                let delay = seconds(message.log_time - header.stamp);
                let [least, most] = topic.delay.unwrap_or([delay; 2]);
                topic.delay = Some([least.min(delay), most.max(delay)]);
            }
        }
    }
    topic
}
