//! Read back by the reader of bags, and by the Python packages of others.

use std::path::Path;

use portolan::geom::Grid;
use portolan::surface::Mesh;
use portolan_ros::container::{Bag, BagOptions, DefinitionFormat, Encoding};

use super::*;
use crate::map_server::MapCell;
use crate::testing::{python, says, temporary, written};
use crate::{IoError, Polyline};

const CELLS: [MapCell; 6] =
    [MapCell::Free, MapCell::Occupied, MapCell::Unknown, MapCell::Unknown, MapCell::Free, MapCell::Occupied];

fn grid() -> Grid<2> {
    Grid::new([-1.5, 2.25], 0.25, [3, 2])
}

fn mesh() -> Mesh {
    Mesh {
        origin: [500_000.0, 4_000_000.0, -3.0],
        vertices: vec![[0.5, 0.25, 0.125], [1.5, 0.25, 0.125], [0.5, 1.25, 0.125], [0.5, 0.25, 3.125]],
        triangles: vec![[0, 2, 1], [0, 1, 3]],
        normals: Vec::new(),
        colors: vec![[255, 0, 0], [0, 255, 0], [0, 0, 255], [51, 102, 204]],
    }
}

/// Values one after the other, each aligned to its size.
struct Values<'a>(&'a [u8], usize);

impl Values<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let at = 4 + self.1.next_multiple_of(N);
        self.1 = at - 4 + N;
        self.0[at..at + N].try_into().unwrap()
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn f32s<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| f32::from_le_bytes(self.take()))
    }

    fn f64s<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| f64::from_le_bytes(self.take()))
    }

    fn string(&mut self) -> String {
        let length = self.u32() as usize;
        let text: Vec<u8> = (0..length).map(|_| self.take::<1>()[0]).collect();
        assert_eq!(text.last(), Some(&0));
        String::from_utf8(text[..length - 1].to_vec()).unwrap()
    }

    fn header(&mut self) {
        assert_eq!((self.u32(), self.u32(), self.string().as_str()), (0, 0, "map"));
    }

    fn is_at_its_end(&self) -> bool {
        self.1 + 4 == self.0.len()
    }
}

/// The only message of each topic, with its topic and type.
fn messages(path: &Path) -> Vec<(String, String, Vec<u8>)> {
    let bag = Bag::open(path, &BagOptions::default()).unwrap();
    assert!(bag.notes().is_empty(), "{:?}", bag.notes());
    let topics: Vec<u32> = (0..bag.topics().len() as u32).collect();
    let all: Vec<_> = bag.messages(&topics);
    assert_eq!(all.len(), topics.len());
    let read = |m: &portolan_ros::container::MessageRef| {
        let (topic, mut data) = (&bag.topics()[m.topic as usize], Vec::new());
        assert_eq!((topic.encoding, topic.definition_format), (Encoding::Cdr, DefinitionFormat::Ros2Msg));
        assert!(topic.latched && m.log_time == 0);
        bag.read(m, &mut data).unwrap();
        (topic.name.clone(), topic.type_name.clone(), data)
    };
    all.iter().map(read).collect()
}

