//! Seeds of the targets: small files, by the project's own writers where it has one.

use std::io::Cursor;
use std::path::Path;

use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
use portolan::cell::{LogOdds32, OccupancyModel};
use portolan::geom::{Grid, Lattice, Pose};
use portolan::map::Occupancy;
use portolan::store::Tree;
use portolan::surface::Mesh;
use portolan_graph::{Edge, EdgeKind, Information, PoseGraph, write_g2o};
use portolan_io::*;

use crate::{bags, folder, two};

/// The seeds of a target.
pub fn of(name: &str) -> Vec<Vec<u8>> {
    match name {
        "message" => messages(),
        "container" | "bag_log" => bags::all(),
        "e57" => vec![e57_file(false), e57_file(true)],
        "las" => vec![las_file(false), las_file(true)],
        "ptx" => vec![ptx_file()],
        "pcd" => pcd_files(),
        "ply" => vec![
            written("a.ply", |path| write_ply_cloud(path, &cloud())),
            ply_mesh_to_bytes(&mesh()).unwrap(),
        ],
        "mesh" => vec![glb_to_bytes(&mesh()).unwrap(), written("a.obj", |path| write_obj(path, &mesh()))],
        "xyz" => texts(&[
            "1 2 3\n4 5 6.5\n",
            "x,y,z,intensity\n1,2,3,9\n-0.0,1e3,nan,2\n",
            "2\n1 2 3 40 1 2 3\n4 5 6 41 9 9 9\n",
        ]),
        "kitti" => vec![written("a.bin", |path| write_kitti_bin(path, &cloud()))],
        "query_points" => texts(&["x,y\n1,2\n3,4 # c\n", "1,2,3\n4,5,6\n"]),
        "numpy" => numpy_files(),
        "carmen" => texts(&[concat!(
            "# message_name [message contents]\nPARAM robot_frontlaser_offset 0.1\nODOM 0 0 0 0 0 0 1.5 host 1.5\n",
            "FLASER 4 1.0 2.0 81.91 3.0 0 0 0 0 0 0 1.5 host 1.5\n",
            "ROBOTLASER1 0 -1.5 3.14 1.0 81.0 0.01 0 4 1.0 2.0 3.0 4.0 0 0 0 0 0 0 0 0 0 0 0 0 2.5 host 2.5\n"
        )]),
        "poses" => texts(&[
            "1 2 0.5\n",
            "0.5 1 2 3 0 0 0 1\n1.5 1 2 3 0 0 0 1\n",
            "1 0 0 0 0 1 0 0 0 0 1 0\n",
            "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
            "1,0,0,0,\n0,1,0,0,\n0,0,1,0,\n0,0,0,16.5,\n",
        ]),
        "map_server" => map_server_files(),
        "octomap" => octomap_files(),
        "g2o" => vec![g2o_file::<2>(), g2o_file::<3>()],
        "map_file" => map_files(),
        "transforms_json" => texts(&[concat!(
            "{\"fl_x\": 10, \"fl_y\": 12, \"cx\": 3.5, \"cy\": 2.5, \"w\": 8, \"h\": 6, \"k1\": 0.01, \"frames\": [{\"file_path\": ",
            "\"images/0.png\", \"depth_file_path\": \"depth/0.png\", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}"
        )]),
        "colmap_text" => vec![two(
            b"# Camera list\n1 OPENCV 8 6 10 12 3.5 2.5 0.01 0 0 0\n",
            b"# Image list\n1 1 0 0 0 0 0 0 1 0.jpg\n1 2 -1\n2 0.5 0.5 0.5 0.5 1 2 3 1 1.jpg\n\n",
        )],
        "colmap_binary" => vec![colmap_binary()],
        "tum" => vec![
            b"1.5 rgb/0.png 1.5 depth/0.png 1.5 1 2 3 0 0 0 1\n".to_vec(),
            b"rgb/0.png depth/0.png 1 2 3 0 0 0 1\n".to_vec(),
            two(b"# depth\n1.5 depth/0.png\n", b"1.49 1 2 3 0 0 0 1\n1.51 1 2 3 0 0 0 1\n"),
        ],
        "depth_picture" => vec![large_depth_png()],
        _ => panic!("no seeds of {name}"),
    }
}

fn texts(all: &[&str]) -> Vec<Vec<u8>> {
    all.iter().map(|text| text.as_bytes().to_vec()).collect()
}

/// What a writer of files writes.
fn written(name: &str, write: impl FnOnce(&Path) -> portolan_io::Result<()>) -> Vec<u8> {
    let path = folder().join(name);
    write(&path).unwrap();
    std::fs::read(path).unwrap()
}

