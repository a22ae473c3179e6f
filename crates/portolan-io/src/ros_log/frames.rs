//! 3-D: clouds, Livox messages and depth images of a bag, read when they are asked for.
//!
//! Opening passes over the messages once for their stamps and frames; arrays are not looked at.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use portolan::scan::Frame;
use portolan_ros::container::MessageRef;
use portolan_ros::message::{Header, MessageKind};

use super::clouds::Clouds;
use super::contents::Decoders;
use super::pictures::Pictures;
use super::pose_source::{NoPose, PoseSource, SensorFrames};
use super::{BagLogStats, Contents};
use crate::poses3::RawPose;
use crate::scan_log::{FrameSource, LayoutPoses, Parts, ScanId, ScanLogOptions, UnreadColors};
use crate::{IoError, Result};

/// The most scans of a log.
const MOST_SCANS: usize = 1 << 22;

/// A message with a scan.
#[derive(Clone, Debug)]
pub(super) struct ScanMessage {
    pub(super) message: MessageRef,
    pub(super) header: Header,
    /// Where it was seen from in its frame (meters), where that is not the frame's zero.
    pub(super) origin: Option<[f64; 3]>,
}

/// Opens a bag as a log of 3-D scans.
///
/// # Errors
/// [`IoError::Bag`] for a bag that cannot be read; [`IoError::Layout`] where it has no 3-D scans, no poses, no camera for
/// depth images, or no scan that can be used: with the first reason.
pub(crate) fn open_bag(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let advice = "they are 2-D; name clouds or depth images with --topic for a map in 3-D";
    let (contents, names, mut stats) = Contents::of_scans(path, &options.bag, 3, advice)?;
    let numbers: Vec<u32> = names.iter().flat_map(|name| contents.numbers(name)).collect();
    let decoders = contents.decoders(&numbers)?;
    decoders.notes(&mut stats.notes);
    let mut scans = scan_messages(&contents, &numbers, &decoders, options.bag.time_offset, &mut stats)?;
    let poses = match &options.poses {
        Some(file) => {
            stats.poses = file.display().to_string();
            LayoutPoses::Missing("--poses".into())
        }
        None => poses_of(&contents, options, &mut scans, &mut stats)?,
    };
    if scans.is_empty() {
        let value = format!("0 of {} messages of {}", stats.messages, stats.topics.join(", "));
        let advice = match stats.first_refused.or(stats.first_without_pose) {
            Some(reason) => format!("the first: {reason}; see info for the frames and times of the bag"),
            None => "name another topic with --topic".into(),
        };
        return Err(IoError::layout(path, "the number of scans that can be used", value, advice));
    }
    let clouds = Clouds::new(&contents, &scans, &decoders, options, &mut stats)?;
    let pictures = Pictures::new(&contents, &names, &scans, &decoders, options, &mut stats)?;
    stats.notes.extend(contents.note_of_longer());
    let camera = pictures.camera().cloned();
    let ids = scans.iter().map(|s| ScanId {
        path: PathBuf::from(path),
        number: None,
        time: Some(s.header.stamp as f64 * 1e-9),
    });
    let ids = ids.collect();
    let posed_from_sensor = clouds.files_from_frames();
    let source = BagFrames { contents, decoders, scans, clouds, pictures, unread_colors: Mutex::default() };
    Ok(Parts {
        camera,
        posed_from_sensor,
        bag: Some(Box::new(stats)),
        ..Parts::new(path, source, ids, poses)
    })
}

