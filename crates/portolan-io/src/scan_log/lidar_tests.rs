//! Logs of lidars and range scanners: exact layouts, traps, real data.

use std::fs;
use std::path::Path;

use portolan::geom::Pose;
use portolan::geom::vector::distance;
use portolan::scan::{Body, Frame, FrameFilter, Origin, PointScan, Projection};

use super::testing::{median_distance, with_convention};
use super::{ScanLog, ScanLogKind, ScanLogOptions};
use crate::poses3::PoseConvention;
use crate::testing::{Random, bad_bytes, real_data, says, temporary};
use crate::{PointCloudFile, Viewpoint, write_kitti_bin, write_pcd};

fn open(path: &Path) -> ScanLog {
    ScanLog::open(path, &ScanLogOptions::default()).unwrap()
}

/// Asserts that opening fails so.
#[track_caller]
fn refused(path: &Path, part: &str) {
    says(ScanLog::open(path, &ScanLogOptions::default()), part);
}

fn points(log: &ScanLog, i: usize) -> PointScan {
    match log.frame(i).unwrap() {
        Frame::Points(scan) => scan,
        Frame::Image(_) => panic!("a lidar gives points"),
    }
}

fn world(log: &ScanLog, i: usize) -> Vec<[f64; 3]> {
    points(log, i).points.iter().map(|p| log.pose(i).transform_point(p.map(f64::from))).collect()
}

/// A room of random points on six walls, as seen from a place: points less that place.
fn room(random: &mut Random, from: [f64; 3]) -> Vec<[f32; 3]> {
    let wall = |random: &mut Random| {
        let mut p = [0, 1, 2].map(|_| 10.0 * random.unit() - 5.0);
        p[random.below(3)] = if random.below(2) == 0 { 5.0 } else { -5.0 };
        std::array::from_fn(|k| (p[k] - from[k]) as f32)
    };
    (0..4000).map(|_| wall(random)).collect()
}

/// Twelve numbers of a pose, as KITTI writes them.
fn row(pose: &Pose<3>) -> String {
    let numbers = |k: usize| {
        let [r, t] = [pose.rotation[k], [pose.translation[k]; 3]];
        format!("{:e} {:e} {:e} {:e}", r[0], r[1], r[2], t[0])
    };
    format!("{} {} {}\n", numbers(0), numbers(1), numbers(2))
}

#[test]
fn kitti_poses_are_the_cameras_and_lead_to_the_lidar() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("sequences/07");
    fs::create_dir_all(root.join("velodyne")).unwrap();
    fs::create_dir_all(folder.path().join("poses")).unwrap();
    let cloud =
        PointCloudFile { points: vec![[1.0, 2.0, 3.0], [4.0, -5.0, 0.5]], ..PointCloudFile::default() };
    for i in 0..3 {
        write_kitti_bin(root.join(format!("velodyne/00000{i}.bin")), &cloud).unwrap();
    }
    let tr = Pose::from_quaternion([-0.012, -0.054, -0.29], [0.5, -0.5, 0.5, 0.5]).unwrap();
    let cameras = [0.0, 0.1, 0.2]
        .map(|a: f64| Pose::<3>::from_quaternion([a, -a, 10.0 * a], [0.0, a.sin(), 0.0, a.cos()]).unwrap());
    let identity = row(&Pose::IDENTITY);
    fs::write(root.join("calib.txt"), format!("P0: {identity}P3: {identity}Tr: {}", row(&tr))).unwrap();
    fs::write(root.join("times.txt"), "0.000000e+00\n1.037875e-01\n2.075897e-01\n").unwrap();
    let rows: String = cameras.iter().map(row).collect();
    fs::write(folder.path().join("poses/07.txt"), &rows).unwrap();

    let log = open(&root);
    assert_eq!((log.kind(), log.len(), log.name()), (ScanLogKind::Kitti, 3, "07"));
    assert_eq!((log.time(1), log.stats().mended_poses), (Some(0.1037875), 0));
    for (i, camera) in cameras.iter().enumerate() {
        let expected = camera.transform_point(tr.transform_point([4.0, -5.0, 0.5]));
        assert!(distance(world(&log, i)[1], expected) < 1e-9);
    }
    let frame = points(&log, 0);
    assert_eq!((frame.origin, frame.points), (Origin::Common([0.0; 3]), cloud.points));

    // Beside the scans they come first; with a convention they are the lidar's own.
    fs::write(root.join("poses.txt"), &rows).unwrap();
    let own = with_convention(PoseConvention::WorldFromSensor);
    let log = ScanLog::open(&root, &own).unwrap();
    assert!(distance(world(&log, 2)[0], cameras[2].transform_point([1.0, 2.0, 3.0])) < 1e-9);
    // So are poses that the caller names: `Tr` is there, and is not for them.
    let named = folder.path().join("odometry.txt");
    fs::write(&named, &rows).unwrap();
    let named = ScanLogOptions { poses: Some(named), ..Default::default() };
    let log = ScanLog::open(&root, &named).unwrap();
    assert!(distance(log.pose(2).translation, cameras[2].translation) < 1e-9);
    assert!(distance(world(&log, 2)[1], cameras[2].transform_point([4.0, -5.0, 0.5])) < 1e-9);
    // A missing scan in the middle keeps the others' poses.
    fs::remove_file(root.join("velodyne/000001.bin")).unwrap();
    let log = open(&root);
    assert_eq!((log.len(), log.time(1), log.stats().poses_without_scan), (2, Some(0.2075897), 1));
    assert!(distance(log.pose(1).translation, (cameras[2] * tr).translation) < 1e-9);
    // Without calibration the camera's poses would turn the world on its side.
    fs::remove_file(root.join("calib.txt")).unwrap();
    refused(&root, "calib.txt is missing; put calib.txt");
    fs::write(root.join("calib.txt"), "P0: 1\nTr: 1 0 0\n").unwrap();
    refused(&root, "calib.txt: line 2: Tr is \"Tr: 1 0 0\"; write twelve numbers");
}