fn messages() -> Vec<Vec<u8>> {
    let of = |choice: u8, definition: &str, data: &[u8]| {
        [&[choice][..], &two(definition.as_bytes(), data)].concat()
    };
    let cdr = [&[0, 1, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 4, 0, 0, 0][..], b"map\0"].concat();
    let idl = "module a { module msg { struct B { long x; sequence<double> y; string s; }; }; };";
    vec![
        of(0, &format!("{}{}", bags::SCAN, bags::HEADER), &bags::scan(1)),
        of(0, &format!("{}{}", bags::CLOUD, bags::HEADER), &bags::cloud(1)),
        of(
            1,
            "builtin_interfaces/Time stamp\nstring frame_id\n===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
            &cdr,
        ),
        of(
            1,
            "uint8 A=3\nint32[<=3] x\nstring<=5 s \"hi\"\nbool[2] b\n",
            &[0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0],
        ),
        of(2, idl, &[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]),
        of(3, "std_msgs/msg/Header", &cdr),
    ]
}

fn cloud() -> PointCloudFile {
    let points: Vec<[f32; 3]> = (0..6).map(|i| [i as f32, 1.0 - i as f32, 0.5]).collect();
    PointCloudFile {
        intensity: vec![0.5; 6],
        colors: vec![[1, 2, 3]; 6],
        normals: vec![[0.0, 0.0, 1.0]; 6],
        points,
        ..Default::default()
    }
}

fn mesh() -> Mesh {
    let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    Mesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Default::default() }
}

fn pcd_files() -> Vec<Vec<u8>> {
    let head = |data: &str| {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb t\nSIZE 4 4 4 4 8\nTYPE F F F U F\nCOUNT 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
             VIEWPOINT 0 0 1 1 0 0 0\nPOINTS 2\nDATA {data}\n"
        )
    };
    // Two points by column, all zeros: a run of one byte that LZF repeats.
    let packed = [0, 0, 0xe0, 38, 0];
    let sizes = [&(packed.len() as u32).to_le_bytes()[..], &48u32.to_le_bytes()].concat();
    vec![
        written("a.pcd", |path| write_pcd(path, &cloud())),
        (head("ascii") + "1 2 3 255 0.5\nnan 5 6 7 1e9\n").into_bytes(),
        [head("binary_compressed").as_bytes(), &sizes, &packed].concat(),
    ]
}

fn ptx_file() -> Vec<u8> {
    let head = "2\n2\n1 2 3\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n";
    format!("{head}1 2 3 0.5 1 2 3\n0 0 0 0.5 0 0 0\n4 5 6 0.1 9 9 9\n-1 0 2 0 1 1 1\n")
        .repeat(2)
        .into_bytes()
}

fn e57_file(spherical: bool) -> Vec<u8> {
    use RecordName::*;
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "a").unwrap();
    let names = match spherical {
        true => [SphericalRange, SphericalAzimuth, SphericalElevation],
        false => [CartesianX, CartesianY, CartesianZ],
    };
    let double = RecordDataType::Double { min: None, max: None };
    let whole = |max| RecordDataType::Integer { min: 0, max };
    let mut prototype: Vec<Record> =
        names.into_iter().map(|name| Record { name, data_type: double.clone() }).collect();
    prototype.extend([RowIndex, ColumnIndex].map(|name| Record { name, data_type: whole(3) }));
    prototype.extend([ColorRed, ColorGreen, ColorBlue].map(|name| Record { name, data_type: whole(255) }));
    let mut scan = writer.add_pointcloud("scan", prototype).unwrap();
    for i in 0..12i64 {
        let mut values = [2.0, 0.1 * i as f64, 0.2].map(RecordValue::Double).to_vec();
        values.extend([i / 4, i % 4, 1, 2, 3].map(RecordValue::Integer));
        scan.add_point(values).unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    out.into_inner()
}

