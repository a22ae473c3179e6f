//! `eval` of 3-D maps.

use std::fmt::Write as _;
use std::path::Path;

use crate::support::{arg, fail, json, succeed};
use portolan::cell::DistanceBrick;
use portolan::geom::{BlockKey, Lattice, Pose};
use portolan::scan::{Frame, Pinhole, Projection, RangeImage, RefusedBeams};
use portolan::store::Bricks;
use portolan::sweep::WeightModel;
use portolan_io::{LogLayout, LogWriter, MapFile, MapHeader, TsdfBricks};
use serde_json::{Map, Value, json as value};

/// Where the map has its wall (x, meters); the truth has it at 1.
const WALL: f64 = 1.03;

/// A map of a wall of 1.6 x 1.6 m and the free space before it, at 10 cm.
fn write_map(folder: &Path) {
    let lattice = Lattice::new([0.0; 3], 0.1);
    let mut store = Bricks::new(lattice);
    for key in (0..8).map(|i| BlockKey([i & 1, i >> 1 & 1, i >> 2])) {
        let distances: Vec<f32> =
            (0..512).map(|i| (WALL - lattice.center(key.cell(i))[0]).clamp(-0.3, 0.3) as f32).collect();
        store.insert(key, DistanceBrick::from_parts(&distances, &[1.0; 512]).unwrap()).unwrap();
    }
    let mut file = MapFile::<3>::default();
    file.header = MapHeader { hold_out: Some(2), ..Default::default() };
    file.tsdf_bricks = Some(TsdfBricks {
        store,
        truncation: 0.3,
        w_max: 64.0,
        carve_weight: 1.0,
        weights: WeightModel::Constant,
        more: Map::new(),
    });
    std::fs::create_dir_all(folder).unwrap();
    file.write(folder.join("map.portolan")).unwrap();
}

