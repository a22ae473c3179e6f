use std::time::Duration;

use super::{parse, read_ply_cloud, read_ply_mesh, write};
use crate::Result;
use crate::bytes::Input;
use crate::points::{CloudGrid, PointCloudFile};
use crate::testing::{no_panic, real_data, says};

fn cloud(bytes: impl Into<Vec<u8>>) -> Result<PointCloudFile> {
    parse(Input::from_reader(std::io::Cursor::new(bytes.into()), "a.ply".as_ref())?)
}

fn mesh(bytes: &[u8]) -> Result<super::PlyMesh> {
    super::mesh::parse_bytes(bytes, "a.ply".as_ref())
}

#[test]
fn faces_may_come_before_the_vertices_that_they_name() {
    let (vertices, faces) = ("0 0 0\n1 0 0\n0 1 0\n1 1 2\n", "3 0 1 2\n3 1 3 2\n");
    let vertex = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 2\nproperty list uchar int vertex_indices\n";
    let text = |head: [&str; 2], body: [&str; 2]| {
        format!("ply\nformat ascii 1.0\n{}end_header\n{}", head.concat(), body.concat())
    };
    let first = mesh(text([face, vertex], [faces, vertices]).as_bytes()).unwrap();
    let last = mesh(text([vertex, face], [vertices, faces]).as_bytes()).unwrap();
    assert_eq!(first, last);
    assert_eq!(first.triangles, [[0, 1, 2], [1, 3, 2]]);
    says(mesh(text([face, vertex], ["3 0 1 4\n3 1 3 2\n", vertices]).as_bytes()), "the file has 4 vertices");
    let more = text([vertex, face], [vertices, faces]) + "3 0 1 3\n";
    says(mesh(more.as_bytes()), "the rest of the file");
    says(cloud(more), "the rest of the file");
}

/// A square and a triangle on five vertices, one of which is NaN, after an element of an unknown name.
fn header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment made here\nelement other 2\nproperty list uchar short names\n\
         property int8 k\nelement vertex 5\nproperty uchar red\nproperty double z\nproperty uint8 green\n\
         property float32 x\nproperty short y\nproperty uchar blue\nelement face 3\nproperty float quality\n\
         property list uint8 int vertex_index\nend_header\n"
    )
}

/// The numbers of the file above, each with its type.
fn numbers() -> Vec<(f64, char)> {
    let mut all = vec![(2.0, 'B'), (-5.0, 'h'), (6.0, 'h'), (-1.0, 'b'), (0.0, 'B'), (3.0, 'b')];
    for (x, y, z) in [(0.0, 0, 0.5), (1.0, 0, 0.5), (1.0, 1, 0.5), (0.0, 1, 0.5), (f64::NAN, 2, 0.5)] {
        all.extend([(255.0, 'B'), (z, 'd'), (128.0, 'B'), (x, 'f'), (f64::from(y), 'h'), (7.0, 'B')]);
    }
    for corners in [&[0, 1, 2, 3][..], &[0, 1, 4], &[0, 1]] {
        all.extend([(0.25, 'f'), (corners.len() as f64, 'B')]);
        all.extend(corners.iter().map(|&c| (f64::from(c), 'i')));
    }
    all
}

fn binary(big: bool) -> Vec<u8> {
    let mut bytes = header(if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
    for (v, kind) in numbers() {
        let mut number = match kind {
            'B' => vec![v as u8],
            'b' => vec![v as i8 as u8],
            'h' => (v as i16).to_be_bytes().to_vec(),
            'i' => (v as i32).to_be_bytes().to_vec(),
            'f' => (v as f32).to_be_bytes().to_vec(),
            _ => v.to_be_bytes().to_vec(),
        };
        if !big {
            number.reverse();
        }
        bytes.extend(number);
    }
    bytes
}

fn ascii() -> Vec<u8> {
    let words: Vec<String> = numbers().iter().map(|(v, _)| v.to_string()).collect();
    [header("ascii"), words.join(" "), "\n".to_owned()].concat().into_bytes()
}

#[test]
fn three_encodings_of_one_file() {
    for bytes in [ascii(), binary(false), binary(true)] {
        let cloud = cloud(bytes.clone()).unwrap();
        assert_eq!(cloud.points, [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.5]]);
        assert_eq!((cloud.colors, cloud.refused.not_finite), (vec![[255, 128, 7]; 4], 1));
        let mesh = mesh(&bytes).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.refused_faces), (5, 2));
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.colors, [[255, 128, 7]; 5]);
    }
}

#[test]
fn strips_are_taken_apart() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0 1 0 0 0 1 0 1 1 0\n8 0 1 2 3 -1 3 3 2\n";
    assert_eq!(mesh(text.as_bytes()).unwrap().triangles, [[0, 1, 2], [2, 1, 3]]);
}

const RANGE_SCAN: &str = "ply\nformat ascii 1.0\nobj_info num_cols 3\nobj_info num_rows 2\nelement vertex 3\n\
    property float x\nproperty float y\nproperty float z\nproperty float intensity\nelement range_grid 6\n\
    property list uchar int vertex_indices\nend_header\n1 1 1 0.1\n2 2 2 0.2\n3 3 3 0.3\n0\n1 2\n0\n1 0\n0\n1 1\n";

