//! The TSDF in bricks: depth images of 640 x 480 pixels and lidar scans of 64 x 1024 beams, as many frames of a building
//! as there are, fused into an empty map.
//!
//! `PORTOLAN_BENCH_DATA` names the folder with `rgbd_building` and `lidar_building`; without it, a room is made up.

use divan::Bencher;
use divan::counter::ItemsCount;
use portolan::geom::Pose;
use portolan::map::{PointSweep, Tsdf3, TsdfConfig};
use portolan::scan::{Frame, Pinhole, PointScan, Projection, RangeImage, Spherical};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

fn main() {
    divan::main();
}

type Log = Vec<(Pose<3>, Frame)>;

static DEPTH: LazyLock<Log> =
    LazyLock::new(|| data().map_or_else(made_up_depth, |d| depth(&d.join("rgbd_building"))));
static LIDAR: LazyLock<Log> =
    LazyLock::new(|| data().map_or_else(made_up_lidar, |d| lidar(&d.join("lidar_building"))));
static RAYS: LazyLock<Log> = LazyLock::new(|| {
    let points = |image: &RangeImage| image.points().map(|(_, p)| p.map(|v| v as f32)).collect::<Vec<_>>();
    LIDAR
        .iter()
        .filter_map(|(pose, frame)| match frame {
            Frame::Image(image) => Some((*pose, Frame::Points(PointScan::new(points(image), [0.0; 3])))),
            Frame::Points(_) => None,
        })
        .collect()
});

/// Frames of a run.
const FRAMES: usize = 25;
const CAMERA: Pinhole = Pinhole { fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5 };

fn data() -> Option<PathBuf> {
    std::env::var_os("PORTOLAN_BENCH_DATA").map(PathBuf::from)
}

fn numbers(path: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.split_whitespace().map(|v| v.parse().expect("a number")).collect()
}

fn pose(rows: &[f64]) -> Pose<3> {
    let rotation = std::array::from_fn(|i| std::array::from_fn(|j| rows[4 * i + j]));
    Pose::from_matrix(rotation, [rows[3], rows[7], rows[11]]).expect("a rigid pose").0
}

fn depth(folder: &Path) -> Log {
    let frame = |i: usize| {
        let path = folder.join(format!("frame-{i:06}.depth.png"));
        let file = std::io::BufReader::new(std::fs::File::open(path).expect("a depth image"));
        let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut bytes).expect("a PNG");
        let values = bytes.chunks_exact(2).map(|b| f32::from(u16::from_be_bytes([b[0], b[1]])) / 1000.0);
        let near = |v: f32| if v <= 5.0 { v } else { 0.0 };
        let pose = pose(&numbers(&folder.join(format!("frame-{i:06}.pose.txt"))));
        (pose, image(Projection::Pinhole(CAMERA), 640, 480, values.map(near).collect()))
    };
    (0..150).step_by(2).map(frame).collect()
}

const RINGS: usize = 64;
const AZIMUTHS: usize = 1024;

fn rings() -> Spherical {
    let elevation = |r: usize| (22.5 - 45.0 * r as f64 / (RINGS - 1) as f64).to_radians() as f32;
    Spherical {
        elevations: (0..RINGS).map(elevation).collect(),
        first_azimuth: 0.0,
        azimuth_step: -std::f64::consts::TAU / AZIMUTHS as f64,
    }
}

fn lidar(folder: &Path) -> Log {
    let poses = numbers(&folder.join("poses.txt"));
    let frame = |i: usize| {
        let path = folder.join(format!("velodyne/{i:06}.bin"));
        let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let mut values = vec![0.0; RINGS * AZIMUTHS];
        for p in bytes.chunks_exact(16) {
            let at =
                |k: usize| f64::from(f32::from_le_bytes(p[4 * k..4 * k + 4].try_into().expect("four bytes")));
            let (x, y, z) = (at(0), at(1), at(2));
            let elevation = z.atan2(x.hypot(y)).to_degrees();
            let row = ((22.5 - elevation) / 45.0 * (RINGS - 1) as f64).round() as usize;
            let turn = -y.atan2(x) / std::f64::consts::TAU * AZIMUTHS as f64;
            let column = turn.round().rem_euclid(AZIMUTHS as f64) as usize;
            values[row * AZIMUTHS + column] = x.hypot(y).hypot(z) as f32;
        }
        (pose(&poses[12 * i..]), image(Projection::Spherical(rings()), AZIMUTHS, RINGS, values))
    };
    (0..200).step_by(200 / FRAMES).map(frame).collect()
}

