//! Clouds of points, whatever file they come from.

mod builder;
mod cloud;
mod posed;
mod read;

pub(crate) use builder::{CloudBuilder, PointFields, channel, is_time};
pub use cloud::{CloudGrid, PointCloudFile, RefusedPoints, Viewpoint};
pub use posed::PosedCloud;
pub use read::{PointFormat, parse_points, point_format, read_points, read_posed_clouds};
pub(crate) use read::{has_poses, most_bytes, posed_clouds, read_points_as, scan_of};
