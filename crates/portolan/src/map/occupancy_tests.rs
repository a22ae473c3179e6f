//! Occupancy maps in bricks: every way in, limits, refusals.

use super::*;
use crate::cell::{LogOdds32, LogOddsValue, OccupancyModel, Planes};
use crate::geom::{Aabb, BlockKey, CellBox, Lattice, Pose};
use crate::scan::{Beam, BeamKind, Frame, Origin, Pinhole, PointScan, RangeImage, Scan};
use crate::store::Store;
use crate::sweep::OccupancySweep;

type Map = Occupancy<3>;

const UTM: [f64; 3] = [500_000.0, 4_000_000.0, 300.0];

fn map(origin: [f64; 3]) -> Map {
    Map::new(Lattice::new(origin, 0.1), OccupancyModel::default()).unwrap().with_sweep(OccupancySweep::Exact)
}

fn shell(n: usize) -> Vec<[f32; 3]> {
    let at = |i: usize, a: f64| (0.5 + i as f64 * a).fract();
    (0..n)
        .map(|i| {
            let (z, a) = (2.0 * at(i, 0.754_877_666_246_692_7) - 1.0, 6.3 * at(i, 0.569_840_290_998_053_2));
            let (r, across) = (2.0 + at(i, 0.618_033_988_7), (1.0 - z * z).sqrt());
            [r * across * a.cos(), r * across * a.sin(), r * z].map(|v| v as f32)
        })
        .collect()
}

fn cells<V: LogOddsValue>(map: &Occupancy<3, V>) -> Vec<(BlockKey<3>, Vec<Option<V>>)> {
    let store = map.store();
    let of = |key| (0..512).map(|i| store.brick(key).unwrap().get(i)).collect();
    store.keys().into_iter().map(|key| (key, of(key))).collect()
}

#[test]
fn every_way_in_is_the_same_map() {
    let (points, pose) = (shell(5000), Pose { translation: [0.3, 0.2, -0.1], ..Pose::IDENTITY });
    let scan = PointScan::new(points.iter().copied(), [0.0; 3]);
    let mut by_frame = map([0.0; 3]);
    let stats = by_frame.integrate(&pose, &Frame::Points(scan.clone())).unwrap();
    assert_eq!((stats.scans, stats.beams.hit, stats.refused.total()), (1, 5000, 0));
    assert_eq!(stats.cells, by_frame.observed_cells() as u64);

    let world: Vec<[f64; 3]> = points.iter().map(|p| pose.transform_point(p.map(f64::from))).collect();
    let mut by_points = map([0.0; 3]);
    by_points.integrate_points(&world, pose.translation).unwrap();
    assert_eq!(cells(&by_frame), cells(&by_points));

    let mut by_origins = map([0.0; 3]);
    let origins = PointScan { origin: Origin::PerPoint(vec![[0.0; 3]; 5000]), ..scan };
    by_origins.integrate(&pose, &Frame::Points(origins)).unwrap();
    assert_eq!(cells(&by_frame), cells(&by_origins));

    let mut wide = Occupancy::<3, LogOdds32>::new(Lattice::new([0.0; 3], 0.1), OccupancyModel::default())
        .unwrap()
        .with_sweep(OccupancySweep::Exact);
    wide.integrate_points(&world, pose.translation).unwrap();
    assert_eq!(wide.observed_cells(), by_frame.observed_cells());
    for p in &world {
        assert_eq!(wide.probability(*p).known().map(|v| (v * 1e6).round()), Some(700_000.0));
        assert!((by_frame.probability(*p).known().unwrap() - 0.7).abs() < 1e-3);
    }
}

#[test]
fn far_from_zero_nothing_changes() {
    let (near, far) = (&mut map([0.0; 3]), &mut map(UTM));
    for (map, translation) in [(&mut *near, [0.0; 3]), (&mut *far, UTM)] {
        let pose = Pose { translation, ..Pose::IDENTITY };
        map.integrate(&pose, &Frame::Points(PointScan::new(shell(3000), [0.0; 3]))).unwrap();
    }
    // Coordinates of millions of meters are rounded to half a nanometre: a ray through a corner may differ.
    let same = cells(near).iter().zip(&cells(far)).filter(|(a, b)| a == b).count();
    assert_eq!(near.store().keys(), far.store().keys());
    assert!(same * 100 >= near.store().len() * 98, "{same} of {}", near.store().len());
}

