//! Maps of hits per meter: stores, order, images against rays, bounds.

use portolan::cell::{AttenuationRule, HitLength, Planes};
use portolan::geom::{Aabb, Grid, Lattice, Pose, vector};
use portolan::map::Attenuation;
use portolan::scan::{Beam, BeamKind, Pinhole, PointScan, RangeImage, Scan, Spherical};
use portolan::store::{Bricks, Store};
use portolan::sweep::OccupancySweep;
use std::collections::{HashMap, HashSet};

const NEVER: AttenuationRule = AttenuationRule::NEVER;

fn cells<const D: usize>(store: &Bricks<HitLength, D>) -> HashMap<[i32; D], HitLength> {
    let mut all = HashMap::new();
    for (key, brick) in store.bricks_by_age() {
        all.extend((0..brick.len()).filter_map(|i| Some((key.cell(i), brick.get(i)?))));
    }
    all
}

fn scans<const D: usize>(count: u64) -> Vec<(Pose<D>, Scan<D>)> {
    let kinds = [BeamKind::Hit, BeamKind::Hit, BeamKind::MaxRange, BeamKind::NoReturn, BeamKind::Dropped];
    (0..count)
        .map(|n| {
            let mut at = n as f64;
            let mut any = || {
                std::array::from_fn(|_| {
                    at += 1.618_033_988_749;
                    2.0 * (at * 7.54877).fract() - 1.0
                })
            };
            let translation = any();
            let beams: Vec<Beam<D>> = (0..40)
                .filter_map(|i| {
                    let direction = vector::unit::<D>(any())?;
                    Some(Beam { direction, range: 0.05 * f64::from(i + 1), kind: kinds[i as usize % 5] })
                })
                .collect();
            (Pose { translation, ..Pose::IDENTITY }, Scan::from_beams(beams))
        })
        .collect()
}

fn stores_and_orders_agree<const D: usize>() {
    let all = scans::<D>(12);
    let grid = Grid::new([-4.0; D], 0.1, [80; D]);
    let mut dense = Attenuation::covering(&grid, NEVER).unwrap();
    let mut bricks = Attenuation::<D>::new(grid.lattice, NEVER).unwrap();
    let mut backwards = bricks.clone();
    all.iter().for_each(|(pose, scan)| {
        dense.integrate(pose, scan).unwrap();
        bricks.integrate(pose, scan).unwrap();
    });
    all.iter().rev().for_each(|(pose, scan)| {
        backwards.integrate(pose, scan).unwrap();
    });
    let known = cells(bricks.store());
    assert!(known.len() > 300);
    let other = cells(backwards.store());
    if D == 2 {
        assert!(known == other);
    } else {
        // What was spread over a block before it was hit depends on the order, no hit and no length does.
        let hits = |all: &HashMap<[i32; D], HitLength>| -> HashMap<[i32; D], u32> {
            all.iter().filter(|c| c.1.hits > 0).map(|(k, c)| (*k, c.hits)).collect()
        };
        assert!(hits(&known) == hits(&other));
        let total = |all: &HashMap<[i32; D], HitLength>| all.values().map(|c| c.cells()).sum::<f64>();
        assert!((total(&known) / total(&other) - 1.0).abs() < 0.05);
    }
    assert_eq!(dense.observed_cells(), known.len());
    assert_eq!(bricks.observed_cells(), known.len());
    assert!((0..grid.len()).all(|i| dense.store().at(i) == known.get(&grid.cell(i)).copied()));
    let hits: u32 = known.values().map(|c| c.hits).sum();
    let sent: u64 = all.iter().map(|(_, s)| s.counts().hit).sum();
    assert_eq!(u64::from(hits), sent);
}

#[test]
fn dense_bricks_and_any_order_hold_the_same_2d_and_3d() {
    stores_and_orders_agree::<2>();
    stores_and_orders_agree::<3>();
}

