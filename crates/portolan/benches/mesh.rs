//! Meshes of a gyroid of four periods in 256^3 cells: as an array, and as bricks with weights and colors.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use portolan::cell::{Color, ColorBrick, DistanceBrick, SignedDistance};
use portolan::geom::{BlockKey, Lattice};
use portolan::store::Bricks;
use portolan::surface::{IsosurfaceSettings, MeshSettings, isosurface, marching_cubes};
use std::sync::LazyLock;

fn main() {
    divan::main();
}

const N: usize = 256;

static GYROID: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let angle = |i: usize| std::f64::consts::TAU * 4.0 * i as f64 / N as f64;
    let table: Vec<(f64, f64)> = (0..N).map(|i| angle(i).sin_cos()).collect();
    let value = |i: usize| {
        let [(sx, cx), (sy, cy), (sz, cz)] = [i % N, i / N % N, i / N / N].map(|i| table[i]);
        (sx * cy + sy * cz + sz * cx) as f32
    };
    (0..N * N * N).map(value).collect()
});

static BRICKS: LazyLock<Bricks<SignedDistance, 3>> = LazyLock::new(|| {
    let mut store = Bricks::new(Lattice::new([0.0; 3], 0.05));
    for key in keys() {
        let value = |i: usize| {
            let c = key.cell(i).map(|v| v as usize);
            GYROID[c[0] + N * (c[1] + N * c[2])]
        };
        let distances: Vec<f32> = (0..512).map(value).collect();
        let brick = DistanceBrick::from_parts(&distances, &[1.0; 512]).expect("finite");
        store.insert(key, brick).expect("no limit");
    }
    store
});

static COLORS: LazyLock<Bricks<Color, 3>> = LazyLock::new(|| {
    let mut store = Bricks::new(Lattice::new([0.0; 3], 0.05));
    for key in keys() {
        let words: Vec<[u16; 4]> = (0..512).map(|i| [i * 100, 65535 - i * 100, 30000, 256]).collect();
        store.insert(key, ColorBrick::from_words(&words)).expect("no limit");
    }
    store
});

fn keys() -> impl Iterator<Item = BlockKey<3>> {
    let n = (N / 8) as i32;
    (0..n * n * n).map(move |i| BlockKey([i % n, i / n % n, i / n / n]))
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

fn settings(normals: bool) -> IsosurfaceSettings<'static> {
    IsosurfaceSettings { normals, ..IsosurfaceSettings::default() }
}

/// Counted in triangles.
#[divan::bench(args = [1, 2], sample_count = 10)]
fn array(bencher: Bencher, threads: usize) {
    let pool = pool(threads);
    let triangles = isosurface(&GYROID, [N; 3], &settings(false)).mesh.triangles.len();
    bencher
        .counter(ItemsCount::new(triangles))
        .bench(|| pool.install(|| isosurface(black_box(&GYROID), [N; 3], &settings(false))));
}

#[divan::bench(args = [1, 2], sample_count = 10)]
fn array_with_normals(bencher: Bencher, threads: usize) {
    let pool = pool(threads);
    let triangles = isosurface(&GYROID, [N; 3], &settings(false)).mesh.triangles.len();
    bencher
        .counter(ItemsCount::new(triangles))
        .bench(|| pool.install(|| isosurface(black_box(&GYROID), [N; 3], &settings(true))));
}

#[divan::bench(args = [1, 2], sample_count = 10)]
fn bricks(bencher: Bencher, threads: usize) {
    let pool = pool(threads);
    let settings = MeshSettings { normals: false, colors: false, ..Default::default() };
    let triangles = marching_cubes(&*BRICKS, None, &settings).triangles.len();
    bencher
        .counter(ItemsCount::new(triangles))
        .bench(|| pool.install(|| marching_cubes(black_box(&*BRICKS), None, &settings)));
}

#[divan::bench(args = [1, 2], sample_count = 10)]
fn bricks_with_normals_and_colors(bencher: Bencher, threads: usize) {
    let pool = pool(threads);
    let settings = MeshSettings::default();
    let triangles = marching_cubes(&*BRICKS, None, &settings).triangles.len();
    bencher
        .counter(ItemsCount::new(triangles))
        .bench(|| pool.install(|| marching_cubes(black_box(&*BRICKS), Some(&COLORS), &settings)));
}
