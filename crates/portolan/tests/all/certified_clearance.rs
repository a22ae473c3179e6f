//! Certified clearance against the exact distance to the extracted surface: a million points per scene, no violation.

use crate::common;
use crate::common::quantile;
use crate::scenes::{Random, Segments, Spoiled, bricks, room};
use portolan::Answer;
use portolan::cell::{Cell, LogOdds8, Planes, SignedDistance};
use portolan::field::{
    Clearance, ClearanceField, Esdf, EsdfMethod, EsdfSettings, ObstacleCells, UnknownSpace,
};
use portolan::geom::{BlockKey, Grid, Lattice, block_cells, vector};
use portolan::map::{BeamSweep, Tsdf2, TsdfConfig};
use portolan::store::{Bricks, Store};
use portolan::surface::{ContourSettings, MeshSettings, NearestSurface, marching_cubes, marching_squares};

/// Points where bounds are likely to fail, and everywhere else: in the bricks of a field, at nodes, on the faces of cells,
/// on the surface's corners and simplices, and close to all of these.
struct Probes<'a, const D: usize> {
    random: Random,
    esdf: &'a Esdf<D>,
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

/// Slack of the bounds in millimeters.
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

/// Bounds that are only as narrow as a demand needs are bounds, and decide what the narrow ones do.
fn decides_alike<const D: usize>(esdf: &Esdf<D>, p: [f64; D], exact: f64, narrow: &Clearance) {
    for enough in [0.0, 0.5 * exact, exact - 0.001, exact - 0.02, exact + 0.001, exact + 0.02, 2.0 * exact] {
        let wide = esdf.clearance_against(p, UnknownSpace::Optimistic, enough).known().unwrap();
        assert!(wide.lower <= exact && exact <= wide.upper && wide.inside == narrow.inside);
        assert_eq!(wide.lower >= enough, narrow.lower >= enough, "{wide:?} {narrow:?} {enough}");
        assert_eq!(wide.upper < enough, narrow.upper < enough, "{wide:?} {narrow:?} {enough}");
    }
}