#[test]
fn what_cannot_be_fused_is_refused_and_counted() {
    let frame = Frame::Points(PointScan::new([[1.0, 0.0, 0.0]], [0.0; 3]));
    let mut map = map([0.0; 3]);
    for pose in [
        Pose { rotation: [[0.5; 3]; 3], translation: [0.0; 3] },
        Pose { translation: [f64::NAN; 3], ..Pose::IDENTITY },
        Pose { translation: [1e12; 3], ..Pose::IDENTITY },
    ] {
        let stats = map.integrate(&pose, &frame).unwrap();
        assert_eq!((stats.scans, stats.refused_poses), (0, 1));
    }
    let stats = map.integrate_points(&[[f64::NAN; 3], [1.0, 0.0, 0.0]], [0.0; 3]).unwrap();
    assert_eq!(stats.refused.not_finite, 1);
    assert_eq!(map.integrate_points(&[[1.0; 3]], [f64::NAN; 3]).unwrap().refused_poses, 1);
    assert!(Map::new(Lattice::new([0.0; 3], 0.0), OccupancyModel::default()).is_err());
}

#[test]
fn packed_maps_answer_and_go_on() {
    let frame = Frame::Points(PointScan::new(shell(3000), [0.0; 3]));
    let mut flat = map([0.0; 3]);
    flat.integrate(&Pose::IDENTITY, &frame).unwrap();
    let mut packed = flat.clone();
    let (epoch, bytes) = (packed.store().epoch(), packed.memory_bytes());
    packed.pack(Some(epoch - 1));
    assert_eq!(packed.memory_bytes(), bytes, "everything changed in the last epoch");
    packed.pack(None);
    assert!(packed.memory_bytes() * 2 < bytes);
    assert!(packed.store().changed_since(epoch).is_empty());
    assert_eq!(cells(&packed), cells(&flat));
    let moved = Pose { translation: [0.35, 0.0, 0.0], ..Pose::IDENTITY };
    flat.integrate(&moved, &frame).unwrap();
    packed.integrate(&moved, &frame).unwrap();
    assert_eq!(cells(&packed), cells(&flat));
    assert_eq!(packed.observed_cells(), flat.observed_cells());
}

#[test]
fn a_sensor_inside_an_occupied_cell() {
    let mut map = map([0.0; 3]);
    map.integrate_points(&[[0.04, 0.04, 0.04], [1.0, 0.05, 0.05]], [0.05; 3]).unwrap();
    assert_eq!(map.is_occupied([0, 0, 0]), Some(true));
    assert_eq!(map.is_occupied([1, 0, 0]), Some(false));
}

#[test]
fn bounds_and_limits_hold() {
    let frame = Frame::Points(PointScan::new(shell(3000), [0.0; 3]));
    let mut all = map([0.0; 3]);
    all.integrate(&Pose::IDENTITY, &frame).unwrap();
    let bounds = Aabb::new([-1.0, -1.03, 0.0], [5.0, 1.0, 0.52]);
    let mut part = map([0.0; 3]);
    part.set_bounds(Some(bounds));
    let stats = part.integrate(&Pose::IDENTITY, &frame).unwrap();
    assert!(stats.hits_outside > 1000);
    let inside = CellBox::covering(&bounds, all.store().lattice());
    for (key, values) in cells(&part) {
        for (i, v) in values.iter().enumerate() {
            assert!(v.is_none() || inside.contains(key.cell(i)));
        }
    }
    // A ray that enters the box starts anew at its border: at a corner it may take the other cell.
    let (mut held, mut same) = (0, 0);
    for (key, values) in cells(&all) {
        for (i, v) in values.iter().enumerate().filter(|(i, v)| v.is_some() && inside.contains(key.cell(*i)))
        {
            held += 1;
            same += usize::from(part.store().cell(key.cell(i)) == *v);
        }
    }
    assert!(same * 100 >= held * 98, "{same} of {held}");

    let mut small = map([0.0; 3]);
    small.set_limit(60_000);
    assert!(matches!(small.integrate(&Pose::IDENTITY, &frame), Err(MapError::Full(_))));
    assert!(small.memory_bytes() <= 70_000 && small.observed_cells() > 0);
}

