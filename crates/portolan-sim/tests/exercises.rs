//! The chapter's exercises, as tests.

#![allow(clippy::unwrap_used, reason = "helpers of tests are tests too")]

use portolan::cell::{OccupancyModel, TsdfRule};
use portolan::field::esdf_from_tsdf;
use portolan::geom::{Grid, vector::distance};
use portolan::map::{Cloud, MapRepr, Quadtree, Tsdf, TsdfConfig, crossover_resolution, memory_ratio};
use portolan_sim::{CHAIR_MOVE, LapConfig, Random, apartment, lap};

/// Sample variance of what a filter believes after `n` observations of variance `sigma^2 / w` of a zero, over
/// `runs` runs.
fn variance_after(w_max: f32, (sigma, w): (f64, f64), n: usize, runs: u64) -> f64 {
    let rule = TsdfRule { truncation: 1.0, w_max };
    let (mut sum, mut sum_sq) = (0.0, 0.0);
    for run in 0..runs {
        let mut random = Random::stream(41, run);
        let (mut d, mut weight) = (0.0, 0.0);
        for _ in 0..n {
            let event = rule.step(d, weight, sigma / w.sqrt() * random.normal(), w);
            (d, weight) = (event.after, event.weight_after);
        }
        (sum, sum_sq) = (sum + d, sum_sq + d * d);
    }
    let mean = sum / runs as f64;
    sum_sq / runs as f64 - mean * mean
}

/// Exercise 1 (a): a clamped cell never comes to rest, and its variance is `sigma^2 / (2 W_max + w)`.
#[test]
fn exercise_1_steady_state_variance() {
    let sigma = 0.02;
    for (w_max, w) in [(4.0f32, 1.0), (24.0, 1.0), (64.0, 1.0), (16.0, 2.0), (8.0, 0.5)] {
        // Long enough for the beginning to be forgotten to a part in 10,000.
        let n = (10.0 * (f64::from(w_max) / w + 1.0)) as usize;
        let measured = variance_after(w_max, (sigma, w), n, 8000);
        let predicted = sigma * sigma / (2.0 * f64::from(w_max) + w);
        println!(
            "W_max {w_max}, w {w}: {:.3} mm, predicted {:.3}",
            1e3 * measured.sqrt(),
            1e3 * predicted.sqrt()
        );
        // The variance of 8000 runs is known to 1.6 %: three of those.
        assert!((measured / predicted - 1.0).abs() < 0.05);
    }
}

/// Exercise 1 (c): at `W_max = 24.5` a cell is as sure as an unclamped one after 50 scans: `2 * 24.5 + 1 = 50`.
#[test]
fn exercise_1_w_max_of_24_5_equals_50_unclamped_scans() {
    let sigma = 0.02;
    let clamped = variance_after(24.5, (sigma, 1.0), 400, 8000);
    let unclamped = variance_after(f32::INFINITY, (sigma, 1.0), 50, 8000);
    println!(
        "standard deviation: clamped {:.3} mm, 50 scans {:.3} mm",
        1e3 * clamped.sqrt(),
        1e3 * unclamped.sqrt()
    );
    assert!((clamped / unclamped - 1.0).abs() < 0.07);
    assert!((unclamped / (sigma * sigma / 50.0) - 1.0).abs() < 0.05);
}

/// The Apartment's plane and walls, and its volume under a ceiling of 3 m.
const PLANE: (f64, f64) = (180.6, 108.0);
const HEIGHT: f64 = 3.0;

/// Exercise 2 (a) and (b): 1.5 cm in the plane, and in space 1.25 cm for walls alone and 0.89 cm with floor and ceiling.
#[test]
fn exercise_2_crossovers_of_the_chapters_node() {
    let (s, v) = PLANE;
    let plane = crossover_resolution::<2>(20.0, s, v);
    let walls = crossover_resolution::<3>(36.0, s * HEIGHT, v * HEIGHT);
    let closed = crossover_resolution::<3>(36.0, s * HEIGHT + 2.0 * v, v * HEIGHT);
    println!("crossovers: {:.2} cm; {:.2} cm, {:.2} cm", 1e2 * plane, 1e2 * walls, 1e2 * closed);
    assert!((plane - 0.015).abs() < 5e-5);
    assert!((walls - 0.0125).abs() < 5e-5);
    assert!((closed - 0.0089).abs() < 5e-5);
}

/// Exercise 2 (c): a tree of 5 cm leaves first pays at `V / S` of 2.0 m in the plane and 2.4 m in space.
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

