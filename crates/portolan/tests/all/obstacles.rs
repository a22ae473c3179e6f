//! Obstacles are surface and what stops beams: thin things stay, what is new is there at once, what has gone goes.

use portolan::Mapper;
use portolan::field::{ClearanceField, Esdf, EsdfSettings, PointKind, UnknownSpace};
use portolan::geom::Pose;
use portolan::map::{Tsdf2, TsdfConfig};
use portolan::mapper::{MapperMaps, MapperSettings};
use portolan::plan::{Demand, Waypoints, check_path};
use portolan::scan::{Frame, PointScan, RangeLimits, Scan};

const R: f64 = 0.1;

/// A room from 0 to 8, 6 and 3 m, with a door at x = 4 m that is shut, or open.
fn range(from: [f64; 3], d: [f64; 3], shut: bool) -> f64 {
    let to_wall = |k: usize, wall: f64| {
        let s = (wall - from[k]) / d[k];
        if s > 0.0 { s } else { f64::INFINITY }
    };
    let walls = (0..3).map(|k| to_wall(k, if d[k] > 0.0 { [8.0, 6.0, 3.0][k] } else { 0.0 }));
    let room = walls.fold(f64::INFINITY, f64::min);
    if shut { room.min(to_wall(0, 4.0)) } else { room }
}

const SENSOR: [f64; 3] = [2.5, 3.0, 1.2];

fn look_2d(shut: bool) -> (Pose<2>, Scan<2>) {
    let bearings: Vec<f64> =
        (0..720).map(|i| (f64::from(i) - 359.5) * std::f64::consts::PI / 360.0).collect();
    let ranges: Vec<f64> = bearings.iter().map(|b| range(SENSOR, [b.cos(), b.sin(), 1e-12], shut)).collect();
    let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
    (Pose::<2>::new(SENSOR[0], SENSOR[1], 0.0), scan)
}

fn look_3d(shut: bool) -> (Pose<3>, Frame) {
    let n = 20_000;
    let directions = (0..n).map(|i| {
        let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n);
        let (r, a) = ((1.0 - z * z).sqrt(), f64::from(i) * 2.399_963_229_728_653);
        [r * a.cos(), r * a.sin(), z]
    });
    let points = directions.map(|d| d.map(|v| (v * range(SENSOR, d, shut)) as f32));
    (Pose { translation: SENSOR, ..Pose::IDENTITY }, Frame::Points(PointScan::new(points, [0.0; 3])))
}

/// The first look at the shut door at which a path through it is refused.
fn refused_after<const D: usize>(
    settings: MapperSettings<D>,
    open: usize,
    mut integrate: impl FnMut(&mut Mapper<D>, bool),
) -> usize {
    let mut mapper = Mapper::with(settings);
    (0..open).for_each(|_| integrate(&mut mapper, false));
    let at = |x: f64| std::array::from_fn(|k| [x, 3.02, 1.22][k]);
    let path = Waypoints::new(vec![at(3.0), at(5.0)]).unwrap();
    for look in 1..=10 {
        integrate(&mut mapper, true);
        let field = mapper.esdf().unwrap();
        if !check_path(field, &path, &Demand::new(R).optimistic()).is_certified() {
            return look;
        }
        // The field that followed is the field made anew.
        let cells = mapper.obstacle_cells().clone();
        let anew = Esdf::with_obstacles(mapper.tsdf().unwrap(), &cells, &mapper.esdf_settings().unwrap());
        assert!(mapper.esdf().unwrap().point_obstacles().eq(anew.point_obstacles()));
    }
    usize::MAX
}

fn a_door_that_shuts<const D: usize>(mut integrate: impl FnMut(&mut Mapper<D>, bool)) {
    for (carve_weight, w_max) in [(1.0, 64.0), (0.3, 64.0), (1.0, 8.0), (0.3, 8.0)] {
        for open in [1, 4, 16, 64] {
            let settings = MapperSettings { carve_weight, w_max, ..MapperSettings::new(R) };
            let look = refused_after(settings, open, &mut integrate);
            assert!(look <= 3, "carve {carve_weight}, W {w_max}, {open} looks at the open door: {look}");
        }
    }
}

#[test]
fn a_door_that_shuts_is_refused_at_the_third_look_2d() {
    let looks = [look_2d(false), look_2d(true)];
    a_door_that_shuts::<2>(|mapper, shut| {
        let (pose, scan) = &looks[usize::from(shut)];
        mapper.integrate(pose, scan).unwrap();
    });
}

