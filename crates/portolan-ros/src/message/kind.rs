//! Which messages are read.

use super::schema::type_name;

/// A type of message that maps are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)] // Their names are those of ROS.
pub enum MessageKind {
    LaserScan,
    MultiEchoLaserScan,
    PointCloud2,
    Livox,
    Image,
    CompressedImage,
    CameraInfo,
    Transforms,
    Odometry,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
    Path,
}

impl MessageKind {
    /// The kind of a type's name, in the writing of ROS 1 or ROS 2; `None` for types that are not read.
    pub fn of(name: &str) -> Option<Self> {
        Some(match type_name(name).as_str() {
            "sensor_msgs/LaserScan" => Self::LaserScan,
            "sensor_msgs/MultiEchoLaserScan" => Self::MultiEchoLaserScan,
            "sensor_msgs/PointCloud2" => Self::PointCloud2,
            "livox_ros_driver/CustomMsg" | "livox_ros_driver2/CustomMsg" | "livox_interfaces/CustomMsg" => {
                Self::Livox
            }
            "sensor_msgs/Image" => Self::Image,
            "sensor_msgs/CompressedImage" => Self::CompressedImage,
            "sensor_msgs/CameraInfo" => Self::CameraInfo,
            "tf2_msgs/TFMessage" | "tf/tfMessage" => Self::Transforms,
            "nav_msgs/Odometry" => Self::Odometry,
            "geometry_msgs/PoseStamped" => Self::PoseStamped,
            "geometry_msgs/PoseWithCovarianceStamped" => Self::PoseWithCovarianceStamped,
            "geometry_msgs/TransformStamped" => Self::TransformStamped,
            "nav_msgs/Path" => Self::Path,
            _ => return None,
        })
    }

    /// Whether its messages are poses of one body, one after the other or all at once.
    pub fn is_pose(self) -> bool {
        use MessageKind::*;
        matches!(self, Odometry | PoseStamped | PoseWithCovarianceStamped | TransformStamped | Path)
    }
}
