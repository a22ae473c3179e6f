//! Exercise 2: where a tree is smaller than an array.

use crate::page::{check, cm};
use portolan::cell::OccupancyModel;
use portolan::geom::Grid;
use portolan::map::Quadtree;
use portolan_chapter::memory::{crossover_resolution, inner_only_node_bytes, memory_ratio};
use portolan_sim::{LapConfig, apartment, lap};

/// The Apartment's plane and walls, and its volume under a ceiling of 3 m.
const PLANE: (f64, f64) = (180.6, 108.0);
const HEIGHT: f64 = 3.0;

/// Crossovers of trees of so many bytes a node in 2-D and 3-D: in 2-D, under the ceiling for walls
/// alone, and there with floor and ceiling.
fn crossovers([plane, space]: [f64; 2]) -> [f64; 3] {
    let (s, v) = PLANE;
    [
        crossover_resolution::<2>(plane, s, v),
        crossover_resolution::<3>(space, s * HEIGHT, v * HEIGHT),
        crossover_resolution::<3>(space, s * HEIGHT + 2.0 * v, v * HEIGHT),
    ]
}

/// Exercise 2 (a) and (b): 1.5 cm in 2-D, and in 3-D 1.25 cm for walls alone and 0.89 cm with floor and ceiling.
#[test]
fn exercise_2_crossovers_of_the_texts_node() {
    let [plane, walls, closed] = crossovers([20.0, 36.0]);
    assert!((plane - 0.015).abs() < 5e-5);
    assert!((walls - 0.0125).abs() < 5e-5);
    assert!((closed - 0.0089).abs() < 5e-5);
}

/// Exercise 2 (c): a tree of 5 cm leaves first pays at `V / S` of 2.0 m in 2-D and 2.4 m in 3-D.
#[test]
fn exercise_2_shape_at_which_a_5_cm_tree_first_pays() {
    assert!((memory_ratio::<2>(20.0, 1.0, 2.0, 0.05) - 1.0).abs() < 1e-12);
    assert!((memory_ratio::<3>(36.0, 1.0, 2.4, 0.05) - 1.0).abs() < 1e-12);
    // The Apartment has 0.6 m, or 0.43 m with floor and ceiling. A yard of 60 m by 40 m with 200 m of fence has 12 m;
    // a hall of 100 m x 60 m x 12 m, floor and ceiling and walls, has 4.6 m: a warehouse with its racks left out.
    let hall = 100.0 * 60.0 * 12.0 / (2.0 * 100.0 * 60.0 + 2.0 * 160.0 * 12.0);
    assert!(memory_ratio::<2>(20.0, PLANE.0, PLANE.1, 0.05) > 3.0);
    assert!(hall > 2.4 && memory_ratio::<3>(36.0, 1.0, hall, 0.05) < 0.6);
}

/// The lap in a tree of 5 cm leaves, compacted, and the cells of a dense array of the same box.
fn lap_in_a_tree() -> (Quadtree, usize) {
    let world = apartment().world;
    let grid = Grid::covering(world.aabb(), 0.05).unwrap();
    let mut tree = Quadtree::covering(&grid, OccupancyModel::default()).unwrap();
    for (pose, scan) in lap(&world, &LapConfig::default()) {
        tree.integrate(&pose, &scan).unwrap();
    }
    tree.compact();
    (tree, grid.len())
}

/// Exercise 2 for our node. A leaf is a byte in its parent's record, of 9 bytes in 2-D and 13 in 3-D; of the
/// nodes that the formula counts one in two is inner in 2-D and one in four in 3-D.
#[test]
fn exercise_2_crossovers_of_our_node() {
    let (plane_node, space_node) = (9.0 / 2.0, 13.0 / 4.0);
    let [plane, walls, closed] = crossovers([plane_node, space_node]);
    println!("V/S at 5 cm: {:.3} m, {:.3} m", 0.05 * plane_node * 2.0, 0.05 * space_node * 4.0 / 3.0);
    assert!((plane - 0.0664).abs() < 1e-4);
    assert!((walls - 0.138).abs() < 5e-4 && (closed - 0.0987).abs() < 5e-4);
    assert!((memory_ratio::<2>(plane_node, 1.0, 0.45, 0.05) - 1.0).abs() < 1e-12);
    assert!((memory_ratio::<3>(space_node, 1.0, 0.65 / 3.0, 0.05) - 1.0).abs() < 1e-12);

    // And measured: the lap in a tree at 5 cm. It refines along furniture and along the border of the unknown too.
    let (tree, cells) = lap_in_a_tree();
    let records = tree.store().inner_nodes();
    let counted = PLANE.0 / 0.05;
    println!(
        "measured: {records} inner records, {counted:.0} by the walls; {} bytes, {:.2} of a byte a cell",
        tree.memory_bytes(),
        tree.memory_bytes() as f64 / cells as f64
    );
    assert!((1.0..3.0).contains(&(records as f64 / counted)));
}

/// `V / S` (meters) from which a tree of leaves of `r` is smaller: `b c_d r`.
fn shape<const D: usize>(node_bytes: f64, r: f64) -> f64 {
    // Of a world with one meter of volume for one of surface the crossover is `1 / (b c_d)`.
    r / crossover_resolution::<D>(node_bytes, 1.0, 1.0)
}

#[test]
fn exercise_2_on_the_page() {
    let (s, v) = PLANE;
    let [plane, walls, closed] = crossovers([20.0, 36.0]).map(cm);
    let ours = [inner_only_node_bytes::<2>(9.0), inner_only_node_bytes::<3>(13.0)];
    let [our_plane, our_walls, our_closed] = crossovers(ours).map(cm);
    let [long, wide, high] = [100.0, 60.0, 12.0];
    let hall = long * wide * high / (2.0 * long * wide + 2.0 * (long + wide) * high);
    let yard = 60.0 * 40.0 / 200.0;
    let (tree, cells) = lap_in_a_tree();
    let m = |metres: f64| format!("{metres:.2} m");
    let rows = [
        ("(a) the Apartment in 2-D, a node of 20 B", plane),
        ("(b) under a ceiling of 3 m, a node of 36 B, walls alone", walls),
        ("(b) with floor and ceiling", closed),
        ("(c) `V / S` from which leaves of 5 cm pay, 2-D, 20 B", m(shape::<2>(20.0, 0.05))),
        ("(c) 3-D, 36 B", m(shape::<3>(36.0, 0.05))),
        ("`V / S` of the Apartment, 2-D", m(v / s)),
        ("`V / S` of the Apartment, 3-D, with floor and ceiling", m(v * HEIGHT / (s * HEIGHT + 2.0 * v))),
        ("`V / S` of a yard of 60 m x 40 m with 200 m of fence", m(yard)),
        ("`V / S` of a hall of 100 m x 60 m x 12 m", m(hall)),
        (
            "bytes of the tree over those of the array in that hall, 5 cm, 36 B",
            format!("{:.2}", memory_ratio::<3>(36.0, 1.0, hall, 0.05)),
        ),
        ("(a) with the nodes of this project: 9 B for four children", our_plane),
        ("(b) the same, 13 B for eight children, walls alone", our_walls),
        ("(b) the same, with floor and ceiling", our_closed),
        ("(c) the same, 2-D", m(shape::<2>(ours[0], 0.05))),
        ("(c) the same, 3-D", m(shape::<3>(ours[1], 0.05))),
        (
            "the lap in a tree of 5 cm, bytes over those of the array",
            format!("{:.2}", tree.memory_bytes() as f64 / cells as f64),
        ),
    ];
    check(2, &rows);
}
