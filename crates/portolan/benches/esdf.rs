//! The distance field of a floor of rooms, 24 x 16 x 3.2 m in cells of 5 cm: 9.8 million cells in 19,200 bricks, walls,
//! floor, ceiling and a pillar in every room. Items are cells of the observed bricks.
//!
//! `hall`: 50 x 16 x 3.2 m of nothing, all of it observed, with a wall at either end of x: 20.5 million cells.
//!
//! `carved`: all free space was observed, as a lidar does. `band`: only what is within the truncation of a surface, as
//! fusion without carving leaves it.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use portolan::cell::{DistanceBrick, SignedDistance};
use portolan::field::{Esdf, EsdfMethod, EsdfSettings, squared_distance_transform};
use portolan::geom::{BlockKey, Lattice};
use portolan::map::{Tsdf3, TsdfConfig};
use portolan::store::{Bricks, Store};
use portolan_sim::SEED;
use portolan_sim::building::{
    BuildingConfig, BuildingSensor, DepthCamera, building_poses, building_world, camera_frame,
};
use std::sync::LazyLock;

fn main() {
    divan::main();
}

const CELLS: [i32; 3] = [480, 320, 64];
const TRUNCATION: f64 = 0.15;

static CARVED: LazyLock<Bricks<SignedDistance, 3>> = LazyLock::new(|| floor(CELLS, false, distance));
static BAND: LazyLock<Bricks<SignedDistance, 3>> = LazyLock::new(|| floor(CELLS, true, distance));
/// Walls at the ends of x; neither floor nor ceiling.
static HALL: LazyLock<Bricks<SignedDistance, 3>> =
    LazyLock::new(|| floor([1000, 320, 64], false, |[x, _, _]| (x - 0.12).min(49.88 - x)));
static FIELD: LazyLock<Esdf<3>> = LazyLock::new(|| {
    let field = Esdf::of(&*CARVED, &EsdfSettings::default());
    field.measure();
    field
});
static PROBES: LazyLock<Vec<[f64; 3]>> = LazyLock::new(|| {
    let at = |i: u32, a: f64| (0.5 + f64::from(i) * a).fract();
    (1..=10_000)
        .map(|i| [24.0 * at(i, 0.819_172_5), 16.0 * at(i, 0.671_043_6), 3.2 * at(i, 0.549_700_5)])
        .collect()
});

/// Signed distance to rooms of 4 m with walls of 20 cm, doors of 1 m, and a pillar.
fn distance([x, y, z]: [f64; 3]) -> f64 {
    let (u, v) = ((x + 2.0).rem_euclid(4.0) - 2.0, (y + 2.0).rem_euclid(4.0) - 2.0);
    let door = (u.abs().max(v.abs()) - 1.5).max(z - 2.2);
    let wall = (u.abs().min(v.abs()) - 0.1).max(-door);
    let pillar = ((u.abs() - 1.4).hypot(v.abs() - 1.4) - 0.25).max(z - 1.2);
    wall.min(pillar).min(z - 0.1).min(3.1 - z)
}

fn floor(cells: [i32; 3], band: bool, distance: fn([f64; 3]) -> f64) -> Bricks<SignedDistance, 3> {
    let lattice = Lattice::new([0.0; 3], 0.05);
    let mut bricks = Bricks::new(lattice);
    for z in 0..cells[2] / 8 {
        for y in 0..cells[1] / 8 {
            for x in 0..cells[0] / 8 {
                let key = BlockKey([x, y, z]);
                let truth: Vec<f64> = (0..512).map(|i| distance(lattice.center(key.cell(i)))).collect();
                if band && truth.iter().all(|d| d.abs() >= TRUNCATION) {
                    continue;
                }
                let observed = |d: &f64| *d > -TRUNCATION && (!band || *d < TRUNCATION);
                let values: Vec<f32> =
                    truth.iter().map(|d| d.clamp(-TRUNCATION, TRUNCATION) as f32).collect();
                let weights: Vec<f32> = truth.iter().map(|d| f32::from(u8::from(observed(d)))).collect();
                let brick = DistanceBrick::from_parts(&values, &weights).expect("finite");
                bricks.insert(key, brick).expect("no limit");
            }
        }
    }
    bricks
}