#[test]
fn a_door_that_shuts_is_refused_at_the_third_look_3d() {
    let looks = [look_3d(false), look_3d(true)];
    a_door_that_shuts::<3>(|mapper, shut| {
        let (pose, frame) = &looks[usize::from(shut)];
        mapper.integrate(pose, frame).unwrap();
    });
}

fn beams() -> Vec<f64> {
    (-200..=200).map(|i| f64::from(i) * 0.004).collect()
}

/// A wall at x = 3 m behind a post that stops a share of the beams near y = 0 at x = 1.55 m.
fn post(stopped: usize, of: usize, looks: usize) -> Mapper<2> {
    let mut mapper = Mapper::<2>::new(0.05);
    let bearings = beams();
    for look in 0..looks {
        let stands = |i: usize| (i + look) % of < stopped;
        let ranges = bearings.iter().enumerate().map(|(i, b)| {
            let wall = 3.0 / b.cos();
            if b.abs() < 0.013 && stands(i) { 1.57 } else { wall }
        });
        let scan = Scan::from_laser(&bearings, &ranges.collect::<Vec<_>>(), &RangeLimits::default());
        mapper.integrate(&Pose::<2>::new(0.025, 0.025, 0.0), &scan).unwrap();
    }
    mapper
}

#[test]
fn what_stops_a_fifth_of_the_beams_is_an_obstacle() {
    let mut mapper = post(1, 5, 100);
    let field = mapper.esdf().unwrap();
    let at = [1.6, 0.03];
    let c = field.clearance(at, UnknownSpace::Optimistic).known().unwrap();
    assert!(c.lower < 0.1 && c.upper < 0.1, "{c:?}");
    assert!(field.distance(at).known().unwrap() < 0.1);
    assert!(field.point_obstacles().any(|(_, kind)| kind == PointKind::Thin));
    // Of the surface alone the post is free space.
    let surface = Esdf::of(mapper.tsdf().unwrap(), &EsdfSettings::default());
    assert!(surface.clearance(at, UnknownSpace::Optimistic).value().unwrap().lower > 0.5);
    // What stops next to nothing is none (of the last looks here, no three in a row hit a cell).
    let field = post(1, 50, 90).esdf().unwrap().clone();
    assert!(field.clearance(at, UnknownSpace::Optimistic).value().unwrap().lower > 0.5);
}

#[test]
fn thin_zero_leaves_the_surface_alone() {
    let mut with = post(1, 5, 60);
    let settings = MapperSettings { thin: 0.0, ..*with.settings() };
    let maps = post(1, 5, 60).into_maps();
    let mut without = Mapper::of_maps(settings, maps).unwrap();
    let lower =
        |field: &Esdf<2>| field.clearance([1.6, 0.03], UnknownSpace::Optimistic).value().unwrap().lower;
    assert!(lower(with.esdf().unwrap()) < 0.1 && lower(without.esdf().unwrap()) > 0.5);
}

/// What is hit by all beams in one look of four is free by log odds, and by a field of means; the counts keep it.
#[test]
fn what_stops_all_beams_at_times_is_an_obstacle_by_its_counts() {
    let (bearings, pose) = (beams(), Pose::<2>::new(0.025, 0.025, 0.0));
    let mut mapper = Mapper::<2>::new(0.05);
    for look in 0..100 {
        let range = |b: &f64| if b.abs() < 0.013 && look % 4 == 0 { 1.5525 } else { 3.0 / b.cos() };
        let ranges: Vec<f64> = bearings.iter().map(range).collect();
        mapper.integrate(&pose, &Scan::from_laser(&bearings, &ranges, &RangeLimits::default())).unwrap();
    }
    let at = [1.6, 0.03];
    let lower = |field: &Esdf<2>| field.clearance(at, UnknownSpace::Optimistic).value().unwrap().lower;
    assert!(mapper.occupancy().unwrap().probability(at).known().unwrap() < 0.5);
    assert!(lower(mapper.esdf().unwrap()) < 0.1);
    let maps = MapperMaps { attenuation: None, ..mapper.clone().into_maps() };
    let mut without = Mapper::of_maps(*mapper.settings(), maps).unwrap();
    assert!(lower(without.esdf().unwrap()) > 0.5);
}