/// Exercise 2 for our node. A leaf is a byte in its parent's record, of 9 bytes in the plane and 13 in space; of the
/// nodes that the formula counts one in two is inner in the plane and one in four in space.
#[test]
fn exercise_2_crossovers_of_our_node() {
    let (s, v) = PLANE;
    let (plane_node, space_node) = (9.0 / 2.0, 13.0 / 4.0);
    let plane = crossover_resolution::<2>(plane_node, s, v);
    let walls = crossover_resolution::<3>(space_node, s * HEIGHT, v * HEIGHT);
    let closed = crossover_resolution::<3>(space_node, s * HEIGHT + 2.0 * v, v * HEIGHT);
    println!("crossovers: {:.2} cm; {:.2} cm, {:.2} cm", 1e2 * plane, 1e2 * walls, 1e2 * closed);
    println!("V/S at 5 cm: {:.3} m, {:.3} m", 0.05 * plane_node * 2.0, 0.05 * space_node * 4.0 / 3.0);
    assert!((plane - 0.0664).abs() < 1e-4);
    assert!((walls - 0.138).abs() < 5e-4 && (closed - 0.0987).abs() < 5e-4);
    assert!((memory_ratio::<2>(plane_node, 1.0, 0.45, 0.05) - 1.0).abs() < 1e-12);
    assert!((memory_ratio::<3>(space_node, 1.0, 0.65 / 3.0, 0.05) - 1.0).abs() < 1e-12);

    // And measured: the lap in a tree at 5 cm. It refines along furniture and along the border of the unknown too.
    let world = apartment().world;
    let grid = Grid::covering(world.aabb(), 0.05).unwrap();
    let mut tree = Quadtree::covering(&grid, OccupancyModel::default()).unwrap();
    for (pose, scan) in lap(&world, &LapConfig::default()) {
        tree.integrate(&pose, &scan);
    }
    tree.compact();
    let records = tree.tree().inner_nodes();
    let counted = s / 0.05;
    println!(
        "measured: {records} inner records, {counted:.0} by the walls; {} bytes, {:.2} of a byte a cell",
        tree.memory_bytes(),
        tree.memory_bytes() as f64 / grid.len() as f64
    );
    assert!((1.0..3.0).contains(&(records as f64 / counted)));
}

/// What the map of a wall at `y = 0` believes along the normal when beams of these angles (radians) were fused with these
/// weights, their ranges off by `errors`: cell centres at `(k + 1/2) r`, up to tau on both sides.
fn fused_line(beams: &[(f64, f64, f64)], r: f64, tau: f64) -> Tsdf<2> {
    let config = TsdfConfig {
        cells: [1, 2 * (tau / r).ceil() as usize],
        resolution: r,
        origin: [0.0, -r * (tau / r).ceil()],
        truncation: tau,
        w_max: f32::INFINITY,
        ..Default::default()
    };
    let mut map = Tsdf::<2>::new(config).unwrap();
    for j in 0..config.cells[1] as i32 {
        let y = map.grid().lattice.center([0, j])[1];
        for &(theta, weight, error) in beams {
            let d = y / theta.cos() + error;
            let taper = (1.0 + d / tau).min(1.0);
            if weight * taper > 0.0 {
                map.fuse([0, j], d, weight * taper);
            }
        }
    }
    map
}

/// Where the linear interpolation between the cells next to the wall is zero, and the slope in front of it.
fn crossing_and_slope(map: &Tsdf<2>) -> (f64, f64) {
    let n = map.grid().shape[1] as i32;
    // Far behind the wall a grazing beam says nothing.
    let at = |j: i32| {
        let cell = map.store().at(map.grid().index([0, j])?)?;
        Some((map.grid().lattice.center([0, j])[1], f64::from(cell.distance)))
    };
    let signs_differ = |j: i32| Some((at(j)?, at(j + 1)?)).filter(|(a, b)| a.1 < 0.0 && b.1 >= 0.0);
    let ((y0, d0), (y1, d1)) = (0..n - 1).find_map(signs_differ).unwrap();
    (y0 + (y1 - y0) * d0 / (d0 - d1), d1 / y1)
}

