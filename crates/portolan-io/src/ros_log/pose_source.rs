//! Where the poses of sensors come from.

use portolan::geom::Pose;
use portolan_ros::message::{
    MessageKind, Record, StampedTransform, frame_name, odometry, path, pose_stamped, pose_with_covariance,
    transform_stamped,
};
use portolan_ros::transforms::{FrameTree, NoTransform, Track, TrackBuilder};

use super::{BagChoice, BagLogStats, Contents};
use crate::{IoError, Result};

/// Poses of sensors in the fixed frame.
pub(crate) struct PoseSource {
    tree: FrameTree,
    fixed: String,
    /// The poses of a topic; `None`: the tree has them.
    topic: Option<PoseTopic>,
    tolerance: f64,
    /// Scans are in a frame in which the robot moves: that of the map, into which a SLAM has moved its clouds already.
    registered: Option<Registered>,
}

/// The frames of the scans.
#[derive(Clone, Copy)]
pub(crate) struct SensorFrames<'a> {
    pub(crate) names: &'a [String],
    /// Whether all scans are clouds.
    pub(crate) clouds: bool,
}

/// What scans of the map's own frame were seen from.
struct Registered {
    /// The frame of the scans.
    frame: String,
    /// The frame whose position counts; `None`: the poses of the topic.
    body: Option<String>,
}

struct PoseTopic {
    name: String,
    track: Track,
    /// The frame of its poses.
    frame: String,
    /// The frame whose poses they are; `None`: the sensor itself.
    body: Option<String>,
}

/// Why a scan has no pose: what is missing, for counting, and in full.
pub(crate) struct NoPose {
    pub(crate) missing: String,
    pub(crate) text: String,
}

/// Frames of bodies, in the order in which they are looked for.
const BODIES: [&str; 3] = ["base_link", "base_footprint", "base"];

impl PoseSource {
    /// Chooses where poses come from: the topic that was named; else the tree, where it has the sensors' frames; else the only
    /// or longest topic of poses. What is chosen, and what else there is, goes into `stats`.
    ///
    /// # Errors
    /// [`IoError::Layout`] where there are no poses, or a named frame or topic is not there.
    pub(crate) fn choose(
        contents: &Contents,
        choice: &BagChoice,
        tolerance: f64,
        SensorFrames { names: sensor_frames, clouds }: SensorFrames<'_>,
        stats: &mut BagLogStats,
    ) -> Result<Self> {
        let tree = contents.tree(&mut stats.notes)?;
        let topics = contents.topics_of(MessageKind::is_pose);
        let sensor = sensor_frames.first().map_or("", |f| f);
        let moves = |frame: &str| tree.chain(frame).iter().any(|edge| !edge.is_static);
        let in_tree = sensor_frames.iter().all(|f| tree.has(f));
        let topic = match (&choice.pose_topic, topics.first()) {
            (Some(name), _) => Some(name.clone()),
            (None, _) if in_tree && moves(sensor) => None,
            (None, Some((name, _))) => {
                let why = if in_tree {
                    "no transform of the tree moves"
                } else {
                    "the tree of frames does not have"
                };
                stats.guesses.push(format!("poses are those of {name}: {why} {sensor}"));
                Some(name.clone())
            }
            (None, None) if in_tree => {
                stats.guesses.push(format!("{sensor} does not move: all transforms above it are static"));
                None
            }
            (None, None) => {
                let value = if tree.frames().is_empty() { "none" } else { "none of the sensor's frame" };
                let advice = format!(
                    "the scans are of frame \"{sensor}\"{}; give poses with --poses FILE",
                    if tree.frames().is_empty() {
                        String::new()
                    } else {
                        format!(", transforms of {}", tree.frames().join(", "))
                    }
                );
                return Err(IoError::layout(&contents.path, "where poses are", value, advice));
            }
        };
        let scans = (sensor, clouds);
        let topic =
            topic.map(|name| PoseTopic::read(contents, &name, choice, &tree, scans, stats)).transpose()?;
        // A laser's ranges are always seen from its own zero, whatever its frame is called.
        let registered = if clouds { registered(topic.as_ref(), choice, &tree, sensor, stats) } else { None };
        let fixed = match (&choice.fixed_frame, &topic) {
            (Some(frame), _) => frame_name(frame).to_owned(),
            (None, Some(topic)) => topic.frame.clone(),
            (None, None) => fixed_above(&tree, sensor),
        };
        if let Some(named) = &choice.fixed_frame
            && !tree.has(&fixed)
            && topic.as_ref().is_none_or(|t| t.frame != fixed)
        {
            let known = match &topic {
                Some(topic) => format!("{} has poses in \"{}\"", topic.name, topic.frame),
                None => format!("the bag has {}", tree.frames().join(", ")),
            };
            return Err(IoError::layout(&contents.path, "--fixed-frame", named, known));
        }
        if choice.fixed_frame.is_none() {
            stats.guesses.push(format!("the map's frame is \"{fixed}\" (--fixed-frame)"));
        }
        if topic.is_none() && !topics.is_empty() {
            let names: Vec<&str> = topics.iter().map(|(n, _)| &**n).collect();
            stats.guesses.push(format!(
                "poses are those of the tree of frames; the bag has {} as well (--pose-topic)",
                names.join(", ")
            ));
        }
        stats.fixed_frame.clone_from(&fixed);
        stats.poses = match &topic {
            None => {
                let mut chain: Vec<&str> = tree.chain(sensor).iter().map(|e| e.parent).collect();
                chain.reverse();
                chain.push(sensor);
                format!("transforms {}", chain.join(" > "))
            }
            Some(topic) => match &topic.body {
                None if registered.is_some() => {
                    format!("scans are in the map's frame, seen from the poses of topic {}", topic.name)
                }
                None => format!("topic {}, taken as poses of the sensor", topic.name),
                Some(body) => {
                    format!("topic {} of {body}, and transforms from {body} to the sensor", topic.name)
                }
            },
        };
        Ok(Self { tree, fixed, topic, tolerance, registered })
    }