#[test]
fn clouds_of_other_kinds_in_a_folder_are_told() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["0.bin", "1.bin", "._0.bin"] {
        std::fs::write(folder.path().join(name), [0u8, 0, 128, 63].repeat(4)).unwrap();
    }
    std::fs::write(folder.path().join("poses.csv"), "0 0 0 0 0 0 1\n".repeat(2)).unwrap();
    let open = || ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
    assert!(open().stats().warnings.is_empty() && open().len() == 2);
    std::fs::write(folder.path().join("2.ply"), b"").unwrap();
    let warnings = open().stats().warnings.clone();
    assert!(warnings.len() == 1 && warnings[0].contains("(first: 2.ply)"), "{warnings:?}");
}

#[test]
fn folders_of_clouds_with_poses_in_every_layout() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for i in [9, 10, 11] {
        fs::write(path.join(format!("scan{i}.xyz")), format!("1 2 {i}\n0 1 0\n")).unwrap();
    }
    refused(path, "the pose file is missing; looked for a file with \"pose\"");
    let given = path.join("given.txt");
    fs::write(&given, "5 0 0 0 0 0 0 1\n6 1 0 0 0 0 0 1\n7 2 0 0 0 0 1 0\n").unwrap();
    let options = ScanLogOptions { poses: Some(given), ..Default::default() };
    let log = ScanLog::open(path, &options).unwrap();
    // In the order of numbers, not of letters; half a turn about z.
    assert_eq!((world(&log, 2)[0], log.time(2)), ([1.0, -2.0, 11.0], Some(7.0)));
    // A name that speaks of poses is enough, two are too many.
    fs::write(path.join("lidar_poses.csv"), row(&Pose::IDENTITY).repeat(3)).unwrap();
    assert_eq!(world(&open(path), 0)[0], [1.0, 2.0, 9.0]);
    fs::write(path.join("trajectory.tum"), "").unwrap();
    refused(path, "the pose file is lidar_poses.csv or trajectory.tum; name the one");
}

#[test]
fn names_that_are_times_are_matched_by_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for name in ["1700000000.25.xyz", "1700000000.75.xyz"] {
        fs::write(path.join(name), "1 2 3\n4 5 6\n").unwrap();
    }
    // 20 poses a second.
    let line = |k: u32| format!("17000000{:02}.{:02} {k} 0 0 0 0 0 1\n", k / 20, k % 20 * 5 + 2);
    let tum: String = (0..24).map(line).collect();
    fs::write(path.join("traj.tum"), &tum).unwrap();
    let log = open(path);
    let x = [0, 1].map(|i| log.pose(i).translation[0]);
    // A double of this size resolves 0.24 microseconds.
    assert!((x[0] - 4.6).abs() < 1e-4 && (x[1] - 14.6).abs() < 1e-4, "{x:?}");
    // Nanoseconds; clouds of an ending that many things have need to be asked for.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("poses.tum"), &tum).unwrap();
    fs::write(path.join("1700000000500000000.csv"), "x,y,z\n1,2,3\n").unwrap();
    assert_eq!(ScanLogKind::recognize(path), None);
    let log =
        ScanLog::open(path, &ScanLogOptions { format: Some(ScanLogKind::Clouds), ..Default::default() });
    assert!(distance(world(&log.unwrap(), 0)[0], [10.6, 2.0, 3.0]) < 1e-4);
}

