//! One function a reader: whether bytes were read. Errors are right answers; a panic, a hang and memory without bound are not.

use std::io::Cursor;
use std::path::Path;

use portolan_io::poses3::{PoseConvention, parse_poses_3d};
use portolan_io::scan_log::{ScanLog, ScanLogKind, ScanLogOptions};
use portolan_io::*;
use portolan_ros::container::{Bag, BagOptions, BytesSource, DefinitionFormat, Encoding, Topic};
use portolan_ros::message::*;

use crate::{apart, file, folder, write};

fn input(bytes: &[u8], name: &str) -> Input {
    Input::from_reader(Cursor::new(bytes.to_vec()), Path::new(name)).unwrap()
}

fn points(bytes: &[u8], name: &str) -> bool {
    parse_points(input(bytes, name)).is_ok_and(|cloud| {
        assert!(cloud.points.iter().flatten().all(|v| v.is_finite()));
        true
    })
}

/// The first byte chooses encoding and language; then a definition and a message.
pub fn message(bytes: &[u8]) -> bool {
    let Some((choice, rest)) = bytes.split_first() else { return false };
    let (encoding, definition_format) = match choice % 4 {
        0 => (Encoding::Ros1, DefinitionFormat::Ros1Msg),
        1 => (Encoding::Cdr, DefinitionFormat::Ros2Msg),
        2 => (Encoding::Cdr, DefinitionFormat::Ros2Idl),
        _ => (Encoding::Cdr, DefinitionFormat::Missing),
    };
    let (definition, data) = apart(rest);
    let Ok(definition) = std::str::from_utf8(definition) else { return false };
    let is_missing = definition_format == DefinitionFormat::Missing;
    let topic = Topic {
        name: "/t".into(),
        type_name: if is_missing { definition } else { "a/msg/B" }.into(),
        encoding,
        definition_format,
        definition: if is_missing { "" } else { definition }.into(),
        publisher: None,
        latched: false,
    };
    decoded(&topic, data)
}

/// Reads a message as everything that it may be.
fn decoded(topic: &Topic, data: &[u8]) -> bool {
    let Ok(decoder) = Decoder::new(topic) else { return false };
    let Ok(message) = decoder.decode(data) else { return false };
    let r = &message.record;
    let _ = (LaserScan::of(r), LivoxScan::of(r), CameraInfo::of(r), Header::of(r));
    let _ = LaserScan::of_echoes(r, EchoChoice::First);
    let _ = (odometry(r), pose_stamped(r), pose_with_covariance(r), transform_stamped(r));
    let _ = (transforms(r), path(r));
    if let Ok(cloud) = PointCloud::of(r) {
        let read = |f: &PointField| cloud.points().take(64).map(|p| f.read(p).to_f64()).sum::<f64>();
        let _ = cloud.position().map(|all| all.map(read));
        if let Some(Ok(times)) = PointTimes::infer(&cloud, Some(0.1)) {
            let _ = (times.after_stamp(&cloud), times.describe());
        }
    }
    if let Ok(image) = Image::of(r) {
        let _ = (image.depth(1000.0), image.colors());
    }
    let _ = CompressedImage::of(r);
    true
}

fn bag(bytes: &[u8], allow_truncated: bool) -> bool {
    let source = Box::new(BytesSource::new("a", bytes.to_vec()));
    let Ok(bag) = Bag::from_sources(vec![source], &BagOptions { allow_truncated }) else { return false };
    let topics: Vec<u32> = (0..bag.topics().len() as u32).collect();
    let mut data = Vec::new();
    for message in bag.messages(&topics).iter().take(100) {
        let read = bag.read(message, &mut data);
        assert!(read.is_ok() || !allow_truncated, "what was kept is read: {read:?}");
        if read.is_ok() {
            decoded(&bag.topics()[message.topic as usize], &data);
        }
    }
    let _ = bag.summary();
    true
}

/// MCAP, sqlite3 and ROS 1: whole, then as far as it goes.
pub fn container(bytes: &[u8]) -> bool {
    let whole = bag(bytes, false);
    let cut = bag(bytes, true);
    whole || cut
}

/// Logs of bags, which guess what is what.
pub fn bag_log(bytes: &[u8]) -> bool {
    let path = file("run.bag", bytes);
    let mut options = ScanLogOptions::default();
    options.bag.allow_truncated = true;
    let _ = LaserLog::read_bag(&path, &options);
    let _ = frames(&path, &options);
    BagInfo::read(&path, &options).is_ok()
}

/// Opens a log and reads its first frames.
fn frames(path: &Path, options: &ScanLogOptions) -> bool {
    let Ok(log) = ScanLog::open(path, options) else { return false };
    (0..log.len().min(3)).all(|i| log.frame(i).is_ok())
}

pub fn e57(bytes: &[u8]) -> bool {
    let path = file("a.e57", bytes);
    let _ = (read_posed_clouds(&path), e57_about(&path));
    points(bytes, "a.e57")
}

pub fn las(bytes: &[u8]) -> bool {
    points(bytes, "a.las")
}

pub fn ptx(bytes: &[u8]) -> bool {
    let _ = read_posed_clouds(file("a.ptx", bytes));
    points(bytes, "a.ptx")
}

pub fn pcd(bytes: &[u8]) -> bool {
    points(bytes, "a.pcd")
}

