//! Bags that tests write.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::{BagChoice, BagLogStats};
use crate::scan_log::ScanLogOptions;
use crate::testing::temporary;
use crate::{LaserLog, LaserLogStats};

pub(super) const HEADER: &str = "===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
pub(super) const SCAN: &str = "Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\nfloat32 scan_time\n\
    float32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n";
pub(super) const POSE: &str = "===\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n===\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n\
    ===\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
pub(super) const STAMPED: &str = "Header header\ngeometry_msgs/Pose pose\n";
pub(super) const TF: &str = "geometry_msgs/TransformStamped[] transforms\n===\nMSG: geometry_msgs/TransformStamped\nHeader header\nstring child_frame_id\nTransform transform\n\
    ===\nMSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n\
    ===\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
pub(super) const CLOUD: &str = "Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n\
    ===\nMSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n";
pub(super) const IMAGE: &str = "Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n";
pub(super) const INFO: &str = "Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] K\nfloat64[9] R\nfloat64[12] P\n\
    uint32 binning_x\nuint32 binning_y\n";

/// The start of the runs here (seconds): of the world's clock.
pub(super) const START: f64 = 1.7e9;

/// The bytes of a message as ROS 1 has them.
#[derive(Default)]
pub(super) struct Message(pub(super) Vec<u8>);

impl Message {
    pub(super) fn header(time: f64, frame: &str) -> Self {
        let mut m = Self::default();
        m.u32(&[0, time.floor() as u32, ((time - time.floor()) * 1e9).round() as u32]).text(frame);
        m
    }

    pub(super) fn u32(&mut self, all: &[u32]) -> &mut Self {
        all.iter().for_each(|v| self.0.extend(v.to_le_bytes()));
        self
    }

    pub(super) fn f32(&mut self, all: &[f32]) -> &mut Self {
        all.iter().for_each(|v| self.0.extend(v.to_le_bytes()));
        self
    }

    pub(super) fn f64(&mut self, all: &[f64]) -> &mut Self {
        all.iter().for_each(|v| self.0.extend(v.to_le_bytes()));
        self
    }

    pub(super) fn text(&mut self, text: &str) -> &mut Self {
        self.blob(text.as_bytes())
    }

    pub(super) fn blob(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(&[bytes.len() as u32]);
        self.0.extend(bytes);
        self
    }

    pub(super) fn u8(&mut self, v: u8) -> &mut Self {
        self.0.push(v);
        self
    }
}

/// Writes a bag.
pub(super) struct Run {
    writer: mcap::Writer<std::io::Cursor<Vec<u8>>>,
    channels: BTreeMap<String, u16>,
}

impl Run {
    pub(super) fn new() -> Self {
        let writer = mcap::WriteOptions::new().compression(None).create(std::io::Cursor::new(Vec::new()));
        Self { writer: writer.unwrap(), channels: BTreeMap::new() }
    }