#[test]
fn clouds_far_away_keep_their_millimetres() {
    let (folder, path) = temporary("utm.xyz");
    fs::write(&path, "500000.001 4000000.002 12.003\n500003.5 4000001.25 12\n").unwrap();
    let origin = Some([500_001.0, 4_000_000.5, 14.0]);
    let log = ScanLog::open(&path, &ScanLogOptions { origin, ..Default::default() }).unwrap();
    assert_eq!((log.kind(), log.len()), (ScanLogKind::Clouds, 1));
    assert!(distance(world(&log, 0)[0], [500_000.001, 4_000_000.002, 12.003]) < 1e-6);
    assert!(distance(log.sensor_position(0), [500_001.0, 4_000_000.5, 14.0]) < 1e-9);
    assert_eq!(points(&log, 0).origin, Origin::Common([-3.0, -0.5, 2.0]));
    // Moved by a pose.
    let poses = folder.path().join("pose.txt");
    fs::write(&poses, "-500000 -4000000 0 0 0 0 1\n").unwrap();
    let log = ScanLog::open(&path, &ScanLogOptions { poses: Some(poses), ..Default::default() }).unwrap();
    assert!(distance(world(&log, 0)[1], [3.5, 1.25, 12.0]) < 1e-6);
    assert!(distance(log.sensor_position(0), [-500_000.0, -4_000_000.0, 0.0]) < 1e-6);
}

/// The bytes of a scan graph: a pose (position and quaternion x, y, z, w) and points each.
fn graph_of(scans: &[([f64; 7], &[[f64; 3]])]) -> Vec<u8> {
    let mut bytes = (scans.len() as u32).to_le_bytes().to_vec();
    let vector = |bytes: &mut Vec<u8>, v: &[f64]| {
        bytes.extend((v.len() as u32).to_le_bytes());
        v.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    };
    for (id, ([x, y, z, a, b, c, d], points)) in scans.iter().enumerate() {
        bytes.extend((points.len() as u32).to_le_bytes());
        points.iter().for_each(|p| vector(&mut bytes, p));
        vector(&mut bytes, &[*x, *y, *z]);
        vector(&mut bytes, &[*d, *a, *b, *c]);
        bytes.extend((id as u32).to_le_bytes());
    }
    bytes.extend(0u32.to_le_bytes());
    bytes
}

#[test]
fn scan_graphs_far_away_keep_their_millimetres() {
    let (folder, path) = temporary("utm.graph");
    let far = [[500_000.001, 4_000_000.002, 12.003], [500_003.5, 4_000_001.25, 12.0]];
    let none = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    // Half a turn about z.
    let turned = [-1.0, 2.0, 0.5, 0.0, 0.0, 1.0, 0.0];
    fs::write(&path, graph_of(&[(none, &[]), (none, &far), (turned, &far[1..])])).unwrap();
    let log = open(&path);
    assert_eq!((log.kind(), log.len()), (ScanLogKind::ScanGraph, 3));
    for (p, expected) in world(&log, 1).iter().zip(far) {
        assert!(distance(*p, expected) < 1e-6, "{p:?}");
    }
    assert!(distance(world(&log, 2)[0], [-500_004.5, -3_999_999.25, 12.5]) < 1e-6);
    assert!(distance(log.sensor_position(1), [0.0; 3]) < 1e-6);
    assert!(distance(log.sensor_position(2), [-1.0, 2.0, 0.5]) < 1e-6);
    assert!(points(&log, 0).points.is_empty());
    // Named poses lead to the file's points, too.
    let poses = folder.path().join("poses.txt");
    fs::write(&poses, "-500000 -4000000 0 0 0 0 1\n".repeat(3)).unwrap();
    let log = ScanLog::open(&path, &ScanLogOptions { poses: Some(poses), ..Default::default() }).unwrap();
    assert!(distance(world(&log, 1)[1], [3.5, 1.25, 12.0]) < 1e-6);
}

