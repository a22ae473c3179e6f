//! The usual definitions, for files that do not have them: sqlite3 bags before ROS 2 Iron.
//!
//! They have been the same in every version of ROS 2 for the types here. A definition in the file always comes first.

use super::fault::Fault;
use super::ros_msg;
use super::schema::{Count, Dialect, Primitive, RawElement, RawField, RawStructure, type_name};

/// Types with their fields, one a `;`.
const TYPES: [(&str, &str); 32] = [
    ("std_msgs/Header", "builtin_interfaces/Time stamp; string frame_id"),
    ("geometry_msgs/Vector3", "float64 x; float64 y; float64 z"),
    ("geometry_msgs/Point", "float64 x; float64 y; float64 z"),
    ("geometry_msgs/Quaternion", "float64 x; float64 y; float64 z; float64 w"),
    ("geometry_msgs/Pose", "Point position; Quaternion orientation"),
    ("geometry_msgs/Transform", "Vector3 translation; Quaternion rotation"),
    ("geometry_msgs/Twist", "Vector3 linear; Vector3 angular"),
    ("geometry_msgs/PoseWithCovariance", "Pose pose; float64[36] covariance"),
    ("geometry_msgs/TwistWithCovariance", "Twist twist; float64[36] covariance"),
    ("geometry_msgs/PoseStamped", "std_msgs/Header header; Pose pose"),
    ("geometry_msgs/PoseWithCovarianceStamped", "std_msgs/Header header; PoseWithCovariance pose"),
    ("geometry_msgs/TransformStamped", "std_msgs/Header header; string child_frame_id; Transform transform"),
    ("tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms"),
    ("tf/tfMessage", "geometry_msgs/TransformStamped[] transforms"),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header; string child_frame_id; geometry_msgs/PoseWithCovariance pose; geometry_msgs/TwistWithCovariance twist",
    ),
    ("nav_msgs/Path", "std_msgs/Header header; geometry_msgs/PoseStamped[] poses"),
    (
        "sensor_msgs/LaserScan",
        "std_msgs/Header header; float32 angle_min; float32 angle_max; float32 angle_increment; float32 time_increment; \
         float32 scan_time; float32 range_min; float32 range_max; float32[] ranges; float32[] intensities",
    ),
    ("sensor_msgs/LaserEcho", "float32[] echoes"),
    (
        "sensor_msgs/MultiEchoLaserScan",
        "std_msgs/Header header; float32 angle_min; float32 angle_max; float32 angle_increment; float32 time_increment; \
         float32 scan_time; float32 range_min; float32 range_max; LaserEcho[] ranges; LaserEcho[] intensities",
    ),
    ("sensor_msgs/PointField", "string name; uint32 offset; uint8 datatype; uint32 count"),
    (
        "sensor_msgs/PointCloud2",
        "std_msgs/Header header; uint32 height; uint32 width; PointField[] fields; bool is_bigendian; uint32 point_step; \
         uint32 row_step; uint8[] data; bool is_dense",
    ),
    (
        "sensor_msgs/Image",
        "std_msgs/Header header; uint32 height; uint32 width; string encoding; uint8 is_bigendian; uint32 step; uint8[] data",
    ),
    ("sensor_msgs/CompressedImage", "std_msgs/Header header; string format; uint8[] data"),
    (
        "sensor_msgs/RegionOfInterest",
        "uint32 x_offset; uint32 y_offset; uint32 height; uint32 width; bool do_rectify",
    ),
    (
        "sensor_msgs/CameraInfo",
        "std_msgs/Header header; uint32 height; uint32 width; string distortion_model; float64[] d; float64[9] k; \
         float64[9] r; float64[12] p; uint32 binning_x; uint32 binning_y; RegionOfInterest roi",
    ),
    (
        "sensor_msgs/Imu",
        "std_msgs/Header header; geometry_msgs/Quaternion orientation; float64[9] orientation_covariance; \
         geometry_msgs/Vector3 angular_velocity; float64[9] angular_velocity_covariance; \
         geometry_msgs/Vector3 linear_acceleration; float64[9] linear_acceleration_covariance",
    ),
    ("livox_ros_driver/CustomPoint", LIVOX_POINT),
    ("livox_ros_driver2/CustomPoint", LIVOX_POINT),
    ("livox_interfaces/CustomPoint", LIVOX_POINT),
    ("livox_ros_driver/CustomMsg", LIVOX),
    ("livox_ros_driver2/CustomMsg", LIVOX),
    ("livox_interfaces/CustomMsg", LIVOX),
];

const LIVOX_POINT: &str =
    "uint32 offset_time; float32 x; float32 y; float32 z; uint8 reflectivity; uint8 tag; uint8 line";
const LIVOX: &str = "std_msgs/Header header; uint64 timebase; uint32 point_num; uint8 lidar_id; uint8[3] rsvd; CustomPoint[] points";

/// The usual structure of a name; `None` where it is not of those that are read.
pub(super) fn structure(name: &str) -> Result<Option<RawStructure>, Fault> {
    let Some((name, fields)) = TYPES.iter().find(|(known, _)| *known == name) else { return Ok(None) };
    Ok(ros_msg::parse(name, &fields.replace("; ", "\n"), Dialect::Ros2)?.into_iter().next())
}

/// Whether the usual definition of a type is known.
pub(super) fn is_known(name: &str) -> bool {
    let name = type_name(name);
    TYPES.iter().any(|(known, _)| *known == name)
}

/// Times, which definitions of ROS 1 take for granted, and ROS 2 has in a package of its own.
pub(super) fn clock(name: &str, dialect: Dialect) -> Option<RawStructure> {
    use Primitive::{I32, U32};
    let (first, second) = match (name, dialect) {
        ("time", Dialect::Ros1) => (("secs", U32), "nsecs"),
        ("duration", Dialect::Ros1) => (("secs", I32), "nsecs"),
        ("builtin_interfaces/Time" | "builtin_interfaces/Duration", _) => (("sec", I32), "nanosec"),
        _ => return None,
    };
    let kind = if name == "duration" { I32 } else { U32 };
    let field = |name: &str, kind| RawField {
        name: name.into(),
        element: RawElement::Number(kind),
        count: Count::One,
    };
    Some(RawStructure { name: name.into(), fields: vec![field(first.0, first.1), field(second, kind)] })
}

#[cfg(test)]
mod tests {
    use super::super::schema::link;
    use super::*;

    #[test]
    fn every_usual_definition_is_whole() {
        for (i, (name, _)) in TYPES.iter().enumerate() {
            let found = structure(name).unwrap().unwrap();
            link(name, vec![found], Dialect::Ros2).unwrap_or_else(|e| panic!("{name}: {}", e.of("")));
            assert!(is_known(&name.replace('/', "/msg/")) && TYPES[..i].iter().all(|(n, _)| n != name));
        }
        assert!(structure("std_msgs/Nothing").unwrap().is_none() && !is_known("std_msgs/Nothing"));
    }
}
