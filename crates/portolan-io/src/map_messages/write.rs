//! The file.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};
use portolan::geom::Grid;
use portolan::surface::Mesh;

use super::messages::{contour_marker, is_far, mesh_marker, occupancy_grid, point_cloud};
use crate::map_server::MapCell;
use crate::{IoError, Polyline, Result, write_atomic};

const OCCUPANCY_GRID: &str = include_str!("definitions/OccupancyGrid.msg");
const POINT_CLOUD2: &str = include_str!("definitions/PointCloud2.msg");
const MARKER: &str = include_str!("definitions/Marker.msg");

/// The last message is kept for subscribers that come late: a map that is played once is seen by all.
const PROFILE: &str = "\
- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
";

/// What of a map is written; `None`: no message.
#[derive(Clone, Copy, Debug, Default)]
pub struct MapMessages<'a> {
    /// A 2-D map: its grid, by how much that is turned about its origin corner (radians), and a state for each cell, x
    /// fastest, y up.
    pub cells: Option<(&'a Grid<2>, f64, &'a [MapCell])>,
    /// Centers of occupied cells (world, meters); z is 0 in 2-D.
    pub occupied: Option<&'a [[f64; 3]]>,
    /// Lines (world, meters) and how wide they are drawn (meters).
    pub contour: Option<(&'a [Polyline], f64)>,
    /// A surface.
    pub mesh: Option<&'a Mesh>,
}

/// Writes the parts of a map as messages of ROS 2, in an MCAP file that is not compressed. Memory: twice the largest
/// message.
///
/// # Errors
/// [`IoError::Unwritable`] where arrays do not fit together, a coordinate is not finite, or a message would be of 4 GiB or
/// more, which its format cannot hold; else as [`write_atomic`].
pub fn write_map_mcap(path: impl AsRef<Path>, map: &MapMessages<'_>) -> Result<()> {
    let path = path.as_ref();
    check(path, map)?;
    write_atomic(path, |file| {
        write_to(file, map).map_err(|error| match error {
            McapError::Io(error) => error,
            error => io::Error::other(error),
        })
    })
}

fn check(path: &Path, map: &MapMessages<'_>) -> Result<()> {
    let refuse = |field, value: String, advice| Err(IoError::unwritable(path, field, value, advice));
    if let Some((grid, yaw, cells)) = map.cells {
        let [x, y] = grid.lattice.origin;
        let resolution = grid.lattice.resolution;
        if grid.checked_len() != Some(cells.len()) || cells.is_empty() {
            let value = format!("{:?} for {} cells", grid.shape, cells.len());
            return refuse("the map size", value, "give one value per cell, at least one");
        }
        if !(resolution > 0.0 && [resolution, x, y, yaw].iter().all(|v| v.is_finite())) {
            let value = format!("{resolution} at {x} {y} {yaw}");
            return refuse("the resolution", value, "give finite values, above zero");
        }
    }
    let occupied = map.occupied.unwrap_or_default();
    let (lines, width) = map.contour.unwrap_or_default();
    if !occupied.iter().flatten().chain(lines.iter().flatten().flatten()).all(|v| v.is_finite()) {
        return refuse("a point", "not finite".into(), "give finite coordinates");
    }
    if map.contour.is_some() && !(width > 0.0 && width.is_finite()) {
        return refuse("the width of lines", width.to_string(), "give a finite width above zero");
    }
    if let Some(mesh) = map.mesh {
        crate::mesh::check(path, mesh)?;
    }
    let cells = map.cells.map_or(0, |(.., cells)| cells.len() as u64);
    let points = occupied.len() as u64 * if is_far(occupied) { 24 } else { 12 };
    let segments: u64 = lines.iter().map(|line| line.len().saturating_sub(1) as u64).sum();
    let mesh = map.mesh.map_or(0, |m| m.triangles.len() as u64 * if m.colors.is_empty() { 72 } else { 120 });
    let sizes = [("/map", cells), ("/occupied", points), ("/contour", 48 * segments), ("/mesh", mesh)];
    for (topic, bytes) in sizes {
        if bytes > u64::from(u32::MAX) - 1024 {
            let value = format!("{bytes} bytes for {topic}");
            return refuse("the size of a message", value, "write a part of the map, or larger cells");
        }
    }
    Ok(())
}

fn write_to(file: &mut dyn Write, map: &MapMessages<'_>) -> mcap::McapResult<()> {
    // Pipes are written to, as well.
    let options =
        WriteOptions::new().profile("ros2").library("portolan").compression(None).disable_seeking(true);
    let mut writer = Writer::with_options(NoSeek::new(file), options)?;
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), PROFILE.to_owned())]);
    let mut send = |topic: &str, type_name: &str, definition: &str, message: Vec<u8>| {
        let schema = writer.add_schema(type_name, "ros2msg", definition.as_bytes())?;
        let channel_id = writer.add_channel(schema, topic, "cdr", &metadata)?;
        let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, &message)
    };
    if let Some((grid, yaw, cells)) = map.cells {
        send("/map", "nav_msgs/msg/OccupancyGrid", OCCUPANCY_GRID, occupancy_grid(grid, yaw, cells))?;
    }
    if let Some(points) = map.occupied {
        send("/occupied", "sensor_msgs/msg/PointCloud2", POINT_CLOUD2, point_cloud(points))?;
    }
    let marker = "visualization_msgs/msg/Marker";
    if let Some((lines, width)) = map.contour {
        send("/contour", marker, MARKER, contour_marker(lines, width))?;
    }
    if let Some(mesh) = map.mesh {
        send("/mesh", marker, MARKER, mesh_marker(mesh))?;
    }
    writer.finish()?;
    Ok(())
}