#[test]
fn a_map_of_two_dimensions_is_read_back() {
    let (_folder, path) = temporary("map.mcap");
    let (grid, points) = (grid(), [[-1.125, 2.375, 0.0], [-0.875, 2.625, 0.0]]);
    let lines: Vec<Polyline> = vec![vec![[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]], vec![[7.0, 7.0]]];
    let map = MapMessages {
        cells: Some((&grid, 0.5, &CELLS)),
        occupied: Some(&points),
        contour: Some((&lines, 0.05)),
        mesh: None,
    };
    write_map_mcap(&path, &map).unwrap();
    let all = messages(&path);
    let names: Vec<_> = all.iter().map(|(n, t, _)| format!("{n} {t}")).collect();
    assert_eq!(
        names,
        [
            "/map nav_msgs/msg/OccupancyGrid",
            "/occupied sensor_msgs/msg/PointCloud2",
            "/contour visualization_msgs/msg/Marker"
        ]
    );
    let mut values = Values(&all[0].2, 0);
    values.header();
    assert_eq!((values.u32(), values.u32(), values.f32s()), (0, 0, [0.25]));
    assert_eq!((values.u32(), values.u32()), (3, 2));
    assert_eq!(values.f64s(), [-1.5, 2.25, 0.0, 0.0, 0.0, 0.25f64.sin(), 0.25f64.cos()]);
    assert_eq!((values.u32(), values.take::<1>()), (6, [0]));
    assert_eq!((0..5).map(|_| values.take::<1>()[0] as i8).collect::<Vec<_>>(), [100, -1, -1, 0, 100]);
    assert!(values.is_at_its_end());
    let mut values = Values(&all[1].2, 0);
    values.header();
    assert_eq!((values.u32(), values.u32(), values.u32()), (1, 2, 3));
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        assert_eq!((values.string().as_str(), values.u32()), (name, 4 * i as u32));
        assert_eq!((values.take::<1>(), values.u32()), ([7], 1));
    }
    assert_eq!((values.take::<1>(), values.u32(), values.u32(), values.u32()), ([0], 12, 24, 24));
    assert_eq!(values.f32s(), [-1.125, 2.375, 0.0, -0.875, 2.625, 0.0]);
    assert_eq!(values.take::<1>(), [1]);
    assert!(values.is_at_its_end());
    let mut values = marker(&all[2].2, "contour", 5);
    assert_eq!(values.f64s(), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.05, 1.0, 1.0]);
    assert_eq!(values.f32s(), [0.1, 0.5, 1.0, 1.0]);
    assert_eq!((values.u32(), values.u32(), values.take::<1>(), values.u32()), (0, 0, [0], 4));
    assert_eq!(values.f64s(), [0.0, 1.0, 0.0, 2.0, 3.0, 0.0, 2.0, 3.0, 0.0, 4.0, 5.0, 0.0]);
    assert_eq!(values.u32(), 0);
    ends(values);
}

/// Up to its pose.
fn marker<'a>(bytes: &'a [u8], space: &str, kind: u32) -> Values<'a> {
    let mut values = Values(bytes, 0);
    values.header();
    assert_eq!((values.string().as_str(), values.u32(), values.u32(), values.u32()), (space, 0, kind, 0));
    values
}

/// From its texture on.
fn ends(mut values: Values<'_>) {
    assert_eq!((values.string(), values.u32(), values.u32()), (String::new(), 0, 0));
    assert_eq!((values.string(), values.string()), (String::new(), String::new()));
    assert_eq!((values.u32(), values.u32()), (0, 0));
    assert_eq!((values.string(), values.string(), values.string()), Default::default());
    assert_eq!((values.u32(), values.take::<1>()), (0, [0]));
    assert!(values.is_at_its_end());
}

