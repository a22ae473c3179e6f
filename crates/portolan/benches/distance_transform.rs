//! Distance transforms of masks; items are cells.
//!
//! `rooms`: walls, floor, ceiling and pillars. `hall`: all is free but the outermost cells, where no early exit helps.
//! `bench/distance_transform.py` sets the same beside other libraries.

use divan::Bencher;
use divan::counter::ItemsCount;
use portolan::field::{MaskTransform, squared_distance_transform};

fn main() {
    divan::main();
}

fn rooms(n: usize) -> Vec<bool> {
    let wall = |v: usize| v % 80 < 3;
    let set = |x: usize, y: usize, z: usize| {
        let door = (x % 80).abs_diff(40).min((y % 80).abs_diff(40)) < 10 && z < n / 2;
        let pillar = (x % 80).abs_diff(20).pow(2) + (y % 80).abs_diff(60).pow(2) < 16;
        (wall(x) || wall(y)) && !door || pillar || z < 2 || z + 2 >= n
    };
    (0..n * n * n).map(|i| set(i % n, i / n % n, i / n / n)).collect()
}

fn hall(n: usize) -> Vec<bool> {
    let outer = |v: usize| v == 0 || v + 1 == n;
    (0..n * n * n).map(|i| outer(i % n) || outer(i / n % n) || outer(i / n / n)).collect()
}

const ARGS: [(&str, usize); 4] = [("rooms", 128), ("rooms", 256), ("hall", 128), ("hall", 256)];

fn one_core<T>(bencher: Bencher, (mask, n): (&str, usize), run: impl Fn(&[bool]) -> T + Sync + Send) {
    let mask = if mask == "rooms" { rooms(n) } else { hall(n) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let run = || pool.install(|| drop(run(&mask)));
    bencher.counter(ItemsCount::new(mask.len())).bench_local(run);
}

fn transform(n: usize) -> MaskTransform<3> {
    MaskTransform::new([n; 3]).expect("not too large")
}

#[divan::bench(args = ARGS, max_time = 2)]
fn unbounded(bencher: Bencher, arg: (&str, usize)) {
    one_core(bencher, arg, |mask| transform(arg.1).squared_distances(mask).expect("all cells"));
}

#[divan::bench(args = ARGS, max_time = 2)]
fn within_20(bencher: Bencher, arg: (&str, usize)) {
    let transform = transform(arg.1).within(20.0).expect("a bound");
    one_core(bencher, arg, |mask| transform.squared_distances(mask).expect("all cells"));
}

#[divan::bench(args = ARGS, max_time = 2)]
fn nearest_unbounded(bencher: Bencher, arg: (&str, usize)) {
    one_core(bencher, arg, |mask| transform(arg.1).nearest(mask).expect("all cells"));
}

#[divan::bench(args = ARGS, max_time = 2)]
fn nearest_within_20(bencher: Bencher, arg: (&str, usize)) {
    let transform = transform(arg.1).within(20.0).expect("a bound");
    one_core(bencher, arg, |mask| transform.nearest(mask).expect("all cells"));
}

/// The envelope of real parabolas, what the textbook's field is made with.
#[divan::bench(args = ARGS, max_time = 2)]
fn envelope(bencher: Bencher, arg: (&str, usize)) {
    one_core(bencher, arg, |mask| {
        let mut f: Vec<f64> = mask.iter().map(|&set| if set { 0.0 } else { f64::INFINITY }).collect();
        squared_distance_transform(&mut f, [arg.1; 3]);
        f
    });
}