/// The true wall, twice as high and wide as the map's: a mesh, or its corners and some points alone.
fn write_reference(path: &Path, faces: bool) {
    let n = 41;
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", n * n);
    text += "property float x\nproperty float y\nproperty float z\n";
    if faces {
        writeln!(text, "element face {}\nproperty list uchar int vertex_indices", (n - 1) * (n - 1)).unwrap();
    }
    text += "end_header\n";
    for i in 0..n * n {
        writeln!(text, "1 {} {}", -0.8 + 0.08 * f64::from(i % n), -0.8 + 0.08 * f64::from(i / n)).unwrap();
    }
    for i in (0..if faces { n * (n - 1) } else { 0 }).filter(|i| i % n + 1 < n) {
        writeln!(text, "4 {i} {} {} {}", i + 1, i + n + 1, i + n).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

fn number(document: &Value, pointer: &str) -> f64 {
    document.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer}: {document}"))
}

#[test]
fn a_wall_is_three_centimetres_off() {
    let folder = tempfile::tempdir().unwrap();
    let (map, mesh, cloud) =
        (folder.path().join("map"), folder.path().join("mesh.ply"), folder.path().join("cloud.ply"));
    write_map(&map);
    write_reference(&mesh, true);
    write_reference(&cloud, false);
    let whole = json(["eval", arg(&map), "--reference", arg(&mesh), "--json"]);
    assert_eq!(whole["reference"]["kind"], "mesh");
    for pointer in ["/reference/accuracy/median", "/reference/accuracy/p95"] {
        assert!((number(&whole, pointer) - 0.03).abs() < 1e-5, "{whole}");
    }
    assert_eq!(whole["reference"]["accuracy"]["within"], value!([0.0, 0.0, 1.0]));
    // The map's surface spans 1.5 of the 3.2 m each way; what is within 5 cm reaches 4 cm beyond.
    let share = number(&whole, "/reference/completeness/within/2");
    assert!((share - (1.58f64 / 3.2).powi(2)).abs() < 0.01, "{share}");
    let cropped = json(["eval", arg(&map), "--reference", arg(&mesh), "--crop", "--json"]);
    assert!((number(&cropped, "/reference/completeness/median") - 0.03).abs() < 1e-5);
    // Observed up to the edge of the bricks, half a cell beyond the surface.
    assert!(number(&cropped, "/reference/completeness/within/2") > 0.9);
    assert!((number(&cropped, "/reference/cropped") / 200_000.0 - 0.75).abs() < 0.01);
    let points = json(["eval", arg(&map), "--reference", arg(&cloud), "--json"]);
    assert_eq!(points["reference"]["kind"], "cloud");
    // Points lie 8 cm apart.
    let median = number(&points, "/reference/accuracy/median");
    assert!((0.03..0.06).contains(&median), "{median}");
    let text = succeed(["eval", arg(&map), "--reference", arg(&mesh)]);
    assert!(
        text.contains("accuracy (map to reference): median 30.00 mm")
            && text.contains("F-score: 0.000 at 1 cm")
    );
}

#[test]
fn ranges_of_scans_are_predicted() {
    let folder = tempfile::tempdir().unwrap();
    let (map, log) = (folder.path().join("map"), folder.path().join("log"));
    write_map(&map);
    let mut writer = LogWriter::create(&log, LogLayout::SevenScenes).unwrap();
    // The camera stands in the map, 0.8 m before the true wall, and looks along x.
    let rotation = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    let pose = Pose { rotation, translation: [0.2, 0.8, 0.8] };
    let frame = Frame::Image(RangeImage {
        projection: Projection::Pinhole(Pinhole { fx: 40.0, fy: 40.0, cx: 9.5, cy: 4.5 }),
        columns: 20,
        rows: 10,
        values: (0..200).map(|i| if i < 20 { 0.0 } else { 0.8 }).collect(),
        colors: Vec::new(),
        colored: Vec::new(),
        refused: RefusedBeams::default(),
    });
    for scan in 0..4 {
        writer.push(&pose, f64::from(scan), &frame).unwrap();
    }
    writer.finish().unwrap();
    let found = json(["eval", arg(&map), "--scans", arg(&log), "--json"]);
    let scans = &found["scans"];
    // Every second scan was held out.
    assert_eq!(
        (&scans["scans"], &scans["beams"], &scans["predicted"]),
        (&2.into(), &360.into(), &360.into())
    );
    assert_eq!(scans["held_out"], true);
    assert!((number(scans, "/bias") - 0.032).abs() < 0.003, "{scans}");
    assert_eq!(number(scans, "/within_one_cell"), 1.0);
    assert!((number(scans, "/within_one_cell_of_all") - 1.0).abs() < 1e-9);
    assert!(number(scans, "/negative_log_likelihood").is_finite());
    let some = json(["eval", arg(&map), "--scans", arg(&log), "--rays", "10", "--json"]);
    assert_eq!(some["scans"]["beams"], 20);
    let text = succeed(["eval", arg(&map), "--scans", arg(&log)]);
    assert!(text.contains("predicted 360 of 360 hits of 2 scans") && text.contains("nats a ray"), "{text}");
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let (map, empty) = (folder.path().join("map"), folder.path().join("empty"));
    write_map(&map);
    std::fs::create_dir(&empty).unwrap();
    MapFile::<3>::default().write(empty.join("map.portolan")).unwrap();
    let far = folder.path().join("far.xyz");
    std::fs::write(&far, "100 100 100\n101 100 100\n").unwrap();
    let error = fail(1, ["eval", arg(&map), "--reference", arg(&far), "--crop"]);
    assert!(error.contains("the map observed nothing of it"), "{error}");
    let error = fail(1, ["eval", arg(&empty), "--reference", arg(&far)]);
    assert!(error.contains("the map has no tsdf"), "{error}");
    fail(2, ["eval", arg(&map), "--reference", arg(&far), "--rays", "0"]);
    fail(2, ["eval", arg(&map), "--crop"]);
}