#[test]
fn a_surface_far_from_zero_is_read_back() {
    let (_folder, path) = temporary("map.mcap");
    let (mesh, points) = (mesh(), [[500_000.123_456, 4_000_000.5, -3.0]]);
    write_map_mcap(&path, &MapMessages { occupied: Some(&points), mesh: Some(&mesh), ..Default::default() })
        .unwrap();
    let all = messages(&path);
    let cloud = &all[0].2;
    // The three numbers before the last byte, as they are.
    let numbers: Vec<u8> = points[0].iter().flat_map(|c| c.to_le_bytes()).collect();
    assert!(all[0].0 == "/occupied" && cloud[..cloud.len() - 1].ends_with(&numbers));
    assert_eq!(all[1].0, "/mesh");
    let mut values = marker(&all[1].2, "mesh", 11);
    assert_eq!(values.f64s(), [500_000.0, 4_000_000.0, -3.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
    assert_eq!(values.f32s::<4>()[3], 1.0);
    assert_eq!((values.u32(), values.u32(), values.take::<1>(), values.u32()), (0, 0, [0], 6));
    for v in [0, 2, 1, 0, 1, 3] {
        assert_eq!(values.f64s(), mesh.vertices[v].map(f64::from));
    }
    assert_eq!(values.u32(), 6);
    for v in [0, 2, 1, 0, 1, 3] {
        let [r, g, b] = mesh.colors[v].map(|c| f32::from(c) / 255.0);
        assert_eq!(values.f32s(), [r, g, b, 1.0]);
    }
    ends(values);
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let (_folder, path) = temporary("map.mcap");
    let (grid, mut bad_mesh) = (grid(), mesh());
    bad_mesh.triangles.push([0, 1, 4]);
    let nothing = MapMessages::default();
    let line: Vec<Polyline> = vec![vec![[0.0, f64::NAN]]];
    for (map, part) in [
        (MapMessages { cells: Some((&grid, 0.0, &CELLS[1..])), ..nothing }, "the map size"),
        (MapMessages { cells: Some((&grid, f64::NAN, &CELLS)), ..nothing }, "the resolution"),
        (MapMessages { occupied: Some(&[[f64::INFINITY; 3]]), ..nothing }, "a point"),
        (MapMessages { contour: Some((&line, 0.1)), ..nothing }, "a point"),
        (MapMessages { contour: Some((&[], 0.0)), ..nothing }, "the width of lines"),
        (MapMessages { mesh: Some(&bad_mesh), ..nothing }, "a triangle"),
    ] {
        let refused = write_map_mcap(&path, &map);
        assert!(matches!(refused, Err(IoError::Unwritable { .. })) && !path.exists());
        says(refused, part);
    }
    // Empty parts are messages; no parts are a file.
    write_map_mcap(&path, &MapMessages { occupied: Some(&[]), mesh: Some(&Mesh::default()), ..nothing })
        .unwrap();
    assert_eq!(messages(&path).len(), 2);
    write_map_mcap(&path, &nothing).unwrap();
    assert!(messages(&path).is_empty());
}

#[test]
fn the_same_map_gives_the_same_bytes() {
    let (grid, mesh) = (grid(), mesh());
    let map = MapMessages { cells: Some((&grid, 0.0, &CELLS)), mesh: Some(&mesh), ..Default::default() };
    let bytes = || written(|path| write_map_mcap(path, &map));
    assert_eq!(bytes(), bytes());
}

/// By definitions of their own (rosbags) and by those of the file (mcap-ros2-support).
const ROSBAGS: &str = "
import sys
from rosbags.typesys import Stores, get_typestore
from rosbags.rosbag2.storage_mcap import McapReader
from pathlib import Path
store = get_typestore(Stores.ROS2_HUMBLE)
reader = McapReader(Path(sys.argv[1]))
reader.open()
seen = {}
for connection, time, data in reader.messages(reader.connections):
    seen[connection.topic] = store.deserialize_cdr(data, connection.msgtype)
    assert time == 0
    assert connection.ext.offered_qos_profiles[0].durability.name == 'TRANSIENT_LOCAL'
    # What was read gives the same bytes.
    assert bytes(store.serialize_cdr(seen[connection.topic], connection.msgtype)) == bytes(data)
grid = seen['/map']
assert (grid.info.width, grid.info.height, grid.info.resolution) == (3, 2, 0.25)
assert list(grid.data) == [0, 100, -1, -1, 0, 100] and grid.header.frame_id == 'map'
assert seen['/occupied'].data.view('<f4').tolist() == [1.0, 2.0, 3.0]
mesh = seen['/mesh']
assert mesh.type == mesh.TRIANGLE_LIST and len(mesh.points) == 6 and mesh.points[1].y == 1.25
assert [round(c.r * 255) for c in mesh.colors] == [255, 0, 0, 255, 0, 51]
";

const MCAP_ROS2: &str = "
import sys
from mcap_ros2.reader import read_ros2_messages
seen = {m.channel.topic: m.ros_msg for m in read_ros2_messages(sys.argv[1])}
assert list(seen['/map'].data) == [0, 100, -1, -1, 0, 100] and seen['/map'].info.origin.position.y == 2.25
assert seen['/mesh'].points[5].z == 3.125 and seen['/mesh'].pose.position.x == 500000.0
assert seen['/occupied'].fields[2].name == 'z' and seen['/contour'].type == 5
";

#[test]
fn other_readers_read_it() {
    let (_folder, path) = temporary("map.mcap");
    let (grid, mesh, points) = (grid(), mesh(), [[1.0, 2.0, 3.0]]);
    let lines: Vec<Polyline> = vec![vec![[0.0, 1.0], [2.0, 3.0]]];
    let map = MapMessages {
        cells: Some((&grid, 0.0, &CELLS)),
        occupied: Some(&points),
        contour: Some((&lines, 0.05)),
        mesh: Some(&mesh),
    };
    write_map_mcap(&path, &map).unwrap();
    for (package, script) in [("rosbags", ROSBAGS), ("mcap_ros2", MCAP_ROS2)] {
        if let Some(python) = python(package) {
            python.run(script, &[&path]).unwrap();
        }
    }
}
