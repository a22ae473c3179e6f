//! OctoMap files of a map that was fused here, with their leaves as text; or how long reading a file takes.
//!
//! `octree_files OUT` writes `bytes.bt`, `bytes.ot`, `bytes.csv` and the same of `floats` into a folder; a row is the center
//! of a leaf, its edge (meters) and its log odds. `octree_files --time FILE` prints milliseconds, the best of ten.
//! `bench/octomap_roundtrip.py` uses both.

use std::error::Error;
use std::io::{self, Write};
use std::path::Path;
use std::time::Instant;

use portolan::cell::{LogOdds8, LogOdds32, LogOddsValue, OccupancyModel};
use portolan::geom::Lattice;
use portolan::map::Occupancy;
use portolan::store::{Store, Tree};
use portolan::sweep::OccupancySweep;
use portolan_io::{OctomapTree, write_atomic, write_octomap_bt, write_octomap_ot};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match &arguments[..] {
        [flag, file] if flag == "--time" => time(Path::new(file)),
        [out] => {
            let rule = LogOdds8::rule(&OccupancyModel::default())?;
            write::<LogOdds8>(Path::new(out), "bytes", rule.quantum)?;
            write::<LogOdds32>(Path::new(out), "floats", 1.0)
        }
        _ => Err("usage: octree_files OUT | octree_files --time FILE".into()),
    }
}

/// Ten scans inside of a box of 12 x 8 x 3 m that has a ball in it; the lattice's zero is not the world's.
fn write<V: LogOddsValue>(out: &Path, name: &str, quantum: f64) -> Result<(), Box<dyn Error>> {
    let lattice = Lattice::new([-7.2, 3.0, 0.8], 0.1);
    let mut map =
        Occupancy::<3, V>::new(lattice, OccupancyModel::default())?.with_sweep(OccupancySweep::Exact);
    for scan in 0..10 {
        let origin = [-3.0 + 0.5 * f64::from(scan), 0.3 * f64::from(scan) - 1.0, 0.2];
        let points: Vec<[f64; 3]> = (0..6000).map(|i| seen(origin, i + 6000 * scan)).collect();
        map.integrate_points(&points, origin)?;
    }
    let tree = Tree::from_bricks(map.store()).ok_or("the map is too large for a tree")?;
    write_octomap_bt(out.join(format!("{name}.bt")), &tree)?;
    write_octomap_ot(out.join(format!("{name}.ot")), &tree, quantum)?;
    write_atomic(out.join(format!("{name}.csv")), |w| {
        let mut failed = Ok(());
        tree.for_each_leaf(|leaf| {
            let half = 0.5 * f64::from(1u32 << leaf.height);
            let [x, y, z] = tree.lattice().corner(leaf.cell).map(|v| v + half * lattice.resolution);
            let (edge, value) = (2.0 * half * lattice.resolution, (leaf.value.units() * quantum) as f32);
            let row = writeln!(w, "{x:.6},{y:.6},{z:.6},{edge:.6},{value}");
            failed = std::mem::replace(&mut failed, Ok(())).and(row);
        });
        failed
    })?;
    Ok(())
}

/// Where the `i`-th ray from a point ends.
fn seen(origin: [f64; 3], i: i32) -> [f64; 3] {
    // Directions of a golden spiral.
    let z = 1.0 - 2.0 * ((f64::from(i) * 0.754_877_666).fract());
    let (angle, flat) = (f64::from(i) * 2.399_963, (1.0 - z * z).sqrt());
    let direction = [flat * angle.cos(), flat * angle.sin(), z];
    let mut length = f64::INFINITY;
    for (k, half) in [6.0, 4.0, 1.5].into_iter().enumerate() {
        length = length.min((f64::copysign(half, direction[k]) - origin[k]) / direction[k]);
    }
    let (center, radius) = ([2.0, 1.0, 0.0], 0.7);
    let offset: [f64; 3] = std::array::from_fn(|k| center[k] - origin[k]);
    let along: f64 = (0..3).map(|k| offset[k] * direction[k]).sum();
    let beside_sq: f64 = offset.iter().map(|v| v * v).sum::<f64>() - along * along;
    if along > 0.0 && beside_sq < radius * radius {
        length = length.min(along - (radius * radius - beside_sq).sqrt());
    }
    std::array::from_fn(|k| origin[k] + length * direction[k])
}

fn time(file: &Path) -> Result<(), Box<dyn Error>> {
    let mut best = f64::INFINITY;
    for _ in 0..10 {
        let start = Instant::now();
        let read = OctomapTree::read(file)?;
        best = best.min(start.elapsed().as_secs_f64());
        std::hint::black_box(read);
    }
    writeln!(io::stdout(), "{:.3}", 1e3 * best)?;
    Ok(())
}