#[test]
fn answers_of_unseen_empty_and_hit_cells() {
    let mut map = Attenuation::<2>::new(Lattice::new([0.0; 2], 0.1), NEVER).unwrap();
    let scan = Scan::from_beams((0..4).map(|i| Beam {
        direction: [1.0, 0.0],
        range: if i == 0 { 0.5 } else { 1.0 },
        kind: BeamKind::Hit,
    }));
    map.integrate(&Pose::<2>::new(0.05, 0.05, 0.0), &scan).unwrap();
    // One of four ends in the middle of the cell: one hit in 3.5 cells.
    let per_meter = 1.0 / 0.35;
    assert!((map.attenuation([0.55, 0.05]).known().unwrap() - per_meter).abs() < 1e-9);
    let opacity = map.opacity([5, 0]).unwrap();
    assert!((opacity - (1.0 - (-per_meter * 0.1 * std::f64::consts::FRAC_PI_4).exp())).abs() < 1e-9);
    assert!((map.hit_probability([5, 0]) - opacity).abs() < 0.05);
    assert_eq!((map.opacity([3, 0]), map.opacity([3, 7]), map.opacity([300, 0])), (Some(0.0), None, None));
    let [empty, unseen] = [[3, 0], [300, 0]].map(|c| map.hit_probability(c));
    assert!(0.0 < empty && empty < 0.1 * unseen && (unseen - 0.0755).abs() < 1e-3, "{empty} {unseen}");
    assert!(map.stops_beams([5, 0], 0.15, 1) && !map.stops_beams([5, 0], 0.15, 2));
    assert!(!map.stops_beams([5, 0], 0.25, 1) && map.stops_beams([10, 0], 0.5, 3));
}

/// A camera or lidar with the room's distances, so that nothing but the walls of a box is seen.
fn room(image: RangeImage, half: f64) -> RangeImage {
    let values: Vec<f32> = (0..image.columns * image.rows)
        .map(|i| {
            let ray = image.ray((i % image.columns) as f64, i / image.columns);
            let longest = ray.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            // Some pixels saw nothing, some no more than so far.
            match i % 97 {
                3 => 0.0,
                5 => -(0.5 * half / longest) as f32,
                _ => (half / longest) as f32,
            }
        })
        .collect();
    RangeImage { values, ..image }
}

/// Lengths and hits of exact rays and of the closed form, summed over shells of distance from the sensor, and over all.
fn closed_form_agrees(image: &RangeImage, resolution: f64, bound: f64) {
    let lattice = Lattice::new([0.013, -0.021, 0.007], resolution);
    let [mut exact, mut closed] = [OccupancySweep::Exact, OccupancySweep::Auto]
        .map(|sweep| Attenuation::<3>::new(lattice, NEVER).unwrap().with_sweep(sweep));
    for k in 0..3 {
        let a = 0.3 * f64::from(k);
        let turn = [0.0, 0.0, (0.5 * a).sin(), (0.5 * a).cos()];
        let pose = Pose::<3>::from_quaternion([0.02 * a, 0.05 * a, 0.01], turn).unwrap();
        let stats = exact.integrate(&pose, image).unwrap();
        assert_eq!(closed.integrate(&pose, image).unwrap().beams, stats.beams);
    }
    let (exact, closed) = (cells(exact.store()), cells(closed.store()));
    let hits = |map: &HashMap<[i32; 3], HitLength>| {
        let mut hits: Vec<_> = map.iter().filter(|c| c.1.hits > 0).map(|(k, c)| (*k, c.hits)).collect();
        hits.sort_unstable();
        hits
    };
    assert!(hits(&exact) == hits(&closed));
    let shells = |map: &HashMap<[i32; 3], HitLength>| {
        let mut shells = vec![0.0f64; 64];
        for (cell, c) in map {
            let r = lattice.center(*cell).iter().map(|v| v * v).sum::<f64>().sqrt();
            shells[((r / (4.0 * resolution)) as usize).min(63)] += c.cells();
        }
        shells
    };
    let (a, b) = (shells(&exact), shells(&closed));
    let total: f64 = a.iter().sum();
    let sum: f64 = b.iter().sum();
    // Blocks about the sensor are spread over themselves, so that its own cell shows in the first four.
    for (k, (a, b)) in a.iter().zip(&b).enumerate().skip(4) {
        if *a > 0.02 * total {
            assert!((b / a - 1.0).abs() < 2.0 * bound, "shell {k}: {a} {b}");
        }
    }
    // What the walls stop, over all cells at a hit, whether it has one itself or not: a cell that happens to have had many
    // hits has had much length in the exact map alone.
    let near: HashSet<[i32; 3]> = hits(&exact)
        .iter()
        .flat_map(|(c, _)| (0..27).map(move |i| [c[0] + i % 3 - 1, c[1] + i / 3 % 3 - 1, c[2] + i / 9 - 1]))
        .collect();
    let stopped = |map: &HashMap<[i32; 3], HitLength>| {
        let walls = near.iter().filter_map(|c| map.get(c));
        let (hits, length) = walls.fold((0.0, 0.0), |s, c| (s.0 + f64::from(c.hits), s.1 + c.cells()));
        hits / length
    };
    let ratio = stopped(&closed) / stopped(&exact);
    assert!((sum / total - 1.0).abs() < bound, "{total} {sum}");
    assert!((ratio - 1.0).abs() < bound, "{ratio}");
}