/// The messages of these topics with their headers, in the order of their log times.
fn scan_messages(
    contents: &Contents,
    numbers: &[u32],
    decoders: &Decoders,
    time_offset: Option<f64>,
    stats: &mut BagLogStats,
) -> Result<Vec<ScanMessage>> {
    let mut scans: Vec<ScanMessage> = Vec::new();
    let mut unstamped = 0u64;
    let visited = contents.bag.for_each(numbers, |message, bytes| {
        stats.messages += 1;
        let Some(decoder) = decoders.find(message.topic) else { return Ok(()) };
        match contents.decode(decoder, bytes).and_then(|record| Header::of(&record)) {
            Ok(mut header) => {
                if header.stamp == 0 {
                    unstamped += 1;
                    header.stamp = message.log_time;
                }
                scans.push(ScanMessage { message, header, origin: None });
            }
            Err(error) => stats.refuse("cannot be read", || error.to_string()),
        }
        Ok::<(), portolan_ros::BagError>(())
    });
    visited.map_err(IoError::bag(&contents.path))?;
    if scans.len() > MOST_SCANS {
        let value = format!("{} scans", scans.len());
        return Err(IoError::layout(&contents.path, "the log", value, "split the bag into parts"));
    }
    if unstamped > 0 {
        stats.notes.push(format!("{unstamped} scans have the stamp 0: the time of their recording is taken"));
    }
    let offset = time_offset.map_or(0, |s| (s * 1e9).round() as i64);
    scans.iter_mut().for_each(|s| s.header.stamp = s.header.stamp.saturating_add(offset));
    scans.sort_by_key(|s| s.message.log_time);
    for scan in &scans {
        if !stats.sensor_frames.contains(&scan.header.frame) {
            stats.sensor_frames.push(scan.header.frame.clone());
        }
    }
    Ok(scans)
}

/// A pose for each scan; those without are taken out and counted.
fn poses_of(
    contents: &Contents,
    options: &ScanLogOptions,
    scans: &mut Vec<ScanMessage>,
    stats: &mut BagLogStats,
) -> Result<LayoutPoses> {
    if scans.is_empty() {
        return Ok(LayoutPoses::PerScan(Vec::new()));
    }
    let frames = stats.sensor_frames.clone();
    let clouds = contents.are_clouds(scans.iter().map(|scan| scan.message.topic));
    let sensors = SensorFrames { names: &frames, clouds };
    let source = PoseSource::choose(contents, &options.bag, options.time_tolerance, sensors, stats)?;
    let mut poses = Vec::with_capacity(scans.len());
    scans.retain_mut(|scan| match source.seen_from(&scan.header.frame, scan.header.stamp) {
        Ok((pose, origin)) => {
            scan.origin = origin;
            let raw = RawPose::new(pose.rotation, pose.translation, 0);
            poses.push(Some((contents.path.clone(), raw)));
            true
        }
        Err(NoPose { missing, text }) => {
            stats.no_pose(&missing, || text);
            false
        }
    });
    Ok(LayoutPoses::PerScan(poses))
}

/// Reads scans of a bag.
struct BagFrames {
    contents: Contents,
    decoders: Decoders,
    scans: Vec<ScanMessage>,
    clouds: Clouds,
    pictures: Pictures,
    /// Why colors of frames that were read could not be, by frame.
    unread_colors: Mutex<BTreeMap<usize, String>>,
}

impl FrameSource for BagFrames {
    fn frame(&self, i: usize) -> Result<Frame> {
        let scan = &self.scans[i];
        match self.contents.kind(scan.message.topic) {
            Some(MessageKind::Image | MessageKind::CompressedImage) => {
                let (image, unread) = self.pictures.frame(&self.contents, &self.decoders, scan)?;
                if let Some(error) = unread {
                    let mut all = self.unread_colors.lock().unwrap_or_else(PoisonError::into_inner);
                    all.insert(i, error.to_string());
                }
                Ok(Frame::Image(image))
            }
            _ => self.clouds.frame(&self.contents, &self.decoders, scan).map(Frame::Points),
        }
    }

    fn origin(&self, i: usize) -> [f64; 3] {
        self.clouds.origin(&self.scans[i])
    }

    fn unread_colors(&self) -> Option<UnreadColors> {
        let unread = self.unread_colors.lock().unwrap_or_else(PoisonError::into_inner);
        let (_, first) = unread.first_key_value()?;
        Some(UnreadColors { pictures: unread.len() as u64, first: first.clone() })
    }
}