pub fn ply(bytes: &[u8]) -> bool {
    let mesh = parse_ply_mesh(input(bytes, "a.ply")).is_ok();
    let _ = parse_mesh_counts(&mut input(bytes, "a.ply"));
    points(bytes, "a.ply") || mesh
}

pub fn mesh(bytes: &[u8]) -> bool {
    read_mesh(file(if bytes.starts_with(b"glTF") { "a.glb" } else { "a.obj" }, bytes)).is_ok()
}

pub fn xyz(bytes: &[u8]) -> bool {
    points(bytes, "a.xyz")
}

pub fn kitti(bytes: &[u8]) -> bool {
    points(bytes, "a.bin")
}

pub fn query_points(bytes: &[u8]) -> bool {
    let _ = parse_geojson(input(bytes, "a.geojson"));
    QueryPoints::parse(input(bytes, "a.csv")).is_ok()
}

pub fn numpy(bytes: &[u8]) -> bool {
    let npz = parse_npz(Cursor::new(bytes), Path::new("a.npz")).is_ok();
    parse_npy(bytes, Path::new("a.npy")).is_ok() || npz
}

pub fn carmen(bytes: &[u8]) -> bool {
    LaserLog::parse_carmen(input(bytes, "a.log")).is_ok_and(|log| {
        let _ = detect_no_return(&log);
        true
    })
}

pub fn poses(bytes: &[u8]) -> bool {
    let flat = parse_poses_2d(input(bytes, "a.txt")).is_ok();
    parse_poses_3d(input(bytes, "a.txt")).is_ok_and(|file| {
        for raw in &file.poses {
            for convention in PoseConvention::ALL {
                assert!(raw.resolve(convention).map_or(true, |(pose, _)| pose.is_rigid()));
            }
        }
        true
    }) || flat
}

/// A yaml file and its picture.
pub fn map_server(bytes: &[u8]) -> bool {
    let (yaml, picture) = apart(bytes);
    ["a.pgm", "a.png"].iter().for_each(|name| drop(file(name, picture)));
    let _ = Pgm::parse(input(picture, "a.pgm"));
    MapServerMap::read(file("a.yaml", yaml)).is_ok()
}

pub fn octomap(bytes: &[u8]) -> bool {
    let _ = parse_scan_graph(input(bytes, "a.graph"));
    OctomapTree::parse(bytes, Path::new("a.bt")).is_ok()
}

pub fn g2o(bytes: &[u8]) -> bool {
    portolan_graph::read_g2o(bytes, "a.g2o").is_ok()
}

/// `map.portolan` and `esdf.bin`.
pub fn map_file(bytes: &[u8]) -> bool {
    let name = Path::new("map.portolan");
    let _ = EsdfFile::parse(bytes, Path::new("esdf.bin"));
    let Ok(container) = Container::parse(bytes.to_vec(), name) else { return false };
    let memory = 256 << 20;
    match map_dimension(&container) {
        Ok(2) => MapFile::<2>::from_container(&container, memory).is_ok(),
        Ok(_) => MapFile::<3>::from_container(&container, memory).is_ok(),
        Err(_) => false,
    }
}

fn of_kind(kind: ScanLogKind) -> ScanLogOptions {
    ScanLogOptions { format: Some(kind), ..ScanLogOptions::default() }
}

/// A folder with the depth image `depth/0.png` and `images/0.png`.
fn depth_folder(name: &str) -> std::path::PathBuf {
    let path = folder().join(name);
    if !path.join("depth/0.png").is_file() {
        write(&path.join("depth/0.png"), &crate::bags::depth_png());
        write(&path.join("calibration.txt"), b"10 12 3.5 2.5");
    }
    path
}

pub fn transforms_json(bytes: &[u8]) -> bool {
    let path = depth_folder("transforms");
    write(&path.join("transforms.json"), bytes);
    frames(&path, &of_kind(ScanLogKind::Transforms))
}

/// `cameras` and `images`.
pub fn colmap_text(bytes: &[u8]) -> bool {
    colmap(bytes, "txt")
}

/// Likewise.
pub fn colmap_binary(bytes: &[u8]) -> bool {
    colmap(bytes, "bin")
}

fn colmap(bytes: &[u8], ending: &str) -> bool {
    let path = depth_folder("colmap");
    let (cameras, images) = apart(bytes);
    write(&path.join(format!("sparse/0/cameras.{ending}")), cameras);
    write(&path.join(format!("sparse/0/images.{ending}")), images);
    frames(&path, &of_kind(ScanLogKind::Colmap))
}

/// An association file, and the same bytes as the lists of TUM.
pub fn tum(bytes: &[u8]) -> bool {
    let path = depth_folder("association");
    write(&path.join("pairs.txt"), bytes);
    let paired = frames(&path, &of_kind(ScanLogKind::TumRgbd));
    let lists = depth_folder("lists");
    let (depth, poses) = apart(bytes);
    write(&lists.join("depth.txt"), depth);
    write(&lists.join("groundtruth.txt"), poses);
    frames(&lists, &of_kind(ScanLogKind::TumRgbd)) || paired
}

/// A depth image.
pub fn depth_picture(bytes: &[u8]) -> bool {
    let path = folder().join("picture");
    write(&path.join("depth/0.png"), bytes);
    write(&path.join("trajectory.log"), b"0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    let mut options = of_kind(ScanLogKind::Redwood);
    options.scale_intrinsics = true;
    frames(&path, &options)
}
