//! Messages with poses: transforms, odometry, stamped poses, paths. Numbers are as they are: not checked.

use super::header::{Header, frame_name};
use super::values::Record;
use crate::Result;

/// A pose of a message: `target_from_source`, numbers as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawTransform {
    /// Position (meters).
    pub translation: [f64; 3],
    /// Orientation `(x, y, z, w)`; perhaps not of length one, perhaps zero.
    pub quaternion: [f64; 4],
}

/// A pose at a time: `frame_from_child`.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedTransform {
    /// The time, and the frame in which the pose is.
    pub header: Header,
    /// The frame whose pose it is, without a leading slash; empty where the message names none.
    pub child: String,
    /// The pose.
    pub transform: RawTransform,
}

/// The transforms of a `tf2_msgs/TFMessage` or `tf/tfMessage`.
///
/// # Errors
/// [`BagError::Message`](crate::BagError) for fields that are missing or of another kind. So below.
pub fn transforms(message: &Record<'_>) -> Result<Vec<StampedTransform>> {
    let one = |record: Result<Record<'_>>| {
        let record = record?;
        let transform = record.record("transform")?;
        let transform = RawTransform {
            translation: vector(transform.record("translation")?)?,
            quaternion: quaternion(transform.record("rotation")?)?,
        };
        let child = frame_name(&record.text("child_frame_id")?).to_owned();
        Ok(StampedTransform { header: Header::of(&record)?, child, transform })
    };
    message.records("transforms")?.iter().map(one).collect()
}

/// The pose of a `nav_msgs/Odometry`.
///
/// # Errors
/// As [`transforms`].
pub fn odometry(message: &Record<'_>) -> Result<StampedTransform> {
    let child = frame_name(&message.text("child_frame_id")?).to_owned();
    let transform = pose(message.record("pose")?.record("pose")?)?;
    Ok(StampedTransform { header: Header::of(message)?, child, transform })
}

/// The pose of a `geometry_msgs/PoseStamped`.
///
/// # Errors
/// As [`transforms`].
pub fn pose_stamped(message: &Record<'_>) -> Result<StampedTransform> {
    let transform = pose(message.record("pose")?)?;
    Ok(StampedTransform { header: Header::of(message)?, child: String::new(), transform })
}

/// The pose of a `geometry_msgs/PoseWithCovarianceStamped`.
///
/// # Errors
/// As [`transforms`].
pub fn pose_with_covariance(message: &Record<'_>) -> Result<StampedTransform> {
    let transform = pose(message.record("pose")?.record("pose")?)?;
    Ok(StampedTransform { header: Header::of(message)?, child: String::new(), transform })
}

/// The transform of a `geometry_msgs/TransformStamped` (motion capture).
///
/// # Errors
/// As [`transforms`].
pub fn transform_stamped(message: &Record<'_>) -> Result<StampedTransform> {
    let transform = message.record("transform")?;
    let transform = RawTransform {
        translation: vector(transform.record("translation")?)?,
        quaternion: quaternion(transform.record("rotation")?)?,
    };
    let child = frame_name(&message.text("child_frame_id")?).to_owned();
    Ok(StampedTransform { header: Header::of(message)?, child, transform })
}

/// The poses of a `nav_msgs/Path`, which is stated anew as a whole in each message: the last one counts. A pose whose own
/// frame is empty has that of the path.
///
/// # Errors
/// As [`transforms`].
pub fn path(message: &Record<'_>) -> Result<Vec<StampedTransform>> {
    let frame = Header::of(message)?.frame;
    let one = |record: Result<Record<'_>>| {
        let mut found = pose_stamped(&record?)?;
        if found.header.frame.is_empty() {
            found.header.frame.clone_from(&frame);
        }
        Ok(found)
    };
    message.records("poses")?.iter().map(one).collect()
}

fn pose(pose: &Record<'_>) -> Result<RawTransform> {
    Ok(RawTransform {
        translation: vector(pose.record("position")?)?,
        quaternion: quaternion(pose.record("orientation")?)?,
    })
}

fn vector(v: &Record<'_>) -> Result<[f64; 3]> {
    Ok([v.number("x")?, v.number("y")?, v.number("z")?])
}

fn quaternion(q: &Record<'_>) -> Result<[f64; 4]> {
    Ok([q.number("x")?, q.number("y")?, q.number("z")?, q.number("w")?])
}
