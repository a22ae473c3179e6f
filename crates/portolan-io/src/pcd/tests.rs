use std::time::Duration;

use super::{lzf::tests::pack, parse, read_pcd, write_pcd};
use crate::bytes::Input;
use crate::points::{CloudGrid, PointCloudFile, RefusedPoints, Viewpoint};
use crate::testing::{no_panic, real_data, says, temporary};
use crate::{IoError, Result, read_points};

fn read(bytes: impl Into<Vec<u8>>) -> Result<PointCloudFile> {
    parse(Input::from_reader(std::io::Cursor::new(bytes.into()), "a.pcd".as_ref())?)
}

/// Fields in an odd order, padding, and types of every kind.
const MIXED: &str = "# .PCD v0.7\nVERSION 0.7\nFIELDS ring z _ rgb x y t normal_x normal_y normal_z intensity\n\
    SIZE 2 4 1 4 4 4 4 4 4 4 1\nTYPE U F U F F F U F F F U\nCOUNT 1 1 3 1 1 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
    VIEWPOINT 1 2 3 0.5 0.5 -0.5 0.5\nPOINTS 2\n";

fn mixed_points() -> Vec<u8> {
    let mut bytes = Vec::new();
    for (ring, z, rgb, x, y, t, intensity) in [
        (7u16, 3.5f32, 0xff0a_0b0cu32, 1.0f32, -2.0f32, 1_000_000_000u32, 200u8),
        (9, 0.25, 0x0001_0203, -1.5, 4.0, 1_250_000_000, 3),
    ] {
        bytes.extend(ring.to_le_bytes());
        bytes.extend(z.to_le_bytes());
        bytes.extend([0xaa; 3]);
        bytes.extend(rgb.to_le_bytes());
        bytes.extend(x.to_le_bytes());
        bytes.extend(y.to_le_bytes());
        bytes.extend(t.to_le_bytes());
        for v in [0.0f32, 0.0, 1.0] {
            bytes.extend(v.to_le_bytes());
        }
        bytes.push(intensity);
    }
    bytes
}

fn mixed_cloud() -> PointCloudFile {
    PointCloudFile {
        points: vec![[1.0, -2.0, 3.5], [-1.5, 4.0, 0.25]],
        intensity: vec![200.0, 3.0],
        times: vec![0.0, 0.25],
        start_time: 1.0,
        rings: vec![7, 9],
        colors: vec![[10, 11, 12], [1, 2, 3]],
        normals: vec![[0.0, 0.0, 1.0]; 2],
        viewpoint: Some(Viewpoint { position: [1.0, 2.0, 3.0], quaternion: [0.5, -0.5, 0.5, 0.5] }),
        ..PointCloudFile::default()
    }
}

/// The columns of the points one after the other, packed.
fn packed(points: &[u8], sizes: &[usize]) -> Vec<u8> {
    let stride: usize = sizes.iter().sum();
    let mut columns = Vec::new();
    let mut start = 0;
    for size in sizes {
        for point in points.chunks(stride) {
            columns.extend_from_slice(&point[start..start + size]);
        }
        start += size;
    }
    let body = pack(&columns);
    [&(body.len() as u32).to_le_bytes()[..], &(columns.len() as u32).to_le_bytes(), &body].concat()
}

fn mixed_packed() -> Vec<u8> {
    let body = packed(&mixed_points(), &[2, 4, 3, 4, 4, 4, 4, 4, 4, 4, 1]);
    [MIXED.as_bytes(), b"DATA binary_compressed\n", &body].concat()
}

#[test]
fn a_cloud_without_points_is_a_cloud() {
    let head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 0\nHEIGHT 1\nPOINTS 0\n";
    let none = [0u8; 8];
    for (data, body) in [("ascii", &[][..]), ("binary", &[]), ("binary_compressed", &none)] {
        let cloud = read([format!("{head}DATA {data}\n").as_bytes(), body].concat()).unwrap();
        assert!(cloud.points.is_empty(), "{data}");
    }
    says(read("FIELDS x y i\nSIZE 4 4 4\nTYPE F F F\nWIDTH 0\nHEIGHT 1\nDATA ascii\n"), "FIELDS is");
}

/// Where packing does not pay some writers leave the columns as they are, under equal sizes.
#[test]
fn packed_data_may_be_stored_as_it_is() {
    let head =
        "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nDATA binary_compressed\n";
    let columns: Vec<u8> = [1.5f32, 2.5, -3.5, 4.5, 5.5, 6.5].iter().flat_map(|v| v.to_le_bytes()).collect();
    let size = (columns.len() as u32).to_le_bytes();
    let cloud = read([head.as_bytes(), &size, &size, &columns].concat()).unwrap();
    assert_eq!(cloud.points, [[1.5, -3.5, 5.5], [2.5, 4.5, 6.5]]);
    let longer = (columns.len() as u32 + 1).to_le_bytes();
    says(read([head.as_bytes(), &longer, &size, &columns, &[9]].concat()), "the packed data is damaged");
}

