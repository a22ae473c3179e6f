//! `convert` into what planners take: arrays and costmaps, on small fields whose every cell is known.

use std::path::{Path, PathBuf};

use crate::support::{arg, fail, map, room, succeed};
use portolan::geom::Grid;
use portolan::handover::Inflation;
use portolan_io::{
    EsdfFile, MapCell, MapServerMap, NpyArray, NpyValues, Pgm, read_npy, read_npz, write_esdf,
};

fn array(path: &Path, name: &str) -> NpyArray {
    let arrays = read_npz(path).unwrap();
    arrays.into_iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no {name}")).1
}

fn numbers(array: &NpyArray) -> Vec<f64> {
    match &array.values {
        NpyValues::F32(v) => v.iter().map(|d| f64::from(*d)).collect(),
        NpyValues::F64(v) => v.clone(),
        NpyValues::U8(v) => v.iter().map(|d| f64::from(*d)).collect(),
        other => panic!("{other:?}"),
    }
}

/// A wall at x = 2 in a box of three different lengths; the last layer was never seen.
fn space(folder: &Path) -> (PathBuf, Grid<3>, Vec<f32>) {
    let grid = Grid::new([0.0, -1.0, 0.5], 0.5, [6, 5, 4]);
    let distance = |i: usize| {
        let [x, _, z] = grid.cell(i);
        if z == 3 { f32::NAN } else { (2.0 - 0.5 * (f64::from(x) + 0.5)).clamp(-1.0, 1.0) as f32 }
    };
    let distances: Vec<f32> = (0..grid.len()).map(distance).collect();
    let status: Vec<u8> =
        distances.iter().map(|d| if d.is_nan() { 0 } else { if d.abs() < 1.0 { 1 } else { 2 } }).collect();
    let path = folder.join("space.bin");
    write_esdf(&path, &grid, &distances, Some(&status)).unwrap();
    (path, grid, distances)
}

#[test]
fn plain_arrays_are_indexed_x_y_in_both_orders() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &[]);
    let EsdfFile::Two(field) = EsdfFile::read(out.join("esdf.bin")).unwrap() else { panic!() };
    let [nx, ny] = field.grid().shape;
    for (order, strides) in [("c", [ny, 1]), ("f", [1, nx])] {
        let npz = folder.path().join(format!("{order}.npz"));
        succeed(["convert", arg(&out), arg(&npz), "--order", order, "--unknown", "nan"]);
        let distance = array(&npz, "distance");
        assert_eq!((&distance.shape[..], distance.fortran), (&[nx, ny][..], order == "f"));
        let (values, status) = (numbers(&distance), numbers(&array(&npz, "status")));
        for i in 0..field.grid().len() {
            let [x, y] = field.grid().cell(i).map(|c| c as usize);
            let at = x * strides[0] + y * strides[1];
            assert_eq!((values[at] as f32).to_bits(), field.samples()[i].to_bits());
            assert_eq!(status[at] == 0.0, field.samples()[i].is_nan());
        }
        assert_eq!(numbers(&array(&npz, "origin")), field.grid().lattice.origin);
        assert_eq!(numbers(&array(&npz, "resolution")), [0.05]);
        assert_eq!(array(&npz, "order"), NpyArray::text(&order.to_uppercase()));
    }
    let npy = folder.path().join("one.npy");
    succeed(["convert", arg(&out.join("esdf.bin")), arg(&npy)]);
    assert_eq!(read_npy(&npy).unwrap().shape, [nx, ny]);
}

