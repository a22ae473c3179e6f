//! What `query` says holds for the files that `map` wrote: contour, mesh and obstacles.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use portolan::geom::vector::{distance, point_segment};
use portolan::surface::{Mesh, NearestSurface};
use portolan_io::read_ply_mesh;

use crate::support::{arg, map, real_data, succeed};

const POINTS: usize = 100_000;

/// Numbers that look random, the same in every run.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Rows of `query`: status, then distance, lower and upper where they are said.
fn query<const D: usize>(
    folder: &Path,
    points: &[[f64; D]],
    options: &[&str],
) -> Vec<(String, [Option<f64>; 3])> {
    let mut text = String::new();
    for p in points {
        let row: Vec<String> = p.iter().map(f64::to_string).collect();
        writeln!(text, "{}", row.join(",")).unwrap();
    }
    let mut child = Command::new(env!("CARGO_BIN_EXE_portolan"))
        .args(["query", arg(folder), "--points", "-"])
        .args(options)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let writing = std::thread::spawn(move || stdin.write_all(text.as_bytes()).unwrap());
    let output = child.wait_with_output().unwrap();
    writing.join().unwrap();
    assert!(output.status.success());
    let lines = String::from_utf8(output.stdout).unwrap();
    let rows: Vec<_> = lines.lines().skip(1).map(row::<D>).collect();
    assert_eq!(rows.len(), points.len());
    rows
}

fn row<const D: usize>(line: &str) -> (String, [Option<f64>; 3]) {
    let fields: Vec<&str> = line.split(',').collect();
    (fields[D].to_owned(), std::array::from_fn(|k| fields[D + 2 + k].parse().ok()))
}

/// Centers of the cells that are obstacles without a surface.
fn obstacles<const D: usize>(folder: &Path) -> Vec<[f64; D]> {
    let text = fs::read_to_string(folder.join("obstacles.csv")).unwrap();
    let center = |line: &str| {
        let fields: Vec<f64> = line.split(',').take(D).map(|v| v.parse().unwrap()).collect();
        std::array::from_fn(|k| fields[k])
    };
    text.lines().skip(1).map(center).collect()
}

/// No bound is violated at any of the points, given exact distances to what was written, and rows are one statement.
fn holds<const D: usize>(folder: &Path, points: &[[f64; D]], exact: impl Fn([f64; D]) -> f64) {
    let optimistic = query(folder, points, &["--unknown", "optimistic"]);
    let default = query(folder, points, &[]);
    assert!(default == query(folder, points, &["--unknown", "pessimistic"]), "the default is pessimistic");
    let (mut known, mut tight, mut nearer) = (0, 0, 0);
    for ((p, free), obstacle) in points.iter().zip(&optimistic).zip(&default) {
        assert_eq!(free.0, obstacle.0);
        let ("known", [Some(distance), Some(lower), Some(upper)]) = (&*free.0, free.1) else { continue };
        known += 1;
        let (want, side) = (exact(*p), if lower < 0.0 { -1.0 } else { 1.0 });
        let want = side * want;
        // Coordinates of the files are f32 (mesh) or have ten digits (obstacles).
        assert!(lower <= want + 2e-5 && want <= upper + 2e-5, "{p:?}: {want} is not in [{lower}, {upper}]");
        assert!(lower <= distance && distance <= upper, "{p:?}: {distance} is not in [{lower}, {upper}]");
        assert!(side * lower >= 0.0 && side * upper >= 0.0, "{p:?}: signs of {distance} [{lower}, {upper}]");
        tight += usize::from(upper - lower < 1e-4);
        let [Some(same), Some(low), Some(high)] = obstacle.1 else { panic!("{p:?}: {obstacle:?}") };
        assert!(same == distance && low.abs().min(high.abs()) <= lower.abs().min(upper.abs()) + 1e-12);
        nearer += usize::from(low != lower || high != upper);
    }
    assert!(known > points.len() / 5 && tight > known / 2, "{known} known, {tight} tight");
    assert!(nearer > known / 100, "unknown space is never nearer");
}

fn in_2d(log: &str, options: &[&str]) {
    let Some(log) = real_data(log) else { return };
    let folder = tempfile::tempdir().unwrap();
    map(&log, folder.path(), options);
    let text = fs::read_to_string(folder.path().join("contour.geojson")).unwrap();
    let geojson: serde_json::Value = serde_json::from_str(&text).unwrap();
    let of = |v: &serde_json::Value| [v[0].as_f64().unwrap(), v[1].as_f64().unwrap()];
    let lines = geojson["geometry"]["coordinates"].as_array().unwrap();
    let segments: Vec<[[f64; 2]; 2]> = lines
        .iter()
        .flat_map(|line| line.as_array().unwrap().windows(2).map(|w| [of(&w[0]), of(&w[1])]))
        .collect();
    let points = obstacles::<2>(folder.path());
    assert!(segments.len() > 5000 && points.len() > 300, "{} {}", segments.len(), points.len());
    let mut random = Random(1);
    let around: Vec<[f64; 2]> = (0..POINTS)
        .map(|n| {
            let [a, _] = segments[(random.unit() * segments.len() as f64) as usize];
            let near = if n % 3 == 0 { points[(random.unit() * points.len() as f64) as usize] } else { a };
            let off = if n % 2 == 0 { 0.1 } else { 1.5 };
            near.map(|v| v + off * (2.0 * random.unit() - 1.0))
        })
        .collect();
    holds(folder.path(), &around, |p| {
        let to_segments = segments.iter().map(|[a, b]| point_segment(p, *a, *b).0);
        let to_points = points.iter().map(|q| distance(p, *q));
        to_segments.chain(to_points).fold(f64::INFINITY, f64::min)
    });
}

#[test]
fn what_is_certified_holds_for_the_contour_of_intel() {
    in_2d("lidar2d_carmen/intel-corrected.log.gz", &[]);
}

#[test]
fn what_is_certified_holds_for_the_contour_of_freiburg() {
    in_2d("lidar2d_carmen/freiburg-079-corrected.log.gz", &["--every", "4"]);
}

#[test]
fn what_is_certified_holds_for_the_mesh_of_the_kitchen() {
    let Some(log) = real_data("rgbd_redkitchen") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    succeed(["map", arg(&log), "--resolution", "0.04", "--every", "6", "--out", arg(out), "-q"]);
    let written = read_ply_mesh(out.join("mesh.ply")).unwrap();
    let points = obstacles::<3>(out);
    assert!(written.triangles.len() > 10_000 && points.len() > 100, "{}", points.len());
    let corners: Vec<[[f64; 3]; 3]> =
        written.triangles.iter().map(|t| t.map(|v| written.vertices[v as usize])).collect();
    let vertices = written.vertices.iter().map(|v| v.map(|c| c as f32)).collect();
    let mesh = Mesh { vertices, triangles: written.triangles, ..Mesh::default() };
    let mut random = Random(2);
    let around: Vec<[f64; 3]> = (0..POINTS)
        .map(|n| {
            let [a, ..] = corners[(random.unit() * corners.len() as f64) as usize];
            let near = if n % 3 == 0 { points[(random.unit() * points.len() as f64) as usize] } else { a };
            let off = if n % 2 == 0 { 0.05 } else { 0.5 };
            near.map(|v| v + off * (2.0 * random.unit() - 1.0))
        })
        .collect();
    let nearest = NearestSurface::of_mesh(&mesh);
    holds(out, &around, |p| {
        points.iter().map(|q| distance(p, *q)).fold(nearest.distance(p).unwrap(), f64::min)
    });
}