    /// The tree of frames.
    pub(crate) fn tree(&self) -> &FrameTree {
        &self.tree
    }

    /// The topic that has the poses; `None`: the tree has them.
    pub(crate) fn topic(&self) -> Option<&str> {
        self.topic.as_ref().map(|t| &*t.name)
    }

    /// Where a scan was seen from, in its own frame (meters), at a stamp (nanoseconds): `None` where that is the zero of a sensor's
    /// frame. Scans that were moved into the map's frame were seen from where the robot was.
    fn origin(&self, sensor: &str, stamp: i64) -> Result<Option<[f64; 3]>, NoPose> {
        let Some(registered) = self.registered.as_ref().filter(|r| r.frame == sensor) else {
            return Ok(None);
        };
        let pose = match (&registered.body, &self.topic) {
            (None, Some(topic)) => self.on_topic(topic, stamp)?,
            (body, _) => self.in_tree(sensor, body.as_deref().unwrap_or(sensor), stamp)?,
        };
        Ok(Some(pose.translation))
    }

    /// The pose of a scan's frame, and where it was seen from in it.
    pub(crate) fn seen_from(&self, sensor: &str, stamp: i64) -> Result<(Pose<3>, Option<[f64; 3]>), NoPose> {
        Ok((self.at(sensor, stamp)?, self.origin(sensor, stamp)?))
    }

    fn in_tree(&self, target: &str, source: &str, stamp: i64) -> Result<Pose<3>, NoPose> {
        self.tree.lookup(target, source, stamp, self.tolerance).map_err(|cause| NoPose {
            missing: match &cause {
                NoTransform::Time { parent, child, .. } => format!("transform {parent} > {child}"),
                other => other.to_string(),
            },
            text: format!("{cause} (stamp {:.3} s)", stamp as f64 * 1e-9),
        })
    }