fn las_file(packed: bool) -> Vec<u8> {
    let mut builder = las::Builder::from((1, 2));
    builder.point_format = las::point::Format::new(3).unwrap();
    builder.point_format.is_compressed = packed;
    let mut writer = las::Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
    for i in 0..20 {
        let color = Some(las::Color::new(256, 512, 65535));
        let point = las::Point { x: f64::from(i), gps_time: Some(f64::from(i)), color, ..Default::default() };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
    writer.into_inner().unwrap().into_inner()
}

fn numpy_files() -> Vec<Vec<u8>> {
    let array = NpyArray::vector(&[1.0, 2.0, -0.0]);
    let text = NpyArray::text("hello");
    vec![
        written("a.npy", |path| write_npy(path, &array)),
        written("b.npy", |path| write_npy(path, &text)),
        written("a.npz", |path| write_npz(path, &[("a", &array), ("b", &text)])),
    ]
}

fn map_server_files() -> Vec<Vec<u8>> {
    let grid = Grid::new([0.0; 2], 0.5, [4, 3]);
    let cells: Vec<MapCell> =
        (0..12).map(|i| [MapCell::Free, MapCell::Occupied, MapCell::Unknown][i % 3]).collect();
    let yaml = written("a.yaml", |path| write_map_server(path, &grid, &cells));
    let pgm = std::fs::read(folder().join("a.pgm")).unwrap();
    let text = "image: a.png\nresolution: 0.05\norigin: [1, 2, nan]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\nmode: scale\n";
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 3, 2);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(vec![0, 0, 0, 205, 205, 205, 255, 255, 255]);
    encoder.write_header().unwrap().write_image_data(&[0, 1, 2, 0, 1, 2]).unwrap();
    vec![two(&yaml, &pgm), two(text.as_bytes(), &png)]
}

fn occupancy() -> Occupancy<3, LogOdds32> {
    let mut map = Occupancy::new(Lattice::new([-0.8; 3], 0.1), OccupancyModel::default()).unwrap();
    let points: Vec<[f64; 3]> =
        (0..40).map(|i| [0.1 + 0.01 * f64::from(i), 0.6, 0.02 * f64::from(i) - 0.4]).collect();
    map.integrate_points(&points, [0.0; 3]).unwrap();
    map
}

fn octomap_files() -> Vec<Vec<u8>> {
    let tree = Tree::from_bricks(occupancy().store()).unwrap();
    vec![octomap_bt_to_bytes(&tree).unwrap(), written("a.ot", |path| write_octomap_ot(path, &tree, 1.0))]
}

fn g2o_file<const D: usize>() -> Vec<u8> {
    let mut graph = PoseGraph::<D>::new();
    let mut pose = Pose::<D>::IDENTITY;
    for id in 0..3 {
        graph.add_vertex(id, pose).unwrap();
        pose.translation[0] += 1.0;
    }
    graph.set_fixed(0, true).unwrap();
    for i in 0..2 {
        let information = Information::from_sigmas(0.05, 0.02).unwrap();
        let (i_from_j, kind) = (Pose::IDENTITY, EdgeKind::Odometry);
        graph.add_edge(Edge { i, j: i + 1, i_from_j, information, kind }).unwrap();
    }
    let mut bytes = Vec::new();
    write_g2o(&graph, &mut bytes).unwrap();
    bytes
}

fn map_files() -> Vec<Vec<u8>> {
    let empty = MapFile::<2>::default().to_bytes().unwrap();
    let mut map = Occupancy::<3>::new(Lattice::new([-0.8; 3], 0.1), OccupancyModel::default()).unwrap();
    map.integrate_points(&[[0.4, 0.2, 0.1]], [0.0; 3]).unwrap();
    let model = *map.model();
    let bricks = OccupancyBricks { store: map.into_store(), model, more: Default::default() };
    let mut file = MapFile::<3>::default();
    file.occupancy_bricks = Some(bricks);
    file.poses = vec![Pose::IDENTITY];
    vec![empty, file.to_bytes().unwrap()]
}

fn colmap_binary() -> Vec<u8> {
    let mut cameras = 1u64.to_le_bytes().to_vec();
    cameras.extend([1u32, 1].iter().flat_map(|v| v.to_le_bytes()));
    cameras.extend([8u64, 6].iter().flat_map(|v| v.to_le_bytes()));
    cameras.extend([10.0f64, 12.0, 3.5, 2.5].iter().flat_map(|v| v.to_le_bytes()));
    let mut images = 1u64.to_le_bytes().to_vec();
    images.extend(1u32.to_le_bytes());
    images.extend([1.0f64, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0].iter().flat_map(|v| v.to_le_bytes()));
    images.extend(1u32.to_le_bytes());
    images.extend(b"0.jpg\0");
    images.extend(1u64.to_le_bytes());
    images.extend([1.0f64, 2.0].iter().flat_map(|v| v.to_le_bytes()));
    images.extend((-1i64).to_le_bytes());
    two(&cameras, &images)
}

/// A depth image whose camera is in its middle, as Redwood's default wants it.
fn large_depth_png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 64, 48);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&1000u16.to_be_bytes().repeat(64 * 48)).unwrap();
    bytes
}