#[test]
fn what_contradicts_itself_is_refused() {
    for sweep in [OccupancySweep::Auto, OccupancySweep::Exact] {
        for (image, why) in crate::scan::broken_images() {
            let mut map = map([0.0; 3]).with_sweep(sweep);
            let mut scan = PointScan::new([[0.0, 0.0, 1.0]], [0.0; 3]);
            scan.image = Some(image.clone());
            let got = map.integrate(&Pose::IDENTITY, &Frame::Image(image));
            assert!(matches!(got, Err(MapError::Image(_))), "{why}");
            let got = map.integrate(&Pose::IDENTITY, &Frame::Points(scan));
            // Exact rays do not look at it.
            assert_eq!(got.is_ok(), sweep == OccupancySweep::Exact, "{why}");
        }
    }
    let mut map = map([0.0; 3]);
    let mut scan = PointScan::new([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]);
    scan.origin = Origin::PerPoint(vec![[0.0; 3]]);
    let stats = map.integrate(&Pose::IDENTITY, &Frame::Points(scan)).unwrap();
    assert_eq!((stats.refused.not_finite, stats.beams.hit, stats.beams.dropped), (2, 1, 2));
}

#[test]
fn readings_that_are_too_far_cost_nothing_and_are_counted() {
    for sweep in [OccupancySweep::Auto, OccupancySweep::Exact] {
        let mut map = map([0.0; 3]).with_sweep(sweep);
        let mut points = shell(3000);
        points.extend([[1e6, 0.0, 0.0], [1e7, 1e7, 1e7], [1e20, 0.0, 0.0]]);
        let mut scan = PointScan::new(points, [0.0; 3]);
        scan.free_ends = vec![[-1e6, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let stats = map.integrate(&Pose::IDENTITY, &Frame::Points(scan)).unwrap();
        assert_eq!((stats.refused.too_far, stats.refused.total()), (4, 4));
        assert_eq!((stats.beams.hit, stats.beams.max_range, stats.beams.dropped), (3000, 1, 4));
        assert!(map.store().len() < 1000, "{}", map.store().len());
        let camera = Pinhole { fx: 2.0, fy: 2.0, cx: 0.5, cy: 0.5 };
        let image = RangeImage::from_depth(camera, 2, 2, [2.0, -1e6, 1e6, 2.0]);
        let stats = map.integrate(&Pose::IDENTITY, &Frame::Image(image)).unwrap();
        assert_eq!((stats.refused.too_far, stats.beams.hit, stats.beams.dropped), (2, 2, 2));
    }
}

#[test]
fn rays_that_pass_more_than_the_limit_holds_end_early() {
    let ends = (0..20).map(|i| {
        let a = f64::from(i);
        [5000.0 * a.cos(), 5000.0 * a.sin(), 0.0]
    });
    let ends: Vec<[f64; 3]> = ends.collect();
    let mut small = map([0.0; 3]);
    small.set_limit(60_000);
    let full = small.integrate_points(&ends, [0.0; 3]);
    assert!(matches!(full, Err(MapError::Full(_))));
    assert!(small.store().is_empty());
}

#[test]
fn images_and_beams_without_a_surface() {
    let camera = Pinhole { fx: 20.0, fy: 20.0, cx: 15.5, cy: 11.5 };
    let values: Vec<f32> = (0..768).map(|i| [2.0, 2.0, -1.0, 0.0][i % 32 / 8]).collect();
    let mut image = RangeImage::from_depth(camera, 32, 24, values);
    image.refused.too_near = 3;
    let mut by_image = map([0.0; 3]);
    let stats = by_image.integrate(&Pose::IDENTITY, &Frame::Image(image)).unwrap();
    assert_eq!((stats.beams.hit, stats.beams.max_range, stats.refused.too_near), (384, 192, 3));
    assert_eq!(by_image.is_occupied([-5, 0, 20]), Some(true));
    assert_eq!(by_image.is_occupied([1, 0, 8]), Some(false));
    assert_eq!(by_image.is_occupied([1, 0, 10]), None);

    let beam = |kind| Beam { direction: [1.0, 0.0, 0.0], range: 1.05, kind };
    let mut by_beams = map([0.0; 3]);
    let scan = Scan::from_beams([beam(BeamKind::NoReturn)]);
    let stats = by_beams.integrate(&Pose::IDENTITY, &scan).unwrap();
    assert_eq!((stats.beams.no_return, by_beams.observed_cells()), (1, 10));
    by_beams.integrate(&Pose::IDENTITY, &Scan::from_beams([beam(BeamKind::Hit)])).unwrap();
    assert_eq!(by_beams.is_occupied([10, 0, 0]), Some(true));
}
