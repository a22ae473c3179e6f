//! Exercise 5: what each pane reads for an answer, without a clock.

use crate::page::{check, cm};
use portolan::cell::OccupancyModel;
use portolan::geom::Grid;
use portolan::map::{OccupancyGrid, Quadtree, Tsdf2, TsdfConfig};
use portolan::surface::{ContourSettings, marching_squares};
use portolan_chapter::memory::{crossover_resolution, inner_only_node_bytes};
use portolan_sim::{Lap, LapConfig, Random, World, apartment, lap};

const R: f64 = 0.05;

/// Levels that a probe descends below the root, over the observed area.
fn levels(tree: &Quadtree) -> f64 {
    let depth = tree.store().depth();
    let (mut area, mut sum) = (0.0, 0.0);
    tree.store().for_each_leaf(|leaf| {
        let cells = f64::from(1u32 << leaf.height).powi(2);
        area += cells;
        sum += cells * f64::from(depth - leaf.height);
    });
    sum / area
}

/// Cells that the ring search of the grid looks at for a distance: the median over free points.
fn cells_of_rings(grid: &OccupancyGrid<2>, world: &World) -> usize {
    let mut random = Random::stream(5, 0);
    let mut cells = Vec::new();
    while cells.len() < 2000 {
        let p = [12.0 * random.uniform(), 9.0 * random.uniform()];
        if world.signed_distance(p) < R {
            continue;
        }
        if let Some(d) = grid.search_distance_by_rings(p, 15.0) {
            // The search ends at the first ring whose cells are all farther than what was found.
            let rings = (d / R + 0.5).floor() as usize;
            cells.push((2 * rings + 1).pow(2));
        }
    }
    cells.sort_unstable();
    cells[cells.len() / 2]
}

/// A tree of the lap on the lattice of a grid that is `times` as wide and high as the Apartment's, and its bytes over
/// those of the dense array.
fn ratio_in_a_box(log: &Lap, times: usize) -> f64 {
    let grid = Grid::new([0.0; 2], R, [240 * times, 180 * times]);
    let mut tree = Quadtree::covering(&grid, OccupancyModel::default()).unwrap();
    for (pose, scan) in log {
        tree.integrate(pose, scan).unwrap();
    }
    tree.compact();
    tree.memory_bytes() as f64 / grid.len() as f64
}

#[test]
fn exercise_5_on_the_page() {
    let world = apartment().world;
    let log = lap(&world, &LapConfig::default());
    let cells = Grid::new([0.0; 2], R, [240, 180]);
    let mut grid = OccupancyGrid::covering(&cells, OccupancyModel::default()).unwrap();
    let mut tree = Quadtree::covering(&cells, OccupancyModel::default()).unwrap();
    let mut tsdf = Tsdf2::covering(&cells, TsdfConfig::textbook()).unwrap();
    for (pose, scan) in &log {
        grid.integrate(pose, scan).unwrap();
        tree.integrate(pose, scan).unwrap();
        tsdf.integrate(pose, scan).unwrap();
    }
    let contour = marching_squares(&tsdf, &ContourSettings::default());
    let levels = levels(&tree);
    let rings = cells_of_rings(&grid, &world);
    // The workloads have different winners, and the tree is none of them.
    assert!(levels > 1.0 && rings > 4 && contour.segments.len() > rings);
    let (s, v) = (world.wall_length(), 12.0 * 9.0);
    let rows = [
        ("occupied? The grid reads", "1 cell".to_owned()),
        ("occupied? The quadtree descends, in the mean over what was seen", format!("{levels:.1} levels")),
        ("how far? The distance field reads", "4 cells".to_owned()),
        ("how far? The grid searches, in the median", format!("{rings} cells")),
        ("how far? The contour compares", format!("{} segments", contour.segments.len())),
        ("where is the boundary? The contour reads", "0 cells".to_owned()),
        ("where is the boundary? The others pass over", format!("{} cells", grid.store().grid().len())),
        (
            "bytes of the quadtree over those of the grid, a box of 12 m x 9 m",
            format!("{:.2}", ratio_in_a_box(&log, 1)),
        ),
        ("the same lap in a box of 60 m x 45 m", format!("{:.3}", ratio_in_a_box(&log, 5))),
        (
            "cells below which the quadtree is smaller here, a node of 20 B",
            cm(crossover_resolution::<2>(20.0, s, v)),
        ),
        (
            "the same with the nodes of this project",
            cm(crossover_resolution::<2>(inner_only_node_bytes::<2>(9.0), s, v)),
        ),
    ];
    check(5, &rows);
}