/// Exercise 3 (a) and (b): beams at 0 and 60 degrees say `y` and `2 y` about a point `y` in front of a wall. Fused with
/// equal weights that is `1.5 y`: the slope is wrong, the zero is not. What a map's cells add is the taper: behind
/// the wall the steeper beam counts less, the slopes on both sides differ, and the straight line between two cells
/// misses the wall by half a millimeter in 5 cm.
#[test]
fn exercise_3_zero_crossing_of_beams_at_0_and_60_degrees() {
    let (tau, sixty) = (0.15, 60f64.to_radians());
    let (zero, slope) = crossing_and_slope(&fused_line(&[(0.0, 1.0, 0.0), (sixty, 1.0, 0.0)], 0.05, tau));
    println!("equal weights: zero at {:.3} mm, slope {slope:.4}", 1e3 * zero);
    assert!((slope - 1.5).abs() < 1e-6 && zero.abs() < 6e-4);
    // It is the cells: with smaller ones it vanishes, with the square.
    let (fine, _) = crossing_and_slope(&fused_line(&[(0.0, 1.0, 0.0), (sixty, 1.0, 0.0)], 0.005, tau));
    assert!(fine.abs() < 1.2e-2 * zero.abs());
    // One beam alone, however grazing: exactly there.
    for theta in [0.0f64, 0.7, 1.0] {
        let (zero, slope) = crossing_and_slope(&fused_line(&[(theta, 1.0, 0.0)], 0.02, tau));
        assert!(zero.abs() < 1e-8 && (slope - 1.0 / theta.cos()).abs() < 1e-5);
    }
}

/// Exercise 3 (c): weights of `cos theta` bring the slope nearer to 1 (4/3), and errors that grow with the incidence
/// count less: an error of the bearing moves the end of a beam by `z tan theta` along itself, and at 60 degrees it
/// moves the wall a quarter less. Against noise of the range alone they do not help: there the grazing beam is the
/// better one across the wall.
#[test]
fn exercise_3_what_cos_weighting_does() {
    let (r, tau, sixty) = (0.005, 0.15, 60f64.to_radians());
    let cosine = sixty.cos();
    let crossing =
        |w: f64, e1: f64, e2: f64| crossing_and_slope(&fused_line(&[(0.0, 1.0, e1), (sixty, w, e2)], r, tau));
    let slope = crossing(cosine, 0.0, 0.0).1;
    assert!((slope - 4.0 / 3.0).abs() < 1e-6);

    // A bearing off by 0.1 degrees at 2 m from the wall: the beam head-on does not notice.
    let z = 2.0 / cosine;
    let error = z * sixty.tan() * 0.1f64.to_radians();
    let (equal, weighted) = (crossing(1.0, 0.0, error).0, crossing(cosine, 0.0, error).0);
    println!(
        "0.1 degrees: the range is off by {:.1} mm, the wall by {:.2} mm, with cos {:.2} mm",
        1e3 * error,
        1e3 * equal,
        1e3 * weighted
    );
    assert!((equal + error / 3.0).abs() < 5e-4 && (weighted + error / 4.0).abs() < 5e-4);

    // Range noise of sigma on both: 2/9 against 5/16 of sigma squared.
    let sigma = 1e-3;
    let variance =
        |w: f64| (crossing(w, sigma, 0.0).0 / sigma).powi(2) + (crossing(w, 0.0, sigma).0 / sigma).powi(2);
    println!("range noise: variance {:.3} sigma^2, with cos {:.3}", variance(1.0), variance(cosine));
    assert!((variance(1.0) - 2.0 / 9.0).abs() < 0.02 && (variance(cosine) - 5.0 / 16.0).abs() < 0.02);
}

/// A plain k-d tree that counts: the nodes that a search of the nearest point visits.
struct CountingTree(Vec<[f64; 2]>);

impl CountingTree {
    fn new(mut points: Vec<[f64; 2]>) -> Self {
        fn sort(points: &mut [[f64; 2]], axis: usize) {
            if points.len() > 1 {
                let middle = points.len() / 2;
                points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
                let (low, high) = points.split_at_mut(middle);
                sort(low, 1 - axis);
                sort(&mut high[1..], 1 - axis);
            }
        }
        sort(&mut points, 0);
        Self(points)
    }

    /// Distance of the nearest point, and the nodes visited.
    fn nearest(&self, p: [f64; 2]) -> (f64, usize) {
        fn descend(points: &[[f64; 2]], axis: usize, p: [f64; 2], best: &mut (f64, usize)) {
            if points.is_empty() {
                return;
            }
            let middle = points.len() / 2;
            best.0 = best.0.min(distance(points[middle], p));
            best.1 += 1;
            let side = p[axis] - points[middle][axis];
            let (low, high) = (&points[..middle], &points[middle + 1..]);
            let (near, far) = if side < 0.0 { (low, high) } else { (high, low) };
            descend(near, 1 - axis, p, best);
            if side.abs() < best.0 {
                descend(far, 1 - axis, p, best);
            }
        }
        let mut best = (f64::INFINITY, 0);
        descend(&self.0, 0, p, &mut best);
        best
    }
}