/// Asks at many points; exact distances to the surface are `exact`. Returns how many obstacles are points.
fn no_bound_is_violated<const D: usize>(
    name: &str,
    probed: usize,
    esdf: &Esdf<D>,
    simplices: &[[[f64; D]; D]],
    exact: impl Fn([f64; D]) -> Option<f64>,
) -> usize {
    let mut probes = Probes { random: Random(3), esdf, keys: esdf.keys(), simplices };
    let (mut uniform, mut slack) = (Slack::default(), Slack::default());
    let (mut violations, mut saturated, mut unknown) = (0, 0, 0);
    let r = esdf.lattice().resolution;
    let points: Vec<[f64; D]> = esdf.point_obstacles().map(|(cell, _)| esdf.lattice().center(cell)).collect();
    for n in 0..probed {
        let p = probes.next(n);
        let to_points = points.iter().map(|q| vector::distance(p, *q)).fold(f64::INFINITY, f64::min);
        let want = exact(p).unwrap().min(to_points);
        match esdf.clearance(p, UnknownSpace::Optimistic) {
            Answer::Known(c) => {
                violations += usize::from(!(c.lower <= want && want <= c.upper && c.lower >= 0.0));
                slack.note(r, want, &c);
                if n % 12 < 3 {
                    uniform.note(r, want, &c);
                }
                if n % 10 == 0 {
                    decides_alike(esdf, p, want, &c);
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
    assert!(saturated + unknown < probed / 2);
    points.len()
}

const MILLION: usize = 1_000_000;

fn of_the_room(name: &str, origin: [f64; 3], spoiled: Spoiled) {
    let store = room(112, [-40, 3, 0], Lattice::new(origin, 0.05), spoiled);
    let mesh = marching_cubes(&store, None, &MeshSettings::default());
    let nearest = NearestSurface::of_mesh(&mesh);
    let esdf = Esdf::of(&store, &EsdfSettings::default());
    let simplices: Vec<_> = mesh.triangles.iter().map(|&t| mesh.corners_world(t)).collect();
    no_bound_is_violated(name, MILLION, &esdf, &simplices, |p| nearest.distance(p));
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
    let tsdf = common::tsdf(BeamSweep::CellCentre, true, &common::apartment().log);
    let settings = ContourSettings::of(&tsdf);
    let contour = marching_squares(&tsdf, &settings);
    let segments = Segments::of(&contour, 0.1);
    let settings = EsdfSettings { min_weight: settings.min_weight, ..Default::default() };
    let esdf = Esdf::of(&tsdf, &settings);
    let simplices: Vec<_> = contour.ends().collect();
    no_bound_is_violated("apartment", MILLION, &esdf, &simplices, |p| segments.distance(p));

    let cells = occupied_here_and_there(&esdf, 20);
    let esdf = Esdf::with_obstacles(&tsdf, &cells, &settings);
    let points =
        no_bound_is_violated("apartment, thin", MILLION / 4, &esdf, &simplices, |p| segments.distance(p));
    assert!(points > 20, "{points}");
}

/// One of `one_in` bricks of a field has a cell that an occupancy map calls occupied; some are explained by the surface.
fn occupied_here_and_there<const D: usize>(esdf: &Esdf<D>, one_in: usize) -> ObstacleCells<D> {
    let mut random = Random(5);
    let mut occupancy = Bricks::<LogOdds8, D>::new(*esdf.lattice());
    for key in esdf.keys().into_iter().step_by(one_in) {
        let mut brick = <LogOdds8 as Cell>::Brick::unobserved(block_cells::<D>());
        brick.set((random.unit() * block_cells::<D>() as f64) as usize, Some(LogOdds8(40)));
        occupancy.insert(key, brick).unwrap();
    }
    ObstacleCells::of_occupancy(&occupancy)
}

#[test]
fn bounds_hold_where_thin_things_stand_in_a_noisy_room() {
    let store = room(112, [-40, 3, 0], Lattice::new([0.0; 3], 0.05), Spoiled::Noisy);
    let mesh = marching_cubes(&store, None, &MeshSettings::default());
    let nearest = NearestSurface::of_mesh(&mesh);
    let alone = Esdf::of(&store, &EsdfSettings::default());
    let esdf = Esdf::with_obstacles(&store, &occupied_here_and_there(&alone, 13), &EsdfSettings::default());
    let simplices: Vec<_> = mesh.triangles.iter().map(|&t| mesh.corners_world(t)).collect();
    let points = no_bound_is_violated("noisy, thin", MILLION / 4, &esdf, &simplices, |p| nearest.distance(p));
    assert!(points > 50, "{points}");
}

/// Distance to the unknown against a look at every cell, and the pessimistic answer against the nearer of both.
fn unknown_cells_are_bounded<const D: usize>(
    shape: i32,
    points: usize,
    surface: impl Fn(&Bricks<SignedDistance, D>) -> Box<dyn Fn([f64; D]) -> Option<f64>>,
) {
    let (r, first) = (0.1, [-13; D]);
    let mut random = Random(8);
    let mut holes = Random(11);
    let lattice = Lattice::new([500_000.0; D], r);
    let store = bricks(lattice, first, shape, |p| {
        if holes.next().is_multiple_of(4000) {
            f64::NAN
        } else {
            0.1 * (p[0] - 0.3 * p[1] - 6.3).clamp(-3.0, 3.0)
        }
    });
    let exact = surface(&store);
    let settings = EsdfSettings { max_distance: 0.9, unknown: true, ..Default::default() };
    // Something stops beams in every third cell that was not observed, and in a few others.
    let mut occupancy = Bricks::<LogOdds8, D>::new(lattice);
    for key in store.keys() {
        let mut brick = <LogOdds8 as Cell>::Brick::unobserved(block_cells::<D>());
        for i in 0..block_cells::<D>() {
            let said = if store.cell(key.cell(i)).is_none() { i % 3 == 0 } else { i % 211 == 0 };
            brick.set(i, said.then_some(LogOdds8(30)));
        }
        occupancy.insert(key, brick).unwrap();
    }
    let esdf = Esdf::with_obstacles(&store, &ObstacleCells::of_occupancy(&occupancy), &settings);
    let obstacles: Vec<[f64; D]> = esdf.point_obstacles().map(|(cell, _)| lattice.center(cell)).collect();
    // Unknown cells in and around the box, further than any answer.
    let all = shape + 24;
    let cells = (0..all.pow(D as u32))
        .map(|n| -> [i32; D] { std::array::from_fn(|k| first[k] - 12 + n / all.pow(k as u32) % all) });
    let unknown: Vec<_> = cells.filter(|c| store.cell(*c).is_none()).collect();
    let (mut known, mut pessimistic) = (0, 0);
    for n in 0..points {
        let at: [f64; D] = std::array::from_fn(|k| {
            let cells = (random.unit() * f64::from(shape) * 2.0).floor() / 2.0;
            let off = if n % 3 == 0 { 0.0 } else { 0.5 * random.unit() };
            f64::from(first[k]) + cells + off
        });
        let p = at.map(|v| 500_000.0 + r * v);
        let to = |c: &[i32; D]| {
            (0..D)
                .map(|k| (f64::from(c[k]) - at[k]).max(at[k] - f64::from(c[k]) - 1.0).max(0.0).powi(2))
                .sum::<f64>()
        };
        let want = r * unknown.iter().map(to).fold(f64::INFINITY, f64::min).sqrt();
        match esdf.unknown_distance(p) {
            Answer::Known(c) => {
                // World coordinates of half a million meters in f64.
                assert!(c.lower <= want + 1e-9 && want <= c.upper + 1e-9, "{c:?} {want}");
                assert!(want >= 0.999 * r || c.upper - c.lower < 1e-3 * r);
                assert!(c.upper - c.lower < 1.8 * r, "{c:?} {want}");
                known += 1;
            }
            Answer::Saturated(c) => assert!(c.lower <= want && want > 0.9 - 2.0 * r, "{c:?} {want}"),
            other => panic!("{other:?}"),
        }
        let to_points = obstacles.iter().map(|q| vector::distance(p, *q)).fold(f64::INFINITY, f64::min);
        let both = want.min(exact(p).unwrap()).min(to_points);
        match esdf.clearance(p, UnknownSpace::Pessimistic) {
            Answer::Known(c) => {
                assert!(c.lower <= both + 1e-9 && both <= c.upper + 1e-9, "{c:?} {both}");
                assert!(c.lower <= c.upper);
                pessimistic += 1;
            }
            Answer::Saturated(c) => assert!(c.lower <= both),
            Answer::Unknown => assert!(want < 1e-9),
            other => panic!("{other:?}"),
        }
    }
    assert!(known > points / 4 && pessimistic > points / 4, "{known} {pessimistic}");
}

#[test]
fn unknown_cells_are_bounded_in_the_plane() {
    // The contour of a plane field is a line.
    unknown_cells_are_bounded::<2>(40, 20_000, |store| {
        let cells = store.keys().into_iter().flat_map(|key| (0..64).map(move |i| key.cell(i)));
        let mut tsdf = Tsdf2::covering(
            &Grid::new([500_000.0 - 1.6; 2], 0.1, [64; 2]),
            TsdfConfig { truncation: 1.0, ..TsdfConfig::textbook() },
        )
        .unwrap();
        for (cell, d) in cells.filter_map(|c| Some((c, store.cell(c)?))) {
            tsdf.fuse(cell.map(|v| v + 16), d.distance.into(), 1.0);
        }
        let segments = Segments::of(&marching_squares(&tsdf, &ContourSettings::default()), 0.2);
        Box::new(move |p| segments.distance(p))
    });
}

#[test]
fn unknown_cells_are_bounded_in_space() {
    unknown_cells_are_bounded::<3>(28, 2_000, |store| {
        let nearest = NearestSurface::of_mesh(&marching_cubes(store, None, &MeshSettings::default()));
        Box::new(move |p| nearest.distance(p))
    });
}

#[test]
fn nothing_near_and_nothing_at_all() {
    let store = bricks(Lattice::new([0.0; 3], 0.1), [0; 3], 16, |_| 0.3);
    let esdf = Esdf::of(&store, &EsdfSettings { unknown: true, ..Default::default() });
    let ask = |p: [f64; 3]| UNKNOWN.map(|u| esdf.clearance(p, u));
    let free = ask([0.83; 3]);
    assert!(
        matches!(free[1], Answer::Saturated(c) if c.lower > 0.99 && c.upper == f64::INFINITY && !c.inside)
    );
    assert!(matches!(free[0], Answer::Known(c) if c.lower <= 0.77 && c.upper >= 0.77));
    assert_eq!(ask([-5.0; 3]), [Answer::Outside; 2]);
    for p in [[f64::NAN; 3], [f64::INFINITY; 3], [1e300; 3], [-1e12, 0.0, 0.0]] {
        assert_eq!(ask(p), [Answer::Outside; 2]);
        assert_eq!(esdf.unknown_distance(p), Answer::Outside);
    }
    assert_eq!(ask([-0.2; 3])[0], Answer::Unknown);
    let seeded = EsdfSettings { method: EsdfMethod::Mask, ..Default::default() };
    let seeded = Esdf::of(&store, &seeded);
    assert_eq!(UNKNOWN.map(|u| seeded.clearance([0.83; 3], u)), [Answer::Unknown; 2]);
}

const UNKNOWN: [UnknownSpace; 2] = [UnknownSpace::Pessimistic, UnknownSpace::Optimistic];