#[test]
fn all_layouts_hold_the_same_cloud() {
    let binary = [MIXED.as_bytes(), b"DATA binary\n", &mixed_points()].concat();
    assert_eq!(read([&binary[..], b"\0\0\0\n"].concat()).unwrap(), mixed_cloud(), "padding");
    // More than the header announces: then they do not fit together.
    says(read([&binary[..], &mixed_points()].concat()), "the rest of the file is");
    says(read([&mixed_packed()[..], b"more"].concat()), "the rest of the file is 4 bytes");
    assert_eq!(read(binary).unwrap(), mixed_cloud());
    assert_eq!(read(mixed_packed()).unwrap(), mixed_cloud());
    let text = "7 3.5 0 0 0 4278848268 1 -2 1000000000 0 0 1 200\r\n\r\n9 0.25 0 0 0 66051 -1.5 4 1250000000 0 0 1 3";
    let ascii = [MIXED, "DATA ascii\r\n", text].concat();
    assert_eq!(read(ascii).unwrap(), mixed_cloud());
}

#[test]
fn what_open3d_writes() {
    let points = vec![
        [0.12, 4.5, -3.56],
        [4.49, -1.88, -0.77],
        [3.28, -0.91, 0.5],
        [-4.72, 2.54, 0.38],
        [-1.7, 2.88, -1.97],
        [-0.47, -3.66, -0.97],
    ];
    let colors = vec![[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3], [0; 3], [51, 102, 153]];
    let head = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\n\
                COUNT 1 1 1 1\nWIDTH 6\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 6\n";
    let compressed = b"DATA binary_compressed\n\\\x00\x00\x00`\x00\x00\x00\x1b\x8f\xc2\xf5=\x14\xae\x8f@\x85\xebQ@=\n\x97\xc0\
        \x9a\x99\xd9\xbf\xd7\xa3\xf0\xbe\x00\x00\x90@ \x07\x1f\xbf\xc3\xf5h\xbf\\\x8f\"@\xecQ8@q=j\xc0\n\xd7c\xc0\xb8\x1eE\
        \xbf\x00\x00\x00?\\\x8f\xc2\x07>\xf6(\xfc\xbf\xecQx \x0f\x00\xff\xc0\x02\x02\x00\xff\xff \x0b \x00\x03\x99f3\x00";
    let ascii = "DATA ascii\n0.1199999973 4.5 -3.559999943 16711680\n4.489999771 -1.879999995 -0.7699999809 65280\n\
        3.279999971 -0.9100000262 0.5 255\n-4.71999979 2.539999962 0.3799999952 16777215\n\
        -1.700000048 2.880000114 -1.970000029 0\n-0.4699999988 -3.660000086 -0.9700000286 3368601\n";
    for body in [&compressed[..], ascii.as_bytes()] {
        let cloud = read([head.as_bytes(), body].concat()).unwrap();
        assert_eq!((&cloud.points, &cloud.colors), (&points, &colors));
    }
}

#[test]
fn organized_clouds_keep_their_pixels_and_others_refuse_nan() {
    let text = |width, height| {
        format!(
            "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH {width}\nHEIGHT {height}\nPOINTS 4\nDATA ascii\n\
             1 2 3\nnan nan nan\n4 5 6\n7 8 2e8\n"
        )
    };
    let organized = read(text(2, 2)).unwrap();
    assert_eq!(organized.grid, Some(CloudGrid { columns: 2, rows: 2, pixels: vec![0, 2] }));
    assert_eq!(organized.refused, RefusedPoints { not_finite: 0, too_far: 1, no_reading: 1 });
    assert_eq!((organized.points.len(), organized.viewpoint), (2, None));
    let bag = read(text(4, 1)).unwrap();
    assert_eq!((bag.grid, bag.refused.not_finite), (None, 1));
}

#[test]
fn doubles_and_text_far_away_keep_their_millimetres() {
    let ascii =
        "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n500000.001 4000000.002 10\n";
    let cloud = read(ascii).unwrap();
    assert!((cloud.position(0)[1] - 4_000_000.002).abs() < 1e-6, "{:?}", cloud.position(0));
    let (_folder, path) = temporary("far.pcd");
    write_pcd(&path, &cloud).unwrap();
    let again = read_pcd(&path).unwrap();
    assert_eq!((again.offset, again.position(0)), (cloud.offset, cloud.position(0)));
}