/// A post of many beams is taken away: it goes within the looks that are promised for distances.
#[test]
fn what_has_gone_goes() {
    let mut mapper = post(1, 1, 200);
    let at = [1.6, 0.03];
    let lower = |mapper: &mut Mapper<2>| {
        mapper.esdf().unwrap().clearance(at, UnknownSpace::Optimistic).value().unwrap().lower
    };
    assert!(lower(&mut mapper) < 0.1);
    let bearings = beams();
    let ranges: Vec<f64> = bearings.iter().map(|b| 3.0 / b.cos()).collect();
    let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
    let mut gone = None;
    for look in 1..=400 {
        mapper.integrate(&Pose::<2>::new(0.025, 0.025, 0.0), &scan).unwrap();
        if look % 10 == 0 && lower(&mut mapper) > 0.5 {
            gone = Some(look);
            break;
        }
    }
    // A half-life of 89 looks: from all to 14.5 of a hundred beams takes three.
    assert!(gone.is_some_and(|n| n <= 300), "{gone:?}");
}

/// A cell that is inside by its own estimate stands between two that were not observed: no surface can be extracted, and it is
/// an obstacle all the same, whatever unknown space counts as, far from everything or three cells before a wall.
#[test]
fn a_cell_inside_without_a_surface_is_an_obstacle() {
    for wall in [40, 23] {
        a_cell_inside_before_a_wall(wall);
    }
}

fn a_cell_inside_before_a_wall(wall: i32) {
    let mut config = TsdfConfig { truncation: 0.15, ..Default::default() };
    config.resolution = 0.05;
    let mut tsdf = Tsdf2::covering(&portolan::geom::Grid::new([0.0; 2], 0.05, [40, 40]), config).unwrap();
    for cell in (0..1600).map(|n| [n % 40, n / 40]).filter(|c| *c != [20, 19] && *c != [20, 21]) {
        tsdf.fuse(cell, if cell[0] < wall { 0.15 } else { -0.15 }, 1.0);
    }
    for _ in 0..2000 {
        tsdf.fuse([20, 20], -0.15, 1.0);
        tsdf.fuse([19, 20], 0.0005, 1.0);
        tsdf.fuse([21, 20], 0.0005, 1.0);
    }
    let esdf = Esdf::of(&tsdf, &EsdfSettings { unknown: true, ..Default::default() });
    assert_eq!(esdf.point_obstacles().collect::<Vec<_>>(), [([20, 20], PointKind::Loose)]);
    let before = esdf.clearance(tsdf.grid().lattice.center([19, 20]), UnknownSpace::Optimistic).known();
    assert!(before.is_some_and(|c| c.lower <= 0.05 && c.upper >= 0.05 - 1e-9), "{before:?}");
    // Behind the cell, and before the wall.
    let end = 1.09;
    for (to, demand) in [([end, 1.025], 0.0), ([end, 1.025], 0.03), ([end, 1.01], 0.0), ([end, 1.01], 0.02)] {
        let path = Waypoints::new(vec![[0.525, 1.025], to]).unwrap();
        let verdict = check_path(&esdf, &path, &Demand::new(demand).optimistic());
        assert!(!verdict.is_certified(), "{to:?} {demand}: {verdict:?}");
    }
}

/// A stray return leaves a cell inside with nothing observed around it: it is an obstacle where it is, and not a meter deep.
#[test]
fn a_stray_cell_inside_is_no_deep_solid() {
    let config = TsdfConfig { resolution: 0.05, truncation: 0.15, ..Default::default() };
    let mut tsdf = Tsdf2::covering(&portolan::geom::Grid::new([0.0; 2], 0.05, [40, 40]), config).unwrap();
    // A wall at x = 1.6 m, observed three cells deep, and the stray cell at 0.5 m.
    for cell in (0..400).map(|n| [25 + n % 10, n / 10]) {
        tsdf.fuse(cell, 0.05 * (31.5 - f64::from(cell[0])), 1.0);
    }
    tsdf.fuse([10, 20], -0.05, 1.0);
    let esdf = Esdf::of(&tsdf, &EsdfSettings::default());
    assert_eq!(esdf.point_obstacles().collect::<Vec<_>>(), [([10, 20], PointKind::Loose)]);
    assert_eq!(esdf.cell([10, 20]).known().map(f32::abs), Some(0.0));
    let c = esdf.clearance([0.525, 1.125], UnknownSpace::Optimistic).known().unwrap();
    assert!((c.lower - 0.1).abs() < 1e-6 && (c.upper - 0.1).abs() < 1e-6, "{c:?}");
}
