//! Bags that are written here, and the real ones.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use portolan::geom::vector::distance;
use portolan::scan::{BeamKind, Frame, RangeLimits};

use super::*;
use crate::scan_log::{ScanLog, ScanLogOptions};
use crate::testing::{no_panic, real_data, says, temporary};
use crate::{FileKind, LaserLog, LaserLogStats, detect, detect_no_return};

const HEADER: &str = "===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
const SCAN: &str = "Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\nfloat32 scan_time\n\
    float32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n";
const POSE: &str = "===\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n===\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n\
    ===\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
const STAMPED: &str = "Header header\ngeometry_msgs/Pose pose\n";
const TF: &str = "geometry_msgs/TransformStamped[] transforms\n===\nMSG: geometry_msgs/TransformStamped\nHeader header\nstring child_frame_id\nTransform transform\n\
    ===\nMSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n\
    ===\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
const CLOUD: &str = "Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n\
    ===\nMSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n";
const IMAGE: &str = "Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n";
const INFO: &str = "Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] K\nfloat64[9] R\nfloat64[12] P\n\
    uint32 binning_x\nuint32 binning_y\n";

/// The start of the runs here (seconds): of the world's clock.
const START: f64 = 1.7e9;

/// The bytes of a message as ROS 1 has them.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn header(time: f64, frame: &str) -> Self {
        let mut m = Self::default();
        m.u32(&[0, time.floor() as u32, ((time - time.floor()) * 1e9).round() as u32]).text(frame);
        m
    }

    fn u32(&mut self, all: &[u32]) -> &mut Self {
        all.iter().for_each(|v| self.0.extend(v.to_le_bytes()));
        self
    }

    fn f32(&mut self, all: &[f32]) -> &mut Self {
        all.iter().for_each(|v| self.0.extend(v.to_le_bytes()));
        self
    }

    fn f64(&mut self, all: &[f64]) -> &mut Self {
        all.iter().for_each(|v| self.0.extend(v.to_le_bytes()));
        self
    }

    fn text(&mut self, text: &str) -> &mut Self {
        self.blob(text.as_bytes())
    }

    fn blob(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(&[bytes.len() as u32]);
        self.0.extend(bytes);
        self
    }

    fn u8(&mut self, v: u8) -> &mut Self {
        self.0.push(v);
        self
    }
}

/// Writes a bag.
struct Run {
    writer: mcap::Writer<std::io::Cursor<Vec<u8>>>,
    channels: BTreeMap<String, u16>,
}

impl Run {
    fn new() -> Self {
        let writer = mcap::WriteOptions::new().compression(None).create(std::io::Cursor::new(Vec::new()));
        Self { writer: writer.unwrap(), channels: BTreeMap::new() }
    }