#[test]
fn an_empty_first_cloud_and_one_elsewhere_do_not_cost_the_others_digits() {
    let folder = tempfile::tempdir().unwrap();
    let write = |i: u32, text: &str| fs::write(folder.path().join(format!("{i}.pcd")), text).unwrap();
    let pcd = |rows: &[&str]| {
        let n = rows.len();
        format!(
            "VERSION .7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nPOINTS {n}\nDATA ascii\n{}",
            rows.join("\n") + "\n"
        )
    };
    write(0, &pcd(&["nan nan nan"]));
    write(1, &pcd(&["500000.001 4000000.002 12.003"]));
    write(2, &pcd(&["500900.001 4002000.002 12.003"]));
    write(3, &pcd(&["1 2 3"]));
    fs::write(folder.path().join("poses.txt"), "0 0 0 0 0 0 1\n".repeat(4)).unwrap();
    let log = open(folder.path());
    assert!(points(&log, 0).points.is_empty());
    assert!(distance(world(&log, 1)[0], [500_000.001, 4_000_000.002, 12.003]) < 1e-6);
    // Two kilometers on: half of an f32's last digit.
    assert!(distance(world(&log, 2)[0], [500_900.001, 4_002_000.002, 12.003]) < 1e-4);
    says(log.frame(3), "3.pcd: the place of the points is about [0.0, 0.0, 0.0] m; the first scan's");
}

#[test]
fn organized_clouds_keep_the_rows_and_columns_of_their_sensor() {
    let (_folder, path) = temporary("scan.pcd");
    let sensor = [10.0, -3.0, 1.5];
    let (mut points, mut pixels) = (Vec::new(), Vec::new());
    for (row, column) in (0..16u32).flat_map(|r| (0..360u32).map(move |c| (r, c))) {
        if (row + column) % 11 != 0 {
            let (e, a) = (0.2 - 0.02 * f64::from(row), f64::from(column).to_radians());
            let range = 4.0 + (0.05 * f64::from(column)).sin();
            let ray = [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()];
            points.push(std::array::from_fn(|k| (sensor[k] + range * ray[k]) as f32));
            pixels.push(360 * row + column);
        }
    }
    let grid = Some(crate::CloudGrid { columns: 360, rows: 16, pixels: pixels.clone() });
    let viewpoint = Some(Viewpoint { position: sensor, ..Viewpoint::NONE });
    let cloud = PointCloudFile { points, grid, viewpoint, ..PointCloudFile::default() };
    write_pcd(&path, &cloud).unwrap();
    let scan = self::points(&open(&path), 0);
    assert_eq!((&scan.origin, &scan.points), (&Origin::Common(sensor), &cloud.points));
    let image = scan.image.unwrap();
    assert!(matches!(image.projection, Projection::Spherical(_)));
    for ((pixel, p), (expected, q)) in image.points().zip(pixels.iter().zip(&cloud.points)) {
        let q: [f64; 3] = std::array::from_fn(|k| f64::from(q[k]) - sensor[k]);
        assert!(pixel == *expected as usize && distance(p, q) < 1e-4, "{pixel} {p:?} {q:?}");
    }
}

#[test]
fn what_viewpoints_mean_is_checked_on_the_points() {
    let mut random = Random(6);
    let places = [[0.0, 0.0, 0.0], [2.0, 1.0, 0.5], [-2.0, 2.0, 1.0], [1.0, -3.0, 0.2]];
    for in_world in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        for (i, place) in places.iter().enumerate() {
            let points = room(&mut random, if in_world { [0.0; 3] } else { *place });
            let viewpoint = Some(Viewpoint { position: *place, ..Viewpoint::NONE });
            let cloud = PointCloudFile { points, viewpoint, ..PointCloudFile::default() };
            write_pcd(folder.path().join(format!("{i}.pcd")), &cloud).unwrap();
        }
        let applied = with_convention(PoseConvention::WorldFromSensor);
        let log = ScanLog::open(folder.path(), &applied).unwrap();
        assert_eq!((log.pose(2).translation, points(&log, 2).origin), (places[2], Origin::Common([0.0; 3])));
        match ScanLog::open(folder.path(), &ScanLogOptions::default()) {
            Ok(log) => {
                assert!(in_world);
                assert_eq!(*log.pose(2), Pose::IDENTITY);
                assert_eq!(
                    (log.sensor_position(2), points(&log, 2).origin),
                    (places[2], Origin::Common(places[2]))
                );
            }
            Err(error) => {
                let error = error.to_string();
                assert!(!in_world && error.contains("give --pose-convention world-from-sensor"), "{error}");
            }
        }
    }
}

