//! Logs of clouds that bring their poses with them, or none.

use std::fs;

use portolan::scan::{Frame, Origin, PointScan};

use super::*;
use crate::testing::{real_data, says, temporary};

fn scan(log: &ScanLog, i: usize) -> PointScan {
    match log.frame(i).unwrap() {
        Frame::Points(scan) => scan,
        Frame::Image(_) => panic!("a cloud is points"),
    }
}

fn open(path: &std::path::Path) -> ScanLog {
    ScanLog::open(path, &ScanLogOptions::default()).unwrap()
}

/// Directions of 40 columns and 16 rows, and the distance from `(0, 0, 0)` to the walls of a room.
fn rays() -> Vec<([usize; 2], [f64; 3])> {
    let mut all = Vec::new();
    for column in 0..40 {
        for row in 0..16 {
            let (az, el) = (0.05 * column as f64, 0.04 * row as f64 - 0.3);
            let d = [el.cos() * az.cos(), el.cos() * az.sin(), el.sin()];
            let far = [4.0, 3.0, 1.5].iter().zip(d).map(|(w, d): (&f64, f64)| w / d.abs());
            let t = far.fold(f64::INFINITY, f64::min);
            all.push(([column, row], d.map(|v| t * v)));
        }
    }
    all
}

/// The same scan, turned by 90 degrees about z and at UTM coordinates, as PTX; the frame's base is the scanner.
fn ptx() -> String {
    let mut text = String::from(
        "40\n16\n500000 4000000 2\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n500000 4000000 2 1\n",
    );
    for (place, [x, y, z]) in rays() {
        match place {
            [3, 5] => text += "0 0 0 0\n",
            _ => text += &format!("{x} {y} {z} 0.5\n"),
        }
    }
    text
}

#[test]
fn a_scan_of_a_scanner_is_an_image_at_its_pose() {
    let (folder, path) = temporary("hall.ptx");
    fs::write(&path, ptx()).unwrap();
    let log = open(&path);
    assert_eq!((log.kind(), log.len(), log.knows_origins()), (ScanLogKind::Clouds, 1, true));
    assert_eq!(log.sensor_position(0), [500_000.0, 4_000_000.0, 2.0]);
    assert_eq!(log.stats().warnings, [""; 0]);
    let from_ptx = scan(&log, 0);
    let image = from_ptx.image.as_ref().expect("rows and columns are those of a lidar");
    assert_eq!((image.hits(), from_ptx.points.len()), (639, 639));
    // The same as a PCD with rows and columns and a pose beside it, to the digits of the text.
    let mut pixels: Vec<_> =
        rays().iter().map(|([c, r], p)| ((r * 40 + c) as u32, p.map(|v| v as f32))).collect();
    pixels.sort_by_key(|(pixel, _)| *pixel);
    let (pixels, points) = pixels.into_iter().unzip();
    let grid = Some(crate::CloudGrid { columns: 40, rows: 16, pixels });
    let pcd = crate::PointCloudFile { points, grid, ..Default::default() };
    let below = folder.path().join("pcd");
    fs::create_dir(&below).unwrap();
    crate::write_pcd(below.join("0.pcd"), &pcd).unwrap();
    fs::write(below.join("poses.txt"), "500000 4000000 2 0 0 0.7071067811865476 0.7071067811865476\n")
        .unwrap();
    let other = open(&below);
    assert!((0..3).all(|k| (other.pose(0).rotation[k][0] - log.pose(0).rotation[k][0]).abs() < 1e-12));
    let (all, mut same) = (scan(&other, 0).points, from_ptx.points);
    same.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let mut all: Vec<_> = all.into_iter().filter(|p| same.iter().any(|q| p == q)).collect();
    all.sort_by(|a, b| a.partial_cmp(b).unwrap());
    assert_eq!(all, same);
}

#[test]
fn an_e57_is_the_same_scan_as_a_ptx() {
    use e57::{
        E57Writer, Quaternion, Record, RecordDataType, RecordName, RecordValue, Transform, Translation,
    };
    let (folder, path) = temporary("hall.ptx");
    fs::write(&path, ptx()).unwrap();
    let e57 = folder.path().join("hall.e57");
    let double = RecordDataType::Double { min: None, max: None };
    let whole = |max| RecordDataType::Integer { min: 0, max };
    let prototype = [
        (RecordName::CartesianX, double.clone()),
        (RecordName::CartesianY, double.clone()),
        (RecordName::CartesianZ, double),
        (RecordName::CartesianInvalidState, whole(2)),
        (RecordName::RowIndex, whole(15)),
        (RecordName::ColumnIndex, whole(39)),
    ];
    let prototype = prototype.into_iter().map(|(name, data_type)| Record { name, data_type }).collect();
    let mut writer = E57Writer::from_file(&e57, "file").unwrap();
    let mut scanned = writer.add_pointcloud("scan", prototype).unwrap();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    scanned.set_transform(Some(Transform {
        rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
        translation: Translation { x: 500_000.0, y: 4_000_000.0, z: 2.0 },
    }));
    for ([column, row], p) in rays() {
        let invalid = if (column, row) == (3, 5) { 2 } else { 0 };
        let mut values: Vec<_> = p.map(RecordValue::Double).into();
        values.extend([invalid, row as i64, column as i64].map(RecordValue::Integer));
        scanned.add_point(values).unwrap();
    }
    scanned.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    let (a, b) = (open(&e57), open(&path));
    assert_eq!(scan(&a, 0), scan(&b, 0));
    let apart = |p: [f64; 3]| {
        let (p, q) = (a.pose(0).transform_point(p), b.pose(0).transform_point(p));
        (0..3).map(|k| (p[k] - q[k]).abs()).fold(0.0, f64::max)
    };
    assert!(apart([3.0, -2.0, 1.0]) < 1e-9);
}