    fn put(&mut self, topic: &str, kind: &str, text: &str, time: f64, message: &Message) {
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
    fn scan(&mut self, topic: &str, frame: &str, time: f64, [first, step]: [f32; 2], ranges: &[f32]) {
        self.scan_at(topic, frame, time, time, [first, step], ranges);
    }

    fn scan_at(
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

    fn transform(&mut self, topic: &str, [parent, child]: [&str; 2], time: f64, pose: [f64; 7]) {
        let mut m = Message::default();
        m.u32(&[1]);
        m.0.extend(Message::header(time, parent).0);
        m.text(child).f64(&pose);
        self.put(topic, "tf2_msgs/TFMessage", TF, time, &m);
    }

    fn pose(&mut self, topic: &str, frame: &str, time: f64, pose: [f64; 7]) {
        let mut m = Message::header(time, frame);
        m.f64(&pose);
        self.put(topic, "geometry_msgs/PoseStamped", &format!("{STAMPED}{POSE}"), time, &m);
    }

    /// Points of x, y, z as `f32`, a color, a time in nanoseconds.
    fn cloud(&mut self, topic: &str, frame: &str, time: f64, points: &[[f32; 3]]) {
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

    fn image(&mut self, topic: &str, frame: &str, time: f64, encoding: &str, data: &[u8]) {
        let mut m = Message::header(time, frame);
        m.u32(&[2, 3]).text(encoding).u8(0).u32(&[data.len() as u32 / 2]).blob(data);
        self.put(topic, "sensor_msgs/Image", IMAGE, time, &m);
    }

    fn bytes(mut self) -> Vec<u8> {
        self.writer.finish().unwrap();
        self.writer.into_inner().into_inner()
    }

    fn save(self) -> (tempfile::TempDir, PathBuf) {
        let (folder, path) = temporary("run.mcap");
        std::fs::write(&path, self.bytes()).unwrap();
        (folder, path)
    }
}

const LEVEL: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

fn at(x: f64, y: f64, z: f64, [a, b, c, d]: [f64; 4]) -> [f64; 7] {
    [x, y, z, a, b, c, d]
}

/// A robot that drives 1 m/s along x of `odom`, with a laser 0.2 m before and 0.3 m above its base.
fn robot() -> Run {
    let mut run = Run::new();
    for k in 0..31 {
        let t = 0.05 * f64::from(k);
        run.transform("/tf", ["/odom", "/base_link"], START + t, at(t, 0.0, 0.0, LEVEL));
    }
    run
}

fn options(choice: BagChoice) -> ScanLogOptions {
    ScanLogOptions { bag: choice, ..ScanLogOptions::default() }
}

fn stats(log: &LaserLog) -> &BagLogStats {
    match log.stats() {
        LaserLogStats::Bag(stats) => stats,
        LaserLogStats::Carmen(_) => panic!("a bag"),
    }
}

#[test]
fn scans_have_poses_at_their_stamps_and_keep_what_the_sensor_says() {
    let mut run = robot();
    let readings = [1.0, f32::INFINITY, f32::NAN, 10.0, 12.0, 0.25, 0.5, 2.0];
    run.scan("/scan", "/laser", START + 0.525, [-0.5, 0.25], &readings);
    run.scan("/scan", "/laser", START + 0.9, [0.5, -0.25], &readings);
    run.scan("/scan", "/laser", START + 1.9, [0.5, -0.25], &readings);
    run.scan("/scan", "/laser", START + 1.0, [0.5, -0.25], &[]);
    // Static transforms hold for all time, however late they come.
    run.transform("/tf_static", ["base_link", "laser"], START + 2.0, at(0.2, 0.0, 0.3, LEVEL));
    let (_folder, path) = run.save();
    assert_eq!(detect(&path).unwrap(), FileKind::Bag);
    assert_eq!(bag_dimension(&path, &BagChoice::default()).unwrap(), 2);
    let log = LaserLog::read_bag(&path, &ScanLogOptions::default()).unwrap();
    assert_eq!((log.len(), log.format(), log.declared_max_range()), (2, "bag", Some(10.0)));
    assert!(distance(log.raw(0).world_from_laser.translation, [0.725, 0.0]) < 1e-6);
    assert!(distance(log.raw(1).world_from_laser.translation, [1.1, 0.0]) < 1e-6);
    assert!((log.raw(0).time.unwrap() - START - 0.525).abs() < 1e-6);
    // A clockwise scanner is kept as it is, and its beams are neighbors all the same.
    assert_eq!(log.raw(1).bearings[..2], [0.5, 0.25]);
    assert_eq!(detect_no_return(&log), None, "what is declared needs no guess");
    let limits = RangeLimits { no_return_free: 4.0, ..RangeLimits::default() };
    for i in 0..2 {
        let scan = log.raw(i).to_scan(&limits);
        use BeamKind::*;
        let mut kinds: Vec<_> = scan.beams().map(|b| b.kind).collect();
        if i == 1 {
            kinds.reverse();
        }
        assert_eq!(kinds, [Hit, NoReturn, Dropped, NoReturn, NoReturn, Dropped, Hit, Hit]);
        assert_eq!((scan.refused().not_finite, scan.refused().too_near), (1, 1));
        assert_eq!(scan.next(0), Some(1));
    }
    // Each reading at its own bearing, whichever way the scanner turns.
    let hit = log.raw(1).to_scan(&limits).hits_world(&log.raw(1).world_from_laser).next().unwrap();
    let bearing = 0.5f64 - 7.0 * 0.25;
    assert!(distance(hit, [1.1 + 2.0 * bearing.cos(), 2.0 * bearing.sin()]) < 1e-6, "{hit:?}");
    // What the caller says stands instead of what is declared.
    let own = RangeLimits { no_return: 50.0, ..RangeLimits::default() };
    assert_eq!(log.raw(0).to_scan(&own).counts().hit, 5);
    let stats = stats(&log);
    assert_eq!((stats.messages, stats.scans_without_pose(), stats.refused_messages()), (4, 1, 1));
    assert_eq!(stats.without_pose.keys().collect::<Vec<_>>(), ["transform odom > base_link"]);
    assert!(stats.first_without_pose.as_ref().unwrap().contains("it is 0.400 s after the last pose"));
    assert_eq!((&*stats.fixed_frame, &*stats.poses), ("odom", "transforms odom > base_link > laser"));
    // A wider tolerance goes on with the motion.
    let wide = ScanLogOptions { time_tolerance: 0.5, ..ScanLogOptions::default() };
    let log = LaserLog::read_bag(&path, &wide).unwrap();
    assert!(distance(log.raw(2).world_from_laser.translation, [2.1, 0.0]) < 1e-6);
}

#[test]
fn lasers_that_hang_or_lean() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mut run = robot();
    run.transform("/tf_static", ["base_link", "hanging"], START, at(0.0, 0.0, 1.0, [1.0, 0.0, 0.0, 0.0]));
    run.transform("/tf_static", ["base_link", "upright"], START, at(0.0, 0.0, 1.0, [half, 0.0, 0.0, half]));
    run.transform("/tf_static", ["base_link", "leaning"], START, at(0.0, 0.0, 1.0, [0.0, 0.05, 0.0, 1.0]));
    for frame in ["hanging", "upright", "leaning"] {
        run.scan(&format!("/{frame}"), frame, START + 0.5, [0.25, 0.25], &[1.0, 2.0]);
    }
    let (_folder, path) = run.save();
    let read = |names: &[&str]| {
        let topics = names.iter().map(|n| (*n).to_owned()).collect();
        LaserLog::read_bag(&path, &options(BagChoice { topics, ..BagChoice::default() }))
    };
    let log = read(&["/hanging"]).unwrap();
    assert_eq!(log.raw(0).bearings, [-0.25, -0.5]);
    assert!(stats(&log).notes.iter().any(|n| n.contains("hangs upside down")));
    says(
        read(&["/upright"]),
        "0 of 1 messages of /upright; the first: scan 0 of upright: its plane is tilted by 90.0 degrees",
    );
    let all = read(&["/hanging", "leaning", "/upright"]).unwrap();
    assert_eq!((all.len(), stats(&all).tilted, stats(&all).refused_messages()), (2, 1, 1));
    assert!((stats(&all).worst_tilt - 0.1).abs() < 1e-3);
}

#[test]
fn poses_of_a_topic_and_of_a_file() {
    let mut run = Run::new();
    for k in 0..31 {
        let t = 0.05 * f64::from(k);
        run.pose("/mocap", "/world", START + t, at(t, 0.0, 0.0, LEVEL));
        run.scan("/scan", "laser", START + t, [0.0, 0.1], &[1.0, 2.0, 3.0]);
    }
    let alone = run.save();
    let log = LaserLog::read_bag(&alone.1, &ScanLogOptions::default()).unwrap();
    let about = stats(&log);
    assert_eq!((log.len(), &*about.fixed_frame), (31, "world"));
    assert_eq!(about.poses, "topic /mocap, taken as poses of the sensor");
    assert!(
        about.guesses.iter().any(|g| g.contains("no transform leads from what /mocap poses to laser")),
        "{:?}",
        about.guesses
    );
    says(
        LaserLog::read_bag(
            &alone.1,
            &options(BagChoice { fixed_frame: Some("map".into()), ..BagChoice::default() }),
        ),
        "--fixed-frame is map; /mocap has poses in \"world\"",
    );
    // The same with what leads from the body to the laser.
    let mut run = robot();
    run.pose("/mocap", "world", START, at(5.0, 0.0, 0.0, LEVEL));
    run.pose("/mocap", "world", START + 0.1, at(5.5, 0.0, 0.0, LEVEL));
    run.scan("/scan", "laser", START + 0.1, [0.0, 0.1], &[1.0]);
    run.transform("/tf_static", ["base_link", "laser"], START, at(0.2, 0.0, 0.3, LEVEL));
    let (_folder, path) = run.save();
    let log = LaserLog::read_bag(&path, &ScanLogOptions::default()).unwrap();
    assert!(distance(log.raw(0).world_from_laser.translation, [0.3, 0.0]) < 1e-6, "the tree comes first");
    assert!(stats(&log).guesses.iter().any(|g| g.contains("the bag has /mocap as well (--pose-topic)")));
    let topic = |base: Option<&str>| BagChoice {
        pose_topic: Some("mocap".into()),
        base_frame: base.map(str::to_owned),
        ..BagChoice::default()
    };
    let log = LaserLog::read_bag(&path, &options(topic(None))).unwrap();
    assert!(distance(log.raw(0).world_from_laser.translation, [5.7, 0.0]) < 1e-6);
    assert!(stats(&log).guesses.iter().any(|g| g.contains("taken as those of base_link (--base-frame)")));
    let log = LaserLog::read_bag(&path, &options(topic(Some("/laser")))).unwrap();
    assert!(distance(log.raw(0).world_from_laser.translation, [5.5, 0.0]) < 1e-6);
    says(LaserLog::read_bag(&path, &options(topic(Some("wheel")))), "no transform names the frame wheel");
    // A file of poses goes by stamp.
    let (_other, file) = temporary("poses.txt");
    std::fs::write(&file, format!("{} 7 1 0\n{} 7.2 1 0\n", START + 0.04, START + 0.24)).unwrap();
    let by_file = ScanLogOptions { poses: Some(file.clone()), ..ScanLogOptions::default() };
    let log = LaserLog::read_bag(&path, &by_file).unwrap();
    assert!(distance(log.raw(0).world_from_laser.translation, [7.06, 1.0]) < 1e-6);
    std::fs::write(&file, "1 2 3\n1 2 3\n").unwrap();
    says(
        LaserLog::read_bag(&path, &by_file),
        "the number of poses is 2; give stamps, or one pose for each of the 1 scans",
    );
}

#[test]
fn what_cannot_be_a_log_is_refused_with_its_reason() {
    let mut run = robot();
    run.scan("/scan", "laser", START + 0.1, [0.0, 0.1], &[1.0]);
    run.cloud("/points", "base_link", START + 0.1, &[[1.0, 2.0, 3.0]; 3]);
    let (folder, path) = run.save();
    let read = |choice: BagChoice| LaserLog::read_bag(&path, &options(choice));
    let topics = |names: &[&str]| BagChoice {
        topics: names.iter().map(|n| (*n).into()).collect(),
        ..BagChoice::default()
    };
    assert_eq!(bag_dimension(&path, &BagChoice::default()).unwrap(), 3, "clouds come before planar lasers");
    says(read(BagChoice::default()), "the topics of scans is /points; they are 3-D");
    says(
        read(topics(&["/lidar"])),
        "--topic is /lidar; the bag has no such topic; it has /points, /scan, /tf",
    );
    says(read(topics(&["/tf"])), "the type of /tf is tf2_msgs/TFMessage");
    says(
        read(topics(&["/scan", "/points"])),
        "the topics is /scan and /points; 2-D and 3-D scans make different maps",
    );
    says(
        read(topics(&["/scan"])),
        "where poses are is none of the sensor's frame; the scans are of frame \"laser\", transforms of base_link, odom",
    );
    says(
        read(BagChoice { pose_topic: Some("/odometry".into()), ..topics(&["/scan"]) }),
        "--pose-topic is /odometry; the bag has no such topic",
    );
    says(ScanLog::open(&path, &options(topics(&["/scan"]))), "they are 2-D; name clouds or depth images");
    // Cut and damaged bags; what can be read first is read where the caller says so.
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    assert!(LaserLog::read_bag(&path, &options(topics(&["/scan"]))).is_err());
    assert_eq!(detect(&path).unwrap(), FileKind::Bag);
    std::fs::write(&path, b"").unwrap();
    says(bag_dimension(&path, &BagChoice::default()), "is empty");
    says(LaserLog::read_bag(folder.path().join("gone.mcap"), &ScanLogOptions::default()), "cannot open it");
    // The file that describes a folder is the folder; a map_server yaml is none.
    std::fs::write(&path, &whole).unwrap();
    let yaml = folder.path().join("metadata.yaml");
    std::fs::write(&yaml, "rosbag2_bagfile_information:\n  relative_file_paths:\n  - run.mcap\n").unwrap();
    assert_eq!((detect(&yaml).unwrap(), detect(folder.path()).unwrap()), (FileKind::Bag, FileKind::Bag));
    std::fs::write(&yaml, "image: a.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n").unwrap();
    assert_eq!(detect(&yaml).unwrap(), FileKind::MapServerYaml);
}

#[test]
fn a_turn_that_ends_at_the_stamp_is_told() {
    let write = |delay: f64, start: f64| {
        let mut run = Run::new();
        for k in 0..40 {
            let t = 0.1 * f64::from(k);
            run.pose("/mocap", "world", start + t, at(t, 0.0, 0.0, LEVEL));
            if k > 2 && k < 38 {
                let readings = [1.0; 90];
                run.scan_at("/scan", "laser", start + t + delay, start + t, [-3.1, 0.0698], &readings);
            }
        }
        run.save()
    };
    let x = |path: &Path, choice: BagChoice| {
        let log = LaserLog::read_bag(path, &options(choice)).unwrap();
        (
            log.raw(0).world_from_laser.translation[0],
            stats(&log).guesses.iter().any(|g| g.contains("--time-offset")),
        )
    };
    let near = |found: (f64, bool), expected: f64, told: bool| {
        assert!((found.0 - expected).abs() < 1e-5 && found.1 == told, "{found:?}");
    };
    let own = BagChoice { time_offset: Some(0.0), ..BagChoice::default() };
    let (_a, early) = write(0.008, START);
    near(x(&early, BagChoice::default()), 0.25, true);
    near(x(&early, own), 0.3, false);
    let (_b, late) = write(0.108, START);
    near(x(&late, BagChoice::default()), 0.3, false);
    let (_c, simulated) = write(0.0, 100.0);
    near(x(&simulated, BagChoice::default()), 0.3, false);
}

#[test]
fn clouds_are_read_by_index_with_colors_and_times() {
    let mut run = robot();
    for k in 0..5 {
        let points = [[1.0, 2.0, 3.0], [f32::NAN; 3], [4.0 + k as f32, 5.0, 6.0]];
        run.cloud("/points", "lidar", START + 0.25 * f64::from(k), &points);
    }
    run.transform("/tf_static", ["base_link", "lidar"], START, at(0.2, 0.0, 0.3, LEVEL));
    let (_folder, path) = run.save();
    let log =
        ScanLog::open(&path, &ScanLogOptions { time_tolerance: 0.0, ..ScanLogOptions::default() }).unwrap();
    assert_eq!((log.len(), log.kind().word()), (5, "bag"));
    assert!(distance(log.pose(2).translation, [0.7, 0.0, 0.3]) < 1e-6);
    assert!((log.time(2).unwrap() - START - 0.5).abs() < 1e-6);
    for i in [3, 0] {
        let Frame::Points(scan) = log.frame(i).unwrap() else { panic!("points") };
        assert_eq!(scan.points, [[1.0, 2.0, 3.0], [4.0 + i as f32, 5.0, 6.0]]);
        assert_eq!(scan.colors, [[0xff, 0x80, 0], [0xff, 0x80, 2]]);
        assert_eq!(scan.refused.not_finite, 1);
        assert!((scan.times[1] - 0.002).abs() < 1e-6 && scan.times[0] == 0.0, "{:?}", scan.times);
    }
    let about = log.bag().unwrap();
    assert_eq!(about.point_times.as_deref(), Some("/points: t in nanoseconds after the stamp"));
    // Without colors, by other poses.
    let (_other, file) = temporary("poses.txt");
    let rows: String =
        (0..5).map(|k| format!("{:.3} {k} 0 0 0 0 0 1\n", START + 0.25 * f64::from(k))).collect();
    std::fs::write(&file, rows).unwrap();
    let own = ScanLogOptions { poses: Some(file), color: false, ..ScanLogOptions::default() };
    let log = ScanLog::open(&path, &own).unwrap();
    assert!((log.pose(3).translation[0] - 3.0).abs() < 1e-6);
    let Frame::Points(scan) = log.frame(0).unwrap() else { panic!("points") };
    assert!(scan.colors.is_empty());
}

#[test]
fn depth_has_its_camera_and_the_colors_of_its_frame() {
    let depth = [1000u16, 0, 2000, 500, 1500, 3000].map(u16::to_le_bytes).concat();
    let write = |color_frame: &str, size: [u32; 2]| {
        let mut run = robot();
        run.transform(
            "/tf_static",
            ["base_link", "optical"],
            START,
            at(0.1, 0.0, 1.0, [-0.5, 0.5, -0.5, 0.5]),
        );
        for k in 0..3 {
            let t = START + 0.1 * f64::from(k);
            run.image("/camera/depth/image_rect_raw", "optical", t, "16UC1", &depth);
            run.image("/camera/color/image_raw", color_frame, t + 0.001, "bgr8", &[7; 18]);
            let mut m = Message::header(t, "optical");
            m.u32(&[size[1], size[0]]).text("plumb_bob").u32(&[1]).f64(&[0.1]);
            m.f64(&[2.0, 0.0, 1.5, 0.0, 2.5, 1.0, 0.0, 0.0, 1.0]).f64(&[0.0; 9]);
            m.f64(&[3.0, 0.0, 1.25, 0.0, 0.0, 3.5, 0.75, 0.0, 0.0, 0.0, 1.0, 0.0]).u32(&[0, 0]);
            run.put("/camera/depth/camera_info", "sensor_msgs/CameraInfo", INFO, t, &m);
        }
        run.save()
    };
    let (_a, path) = write("optical", [3, 2]);
    let log = ScanLog::open(&path, &ScanLogOptions::default()).unwrap();
    let pinhole = log.camera().unwrap().pinhole;
    // Rectified pictures have the camera of P.
    assert_eq!([pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy], [3.0, 3.5, 1.25, 0.75]);
    let Frame::Image(image) = log.frame(1).unwrap() else { panic!("an image") };
    assert_eq!(image.values, [1.0, 0.0, 2.0, 0.5, 1.5, 3.0]);
    assert_eq!((image.columns, image.rows, &*image.colors), (3, 2, &[[7; 3]; 6][..]));
    assert!(distance(log.pose(1).translation, [0.2, 0.0, 1.0]) < 1e-6);
    let (_b, path) = write("color_optical", [3, 2]);
    let log = ScanLog::open(&path, &ScanLogOptions::default()).unwrap();
    let Frame::Image(image) = log.frame(0).unwrap() else { panic!("an image") };
    assert!(image.colors.is_empty());
    assert!(
        log.bag()
            .unwrap()
            .notes
            .iter()
            .any(|n| n.contains("/camera/color/image_raw (frame color_optical) is not registered"))
    );
    let (_c, path) = write("optical", [640, 480]);
    says(
        ScanLog::open(&path, &ScanLogOptions::default()),
        "the size of the picture is 3 x 2; the camera is for 640 x 480",
    );
}

#[test]
fn info_proposes_what_map_would_choose() {
    let mut run = robot();
    for k in 0..10 {
        run.scan_at(
            "/scan",
            "laser",
            START + 0.1 * f64::from(k) + 0.02,
            START + 0.1 * f64::from(k),
            [0.0, 0.1],
            &[1.0],
        );
    }
    run.transform("/tf_static", ["base_link", "laser"], START, at(0.2, 0.0, 0.3, LEVEL));
    let (_folder, path) = run.save();
    let info = BagInfo::read(&path, &ScanLogOptions::default()).unwrap();
    assert_eq!(
        (&*info.container, info.dimension, &info.roots[..]),
        ("MCAP", Some(2), &["odom".to_owned()][..])
    );
    assert_eq!(info.map_options.unwrap(), ["--topic", "/scan", "--fixed-frame", "odom"]);
    let scan = &info.topics[0];
    assert_eq!(
        (&*scan.name, scan.messages, &scan.frames[..], scan.is_read),
        ("/scan", 10, &["laser".to_owned()][..], true)
    );
    assert!((scan.rate.unwrap() - 10.0).abs() < 0.1 && (scan.longest_gap - 0.1).abs() < 1e-3);
    assert!(scan.delay.unwrap().iter().all(|d| (d - 0.02).abs() < 1e-3));
    let edges: Vec<_> = info.edges.iter().map(|e| (&*e.parent, &*e.child, e.is_static, e.messages)).collect();
    assert_eq!(edges, [("base_link", "laser", true, 1), ("odom", "base_link", false, 31)]);
    assert!((info.edges[1].interval - 0.05).abs() < 1e-6);
}

/// No phantom walls: what reads the maximum or infinity is no surface.
#[test]
fn real_bags_of_planar_lasers() {
    let hits = |log: &LaserLog| {
        let limits = RangeLimits {
            no_return: detect_no_return(log).unwrap_or(f64::INFINITY),
            ..RangeLimits::default()
        };
        log.scans(&limits).fold([0u64; 3], |[h, n, d], (_, scan)| {
            let c = scan.counts();
            [h + c.hit, n + c.no_return, d + c.dropped]
        })
    };
    let read = |name: &str| {
        Some(LaserLog::read_bag(real_data(&format!("ros_bags/{name}"))?, &ScanLogOptions::default()).unwrap())
    };
    if let (Some(one), Some(two)) = (read("jackal/run.bag"), read("jackal/run_ros2")) {
        assert_eq!((one.len(), stats(&one).messages), (385, 414));
        assert_eq!(hits(&one), hits(&two));
        let same = |(a, b): (crate::RawLaserScan<'_>, crate::RawLaserScan<'_>)| {
            let bits = |all: &[f64]| all.iter().map(|r| r.to_bits()).collect::<Vec<_>>();
            a.world_from_laser == b.world_from_laser
                && a.time == b.time
                && bits(a.readings) == bits(b.readings)
        };
        assert!(one.raw_scans().zip(two.raw_scans()).all(same));
        assert!(
            stats(&one).guesses.iter().any(|g| g.contains("50 ms before it")),
            "{:?}",
            stats(&one).guesses
        );
    }
    if let Some(log) = read("fembots_hokuyo/mylaserdata.bag") {
        assert_eq!((log.len(), &*stats(&log).poses), (415, "transforms map > odom > base_link > laser"));
        let [hit, no_return, dropped] = hits(&log);
        assert!(
            no_return as f64 > 0.54 * (hit + no_return + dropped) as f64 && dropped < 200,
            "{hit} {no_return} {dropped}"
        );
    }
    if let Some(log) = read("pr2_gazebo/mylaserdata.bag") {
        let [hit, no_return, dropped] = hits(&log);
        assert!(
            no_return as f64 > 0.96 * (hit + no_return + dropped) as f64 && hit > 0,
            "{hit} {no_return} {dropped}"
        );
    }
    if let Some(log) = read("stage_truth/Mapping1.bag") {
        assert_eq!(log.len(), 1727);
    }
    if let Some(log) = read("turtlebot3_gazebo") {
        assert_eq!(log.len(), 99);
        assert!(stats(&log).notes.iter().any(|n| n.contains("no definition of sensor_msgs/LaserScan")));
    }
}

#[test]
fn no_bytes_of_a_bag_make_it_panic() {
    let mut run = robot();
    run.scan("/scan", "base_link", START + 0.1, [0.0, 0.1], &[1.0]);
    run.cloud("/points", "base_link", START + 0.1, &[[1.0, 2.0, 3.0]; 3]);
    let (_folder, path) = temporary("run.mcap");
    let topics =
        |name: &str| BagChoice { topics: vec![name.into()], allow_truncated: true, ..BagChoice::default() };
    no_panic(run.bytes(), 11, 400, |bytes| {
        std::fs::write(&path, bytes).unwrap();
        let _ = LaserLog::read_bag(&path, &options(topics("/scan")));
        let _ = BagInfo::read(&path, &options(BagChoice::default()));
        ScanLog::open(&path, &options(topics("/points"))).and_then(|log| log.frame(0))
    });
}

#[test]
fn messages_that_are_longer_than_their_type_are_told() {
    let mut run = robot();
    let mut m = Message::header(START + 0.1, "base_link");
    m.f32(&[0.0, 0.0, 0.1, 0.0, 0.0, 0.5, 10.0]).u32(&[1]).f32(&[2.0]).u32(&[0]).u32(&[7]);
    run.put("/scan", "sensor_msgs/LaserScan", SCAN, START + 0.1, &m);
    let (_folder, path) = run.save();
    let log = LaserLog::read_bag(&path, &ScanLogOptions::default()).unwrap();
    assert!(stats(&log).notes.iter().any(|n| n.contains("1 messages have bytes behind their end")));
}

#[test]
fn beams_have_times_and_the_laser_poses_at_them() {
    let mut run = robot();
    for (k, step) in [(0u32, 0.1f32), (1, -0.1)] {
        let mut m = Message::header(START + 0.25 + 0.5 * f64::from(k), "base_link");
        m.f32(&[0.0, 0.0, step, 0.01, 0.1, 0.5, 10.0]).u32(&[11]).f32(&[2.0; 11]).u32(&[0]);
        run.put("/scan", "sensor_msgs/LaserScan", SCAN, START + 0.5, &m);
    }
    let (_folder, path) = run.save();
    let log = LaserLog::read_bag(&path, &ScanLogOptions::default()).unwrap();
    for i in 0..2 {
        let (scan, motion) = (log.raw(i), log.trajectory(i).unwrap());
        let times = scan.beam_times().unwrap();
        // The order is that of the beams of the scan, which is counter-clockwise.
        assert!((times[if i == 0 { 10 } else { 0 }] - 0.1).abs() < 1e-6, "{times:?}");
        for time in times {
            let at = motion.at(scan.time.unwrap() + f64::from(time), 0.02).unwrap();
            let x = scan.world_from_laser.translation[0] + f64::from(time);
            assert!((at.translation[0] - x).abs() < 1e-5, "{time}: {at:?}");
        }
    }
}