#[test]
fn what_is_no_cloud_is_not_taken_for_one() {
    let folder = tempfile::tempdir().unwrap();
    let kind = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        ScanLogKind::recognize(&path)
    };
    let mesh = b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nelement face 1\nproperty list int int vertex_index\n\
                 end_header\n";
    assert_eq!(kind("a.ply", mesh), None);
    assert_eq!(kind("b.ply", &[&mesh[..60], b"\nend_header\n"].concat()), Some(ScanLogKind::Clouds));
    assert_eq!(kind("noise.bin", &[0xfe; 160]), None);
    assert_eq!(kind("scan.bin", &1f32.to_le_bytes().repeat(8)), Some(ScanLogKind::Clouds));
    assert_eq!(kind("notes.txt", b"Dear diary,\n1 2 3\n"), None);
    assert_eq!(kind("scan.txt", b"1 2 3\n4 5 6\n"), Some(ScanLogKind::Clouds));
    assert_eq!(kind("scene.conf", b"bmesh a.ply 0 0 0 0 0 0 1\n"), Some(ScanLogKind::Stanford));
    assert_eq!(kind("nginx.conf", b"server {\n}\n"), None);
}

#[test]
fn broken_files_of_a_log_make_nothing_panic() {
    let folder = tempfile::tempdir().unwrap();
    let conf = folder.path().join("a.conf");
    fs::write(folder.path().join("a.ply"), "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n").unwrap();
    let good = b"camera 0 0 0 0 0 0 1\nbmesh a.ply 1 0 0 0 0 0.6 0.8\n";
    for bytes in bad_bytes(good, 5, 600) {
        fs::write(&conf, bytes).unwrap();
        if let Ok(log) = ScanLog::open(&conf, &ScanLogOptions::default()) {
            let _ = log.frame(0);
        }
    }
    fs::write(&conf, good).unwrap();
    let log = open(&conf);
    assert_eq!(log.len(), 1);
    // Turned by -74 degrees, then moved.
    assert!(distance(world(&log, 0)[0], [1.0 + 0.28 + 1.92, -0.96 + 0.56, 3.0]) < 1e-9);
    fs::write(&conf, [&good[..], b"bmesh b.ply 0 0 0 0 0 0 1\n"].concat()).unwrap();
    assert_eq!((open(&conf).len(), open(&conf).stats().missing_files), (1, 1));
    fs::remove_file(folder.path().join("a.ply")).unwrap();
    refused(&conf, "a.conf: the number of scans is 0");
}

#[test]
fn scans_of_the_real_hall_agree_in_the_world() {
    let Some(path) = real_data("lidar3d_balm_hall") else { return };
    let log = open(&path);
    assert_eq!((log.kind(), log.len(), log.stats().poses_without_scan), (ScanLogKind::Clouds, 48, 48));
    let (first, last) = log.time_span().unwrap();
    assert!((first - 1_630_577_758.569).abs() < 1e-3 && (last - first - 47.0).abs() < 0.1, "{first} {last}");
    assert!((log.path_length() - 31.2).abs() < 0.1 && log.stats().refused_poses.is_empty());
    // Points are some centimeters apart, and other ones in every scan.
    let right = median_distance(&world(&log, 20), &world(&log, 21), 200);
    assert!(right < 0.07, "{right}");
    let turned = with_convention(PoseConvention::SensorFromWorld);
    let log = ScanLog::open(&path, &turned).unwrap();
    let wrong = median_distance(&world(&log, 20), &world(&log, 21), 200);
    assert!(wrong > 3.0 * right, "{wrong} against {right}");
}

