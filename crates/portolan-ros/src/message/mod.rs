//! Definitions of messages, bytes to values, and the messages that maps are made of.
//!
//! A [`Decoder`] parses the definition that the file has for a topic (`.msg` of ROS 1 and ROS 2, IDL) and reads each message by
//! it: the definition decides which fields there are and in which order, so that versions of ROS do not matter. A message is
//! a [`Record`], whose values are asked for by name; arrays of numbers stay bytes. [`LaserScan`], [`PointCloud`] and so on are
//! made of records.
//!
//! | file | holds |
//! |---|---|
//! | `schema` | structures and their fields; which definitions are refused |
//! | `ros_msg`, `idl`, `builtin` | where they come from |
//! | `values` | bytes to values: ROS 1 and CDR |
//! | `decoder` | both for a topic |
//! | `laser`, `cloud`, `cloud_times`, `livox`, `image`, `camera_info`, `poses`, `header` | the messages |

mod builtin;
mod camera_info;
mod cloud;
mod cloud_times;
mod decoder;
mod fault;
mod header;
mod idl;
mod image;
mod kind;
mod laser;
mod livox;
mod poses;
mod ros_msg;
mod schema;
#[cfg(test)]
mod tests;
mod values;

pub use camera_info::CameraInfo;
pub use cloud::{ColorFields, PointCloud, PointField};
pub use cloud_times::{PointTimes, TimeBase, TimeUnit};
pub use decoder::{Decoder, Message};
pub use header::{Header, frame_name};
pub use image::{Compressed, CompressedImage, Image, InverseDepth, PixelFormat};
pub use kind::MessageKind;
pub use laser::{EchoChoice, LaserScan};
pub use livox::{LivoxPoint, LivoxScan};
pub use poses::{
    RawTransform, StampedTransform, odometry, path, pose_stamped, pose_with_covariance, transform_stamped,
    transforms,
};
pub use schema::{Count, Definition, Element, Field, Primitive, Structure, type_name};
pub use values::{ByteOrder, Number, Numbers, Record, Records};
