//! Certified clearance against the exact distance to the extracted surface: a million points per scene, no violation.
#![allow(clippy::unwrap_used, reason = "in a test a panic is the report")]

mod common;
#[path = "common/scenes.rs"]
mod scenes;

use common::quantile;
use portolan::Answer;
use portolan::field::{Clearance, ClearanceField, SparseEsdf, SparseEsdfSettings, UnknownSpace};
use portolan::geom::{BlockKey, Lattice, block_cells, vector};
use portolan::map::SweepKind;
use portolan::store::Store;
use portolan::surface::{ContourSettings, MeshSettings, NearestSurface, marching_cubes, marching_squares};
use scenes::{Random, Segments, Spoiled, room};

/// Points where bounds are likely to fail, and everywhere else: in the bricks of a field, at nodes, on the faces of cells,
/// on the surface's corners and simplices, and close to all of these.
struct Probes<'a, const D: usize> {
    random: Random,
    esdf: &'a SparseEsdf<D>,
    keys: Vec<BlockKey<D>>,
    /// Corners of the simplices.
    simplices: &'a [[[f64; D]; D]],
}

impl<const D: usize> Probes<'_, D> {
    fn next(&mut self, n: usize) -> [f64; D] {
        let random = &mut self.random;
        let mut unit = || random.unit();
        let r = self.esdf.lattice().resolution;
        let key = self.keys[(unit() * self.keys.len() as f64) as usize];
        let cell = key.cell((unit() * block_cells::<D>() as f64) as usize);
        let corner = self.esdf.lattice().corner(cell);
        let simplex = self.simplices[(unit() * self.simplices.len() as f64) as usize];
        let mut weights: [f64; D] = std::array::from_fn(|_| unit());
        let sum: f64 = weights.iter().sum();
        weights = weights.map(|w| w / sum);
        let inside = (0..D).fold([0.0; D], |p, i| vector::add(p, vector::scale(simplex[i], weights[i])));
        let off: [f64; D] = std::array::from_fn(|_| 2.0 * unit() - 1.0);
        match n % 12 {
            // Anywhere, three times of twelve; at nodes; on faces and edges of cells.
            0..3 => std::array::from_fn(|k| corner[k] + unit() * r),
            3 => self.esdf.lattice().center(cell),
            4 => corner,
            5 => std::array::from_fn(|k| corner[k] + if k == 0 { 0.5 } else { unit() } * r),
            6 => std::array::from_fn(|k| corner[k] + if k == 0 { 0.0 } else { unit() } * r),
            // On the surface, a little off, up to a cell and a half off.
            7 => simplex[0],
            8 => inside,
            9 => vector::along(inside, off, 1e-6 * r),
            10 => vector::along(simplex[1], off, r),
            _ => vector::along(inside, off, 1.5 * r),
        }
    }
}

/// Slack of the bounds in millimetres.
#[derive(Default)]
struct Slack {
    lower: [Vec<f64>; 3],
    upper: [Vec<f64>; 3],
}

impl Slack {
    fn note(&mut self, r: f64, exact: f64, c: &Clearance) {
        let band = usize::from(exact >= r) + usize::from(exact >= 3.0 * r);
        self.lower[band].push(1e3 * (exact - c.lower));
        self.upper[band].push(1e3 * (c.upper - exact));
    }

    /// Prints the table; returns median and 99th percentile of the lower bound's slack beyond three cells.
    fn table(&mut self, name: &str) -> [f64; 2] {
        let mut far = [0.0; 2];
        for (band, at) in ["< 1 cell", "1-3", "> 3"].iter().enumerate() {
            let figures = |v: &mut Vec<f64>| [0.5, 0.99, 1.0].map(|q| quantile(v, q));
            let (l, u) = (figures(&mut self.lower[band]), figures(&mut self.upper[band]));
            println!(
                "{name:16} {at:8} {:7} points: lower {:.3} / {:.2} / {:.2} mm, upper {:.3} / {:.2} / {:.2} mm (median / p99 / worst)",
                self.lower[band].len(),
                l[0],
                l[1],
                l[2],
                u[0],
                u[1],
                u[2]
            );
            far = [l[0], l[1]];
        }
        far
    }
}

/// Asks at a million points; exact distances to the surface are `exact`.
fn no_bound_is_violated<const D: usize>(
    name: &str,
    esdf: &SparseEsdf<D>,
    simplices: &[[[f64; D]; D]],
    exact: impl Fn([f64; D]) -> Option<f64>,
) {
    let mut probes = Probes { random: Random(3), esdf, keys: esdf.keys(), simplices };
    let (mut uniform, mut slack) = (Slack::default(), Slack::default());
    let (mut violations, mut saturated, mut unknown) = (0, 0, 0);
    let r = esdf.lattice().resolution;
    for n in 0..1_000_000 {
        let p = probes.next(n);
        let want = exact(p).unwrap();
        match esdf.clearance(p, UnknownSpace::Optimistic) {
            Answer::Known(c) => {
                violations += usize::from(!(c.lower <= want && want <= c.upper && c.lower >= 0.0));
                slack.note(r, want, &c);
                if n % 12 < 3 {
                    uniform.note(r, want, &c);
                }
                // Exact but for rounding.
                if want < 0.999 * r {
                    assert!(c.upper - c.lower < 1e-3 * r, "{c:?} at {want}");
                }
            }
            Answer::Saturated(c) => {
                violations += usize::from(!(c.lower <= want));
                assert!(c.upper == f64::INFINITY);
                saturated += 1;
            }
            Answer::Unknown | Answer::Outside => unknown += 1,
        }
    }
    println!("{name}: {saturated} saturated, {unknown} unknown, {violations} violations");
    slack.table(&format!("{name}, all"));
    let [median, p99] = uniform.table(&format!("{name}, uniform"));
    assert_eq!(violations, 0);
    assert!(median <= 0.8 && p99 <= 10.0, "{median} {p99}");
    assert!(saturated + unknown < 500_000);
}

fn of_the_room(name: &str, origin: [f64; 3], spoiled: Spoiled) {
    let store = room(112, [-40, 3, 0], Lattice::new(origin, 0.05), spoiled);
    let mesh = marching_cubes(&store, None, &MeshSettings::default());
    let nearest = NearestSurface::of_mesh(&mesh);
    let esdf = SparseEsdf::of(&store, &SparseEsdfSettings::default());
    let simplices: Vec<_> = mesh.triangles.iter().map(|&t| mesh.corners_world(t)).collect();
    no_bound_is_violated(name, &esdf, &simplices, |p| nearest.distance(p));
}

#[test]
fn bounds_hold_in_a_noisy_room() {
    of_the_room("noisy room", [0.0; 3], Spoiled::Noisy);
}

#[test]
fn bounds_hold_where_crossings_lie_at_nodes_far_from_zero() {
    of_the_room("rounded, utm", [500_000.0, 4_000_000.0, 120.0], Spoiled::Rounded);
}

#[test]
fn bounds_hold_in_the_apartment() {
    let tsdf = common::tsdf(SweepKind::CellCentre, true, &common::apartment().log);
    let settings = ContourSettings::of(&tsdf);
    let contour = marching_squares(&tsdf, &settings);
    let segments = Segments::of(&contour, 0.1);
    let settings = SparseEsdfSettings { min_weight: settings.min_weight, ..Default::default() };
    let esdf = SparseEsdf::of_tsdf(&tsdf, &settings);
    let simplices: Vec<_> = contour.ends().collect();
    no_bound_is_violated("apartment", &esdf, &simplices, |p| segments.distance(p));
}
