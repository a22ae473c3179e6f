//! Maps as messages of ROS 2 in an MCAP file, for Foxglove, Rerun, rosbag2 and RViz.
//!
//! | topic | type | holds |
//! |---|---|---|
//! | `/map` | `nav_msgs/msg/OccupancyGrid` | the cells of a 2-D map, rows from the lower left: -1 unknown, 0 free, 100 occupied |
//! | `/occupied` | `sensor_msgs/msg/PointCloud2` | the centers of occupied cells |
//! | `/contour` | `visualization_msgs/msg/Marker` | the segments of a contour, `LINE_LIST` |
//! | `/mesh` | `visualization_msgs/msg/Marker` | the triangles of a mesh, `TRIANGLE_LIST`, counter-clockwise seen from free space |
//!
//! All are in frame `map` and at time 0, as a map holds no times: the same map gives the same bytes, and transforms of any
//! time fit. The definitions of the messages are those of ROS 2 since Humble, without their comments.

mod cdr;
mod messages;
#[cfg(test)]
mod tests;
mod write;

pub use write::{MapMessages, write_map_mcap};