#[test]
fn layouts_are_those_of_their_consumers() {
    let folder = tempfile::tempdir().unwrap();
    let (file, grid, distances) = space(folder.path());
    let npz = folder.path().join("a.npz");
    let of = |more: &[&str]| {
        let mut arguments = vec!["convert", arg(&file), arg(&npz)];
        arguments.extend(more);
        succeed(arguments);
    };
    let refused = fail(2, ["convert", arg(&file), arg(&npz), "--layout", "gpmp2", "--unknown", "nan"]);
    assert!(refused.contains("only for --layout plain"), "{refused}");

    of(&["--layout", "gpmp2", "--unknown", "optimistic"]);
    let data = array(&npz, "data");
    assert_eq!((&data.shape[..], data.fortran), (&[4, 5, 6][..], false)); // layers, rows (y), columns (x)
    assert_eq!(numbers(&array(&npz, "origin")), [0.25, -0.75, 0.75]);
    let values = numbers(&data);
    for (i, d) in distances.iter().enumerate() {
        // Unknown and free: no less than the cell below.
        let known = if d.is_nan() { distances[i - 30] } else { *d };
        assert!(values[i] >= f64::from(known) - 1e-6 && (d.is_nan() || values[i] == f64::from(known)));
    }
    of(&["--layout", "casadi", "--bounds", "0,-1,0.5,3,1.5,2"]);
    assert_eq!(array(&npz, "values").shape, [6 * 5 * 3]);
    assert_eq!(numbers(&array(&npz, "z")), [0.75, 1.25, 1.75]);
    of(&["--layout", "curobo"]);
    let tensor = array(&npz, "feature_tensor");
    let NpyValues::F16(half) = tensor.values else { panic!() };
    assert_eq!(tensor.shape, grid.shape);
    assert_eq!(numbers(&array(&npz, "dims")), [3.0, 2.5, 2.0]);
    assert_eq!(numbers(&array(&npz, "pose")), [1.5, 0.25, 1.5, 1.0, 0.0, 0.0, 0.0]);
    // x slowest: the last cell along x of the lowest layer is inside.
    assert_eq!([half[0], half[5 * 5 * 4]], [0x3c00, 0xba00]); // 1 and -0.75
    assert_eq!(half[3], 0xb400); // never seen, half a cell from what is free: -0.25
    of(&["--layout", "curobo07", "--unknown", "pessimistic", "--precision", "f32"]);
    assert_eq!(numbers(&array(&npz, "feature_tensor"))[5 * 5 * 4], 0.75);

    let (_room, log) = room();
    assert!(fail(1, ["convert", arg(&log), arg(&npz)]).contains("a CARMEN log"));
    let yaml = folder.path().join("a.yaml");
    assert!(fail(2, ["convert", arg(&file), arg(&yaml), "--layout", "gpmp2"]).contains("are only for .npz"));
    assert!(fail(2, ["convert", arg(&file), arg(&npz), "--inflate", "1"]).contains("are only for .yaml"));
    assert!(fail(2, ["convert", arg(&file), arg(&npz), "--bounds", "0,0,1,1"]).contains("six numbers"));
    let outside = ["convert", arg(&file), arg(&npz), "--bounds", "50,0,0,51,1,1"];
    assert!(fail(1, outside).contains("no cell of the map"));
}

#[test]
fn costmaps_are_the_formula_over_the_distances() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &[]);
    let EsdfFile::Two(field) = EsdfFile::read(out.join("esdf.bin")).unwrap() else { panic!() };
    let yaml = folder.path().join("costs.yaml");
    succeed([
        "convert",
        arg(&out),
        arg(&yaml),
        "--inflate",
        "0.55",
        "--inscribed",
        "0.22",
        "--scaling",
        "10",
    ]);
    let how = Inflation { inscribed_radius: 0.22, inflation_radius: 0.55, cost_scaling_factor: 10.0 };
    let image = Pgm::read(yaml.with_extension("pgm")).unwrap();
    let mut kinds = [0; 4];
    for (pixel, d) in image.pixels.chunks(image.width).rev().flatten().zip(field.samples()) {
        let expected = Inflation::percent(how.cost(f64::from(*d)));
        assert_eq!(*pixel, expected.map_or(255, u16::from));
        kinds[match expected {
            None => 0,
            Some(0) => 1,
            Some(99..) => 2,
            _ => 3,
        }] += 1;
    }
    assert!(kinds.iter().all(|n| *n > 100), "{kinds:?}");
    let map = MapServerMap::read(&yaml).unwrap();
    assert_eq!(map.grid, *field.grid());
    let bad = ["convert", arg(&out), arg(&yaml), "--inflate", "0.1", "--inscribed", "0.2"];
    assert!(fail(2, bad).contains("the inflation radius"));
    let scale = ["convert", arg(&out), arg(&yaml), "--inflate", "0.5", "--mode", "scale"];
    assert!(fail(1, scale).contains("unknown space is"));
}

#[test]
fn a_layer_of_a_3d_field_becomes_a_2d_map() {
    let folder = tempfile::tempdir().unwrap();
    let (file, grid, _) = space(folder.path());
    let yaml = folder.path().join("layer.yaml");
    let refused = fail(2, ["convert", arg(&file), arg(&yaml), "--inflate", "1"]);
    assert!(refused.contains("--z LOW:HIGH"), "{refused}");
    let nan = fail(2, ["convert", arg(&file), arg(&yaml), "--z", "0.6:1.4", "--unknown", "nan"]);
    assert!(nan.contains("only for plain arrays"), "{nan}");
    succeed(["convert", arg(&file), arg(&yaml), "--z", "0.6:1.4"]);
    let map = MapServerMap::read(&yaml).unwrap();
    assert_eq!((map.grid.shape, map.grid.lattice.origin), ([6, 5], [0.0, -1.0]));
    let expected: Vec<_> =
        (0..30).map(|i| if i % 6 < 4 { MapCell::Free } else { MapCell::Occupied }).collect();
    assert_eq!(map.cells, expected);
    // Partly unknown columns are unknown, but where there is an obstacle.
    succeed(["convert", arg(&file), arg(&yaml), "--z", "0.6:2.4"]);
    let cells = MapServerMap::read(&yaml).unwrap().cells;
    assert!((0..30).all(|i| cells[i] == if i % 6 < 4 { MapCell::Unknown } else { MapCell::Occupied }));
    let none = ["convert", arg(&file), arg(&yaml), "--z", "5:6", "--unknown", "optimistic"];
    assert!(fail(1, none).contains("the height range"));
    assert_eq!(grid.shape, [6, 5, 4]);
}

