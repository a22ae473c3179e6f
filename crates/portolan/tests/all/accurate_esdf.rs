//! The accurate distance field against the extracted surface.

use crate::common;
use crate::scenes::{Random, Segments, Spoiled, room};
use portolan::field::{Esdf, EsdfMethod, EsdfSettings};
use portolan::geom::{Lattice, block_cells, vector};
use portolan::map::BeamSweep;
use portolan::surface::{ContourSettings, MeshSettings, NearestSurface, marching_cubes, marching_squares};

/// Errors of the nodes in cells, by distance in cells.
#[derive(Default)]
struct Errors(Vec<(f64, f64)>);

impl Errors {
    /// Of every node that the field knows, or one of `every` of them.
    fn of<const D: usize>(esdf: &Esdf<D>, every: u64, exact: impl Fn([f64; D]) -> Option<f64>) -> Self {
        let mut random = Random(1);
        let mut errors = Self::default();
        let r = esdf.lattice().resolution;
        let points: Vec<[f64; D]> =
            esdf.point_obstacles().map(|(cell, _)| esdf.lattice().center(cell)).collect();
        for cell in esdf.keys().iter().flat_map(|key| (0..block_cells::<D>()).map(|i| key.cell(i))) {
            let asked = random.next().is_multiple_of(every);
            if let (true, Some(got)) = (asked, esdf.cell(cell).known()) {
                let center = esdf.lattice().center(cell);
                let to_points = points.iter().map(|p| vector::distance(center, *p));
                let want = to_points.fold(exact(center).unwrap(), f64::min);
                errors.0.push((want / r, (f64::from(got.abs()) - want) / r));
            }
        }
        errors
    }

    /// Share of nodes that are exact, and the worst error (cells), among those between two distances.
    fn check(&self, name: &str, from: f64, to: f64) -> (f64, f64) {
        let here: Vec<f64> = self.0.iter().filter(|(d, _)| (from..to).contains(d)).map(|e| e.1).collect();
        let exact = here.iter().filter(|e| e.abs() <= 1e-3).count() as f64 / here.len() as f64;
        let worst = here.iter().fold(0.0, |a: f64, e| a.max(e.abs()));
        let least = here.iter().fold(0.0, |a: f64, e| a.min(*e));
        println!(
            "{name} {from}..{to}: {} nodes, {:.4} % exact, worst {worst:.4}, too small by {:.1e}",
            here.len(),
            100.0 * exact,
            -least
        );
        // An element's distance is never less than that to the surface: f32 alone, of up to 20 cells and of the
        // vertices of the mesh.
        assert!(least > -2e-4);
        (exact, worst)
    }

    fn assert_exact(&self, name: &str, share: f64) {
        let near = self.check(name, 0.0, 1.0);
        let middle = self.check(name, 1.0, 3.0);
        let far = self.check(name, 3.0, f64::INFINITY);
        let (exact, worst) = self.check(name, 0.0, f64::INFINITY);
        assert_eq!(near.0, 1.0, "all exact within one cell");
        assert!(exact >= share && worst <= 0.2 && middle.1 <= 0.2 && far.1 <= 0.2);
    }
}

fn nodes_of_the_room(spoiled: Spoiled, share: f64, name: &str) {
    let store = room(112, [-40, 3, 0], Lattice::new([0.0; 3], 0.05), spoiled);
    let mesh = marching_cubes(&store, None, &MeshSettings::default());
    let nearest = NearestSurface::of_mesh(&mesh);
    let esdf = Esdf::of(&store, &EsdfSettings::default());
    Errors::of(&esdf, 4, |p| nearest.distance(p)).assert_exact(name, share);
}

#[test]
fn nodes_in_space_are_exact() {
    nodes_of_the_room(Spoiled::Noisy, 0.999, "noisy room");
}

#[test]
fn nodes_in_space_are_exact_where_crossings_are_at_nodes() {
    nodes_of_the_room(Spoiled::Rounded, 0.995, "rounded room");
}

#[test]
fn nodes_of_the_apartment_are_exact() {
    let tsdf = common::tsdf(BeamSweep::CellCentre, true, &common::apartment().log);
    let settings = ContourSettings::of(&tsdf);
    let contour = marching_squares(&tsdf, &settings);
    let segments = Segments::of(&contour, 0.1);
    let settings = EsdfSettings { min_weight: settings.min_weight, ..Default::default() };
    let esdf = Esdf::of(&tsdf, &settings);
    Errors::of(&esdf, 1, |p| segments.distance(p)).assert_exact("apartment", 0.999);
}