#[test]
fn closed_form_of_a_camera_agrees_with_rays() {
    let camera = Pinhole { fx: 100.0, fy: 105.0, cx: 79.5, cy: 59.5 };
    closed_form_agrees(&room(RangeImage::from_depth(camera, 160, 120, vec![0.0; 160 * 120]), 2.0), 0.1, 0.02);
}

#[test]
fn closed_form_of_a_lidar_agrees_with_rays() {
    let lidar = Spherical {
        elevations: (0..48u8).map(|i| 0.5 - 0.02 * f32::from(i)).collect(),
        first_azimuth: 0.1,
        azimuth_step: -std::f64::consts::TAU / 360.0,
    };
    closed_form_agrees(&room(RangeImage::from_ranges(lidar, 360, vec![0.0; 48 * 360]), 3.0), 0.1, 0.02);
}

#[test]
fn points_without_rows_are_exact_rays() {
    let ends: Vec<[f32; 3]> = (0..50u8).map(|i| [2.0, 0.03 * f32::from(i), 0.1]).collect();
    let mut scan = PointScan::new(ends, [0.0; 3]);
    scan.free_ends = vec![[0.0, -1.0, 0.0]];
    let mut map = Attenuation::<3>::new(Lattice::new([-0.05; 3], 0.1), NEVER).unwrap();
    let stats = map.integrate(&Pose::IDENTITY, &scan).unwrap();
    assert_eq!((stats.beams.hit, stats.beams.max_range), (50, 1));
    let all = cells(map.store());
    assert_eq!(all.values().map(|c| c.hits).sum::<u32>(), 50);
    let length: f64 = all.values().map(|c| c.cells()).sum();
    let sent: f64 =
        scan.points.iter().map(|p| f64::from(p[0].hypot(p[1]).hypot(p[2]))).sum::<f64>() / 0.1 + 10.0;
    assert!((length / sent - 1.0).abs() < 0.02, "{length} {sent}");
}

#[test]
fn only_cells_within_the_bounds_change() {
    let camera = Pinhole { fx: 40.0, fy: 40.0, cx: 31.5, cy: 23.5 };
    let image = room(RangeImage::from_depth(camera, 64, 48, vec![0.0; 64 * 48]), 2.0);
    let lattice = Lattice::new([0.0; 3], 0.1);
    let bounds = Aabb::new([-0.35, -0.35, 0.45], [0.55, 0.55, 1.25]);
    let mut whole = Attenuation::<3>::new(lattice, NEVER).unwrap();
    let mut part = whole.clone();
    part.set_bounds(Some(bounds));
    whole.integrate(&Pose::IDENTITY, &image).unwrap();
    let stats = part.integrate(&Pose::IDENTITY, &image).unwrap();
    assert_eq!(stats.hits_outside, image.hits() as u64);
    // Blocks that reach out of the box are told apart cell by cell, by rays and in closed form alike.
    let mut rays = Attenuation::<3>::new(lattice, NEVER).unwrap().with_sweep(OccupancySweep::Exact);
    rays.set_bounds(Some(bounds));
    rays.integrate(&Pose::IDENTITY, &image).unwrap();
    let (held, exact) = (cells(part.store()), cells(rays.store()));
    let inside = |c: &[i32; 3]| bounds.grown(0.05).contains(lattice.center(*c));
    assert!(held.len() > 300 && held.keys().chain(exact.keys()).all(inside));
    let sum = |all: &HashMap<[i32; 3], HitLength>| all.values().map(|c| c.cells()).sum::<f64>();
    assert!((sum(&held) / sum(&exact) - 1.0).abs() < 0.03, "{} {}", sum(&held), sum(&exact));
    assert!(held.len() < cells(whole.store()).len() / 2);
    assert!(part.store().cell([0, 0, 3]).is_none());
}

/// Bricks of free space take no memory until a beam ends in them: then the limit is asked, too.
#[test]
fn the_limit_is_kept_where_free_bricks_are_hit() {
    let camera = Pinhole { fx: 40.0, fy: 40.0, cx: 31.5, cy: 23.5 };
    let image = |half| room(RangeImage::from_depth(camera, 64, 48, vec![0.0; 64 * 48]), half);
    let mut map = Attenuation::<3>::new(Lattice::new([0.0; 3], 0.02), NEVER).unwrap();
    map.integrate(&Pose::IDENTITY, &image(3.0)).unwrap();
    let limit = map.memory_bytes() + 100_000;
    map.set_limit(limit);
    let full = map.integrate(&Pose::IDENTITY, &image(2.0)).unwrap_err();
    assert!(matches!(full, portolan::map::MapError::Full(_)), "{full}");
    assert!(map.memory_bytes() <= limit && map.memory_bytes() > limit - 20_000, "{}", map.memory_bytes());
}
