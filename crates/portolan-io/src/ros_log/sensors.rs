//! Which topics are the scans of the log.

use std::path::Path;

use portolan_ros::message::{Compressed, CompressedImage, Image, MessageKind};

use super::{BagChoice, Contents};
use crate::{IoError, Result};

/// The topics whose messages are scans.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sensors {
    /// 2 or 3.
    pub(crate) dimension: usize,
    /// Names of topics.
    pub(crate) names: Vec<String>,
    /// What was chosen without being told.
    pub(crate) guesses: Vec<String>,
}

/// Whether the scans of a bag, as chosen or guessed, are 2-D or 3-D (2 or 3).
///
/// # Errors
/// Those of opening the bag; [`IoError::Layout`] where it has no topic with scans, or a chosen one does not exist.
pub fn bag_dimension(path: &Path, choice: &BagChoice) -> Result<usize> {
    Ok(Contents::open(path, choice)?.sensors(choice)?.dimension)
}

fn is_laser(kind: MessageKind) -> bool {
    matches!(kind, MessageKind::LaserScan | MessageKind::MultiEchoLaserScan)
}

fn is_cloud(kind: MessageKind) -> bool {
    matches!(kind, MessageKind::PointCloud2 | MessageKind::Livox)
}

fn is_picture(kind: MessageKind) -> bool {
    matches!(kind, MessageKind::Image | MessageKind::CompressedImage)
}

impl Contents {
    /// The topics with scans: those that were chosen, else the one with the most messages, of clouds before planar lasers before
    /// depth images.
    pub(crate) fn sensors(&self, choice: &BagChoice) -> Result<Sensors> {
        if !choice.topics.is_empty() {
            return self.chosen(&choice.topics);
        }
        let (clouds, lasers) = (self.topics_of(is_cloud), self.topics_of(is_laser));
        let depths = if clouds.is_empty() && lasers.is_empty() { self.depth_topics() } else { Vec::new() };
        let (dimension, group) = match (clouds.first(), lasers.first(), depths.first()) {
            (Some(_), ..) => (3, &clouds),
            (None, Some(_), _) => (2, &lasers),
            (None, None, Some(_)) => (3, &depths),
            (None, None, None) => {
                let all: Vec<String> = self
                    .bag
                    .topics()
                    .iter()
                    .take(30)
                    .map(|t| format!("{} ({})", t.name, t.type_name))
                    .collect();
                let value = if all.is_empty() { "no topics at all".into() } else { all.join(", ") };
                let advice = "give a bag with LaserScan, PointCloud2, Livox or depth images";
                return Err(IoError::layout(&self.path, "what it holds", value, advice));
            }
        };
        let name = group[0].0.clone();
        let mut others: Vec<&str> =
            clouds.iter().chain(&lasers).chain(&depths).map(|(n, _)| n.as_str()).collect();
        others.retain(|n| *n != name);
        let guesses = if others.is_empty() {
            Vec::new()
        } else {
            vec![format!("scans are those of {name}; the bag has {} as well (--topic)", others.join(", "))]
        };
        Ok(Sensors { dimension, names: vec![name], guesses })
    }

    fn chosen(&self, topics: &[String]) -> Result<Sensors> {
        let mut sensors = Sensors::default();
        for name in topics {
            let number = self.existing(name, "--topic")?;
            let dimension = match self.kind(number) {
                Some(kind) if is_laser(kind) => 2,
                Some(kind) if is_cloud(kind) || is_picture(kind) => 3,
                _ => {
                    let value = &self.bag.topics()[number as usize].type_name;
                    let advice =
                        "--topic takes LaserScan, MultiEchoLaserScan, PointCloud2, Livox and depth images";
                    return Err(IoError::layout(&self.path, format!("the type of {name}"), value, advice));
                }
            };
            if sensors.dimension != 0 && sensors.dimension != dimension {
                let value = format!("{} and {name}", sensors.names.join(", "));
                let advice = "2-D and 3-D scans make different maps; name topics of one kind";
                return Err(IoError::layout(&self.path, "the topics", value, advice));
            }
            let full = self.bag.topics()[number as usize].name.clone();
            sensors.dimension = dimension;
            if !sensors.names.contains(&full) {
                sensors.names.push(full);
            }
        }
        Ok(sensors)
    }

    /// The number of the first topic of a name.
    pub(crate) fn existing(&self, name: &str, option: &str) -> Result<u32> {
        self.numbers(name).first().copied().ok_or_else(|| {
            let mut names: Vec<&str> = self.bag.topics().iter().map(|t| &*t.name).collect();
            names.sort_unstable();
            names.dedup();
            names.truncate(60);
            let advice = format!("the bag has no such topic; it has {}", names.join(", "));
            IoError::layout(&self.path, option, name, advice)
        })
    }

    /// Topics of pictures that are depth, by their first message. Messages that cannot be read are of none.
    pub(crate) fn depth_topics(&self) -> Vec<(String, u64)> {
        let mut found = self.topics_of(is_picture);
        found.retain(|(name, _)| self.is_depth(name).unwrap_or(false));
        found
    }

    fn is_depth(&self, name: &str) -> Result<bool> {
        let numbers = self.numbers(name);
        let decoders = self.decoders(&numbers)?;
        let Some(first) = self.bag.messages(&numbers).first().copied() else { return Ok(false) };
        let compressed = self.kind(first.topic) == Some(MessageKind::CompressedImage);
        self.read(&first, &decoders, |record| {
            Ok(match compressed {
                true => !matches!(CompressedImage::of(record)?.content, Compressed::Color(_)),
                false => Image::of(record)?.format.is_depth(),
            })
        })
    }
}