/// Probes in observed free space, more than 5 cm from the contour; errors in meters against the contour and against the
/// true walls, and lengths of gradients, by each method.
#[test]
fn distances_of_the_apartment_by_every_method() {
    let tsdf = common::tsdf(BeamSweep::CellCentre, true, &common::apartment().log);
    let settings = ContourSettings::of(&tsdf);
    let segments = Segments::of(&marching_squares(&tsdf, &settings), 0.1);
    let min_weight = settings.min_weight;
    let methods = [EsdfMethod::Accurate, EsdfMethod::TEXTBOOK, EsdfMethod::Mask];
    let (mut medians, mut probes) = (Vec::new(), Vec::new());
    for method in methods {
        let settings = EsdfSettings { min_weight, method, max_distance: 5.0, ..Default::default() };
        let esdf = Esdf::of(&tsdf, &settings);
        let (mut contour, mut walls, mut slopes) = (Vec::new(), Vec::new(), Vec::new());
        for p in common::points(100_000) {
            let exact = segments.distance(p).unwrap();
            // Beyond the truncation the distance is no number, but the space is seen to be free.
            let free = tsdf.signed_distance(p).value().is_some_and(|d| d > 0.0);
            if let (true, Some((d, slope))) = (free && exact > 0.05, esdf.distance_and_gradient(p).known()) {
                contour.push((d - exact).abs());
                walls.push((d - common::apartment().world.signed_distance(p)).abs());
                slopes.push(vector::norm(slope));
            }
        }
        let n = contour.len();
        probes.push(n);
        let [c, c99] = [0.5, 0.99].map(|q| 1e3 * common::quantile(&mut contour, q));
        let [w, s] = [1e3 * common::quantile(&mut walls, 0.5), common::quantile(&mut slopes, 0.5)];
        println!(
            "{method:?}: {n} probes, contour {c:.3} mm (p99 {c99:.2}), walls {w:.2} mm, gradient {s:.4}"
        );
        medians.push([c, w, s]);
    }
    let [contour, walls, slope] = medians[0];
    assert!(probes.iter().all(|&n| n > 40_000), "{probes:?}: not all of the free space");
    assert!(contour <= 0.25 && walls <= 5.0 && slope >= 0.995);
    assert!(medians[1..].iter().all(|m| m[0] > 10.0 * contour));
}

/// The same against the mesh, in the room.
#[test]
fn distances_in_space_by_every_method() {
    let store = room(112, [0; 3], Lattice::new([0.0; 3], 0.05), Spoiled::Noisy);
    let nearest = NearestSurface::of_mesh(&marching_cubes(&store, None, &MeshSettings::default()));
    let mut random = Random(2);
    let probes: Vec<[f64; 3]> = (0..60_000).map(|_| std::array::from_fn(|_| 5.6 * random.unit())).collect();
    let mut medians = Vec::new();
    for method in [EsdfMethod::Accurate, EsdfMethod::TEXTBOOK, EsdfMethod::Mask] {
        let settings = EsdfSettings { method, max_distance: 2.0, ..Default::default() };
        let esdf = Esdf::of(&store, &settings);
        let (mut errors, mut slopes) = (Vec::new(), Vec::new());
        for &p in &probes {
            let exact = nearest.distance(p).unwrap();
            if let Some((d, slope)) =
                esdf.distance_and_gradient(p).known().filter(|(d, _)| *d > 0.0 && exact > 0.05)
            {
                errors.push((d - exact).abs());
                slopes.push(vector::norm(slope));
            }
        }
        let [e, e99] = [0.5, 0.99].map(|q| 1e3 * common::quantile(&mut errors, q));
        let s = common::quantile(&mut slopes, 0.5);
        println!("{method:?}: {} probes, mesh {e:.3} mm (p99 {e99:.2}), gradient {s:.4}", errors.len());
        medians.push([e, s]);
    }
    assert!(medians[0][1] >= 0.995);
    assert!(medians[1..].iter().all(|m| m[0] > 10.0 * medians[0][0]));
}
