//! Clouds of points, whatever file they come from.

mod builder;
mod cloud;
mod read;

pub(crate) use builder::{CloudBuilder, PointFields, channel, is_time};
pub use cloud::{CloudGrid, PointCloudFile, RefusedPoints, Viewpoint};
pub use read::{PointFormat, parse_points, point_format, read_points};
pub(crate) use read::{most_bytes, read_points_as};