#[test]
fn the_simulated_scans_are_in_the_world_already() {
    let Some(path) = real_data("lidar3d_la3dm_sim_structured") else { return };
    let log = open(&path);
    assert_eq!((log.kind(), log.len()), (ScanLogKind::Clouds, 12));
    let origins: Vec<[f64; 3]> = (0..12).map(|i| log.sensor_position(i)).collect();
    assert_eq!((origins[0], *log.pose(0)), ([0.999982, 1.00002, 0.0997627], Pose::IDENTITY));
    for i in 0..12 {
        let scan = points(&log, i);
        assert_eq!(
            (scan.points.len(), scan.origin, scan.refused.total()),
            (3500, Origin::Common(origins[i]), 0)
        );
    }
    let applied = with_convention(PoseConvention::WorldFromSensor);
    let posed = ScanLog::open(&path, &applied).unwrap();
    // Three scans are from each of four places.
    let disagreement = |log: &ScanLog| {
        let place = |i: usize| if i < 6 { i / 3 } else { 2 + (i - 6) / 3 };
        let all = |wanted: usize| (0..12).filter(move |i| place(*i) == wanted).flat_map(|i| world(log, i));
        let from: Vec<_> = all(0).collect();
        let to: Vec<_> = (1..4).flat_map(all).collect();
        median_distance(&from, &to, 10)
    };
    let (right, wrong) = (disagreement(&log), disagreement(&posed));
    assert!(right < 0.1 && wrong > 0.5, "{right} {wrong}");
}

#[test]
fn the_range_scans_of_the_bunny_lie_on_its_mesh() {
    let Some(path) = real_data("rangescan_stanford_bunny") else { return };
    let log = open(&path);
    assert_eq!((log.kind(), log.len()), (ScanLogKind::Stanford, 10));
    let mesh = crate::read_ply_mesh(path.join("reconstruction/bun_zipper.ply")).unwrap();
    let (mut all, mut off, mut covered) = (Vec::new(), Vec::new(), 0);
    for i in 0..10 {
        let scan = points(&log, i);
        all.extend(world(&log, i));
        let Origin::PerPoint(origins) = &scan.origin else { panic!("rays are parallel") };
        let image = scan.image.as_ref().unwrap();
        let Projection::Orthographic { rays, top } = image.projection else { panic!("rays are parallel") };
        for (p, o) in scan.points.iter().zip(origins) {
            assert!(o[0] == p[0] && o[1] == p[1] && f64::from(o[2] - p[2]) > 0.0);
            // The image between its pixels, where all four are there and belong to one surface.
            let [u, v] = [0, 1].map(|k| (f64::from(p[k]) - rays.first[k]) / rays.step[k]);
            let (column, row) = (u.floor(), v.floor());
            if !(u >= 0.0 && v >= 0.0 && column + 1.0 < image.columns as f64 && row + 1.0 < image.rows as f64)
            {
                continue;
            }
            let at = row as usize * image.columns + column as usize;
            let four = [at, at + 1, at + image.columns, at + image.columns + 1].map(|i| image.values[i]);
            let spread = four.iter().fold(0f32, |m, v| m.max((v - four[0]).abs()));
            if four.iter().all(|v| *v > 0.0) && spread < 0.003 {
                let (s, t) = (u - column, v - row);
                let [a, b, c, d] = four.map(f64::from);
                let value = (1.0 - t) * ((1.0 - s) * a + s * b) + t * ((1.0 - s) * c + s * d);
                off.push((top - value - f64::from(p[2])).abs());
                covered += 1;
            }
        }
    }
    assert_eq!(all.len(), 362_272);
    let median = median_distance(&all, &mesh.vertices, 100);
    assert!((median - 0.00054).abs() < 0.00004, "{median}");
    off.sort_by(f64::total_cmp);
    let (half, most) = (off[off.len() / 2], off[off.len() * 95 / 100]);
    println!(
        "image against points: median {half:.2e} m, 95 % {most:.2e} m, covered {:.3}",
        f64::from(covered) / 362_272.0
    );
    // Two interpolations, one of which the image costs.
    assert!(half < 3e-5 && most < 1.5e-4, "{half} {most}");
    assert!(f64::from(covered) > 0.85 * 362_272.0, "{covered}");
}

#[test]
fn the_scan_graph_of_octomap() {
    let Some(path) = real_data("maps_octomap/spherical_scan.graph") else { return };
    let log = open(&path);
    assert_eq!((log.kind(), log.len()), (ScanLogKind::ScanGraph, 1));
    assert_eq!(log.sensor_position(0), [1.0, 0.0, -0.5]);
    for p in world(&log, 0) {
        assert!((distance(p, [1.0, 0.0, -0.5]) - 4.01).abs() < 1e-3);
    }
    let Some(path) = real_data("maps_octomap/scan.dat.bz2") else { return };
    let log = open(&path);
    assert_eq!((log.kind(), points(&log, 0).points.len()), (ScanLogKind::Clouds, 88_206));
}