    fn on_topic(&self, topic: &PoseTopic, stamp: i64) -> Result<Pose<3>, NoPose> {
        topic.track.at(stamp, self.tolerance).map_err(|cause| NoPose {
            missing: format!("topic {}", topic.name),
            text: format!("topic {}: {cause} (stamp {:.3} s)", topic.name, stamp as f64 * 1e-9),
        })
    }

    /// The pose of a frame in the fixed frame at a stamp (nanoseconds).
    pub(crate) fn at(&self, sensor: &str, stamp: i64) -> Result<Pose<3>, NoPose> {
        let lookup = |target: &str, source: &str| self.in_tree(target, source, stamp);
        let Some(topic) = &self.topic else { return lookup(&self.fixed, sensor) };
        if self.registered.as_ref().is_some_and(|r| r.frame == sensor) {
            return if topic.frame == self.fixed { Ok(Pose::IDENTITY) } else { lookup(&self.fixed, sensor) };
        }
        let frame_from_body = self.on_topic(topic, stamp)?;
        let fixed_from_body = match topic.frame == self.fixed {
            true => frame_from_body,
            false => lookup(&self.fixed, &topic.frame)? * frame_from_body,
        };
        match &topic.body {
            None => Ok(fixed_from_body),
            Some(body) => Ok(fixed_from_body * lookup(body, sensor)?),
        }
    }
}

/// Whether scans of this frame were moved into the frame in which poses are, and what they were seen from then.
fn registered(
    topic: Option<&PoseTopic>,
    choice: &BagChoice,
    tree: &FrameTree,
    sensor: &str,
    stats: &mut BagLogStats,
) -> Option<Registered> {
    let moves_below = |frame: &str| {
        let chain = tree.chain(frame);
        let below = chain.iter().position(|e| e.parent == sensor);
        below.is_some_and(|top| chain[..=top].iter().any(|edge| !edge.is_static))
    };
    let moves = tree.chain(sensor).iter().any(|edge| !edge.is_static);
    let named = choice.base_frame.as_deref().map(frame_name).filter(|frame| moves_below(frame));
    let (body, who) = if let Some(topic) = topic.filter(|topic| topic.frame == sensor) {
        (None, format!("the poses of {}", topic.name))
    } else if topic.is_some() || moves {
        return None;
    } else if let Some(frame) = named {
        (Some(frame.to_owned()), format!("frame {frame}"))
    } else {
        let known = BODIES.iter().copied().find(|frame| moves_below(frame));
        let below = || tree.edges().find(|e| e.parent == sensor && !e.is_static).map(|e| e.child);
        let frame = known.or_else(below)?;
        (Some(frame.to_owned()), format!("frame {frame} (--base-frame)"))
    };
    stats.guesses.push(format!(
        "scans are in {sensor}, in which the robot moves: they were moved into the map's frame before, and were seen from \
         {who}"
    ));
    Some(Registered { frame: sensor.to_owned(), body })
}

/// The frame of the map: `map` where it is above the sensor, else the top of the tree.
fn fixed_above(tree: &FrameTree, sensor: &str) -> String {
    let above = tree.chain(sensor);
    let map = above.iter().map(|e| e.parent).find(|p| *p == "map");
    map.unwrap_or_else(|| tree.root_of(sensor)).to_owned()
}