/// Exercise 6: the k-d tree over end points wins the distance query while points are few, and loses it as they grow.
/// Without a clock: an answer of the ESDF reads four cells, whatever was mapped; a search visits nodes, at least the
/// depth of the tree and more with every doubling. Bytes cross over too, after 14 scans of 200.
#[test]
fn exercise_6_the_cloud_wins_while_points_are_few() {
    const ESDF_READS: usize = 4;
    let world = apartment().world;
    let scans = lap(&world, &LapConfig::default());
    let points: Vec<[f64; 2]> =
        scans.iter().flat_map(|(pose, scan)| scan.hits_world(pose).collect::<Vec<_>>()).collect();
    let mut random = Random::stream(6, 0);
    let mut probes = Vec::new();
    while probes.len() < 500 {
        let p = [12.0 * random.uniform(), 9.0 * random.uniform()];
        if world.signed_distance(p) > 0.0 {
            probes.push(p);
        }
    }
    let mut crossover = None;
    let (mut last, mut n) = (0, 1);
    while n <= points.len() {
        let some: Vec<_> = points.iter().copied().step_by(points.len() / n).take(n).collect();
        let (cloud, tree) = (Cloud::from_points(some.iter().copied()), CountingTree::new(some));
        let mut visits: Vec<usize> = probes
            .iter()
            .map(|&p| {
                let (d, visits) = tree.nearest(p);
                assert!((d - cloud.nearest_distance(p).unwrap()).abs() < 1e-12);
                visits
            })
            .collect();
        visits.sort_unstable();
        let median = visits[visits.len() / 2];
        println!("{n:6} points: {median} nodes visited");
        assert!(median >= last && median >= n.ilog2() as usize);
        if median > ESDF_READS && crossover.is_none() {
            crossover = Some(n);
        }
        (last, n) = (median, 4 * n);
    }
    let crossover = crossover.unwrap();
    // Less than a hundredth of a scan.
    println!("more nodes than the ESDF reads cells from {crossover} points on");
    assert!((2..=64).contains(&crossover));

    let grid = Grid::covering(world.aabb(), 0.05).unwrap();
    let tsdf = Tsdf::<2>::new(TsdfConfig::default().with_grid(&grid)).unwrap();
    let esdf_bytes = size_of_val(esdf_from_tsdf(&tsdf, 0.5, 1.5).samples());
    // A point is held twice, once with its index: 36 bytes.
    let bytes = 36 * points.len();
    assert!(Cloud::from_points(points.iter().copied()).memory_bytes() >= bytes);
    let scans_until = (esdf_bytes * scans.len()) as f64 / bytes as f64;
    println!(
        "an ESDF of {esdf_bytes} bytes; the cloud is larger after {scans_until:.1} scans, {bytes} after the lap"
    );
    assert!((scans_until - 14.0).abs() < 1.0);
    // The map stays as large as the building, the cloud grows with the time.
    let twice = Cloud::from_points(points.iter().chain(&points).copied());
    assert!(twice.memory_bytes() >= 2 * bytes && twice.points().len() == 2 * points.len());
}

/// Exercise 6, the real question: a cloud is the log, not the map. It keeps every end point, so that the chair is still
/// there after it was moved, and it cannot be told otherwise; the filter forgets.
#[test]
fn exercise_6_a_cloud_cannot_forget() {
    let world = apartment().world;
    let moved = world.with_moved("chair", CHAIR_MOVE);
    let grid = Grid::covering(world.aabb(), 0.05).unwrap();
    let mut tsdf =
        Tsdf::<2>::new(TsdfConfig { w_max: 4.0, ..TsdfConfig::default() }.with_grid(&grid)).unwrap();
    let mut cloud = Cloud::new();
    for (k, world) in [&world, &moved].into_iter().enumerate() {
        for (pose, scan) in lap(world, &LapConfig { first_index: 200 * k as u64, ..Default::default() }) {
            tsdf.integrate(&pose, &scan, true);
            cloud.integrate(&pose, &scan);
        }
    }
    cloud.rebuild();
    // The middle of the side that the robot saw.
    let ghost = [1.87, 2.825];
    let true_distance = moved.signed_distance(ghost);
    assert!(true_distance > 0.5);
    assert!(cloud.nearest_distance(ghost).unwrap() < 0.03);
    assert_eq!(MapRepr::<2>::occupancy(&tsdf, ghost), Some(0.0));
    // And it has no inside and no free space to tell.
    assert_eq!(MapRepr::<2>::occupancy(&cloud, ghost), None);
}