/// A lidar that drives along x at 2 m/s past points of the world: each is measured at another time of its scan.
fn moving_log(stamp_of: impl Fn(usize) -> f64, time_of: impl Fn(usize, f64) -> f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut poses = String::new();
    for i in 0..8 {
        let start = stamp_of(i);
        let world: Vec<[f64; 3]> = (0..40).map(|k| [3.0, f64::from(k) - 20.0, 1.0]).collect();
        let since = |k: usize| 0.1 * k as f64 / 40.0;
        let local = world.iter().enumerate().map(|(k, p)| {
            let x = 2.0 * (start + since(k) - 100.0);
            [p[0] - x, p[1], p[2]].map(|v| v as f32)
        });
        let start_time = time_of(i, start);
        let cloud = PointCloudFile {
            points: local.collect(),
            times: (0..40).map(|k| since(k) as f32).collect(),
            start_time,
            ..PointCloudFile::default()
        };
        write_pcd(folder.path().join(format!("{start:.3}.pcd")), &cloud).unwrap();
        poses += &format!("{start:.3} {} 0 0 0 0 0 1\n", 2.0 * (start - 100.0));
    }
    fs::write(folder.path().join("poses.txt"), poses).unwrap();
    folder
}

/// How far the points of all scans are from where they are in the world, at most (meters).
fn off(log: &ScanLog, filter: &FrameFilter) -> f64 {
    let mut most: f64 = 0.0;
    for i in 0..log.len() {
        let (Frame::Points(scan), _) = log.filtered_frame(i, filter).unwrap() else { panic!("points") };
        for p in scan.points.iter().chain(&scan.free_ends) {
            most = most.max((log.pose(i).transform_point(p.map(f64::from))[0] - 3.0).abs());
        }
    }
    most
}

#[test]
fn the_motion_within_scans_is_taken_out_where_poses_cover_it() {
    let stamp = |i: usize| 100.0 + 0.1 * i as f64;
    // Times of the stamps' own clock, and times since the stamp.
    for time_of in [|_: usize, start: f64| start, |_: usize, _: f64| 0.0] {
        let folder = moving_log(stamp, time_of);
        let log = open(folder.path());
        // The last scan lasts longer than the poses do: constant twist.
        assert!(off(&log, &FrameFilter::default()) < 1e-4);
        let motion = log.motion().unwrap();
        assert_eq!((motion.deskewed, motion.still, motion.not_covered.0), (8, 0, 0));
        assert!((motion.largest - 0.195).abs() < 1e-3, "{motion:?}");
        let (Frame::Points(scan), _) = log.filtered_frame(3, &FrameFilter::default()).unwrap() else {
            panic!()
        };
        assert!((scan.origin_of(39).unwrap()[0] - 0.195).abs() < 1e-3);
        // The robot's body is where it is at the moment, and limits of range are from there.
        let body = Body::Sphere { center: [2.9, 18.0, 1.0], radius: 0.25 };
        let filter = FrameFilter { max_range: 19.0, body: vec![body], ..FrameFilter::default() };
        let (Frame::Points(scan), counts) = log.filtered_frame(0, &filter).unwrap() else { panic!() };
        assert_eq!((counts.self_hit, counts.max_range, scan.free_ends.len()), (1, 3, 3));
        let end = scan.free_ends[2].map(f64::from);
        let origin = scan.origin_of(scan.points.len() + 2).unwrap();
        assert!((distance(end, origin) - 19.0).abs() < 1e-4 && origin[0] > 0.18, "{origin:?}");

        let off_log =
            ScanLog::open(folder.path(), &ScanLogOptions { deskew: false, ..ScanLogOptions::default() });
        let off_log = off_log.unwrap();
        assert!((off(&off_log, &FrameFilter::default()) - 0.195).abs() < 1e-3);
        assert_eq!(off_log.motion(), None);
    }
    // Poses of a keyframe each second say nothing of the motion in between.
    let folder = moving_log(|i| 100.0 + i as f64, |_, start| start);
    let log = open(folder.path());
    assert!(off(&log, &FrameFilter::default()) > 0.1);
    let motion = log.motion().unwrap();
    let why = motion.not_covered.1.unwrap();
    assert!(
        (motion.deskewed, motion.not_covered.0) == (0, 8)
            && why.contains("the poses around it are 1.000 s apart"),
        "{why}"
    );
}