fn cells(bricks: &Bricks<SignedDistance, 3>) -> ItemsCount {
    ItemsCount::new(512 * bricks.len())
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

#[divan::bench(args = [1, 2], max_time = 5)]
fn carved_1m(bencher: Bencher, threads: usize) {
    of(bencher, &CARVED, 1.0, threads);
}

#[divan::bench(max_time = 5)]
fn carved_2m(bencher: Bencher) {
    of(bencher, &CARVED, 2.0, 1);
}

#[divan::bench(max_time = 5)]
fn carved_50cm(bencher: Bencher) {
    of(bencher, &CARVED, 0.5, 1);
}

#[divan::bench(args = [1, 2], max_time = 5)]
fn band_1m(bencher: Bencher, threads: usize) {
    of(bencher, &BAND, 1.0, threads);
}

fn of(bencher: Bencher, bricks: &Bricks<SignedDistance, 3>, max_distance: f64, threads: usize) {
    by(bencher, bricks, max_distance, EsdfMethod::TEXTBOOK, threads);
}

fn by(
    bencher: Bencher,
    bricks: &Bricks<SignedDistance, 3>,
    max_distance: f64,
    method: EsdfMethod,
    threads: usize,
) {
    let settings = EsdfSettings { max_distance, method, ..Default::default() };
    let pool = pool(threads);
    bencher.counter(cells(bricks)).bench(|| pool.install(|| Esdf::of(bricks, &settings)));
}

#[divan::bench(args = [1, 2], max_time = 5)]
fn accurate_carved_1m(bencher: Bencher, threads: usize) {
    by(bencher, &CARVED, 1.0, EsdfMethod::Accurate, threads);
}

#[divan::bench(max_time = 5)]
fn accurate_carved_unbounded(bencher: Bencher) {
    by(bencher, &CARVED, 25.4, EsdfMethod::Accurate, 1);
}

#[divan::bench(max_time = 5)]
fn accurate_band_1m(bencher: Bencher) {
    by(bencher, &BAND, 1.0, EsdfMethod::Accurate, 1);
}

#[divan::bench(args = [1.0, 25.4], max_time = 5)]
fn accurate_hall(bencher: Bencher, max_distance: f64) {
    by(bencher, &HALL, max_distance, EsdfMethod::Accurate, 1);
}

#[divan::bench(max_time = 5)]
fn mask_carved_1m(bencher: Bencher) {
    by(bencher, &CARVED, 1.0, EsdfMethod::Mask, 1);
}

/// Distances of all cells to the segments and triangles, which are otherwise measured when they are read.
#[divan::bench(args = [1, 2], max_time = 5)]
fn measure_carved_1m(bencher: Bencher, threads: usize) {
    let settings = EsdfSettings::default();
    let pool = pool(threads);
    bencher.counter(cells(&CARVED)).with_inputs(|| Esdf::of(&*CARVED, &settings)).bench_local_values(
        |esdf| {
            pool.install(|| esdf.measure());
            esdf
        },
    );
}

/// A walk with a depth camera of 640 x 480 pixels through the simulated Building: the map before one more frame and
/// after it.
static WALK: LazyLock<[Tsdf3; 2]> = LazyLock::new(|| {
    let camera = DepthCamera::default();
    let config = BuildingConfig { scans: 600, sensor: BuildingSensor::Camera(camera), seed: SEED };
    let building = building_world(config.seed);
    let mut map = Tsdf3::new(TsdfConfig { max_range: 5.0, ..TsdfConfig::textbook() }).expect("a valid map");
    let mut before = map.clone();
    for (i, pose) in building_poses(&building, &config).iter().enumerate().take(16) {
        before = map.clone();
        map.integrate(pose, &camera_frame(&building.world, pose, &camera, (SEED, i as u64)))
            .expect("no limit");
    }
    [before, map]
});

/// The field follows one depth frame at 5 cm; items are cells solved again.
#[divan::bench(args = [(1.0, 1), (1.0, 2), (2.0, 1), (2.0, 2)], max_time = 5)]
fn one_depth_frame(bencher: Bencher, (max_distance, threads): (f64, usize)) {
    follow(bencher, max_distance, threads, false);
}

/// The same, and all distances measured that are not what they were.
#[divan::bench(args = [(1.0, 1), (1.0, 2)], max_time = 5)]
fn one_depth_frame_measured(bencher: Bencher, (max_distance, threads): (f64, usize)) {
    follow(bencher, max_distance, threads, true);
}

fn follow(bencher: Bencher, max_distance: f64, threads: usize, measure: bool) {
    let [before, after] = &*WALK;
    let settings = EsdfSettings { max_distance, ..Default::default() };
    let esdf = Esdf::of(before, &settings);
    esdf.measure();
    let update = esdf.clone().update(after.store());
    let pool = pool(threads);
    bencher.counter(ItemsCount::new(512 * update.solved)).with_inputs(|| esdf.clone()).bench_local_values(
        |mut esdf| {
            pool.install(|| {
                esdf.update(after.store());
                if measure {
                    esdf.measure();
                }
            });
            esdf
        },
    );
}

/// The unbounded transform of the whole box, what [`portolan::field::esdf_from_tsdf`] runs.
#[divan::bench(max_time = 5)]
fn whole_box_unbounded(bencher: Bencher) {
    let shape = CELLS.map(|c| c as usize);
    let mut seeds = vec![f64::INFINITY; shape.iter().product()];
    for (key, brick) in CARVED.bricks_by_age() {
        for (i, (&d, &w)) in brick.distances().iter().zip(brick.weights()).enumerate() {
            let offset = f64::from(d) / CARVED.lattice().resolution;
            if w > 0.0 && offset.abs() <= 1.5 {
                let [x, y, z] = key.cell(i).map(|c| c as usize);
                seeds[(z * shape[1] + y) * shape[0] + x] = offset * offset;
            }
        }
    }
    let pool = pool(1);
    bencher.counter(cells(&CARVED)).with_inputs(|| seeds.clone()).bench_local_values(|mut seeds| {
        pool.install(|| squared_distance_transform(&mut seeds, shape));
        seeds
    });
}

#[divan::bench]
fn query(bencher: Bencher) {
    bencher.counter(ItemsCount::new(PROBES.len())).bench(|| {
        PROBES
            .iter()
            .filter_map(|&p| FIELD.distance_and_gradient(black_box(p)).known())
            .map(|a| a.0)
            .sum::<f64>()
    });
}