impl PoseTopic {
    fn read(
        contents: &Contents,
        name: &str,
        choice: &BagChoice,
        tree: &FrameTree,
        (sensor, clouds): (&str, bool),
        stats: &mut BagLogStats,
    ) -> Result<Self> {
        let number = contents.existing(name, "--pose-topic")?;
        let name = contents.bag.topics()[number as usize].name.clone();
        let Some(kind) = contents.kind(number).filter(|k| k.is_pose()) else {
            let value = &contents.bag.topics()[number as usize].type_name;
            let advice =
                "Odometry, PoseStamped, PoseWithCovarianceStamped, TransformStamped and Path are read";
            return Err(IoError::layout(&contents.path, format!("the type of {name}"), value, advice));
        };
        let numbers = contents.numbers(&name);
        let decoders = contents.decoders(&numbers)?;
        decoders.notes(&mut stats.notes);
        let mut messages = contents.bag.messages(&numbers);
        if kind == MessageKind::Path {
            // Each states the whole way anew.
            messages = messages.last().copied().into_iter().collect();
        }
        let mut builder = TrackBuilder::default();
        let (mut frames, mut children): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
        let (mut bad, mut first_bad) = (0u64, None);
        for message in messages {
            match contents.read(&message, &decoders, |record| poses_of(kind, record)) {
                Ok(poses) => {
                    for StampedTransform { header, child, transform } in poses {
                        builder.add(header.stamp, &transform);
                        for (list, name) in [(&mut frames, header.frame), (&mut children, child)] {
                            if !list.contains(&name) && list.len() < 8 {
                                list.push(name);
                            }
                        }
                    }
                }
                Err(error) => {
                    bad += 1;
                    first_bad.get_or_insert(error);
                }
            }
        }
        if let Some(first) = first_bad {
            stats.notes.push(format!("{bad} messages of {name} could not be read (first: {first})"));
        }
        let track = builder.finish(&name);
        stats.notes.extend(track.notes().iter().cloned());
        if track.is_empty() {
            return Err(IoError::layout(
                &contents.path,
                format!("the number of poses of {name}"),
                0,
                "name another topic",
            ));
        }
        for (what, list) in [("in the frames", &frames), ("of the frames", &children)] {
            if list.len() > 1 {
                stats
                    .notes
                    .push(format!("{name}: poses {what} {}: all are taken as of the first", list.join(", ")));
            }
        }
        let frame = frames.into_iter().next().unwrap_or_default();
        let child = children.into_iter().next().filter(|c| !c.is_empty());
        // Clouds in the frame of the poses were moved there: see `registered`.
        let is_moved = clouds && frame == sensor;
        let body = if is_moved { None } else { body_of(&name, choice, child, tree, sensor, stats) };
        Ok(Self { name, track, frame, body })
    }
}

fn poses_of(kind: MessageKind, record: &Record<'_>) -> portolan_ros::Result<Vec<StampedTransform>> {
    Ok(match kind {
        MessageKind::Odometry => vec![odometry(record)?],
        MessageKind::PoseStamped => vec![pose_stamped(record)?],
        MessageKind::PoseWithCovarianceStamped => vec![pose_with_covariance(record)?],
        MessageKind::TransformStamped => vec![transform_stamped(record)?],
        MessageKind::Path => path(record)?,
        _ => Vec::new(),
    })
}

/// The frame whose poses a topic has; `None` where it is the sensor itself, as far as anyone knows.
fn body_of(
    name: &str,
    choice: &BagChoice,
    child: Option<String>,
    tree: &FrameTree,
    sensor: &str,
    stats: &mut BagLogStats,
) -> Option<String> {
    if let Some(frame) = &choice.base_frame {
        let frame = frame_name(frame).to_owned();
        return (frame != sensor).then_some(frame);
    }
    let leads = |frame: &str| {
        // At any time: an edge that has no pose at zero is there all the same.
        !matches!(
            tree.lookup(frame, sensor, 0, 0.0),
            Err(NoTransform::UnknownFrame(_) | NoTransform::NotConnected { .. })
        )
    };
    match &child {
        Some(child) if child == sensor => None,
        Some(child) if leads(child) => Some(child.clone()),
        _ => {
            let known = BODIES.iter().find(|b| tree.has(b) && leads(b));
            if let Some(body) = known {
                let names = child.map_or("do not say of what".to_owned(), |c| {
                    format!("are of {c}, which the tree does not join to {sensor}")
                });
                stats
                    .guesses
                    .push(format!("the poses of {name} {names}: taken as those of {body} (--base-frame)"));
                return Some((*body).to_owned());
            }
            let of = child.map_or(String::new(), |c| format!(" of {c}"));
            stats.guesses.push(format!(
                "no transform leads from what {name} poses{of} to {sensor}: taken as poses of {sensor} itself (--base-frame)"
            ));
            None
        }
    }
}
