//! 3-D occupancy from a lidar of 64 x 1024 beams in a building, at 10 and 5 cm, with one and two threads.
//!
//! `update` fuses 20 scans into an empty map (the range images are made inside the clock); the items of the counter are
//! scans. With `PORTOLAN_BENCH_DATA` set to a folder that holds `lidar_building/` (KITTI layout) its first scans are taken,
//! else scans of a simple building are made here.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use portolan::cell::{LogOdds8, OccupancyModel};
use portolan::geom::{Lattice, Pose};
use portolan::map::Occupancy;
use portolan::scan::{Frame, PointScan};
use portolan::sweep::OccupancySweep;
use std::sync::LazyLock;

type Map = Occupancy<3, LogOdds8>;

fn main() {
    divan::main();
}

const SCANS: usize = 20;

static LOG: LazyLock<Vec<(Pose<3>, Frame)>> =
    LazyLock::new(|| recorded().unwrap_or_else(|| (0..SCANS).map(simulated).collect()));

/// The first scans of a recorded log.
fn recorded() -> Option<Vec<(Pose<3>, Frame)>> {
    let folder = std::path::PathBuf::from(std::env::var_os("PORTOLAN_BENCH_DATA")?).join("lidar_building");
    let poses = std::fs::read_to_string(folder.join("poses.txt")).ok()?;
    poses
        .lines()
        .take(SCANS)
        .enumerate()
        .map(|(i, line)| {
            let v: Vec<f64> = line.split_whitespace().map(|w| w.parse().ok()).collect::<Option<_>>()?;
            let row = |r: usize| Some([*v.get(4 * r)?, *v.get(4 * r + 1)?, *v.get(4 * r + 2)?]);
            let rotation = [row(0)?, row(1)?, row(2)?];
            let (pose, _) = Pose::from_matrix(rotation, [*v.get(3)?, *v.get(7)?, *v.get(11)?]).ok()?;
            let bytes = std::fs::read(folder.join(format!("velodyne/{i:06}.bin"))).ok()?;
            let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            let points = bytes.chunks_exact(16).map(|p| [number(p), number(&p[4..]), number(&p[8..])]);
            Some((pose, Frame::Points(PointScan::new(points, [0.0; 3]))))
        })
        .collect()
}

/// A scan in a building of rooms of 9 m x 10 m with pillars, on the way through a corridor.
fn simulated(i: usize) -> (Pose<3>, Frame) {
    let origin = [1.0 + 0.3 * i as f64, 0.2, 1.2];
    let mut points = Vec::with_capacity(64 * 1024);
    for row in 0..64 {
        for column in 0..1024 {
            let e = (22.5 - 45.0 * row as f64 / 63.0).to_radians();
            let a = -std::f64::consts::TAU * column as f64 / 1024.0;
            let d = [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()];
            let noise = ((points.len() * 7919 % 1000) as f64 / 1000.0 - 0.5) * 0.03;
            points.push(d.map(|v| (v * (range(origin, d) + noise)) as f32));
        }
    }
    let pose = Pose { translation: origin, ..Pose::IDENTITY };
    (pose, Frame::Points(PointScan::new(points, [0.0; 3])))
}

/// Distance to floor, ceiling, outer walls, inner walls with doors, and pillars.
fn range(o: [f64; 3], d: [f64; 3]) -> f64 {
    let at = |t: f64| [0, 1, 2].map(|k| o[k] + t * d[k]);
    let to = |k: usize, v: f64| Some((v - o[k]) / d[k]).filter(|t| *t > 0.0);
    let mut t = [to(2, 0.0), to(2, 3.0), to(0, -9.0), to(0, 27.0), to(1, -11.0), to(1, 11.0)]
        .into_iter()
        .flatten()
        .fold(f64::INFINITY, f64::min);
    for wall in [-1.5, 1.5] {
        let hit = to(1, wall).filter(|s| (at(*s)[0].rem_euclid(4.5) - 2.0).abs() > 0.6);
        t = hit.map_or(t, |s| t.min(s));
    }
    for wall in [0.0, 9.0, 18.0] {
        t = to(0, wall).filter(|s| at(*s)[1].abs() > 1.5).map_or(t, |s| t.min(s));
    }
    for (x, y) in [(3.0, 5.0), (12.0, -6.0), (6.5, 0.9), (20.0, 4.0)] {
        let (px, py) = (o[0] - x, o[1] - y);
        let (a, b, c) = (d[0] * d[0] + d[1] * d[1], px * d[0] + py * d[1], px * px + py * py - 0.04);
        let root = b * b - a * c;
        if root > 0.0 && -b - root.sqrt() > 0.0 {
            t = t.min((-b - root.sqrt()) / a);
        }
    }
    t
}

fn fused(sweep: OccupancySweep, resolution: f64) -> Map {
    let lattice = Lattice::new([0.0; 3], resolution);
    let mut map = Map::new(lattice, OccupancyModel::default()).expect("a valid map").with_sweep(sweep);
    for (pose, frame) in LOG.iter() {
        map.integrate(pose, frame).expect("memory without limit");
    }
    map
}

/// Resolution in centimeters and number of threads.
const CASES: [(u32, usize); 4] = [(10, 1), (10, 2), (5, 1), (5, 2)];

fn update(bencher: Bencher, sweep: OccupancySweep, (cm, threads): (u32, usize)) {
    LazyLock::force(&LOG);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    bencher
        .counter(ItemsCount::new(LOG.len()))
        .bench_local(|| pool.install(|| fused(black_box(sweep), f64::from(cm) / 100.0)));
}

#[divan::bench(args = CASES, sample_count = 8)]
fn update_default(bencher: Bencher, case: (u32, usize)) {
    update(bencher, OccupancySweep::Auto, case);
}

#[divan::bench(args = CASES, sample_count = 8)]
fn update_exact(bencher: Bencher, case: (u32, usize)) {
    update(bencher, OccupancySweep::Exact, case);
}

/// Random points in the box of the map, one after the other.
#[divan::bench(args = [10, 5])]
fn query(bencher: Bencher, cm: u32) {
    let map = fused(OccupancySweep::Auto, f64::from(cm) / 100.0);
    let at = |i: u32, a: f64| (0.5 + f64::from(i) * a).fract();
    let points: Vec<[f64; 3]> = (1..=100_000)
        .map(|i| [12.0 * at(i, 0.754_877_666), 20.0 * at(i, 0.569_840_291), 3.0 * at(i, 0.324_717_957)])
        .collect();
    bencher
        .counter(ItemsCount::new(points.len()))
        .bench(|| points.iter().filter_map(|&p| map.probability(black_box(p)).known()).sum::<f64>());
}