/// The default of every file that has to say something of unknown space is an obstacle, and every file or line says what it is.
#[test]
fn unknown_space_is_an_obstacle_and_every_output_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let (file, grid, distances) = space(folder.path());
    let npz = folder.path().join("a.npz");
    let convert = |out: &Path, more: &[&str]| {
        let mut arguments = vec!["convert", arg(&file), arg(out), "--json"];
        arguments.extend(more);
        let document: serde_json::Value = serde_json::from_str(&succeed(arguments)).unwrap();
        document["unknown_as"].as_str().map(str::to_owned)
    };
    let main = |layout: &str| if layout == "plain" { "distance" } else { "values" };
    for layout in ["plain", "casadi"] {
        let of = |more: &[&str]| {
            let said = convert(&npz, &[&["--layout", layout], more].concat()).unwrap();
            assert_eq!(array(&npz, "unknown_as"), NpyArray::text(&said));
            (said, numbers(&array(&npz, main(layout))))
        };
        let (said, default) = of(&[]);
        assert_eq!((said.as_str(), &default), ("obstacle", &of(&["--unknown", "pessimistic"]).1), "{layout}");
        let (said, free) = of(&["--unknown", "optimistic"]);
        assert!(said == "free" && free != default, "{layout}");
        assert!(default.iter().zip(&free).all(|(obstacle, free)| obstacle <= free), "{layout}");
        // Of the cells that nobody saw not one is free.
        let unseen = distances.iter().filter(|d| d.is_nan()).count();
        assert!(default.iter().filter(|d| **d <= 0.0).count() >= unseen, "{layout}");
    }
    let (out, yaml) = (folder.path().join("b.bin"), folder.path().join("a.yaml"));
    assert_eq!(convert(&npz, &["--unknown", "nan"]).as_deref(), Some("unknown"));
    assert!(numbers(&array(&npz, "distance")).iter().filter(|d| d.is_nan()).count() == 30);
    // What holds unknown cells leaves them unknown, and refuses to be told otherwise.
    assert_eq!(convert(&out, &[]).as_deref(), Some("unknown"));
    assert!(fail(2, ["convert", arg(&file), arg(&out), "--unknown", "optimistic"]).contains("as NaN"));
    let comment = || std::fs::read_to_string(&yaml).unwrap().lines().next().unwrap().to_owned();
    assert_eq!(convert(&yaml, &["--z", "0.6:2.4"]).as_deref(), Some("obstacle"));
    assert!(comment().starts_with("# columns with an unknown cell are unknown"), "{}", comment());
    let cells = MapServerMap::read(&yaml).unwrap().cells;
    assert_eq!(convert(&yaml, &["--z", "0.6:2.4", "--unknown", "optimistic"]).as_deref(), Some("free"));
    assert!(comment().starts_with("# columns are free"), "{}", comment());
    let optimistic = MapServerMap::read(&yaml).unwrap().cells;
    assert!(cells.contains(&MapCell::Unknown) && !optimistic.contains(&MapCell::Unknown));
    assert!(succeed(["convert", arg(&file), arg(&npz)]).contains("unknown cells are obstacles"));
    assert_eq!(grid.shape, [6, 5, 4]);

    let (folder, log) = room();
    let (map_folder, yaml) = (folder.path().join("out"), folder.path().join("costs.yaml"));
    map(&log, &map_folder, &[]);
    let costs = ["convert", arg(&map_folder), arg(&yaml), "--inflate", "0.5"];
    assert!(succeed(costs).contains("unknown cells are unknown"));
    let refused = fail(2, [&costs[..], &["--unknown", "optimistic"]].concat());
    assert!(refused.contains("unknown cells stay unknown"), "{refused}");
    for command in ["query", "convert"] {
        // Wherever the lines break.
        let help = succeed([command, "--help"]).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(help.contains("[default: pessimistic]"), "{help}");
    }
}