#[test]
fn what_is_written_is_read() {
    let (_folder, path) = temporary("cloud.pcd");
    let unorganized = mixed_cloud();
    let grid = Some(CloudGrid { columns: 3, rows: 2, pixels: vec![1, 4] });
    let organized = PointCloudFile { grid, ..mixed_cloud() };
    for cloud in [unorganized, organized] {
        write_pcd(&path, &cloud).unwrap();
        let mut again = read_points(&path).unwrap();
        again.refused.no_reading = 0;
        assert_eq!(again, cloud);
    }
    let wrong = PointCloudFile { colors: vec![[0; 3]], ..mixed_cloud() };
    assert!(matches!(write_pcd(&path, &wrong), Err(IoError::Unwritable { .. })));
    let wrong = CloudGrid { columns: 1, rows: 1, pixels: vec![0, 1] };
    let wrong = PointCloudFile { grid: Some(wrong), ..mixed_cloud() };
    assert!(matches!(write_pcd(&path, &wrong), Err(IoError::Unwritable { .. })));
}

#[test]
fn errors_name_the_place() {
    let head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
    for (text, part) in [
        ("", "a.pcd: line 1: the header is missing; give a PCD file"),
        ("hello\n", "line 1: the first word is \"hello\""),
        (
            "FIELDS x y\nSIZE 4 4\nTYPE F F\nWIDTH 0\nDATA ascii\n",
            "FIELDS is \"x y\"; give a cloud with fields x, y",
        ),
        (
            "FIELDS x y z\nSIZE 4 4\nTYPE F F F\nWIDTH 0\nDATA ascii\n",
            "2 SIZE, 3 TYPE, 0 COUNT; write 3 of each",
        ),
        ("FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nWIDTH 0\nDATA ascii\n", "a TYPE is \"F\" of size \"3\""),
        (&format!("{head}WIDTH -1\n"), "line 4: WIDTH is \"-1\"; write a whole number"),
        (&format!("{head}WIDTH 4\nHEIGHT 4\nPOINTS 3\nDATA ascii\n"), "4 x 4 with 3 POINTS"),
        (&format!("{head}WIDTH 9999999999\nHEIGHT 9999999999\nDATA binary\n"), "at most 1073741824"),
        (
            &format!("{head}WIDTH 2\nDATA binary\n123"),
            "byte 55: the data is 3 bytes; the header announces 24",
        ),
        (&format!("{head}WIDTH 2\nDATA packed\n"), "line 5: DATA is \"packed\"; write ascii"),
        (&format!("{head}WIDTH 2\nDATA ascii\n1 2 3\n"), "the number of points is 1; the header announces 2"),
        (&format!("{head}WIDTH 1\nDATA ascii\n1 2\n"), "line 6: column 3 is missing; write 3 numbers"),
        (&format!("{head}WIDTH 1\nDATA ascii\n1 2 3 4\n"), "line 6: the number of columns is too large"),
        (&format!("{head}WIDTH 0\nDATA ascii\n1 2 3\n"), "line 6: a line behind the last point is \"1 2 3\""),
        (&format!("{head}WIDTH 2\nDATA binary_compressed\n12345678"), "the unpacked size is 943142453"),
        (&format!("{head}VIEWPOINT 0 0 0\n"), "line 4: VIEWPOINT is \"VIEWPOINT 0 0 0\"; write seven"),
    ] {
        says(read(text), part);
    }
}

#[test]
fn no_bytes_make_it_panic() {
    let ascii =
        [MIXED, "DATA ascii\n7 3.5 0 0 0 1 1 -2 1 0 0 1 200\n9 0.25 0 0 0 1 -1.5 4 1 0 0 1 3\n"].concat();
    for good in
        [ascii.into_bytes(), [MIXED.as_bytes(), b"DATA binary\n", &mixed_points()].concat(), mixed_packed()]
    {
        no_panic(&good, 23, 3000, read);
    }
}

#[test]
fn the_scans_of_the_hall() {
    let mut total = 0;
    let mut fastest = Duration::MAX;
    for k in 0..48 {
        let Some(path) = real_data(&format!("lidar3d_balm_hall/full{}.pcd", 2 * k)) else { return };
        let start = std::time::Instant::now();
        let cloud = read_pcd(path).unwrap();
        fastest = fastest.min(start.elapsed());
        assert_eq!((cloud.intensity.len(), cloud.refused), (cloud.points.len(), RefusedPoints::default()));
        assert_eq!(cloud.viewpoint, Some(Viewpoint::NONE));
        total += cloud.points.len();
    }
    assert_eq!(total, 3_819_954);
    println!("fastest scan: {fastest:?}");
}

#[test]
fn the_simulated_scans() {
    for k in 1..=12 {
        let Some(path) = real_data(&format!("lidar3d_la3dm_sim_structured/sim_structured_{k}.pcd")) else {
            return;
        };
        let cloud = read_pcd(path).unwrap();
        assert_eq!((cloud.points.len(), cloud.refused), (3500, RefusedPoints::default()));
        assert!(cloud.viewpoint.is_some_and(|v| v.position != [0.0; 3]));
    }
}