fn image(projection: Projection, columns: usize, rows: usize, values: Vec<f32>) -> Frame {
    Frame::Image(RangeImage::new(projection, columns, rows, values))
}

/// A room of 10 m x 8 m x 3 m with the sensor in it: ranges along a unit vector.
fn room(direction: [f64; 3], at: [f64; 3]) -> f64 {
    let size = [10.0, 8.0, 3.0];
    let to =
        |k: usize| if direction[k] > 0.0 { (size[k] - at[k]) / direction[k] } else { -at[k] / direction[k] };
    (0..3).map(to).fold(f64::INFINITY, f64::min)
}

fn made_up(projection: &Projection, columns: usize, rows: usize, level: [[f64; 3]; 3]) -> Log {
    let frame = |i: usize| {
        let (sin, cos) = (i as f64 * 0.2).sin_cos();
        let turn = Pose::<3> {
            rotation: [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]],
            translation: [0.0; 3],
        };
        let at = [3.0 + 0.1 * i as f64, 4.0, 1.3];
        let world_from_sensor =
            Pose { translation: at, ..turn * Pose { rotation: level, translation: [0.0; 3] } };
        let empty = RangeImage::new(projection.clone(), columns, rows, []);
        let value = |i: usize| {
            let ray = world_from_sensor.rotate(empty.ray((i % columns) as f64, i / columns));
            let length = portolan::geom::vector::norm(ray);
            (room(ray.map(|v| v / length), at) / length) as f32
        };
        (
            world_from_sensor,
            image(projection.clone(), columns, rows, (0..columns * rows).map(value).collect()),
        )
    };
    (0..FRAMES).map(frame).collect()
}

fn made_up_depth() -> Log {
    made_up(&Projection::Pinhole(CAMERA), 640, 480, [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
}

fn made_up_lidar() -> Log {
    made_up(&Projection::Spherical(rings()), AZIMUTHS, RINGS, Pose::<3>::IDENTITY.rotation)
}

fn config(resolution: f64, carve: bool) -> TsdfConfig<3> {
    TsdfConfig { resolution, truncation: 4.0 * resolution, carve, max_range: 60.0, ..TsdfConfig::textbook() }
}

fn fuse(bencher: Bencher, log: &Log, config: TsdfConfig<3>, threads: usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    bencher.counter(ItemsCount::new(log.len())).bench(|| {
        pool.install(|| {
            let mut map = Tsdf3::new(config).expect("a valid map");
            for (pose, frame) in log {
                map.integrate(pose, frame).expect("room for it");
            }
            map
        })
    });
}

#[divan::bench(args = [(0.02, 1), (0.02, 2), (0.01, 1), (0.01, 2)], sample_count = 3)]
fn depth_without_carving(bencher: Bencher, (resolution, threads): (f64, usize)) {
    fuse(bencher, &DEPTH, config(resolution, false), threads);
}

#[divan::bench(args = [(0.02, 1), (0.02, 2)], sample_count = 3)]
fn depth_with_carving(bencher: Bencher, (resolution, threads): (f64, usize)) {
    fuse(bencher, &DEPTH, config(resolution, true), threads);
}

#[divan::bench(args = [(0.1, 1), (0.1, 2), (0.05, 1), (0.05, 2)], sample_count = 3)]
fn lidar_with_carving(bencher: Bencher, (resolution, threads): (f64, usize)) {
    fuse(bencher, &LIDAR, config(resolution, true), threads);
}

#[divan::bench(args = [0.1, 0.05], sample_count = 3)]
fn lidar_rays_with_carving(bencher: Bencher, resolution: f64) {
    let config = TsdfConfig { points: PointSweep::Rays, ..config(resolution, true) };
    fuse(bencher, &RAYS, config, 1);
}