#[test]
fn a_folder_of_scans_and_poses_that_are_named() {
    let (folder, path) = temporary("a.ptx");
    fs::write(&path, ptx()).unwrap();
    fs::write(folder.path().join("b.ptx"), format!("{}{}", ptx(), ptx())).unwrap();
    assert_eq!(open(folder.path()).len(), 3);
    let poses = folder.path().join("named.poses");
    fs::write(&poses, "1 2 3 0 0 0 1\n4 5 6 0 0 0 1\n7 8 9 0 0 0 1\n").unwrap();
    let named = ScanLogOptions { poses: Some(poses), ..Default::default() };
    let log = ScanLog::open(folder.path(), &named).unwrap();
    assert_eq!(log.sensor_position(2), [7.0, 8.0, 9.0]);
    assert_eq!(scan(&log, 2).origin, Origin::Common([0.0; 3]));
}

#[test]
fn clouds_that_are_far_or_of_a_survey_have_no_rays() {
    let (folder, path) = temporary("utm.xyz");
    fs::write(&path, "500000.5 4000000.25 12\n500003.5 4000001.25 12\n500001 4000002 13\n").unwrap();
    let log = open(&path);
    assert!(
        !log.knows_origins() && log.stats().warnings[0].contains("4031 km from 0,0,0"),
        "{:?}",
        log.stats().warnings
    );
    let far = scan(&log, 0);
    assert_eq!((far.origin, far.points.len()), (Origin::Unknown, 3));
    // Near zero, or with an origin, they have.
    let origin = Some([500_000.0, 4_000_000.0, 20.0]);
    assert!(ScanLog::open(&path, &ScanLogOptions { origin, ..Default::default() }).unwrap().knows_origins());
    fs::write(&path, "1 2 3\n4 5 6\n7 8 9\n").unwrap();
    assert!(open(&path).knows_origins());
    let Some(las) = real_data("e57_las_ptx/simple.las") else { return };
    let log = open(&las);
    assert!(!log.knows_origins() && log.stats().warnings[0].contains("LAS does not say"));
    // By its GeoTIFF keys; those of the same points in UTM are meters.
    for (name, feet) in [("autzen_trim.laz", true), ("autzen-utm.las", false)] {
        let Some(path) = real_data(&format!("e57_las_ptx/{name}")) else { continue };
        assert_eq!(open(&path).stats().warnings.iter().any(|note| note.contains("are feet")), feet, "{name}");
    }
    // Poses of the scanner at the points' times: 100 m above, on the way.
    let poses = folder.path().join("way.txt");
    let line = |t: f64| format!("{t} 637000 851000 700 0 0 0 1\n");
    let text: String = (0..4500).map(|i| line(245_370.0 + f64::from(i))).collect();
    fs::write(&poses, text).unwrap();
    let along = ScanLogOptions { poses: Some(poses.clone()), time_tolerance: 0.5, ..Default::default() };
    let log = ScanLog::open(&las, &along).unwrap();
    let seen = scan(&log, 0);
    let Origin::PerPoint(origins) = &seen.origin else { panic!("{:?}", seen.origin) };
    let at = log.pose(0).transform_point(origins[7].map(f64::from));
    assert!(log.knows_origins() && (at[2] - 700.0).abs() < 1e-3, "{at:?}");
    fs::write(&poses, line(1.0) + &line(2.0)).unwrap();
    says(
        ScanLog::open(&las, &along).unwrap().frame(0),
        "the number of points with a pose near in time is 0 of 1065",
    );
    fs::write(&poses, "1 2 3 0 0 0 1\n").unwrap();
    says(ScanLog::open(&las, &along), "the times of the poses is missing");
}

#[test]
fn fused_maps_are_told() {
    for (name, is_told) in [("immlio_scans.pcd", true), ("source.ply", false)] {
        let Some(path) = real_data(&format!("clouds_users/{name}")) else { continue };
        let notes = &open(&path).stats().warnings.clone();
        assert_eq!(notes.iter().any(|note| note.contains("looks like a fused map")), is_told, "{notes:?}");
    }
}

#[test]
fn packed_scans_of_kitti_are_read_alone() {
    use std::io::Write;
    let (_folder, path) = temporary("0.bin.gz");
    let mut packed =
        flate2::write::GzEncoder::new(fs::File::create(&path).unwrap(), flate2::Compression::fast());
    for v in [1.0f32, 2.0, 0.5, 0.25, -3.0, 1.0, 0.5, 0.5] {
        packed.write_all(&v.to_le_bytes()).unwrap();
    }
    packed.finish().unwrap();
    assert_eq!(scan(&open(&path), 0).points, [[1.0, 2.0, 0.5], [-3.0, 1.0, 0.5]]);
}