    pub(super) fn put(&mut self, topic: &str, kind: &str, text: &str, time: f64, message: &Message) {
        let channel = match self.channels.get(topic) {
            Some(channel) => *channel,
            None => {
                let text = format!("{text}{HEADER}");
                let schema = self.writer.add_schema(kind, "ros1msg", text.as_bytes()).unwrap();
                let channel = self.writer.add_channel(schema, topic, "ros1", &BTreeMap::new()).unwrap();
                self.channels.insert(topic.into(), channel);
                channel
            }
        };
        let nanoseconds = (time * 1e9) as u64;
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: nanoseconds,
            publish_time: nanoseconds,
        };
        self.writer.write_to_known_channel(&header, &message.0).unwrap();
    }

    /// Bearings from `first` by `step`; a range of 0.5 to 10 m is declared.
    pub(super) fn scan(
        &mut self,
        topic: &str,
        frame: &str,
        time: f64,
        [first, step]: [f32; 2],
        ranges: &[f32],
    ) {
        self.scan_at(topic, frame, time, time, [first, step], ranges);
    }

    pub(super) fn scan_at(
        &mut self,
        topic: &str,
        frame: &str,
        log: f64,
        time: f64,
        [first, step]: [f32; 2],
        ranges: &[f32],
    ) {
        let mut m = Message::header(time, frame);
        m.f32(&[first, 0.0, step, 0.0, 0.0, 0.5, 10.0]).u32(&[ranges.len() as u32]).f32(ranges).u32(&[0]);
        self.put(topic, "sensor_msgs/LaserScan", SCAN, log, &m);
    }

    pub(super) fn transform(&mut self, topic: &str, [parent, child]: [&str; 2], time: f64, pose: [f64; 7]) {
        let mut m = Message::default();
        m.u32(&[1]);
        m.0.extend(Message::header(time, parent).0);
        m.text(child).f64(&pose);
        self.put(topic, "tf2_msgs/TFMessage", TF, time, &m);
    }

    pub(super) fn pose(&mut self, topic: &str, frame: &str, time: f64, pose: [f64; 7]) {
        let mut m = Message::header(time, frame);
        m.f64(&pose);
        self.put(topic, "geometry_msgs/PoseStamped", &format!("{STAMPED}{POSE}"), time, &m);
    }

    /// Points of x, y, z as `f32`, a color, a time in nanoseconds.
    pub(super) fn cloud(&mut self, topic: &str, frame: &str, time: f64, points: &[[f32; 3]]) {
        let mut data = Message::default();
        for (i, p) in points.iter().enumerate() {
            data.f32(p).u32(&[0x00ff_8000 + i as u32, 1_000_000 * i as u32]);
        }
        let mut m = Message::header(time, frame);
        m.u32(&[1, points.len() as u32, 5]);
        for (name, offset, kind) in [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("rgb", 12, 7), ("t", 16, 6)] {
            m.text(name).u32(&[offset]).u8(kind).u32(&[1]);
        }
        m.u8(0).u32(&[20, 20 * points.len() as u32]).blob(&data.0).u8(1);
        self.put(topic, "sensor_msgs/PointCloud2", CLOUD, time, &m);
    }

    pub(super) fn image(&mut self, topic: &str, frame: &str, time: f64, encoding: &str, data: &[u8]) {
        let mut m = Message::header(time, frame);
        m.u32(&[2, 3]).text(encoding).u8(0).u32(&[data.len() as u32 / 2]).blob(data);
        self.put(topic, "sensor_msgs/Image", IMAGE, time, &m);
    }

    pub(super) fn bytes(mut self) -> Vec<u8> {
        self.writer.finish().unwrap();
        self.writer.into_inner().into_inner()
    }

    pub(super) fn save(self) -> (tempfile::TempDir, PathBuf) {
        let (folder, path) = temporary("run.mcap");
        std::fs::write(&path, self.bytes()).unwrap();
        (folder, path)
    }
}

pub(super) const LEVEL: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

pub(super) fn at(x: f64, y: f64, z: f64, [a, b, c, d]: [f64; 4]) -> [f64; 7] {
    [x, y, z, a, b, c, d]
}

/// A robot that drives 1 m/s along x of `odom`, with a laser 0.2 m before and 0.3 m above its base.
pub(super) fn robot() -> Run {
    let mut run = Run::new();
    for k in 0..31 {
        let t = 0.05 * f64::from(k);
        run.transform("/tf", ["/odom", "/base_link"], START + t, at(t, 0.0, 0.0, LEVEL));
    }
    run
}

pub(super) fn options(choice: BagChoice) -> ScanLogOptions {
    ScanLogOptions { bag: choice, ..ScanLogOptions::default() }
}

pub(super) fn stats(log: &LaserLog) -> &BagLogStats {
    match log.stats() {
        LaserLogStats::Bag(stats) => stats,
        LaserLogStats::Carmen(_) => panic!("a bag"),
    }
}
