//! The map that OctoMap made of twelve scans, made again.
//!
//! `map.bt` and the csv beside the scans are OctoMap's, at 0.1 m with hit 0.7, miss 0.4, clamps 0.1192 and 0.971, and a
//! maximum range of 8 m (points beyond are free space up to there): with that range OctoMap 1.10 makes exactly their
//! 138,477 leaves of the scans (197,291 cells), without it 260,629 cells. Here the same settings go through exact rays, bricks of
//! `f32` log odds and a tree of the bricks.

#![allow(clippy::unwrap_used, reason = "what cannot be set up ends the test")]

use std::io::Write;
use std::path::PathBuf;

use portolan::cell::{LogOdds32, LogOddsValue, OccupancyModel};
use portolan::geom::vector::{along, distance, scale, sub};
use portolan::geom::{Lattice, Pose};
use portolan::map::Occupancy;
use portolan::scan::{Frame, PointScan};
use portolan::store::{Leaf, Store, Tree};
use portolan::sweep::OccupancySweep;
use portolan_io::{OctomapTree, read_pcd};

const RESOLUTION: f64 = 0.1;
const MAX_RANGE: f64 = 8.0;

/// The folder; `None` where the data are not there, noted past the test harness's capture.
fn folder() -> Option<PathBuf> {
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    let root = std::env::var_os("PORTOLAN_DATA").map_or_else(beside, PathBuf::from);
    let folder = root.join("lidar3d_la3dm_sim_structured");
    if folder.is_dir() {
        return Some(folder);
    }
    let note = format!("SKIPPED: {} is not there; set PORTOLAN_DATA\n", folder.display());
    std::io::stderr().write_all(note.as_bytes()).unwrap();
    None
}

/// Twelve scans in the world's frame, fused.
fn fused(folder: &std::path::Path) -> Occupancy<3, LogOdds32> {
    let model = OccupancyModel { p_min: 0.1192, p_max: 0.971, ..OccupancyModel::default() };
    let lattice = Lattice::new([0.0; 3], RESOLUTION);
    let mut map = Occupancy::<3, LogOdds32>::new(lattice, model).unwrap().with_sweep(OccupancySweep::Exact);
    for k in 1..=12 {
        let cloud = read_pcd(folder.join(format!("sim_structured_{k}.pcd"))).unwrap();
        let origin = cloud.viewpoint.unwrap().position;
        let (near, far): (Vec<_>, Vec<_>) =
            cloud.points.iter().partition(|p| distance(p.map(f64::from), origin) <= MAX_RANGE);
        let mut scan = PointScan::new(near, origin);
        scan.free_ends = far
            .iter()
            .map(|p: &[f32; 3]| {
                let offset = sub(p.map(f64::from), origin);
                along(origin, scale(offset, 1.0 / distance(p.map(f64::from), origin)), MAX_RANGE)
                    .map(|v| v as f32)
            })
            .collect();
        let stats = map.integrate(&Pose::IDENTITY, &Frame::Points(scan)).unwrap();
        assert_eq!((stats.scans, stats.beams.total()), (1, 3500));
    }
    map
}

/// Center and probability of each leaf.
fn rows(folder: &std::path::Path) -> Vec<([f64; 3], f64)> {
    let text = std::fs::read_to_string(folder.join("sim_structured_octomap.csv")).unwrap();
    let row = |line: &str| {
        let v: Vec<f64> = line.split(',').map(|w| w.trim().parse().unwrap()).collect();
        ([v[0], v[1], v[2]], v[3])
    };
    text.lines().filter(|l| !l.is_empty()).map(row).collect()
}

/// All 12 scans: the same 197,291 cells, the same label in each, the same 138,477 leaves after merging, and the
/// probabilities of the csv to its six digits. Nothing is left to explain by OctoMap's `f32` arithmetic.
#[test]
fn octomaps_own_map_comes_out() {
    let Some(folder) = folder() else { return };
    let map = fused(&folder);
    let tree = Tree::from_bricks(map.store()).unwrap();
    let theirs = OctomapTree::read(folder.join("map.bt")).unwrap();
    let theirs = theirs.tree();

    let (mut leaves, mut cells, mut same_label) = (0, 0, 0);
    tree.for_each_leaf(|leaf| {
        leaves += 1;
        for cell in cells_of(&leaf) {
            cells += 1;
            let there = theirs.lattice().cell_of(tree.lattice().center(cell)).unwrap();
            let label = theirs.cell(there).map(|v| v.0 >= 0.0);
            same_label += usize::from(label == Some(leaf.value.0 >= 0.0));
        }
    });
    let mut their_cells = 0;
    theirs.for_each_leaf(|leaf| their_cells += cells_of(&leaf).count());
    assert_eq!((cells, same_label), (their_cells, their_cells));

    let rows = rows(&folder);
    assert_eq!((leaves, rows.len(), cells), (138_477, 138_477, 197_291));
    let mut worst = 0f64;
    for (center, p) in rows {
        // A leaf of an even number of cells has its center between cells.
        let cell = tree.lattice().cell_of(center.map(|v| v + 0.01 * RESOLUTION)).unwrap();
        let leaf = tree.leaves_in(cell, cell.map(|v| v + 1)).next().unwrap();
        let whole = tree.lattice().aabb(leaf.cell, leaf.cell.map(|v| v + (1 << leaf.height)));
        let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * (whole.min[k] + whole.max[k]));
        assert!(distance(middle, center) < 1e-6, "another leaf at {center:?}");
        worst = worst.max((leaf.value.probability(map.rule()) - p).abs());
    }
    // The csv has six digits.
    assert!(worst <= 5.1e-7, "{worst}");
}

fn cells_of(leaf: &Leaf<LogOdds32, 3>) -> impl Iterator<Item = [i32; 3]> + use<> {
    let (cell, height) = (leaf.cell, leaf.height);
    let part = move |i: usize, k: usize| (i >> (k as u32 * height) & ((1 << height) - 1)) as i32;
    (0..8usize.pow(height)).map(move |i| std::array::from_fn(|k| cell[k] + part(i, k)))
}