#[test]
fn range_scans_have_rows_and_columns() {
    let scan = cloud(RANGE_SCAN).unwrap();
    assert_eq!(scan.grid, Some(CloudGrid { columns: 3, rows: 2, pixels: vec![1, 3, 5] }));
    assert_eq!(scan.points, [[3.0; 3], [1.0; 3], [2.0; 3]]);
    assert_eq!((scan.intensity, scan.refused.no_reading), (vec![0.3, 0.1, 0.2], 3));
    let broken = RANGE_SCAN.replace("2 2 2 0.2", "nan 2 2 0.2");
    let scan = cloud(broken).unwrap();
    assert_eq!(scan.grid.unwrap().pixels, [1, 3]);
    assert_eq!((scan.refused.not_finite, scan.refused.no_reading), (1, 3));
}

#[test]
fn clouds_are_written_and_read() {
    let near = PointCloudFile {
        points: vec![[1.0, -2.0, 0.1], [4.0, 5.0, 6.0]],
        intensity: vec![0.5, 0.75],
        normals: vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
        colors: vec![[1, 2, 3], [4, 5, 6]],
        ..PointCloudFile::default()
    };
    let points = vec![[0.125, 0.25, 0.0]];
    let far = PointCloudFile { offset: [500_000.0, 4_000_000.0, 0.0], points, ..PointCloudFile::default() };
    for expected in [near, far] {
        let mut bytes = Vec::new();
        write::write_to(&mut bytes, &expected).unwrap();
        assert_eq!(cloud(bytes).unwrap(), expected);
    }
}

#[test]
fn errors_name_the_place() {
    let head = "ply\nformat ascii 1.0\n";
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    for (text, part) in [
        ("", "a.ply: line 1: the header is missing; give a PLY file"),
        ("plyy\n", "line 1: the first line is \"plyy\""),
        ("ply\nend_header\n", "the format is missing"),
        (&format!("{head}element vertex -1\n"), "line 3: the number of an element is \"-1\""),
        (&format!("{head}property float x\n"), "line 3: a property is \"property float x\""),
        (&format!("{head}element vertex 1\nproperty half x\n"), "line 4: a property is"),
        (&format!("{head}element a 9999999999\nend_header\n"), "the number of properties of \"a\" is 0"),
        (&format!("{head}element vertex 2\n{xyz}end_header\n1 2 3\n4 5\n"), "line 10: \"z\" is missing"),
        (
            &format!("{head}element vertex 1\n{xyz}end_header\n1 a 3\n"),
            "line 8: \"y\" is \"a\"; write a number",
        ),
        (
            &format!("{head}element face 0\n{xyz}end_header\n"),
            "the elements is \"face\"; give a file with vertices",
        ),
        (&RANGE_SCAN.replace("num_cols 3", "num_cols 4"), "Some(4) x Some(2) for 6 pixels"),
        (
            &RANGE_SCAN.replace("\n1 2\n", "\n1 3\n"),
            "range_grid is [3.0]; a pixel has no vertex, or one of 3",
        ),
        (&RANGE_SCAN.replace("\n1 2\n", "\n1 1\n"), "range_grid is 1 again"),
    ] {
        says(cloud(text), part);
    }
    says(
        cloud(&binary(true)[..header("binary_big_endian").len() + 12]),
        "\"z\" is missing; the header announces more",
    );
    let mut wrong = ascii();
    let at = wrong.len() - 4;
    wrong[at] = b'9';
    says(mesh(&wrong), "a corner of a face is 9; the file has 5 vertices");
}

#[test]
fn no_bytes_make_it_panic() {
    for good in [ascii(), binary(false), binary(true), RANGE_SCAN.into()] {
        no_panic(&good, 29, 3000, |bytes| mesh(&bytes));
        no_panic(&good, 29, 3000, cloud);
    }
}

const BUNNY_SCANS: [&str; 10] =
    ["bun000", "bun045", "bun090", "bun180", "bun270", "bun315", "chin", "ear_back", "top2", "top3"];

#[test]
fn the_scans_of_the_bunny() {
    let (mut total, mut fastest) = (0, Duration::MAX);
    for name in BUNNY_SCANS {
        let Some(path) = real_data(&format!("rangescan_stanford_bunny/data/{name}.ply")) else { return };
        let start = std::time::Instant::now();
        let scan = read_ply_cloud(path).unwrap();
        fastest = fastest.min(start.elapsed());
        let grid = scan.grid.unwrap();
        assert_eq!((grid.columns, grid.rows, grid.pixels.len()), (512, 400, scan.points.len()));
        assert_eq!(scan.refused.no_reading as usize, 512 * 400 - scan.points.len());
        total += scan.points.len();
    }
    assert_eq!(total, 362_272);
    println!("fastest scan: {fastest:?}");
}

#[test]
fn the_mesh_of_the_bunny() {
    let Some(path) = real_data("rangescan_stanford_bunny/reconstruction/bun_zipper.ply") else { return };
    let mesh = read_ply_mesh(path).unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len(), mesh.refused_faces), (35_947, 69_451, 0));
}
