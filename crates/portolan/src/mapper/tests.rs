//! A mapper makes what its parts make, with thresholds that fit.

use super::*;
use crate::answer::Status;
use crate::field::{Esdf, ObstacleCells};
use crate::geom::{Pose, vector};
use crate::map::{MapError, Occupancy, ScanKind, Tsdf};
use crate::scan::{Beam, BeamKind, Scan};
use crate::surface::{ContourSettings, MeshSettings, marching_cubes, marching_squares};
use crate::sweep::WeightModel;

const POSES: usize = 5;

/// Beams from near the middle of a ball of 2 m.
fn scan<const D: usize>(k: usize) -> (Pose<D>, Scan<D>) {
    let mut pose = Pose::<D>::IDENTITY;
    pose.translation[0] = 0.1 * k as f64;
    let fraction = |i: usize, a: f64| 2.0 * (0.5 + (i + 7 * k) as f64 * a).fract() - 1.0;
    let beams = (0..2000).filter_map(|i| {
        let along = [0.754_877_666, 0.569_840_291, 0.618_033_989];
        let direction = vector::unit(std::array::from_fn::<_, D, _>(|j| fraction(i, along[j])))?;
        // The root of |o + s d| = 2.
        let b = vector::dot(pose.translation, direction);
        let c = vector::dot(pose.translation, pose.translation) - 4.0;
        Some(Beam { direction, range: (b * b - c).sqrt() - b, kind: BeamKind::Hit })
    });
    (pose, Scan::from_beams(beams))
}

fn fused<const D: usize>(settings: MapperSettings<D>) -> Mapper<D>
where
    Scan<D>: ScanKind<D>,
{
    let mut mapper = Mapper::with(settings);
    for k in 0..POSES {
        let (pose, scan) = scan(k);
        assert_eq!(mapper.integrate(&pose, &scan).unwrap().scans, 1);
    }
    assert_eq!(mapper.stats().scans, POSES as u64);
    mapper
}

/// Whatever the weights, what was seen is a surface and free space is known.
fn thresholds_fit<const D: usize>(surface: impl Fn(&mut Mapper<D>) -> usize) {
    let usual = MapperSettings::<D>::new(0.1);
    let all = [
        usual,
        MapperSettings { carve_weight: 1.0, ..usual },
        MapperSettings { carve_weight: 0.03, ..usual },
        MapperSettings { weights: WeightModel::InverseSquare, ..usual },
        MapperSettings { weights: WeightModel::InverseSquareCosIncidence, ..usual },
    ];
    let count = surface(&mut fused(usual));
    assert!(count > 50, "{count}");
    for settings in all {
        let mut mapper = fused(settings);
        let found = surface(&mut mapper);
        assert!(found * 10 > count * 9, "{settings:?}: {found} of {count}");
        let field = mapper.esdf().unwrap();
        for x in [0.0, 0.5, 1.0] {
            let mut p = [0.0; D];
            p[0] = x;
            assert!(field.distance(p).status() != Status::Unknown, "{settings:?}: unknown at {x}");
        }
    }
}

#[test]
fn thresholds_fit_whatever_the_weights_2d() {
    thresholds_fit::<2>(|mapper| mapper.contour().segments.len());
}

#[test]
fn thresholds_fit_whatever_the_weights_3d() {
    thresholds_fit::<3>(|mapper| mapper.mesh().triangles.len());
}

fn makes_what_its_parts_make<const D: usize>() {
    let settings = MapperSettings::<D>::new(0.1);
    let mut mapper = fused(settings);
    let mut tsdf = Tsdf::<D>::new(settings.tsdf([0.0; D])).unwrap();
    let mut occupancy =
        Occupancy::<D>::new(crate::geom::Lattice::new([0.0; D], 0.1), Default::default()).unwrap();
    for k in 0..POSES {
        let (pose, scan) = scan(k);
        tsdf.integrate(&pose, &scan).unwrap();
        occupancy.integrate(&pose, &scan).unwrap();
        // Asked for in between, it follows.
        let _ = mapper.esdf();
    }
    let (ours, theirs) = (mapper.tsdf().unwrap().store(), tsdf.store());
    assert_eq!(ours.keys(), theirs.keys());
    assert!(ours.keys().iter().all(|&key| ours.brick(key) == theirs.brick(key)));
    let (ours, theirs) = (mapper.occupancy().unwrap().store(), occupancy.store());
    assert!(!ours.is_empty() && ours.keys() == theirs.keys());
    assert!(ours.keys().iter().all(|&key| ours.brick(key) == theirs.brick(key)));
    let settings = mapper.esdf_settings().unwrap();
    let mut cells = ObstacleCells::of_occupancy(occupancy.store());
    cells.follow_attenuation(mapper.attenuation().unwrap().store(), mapper.settings().thin);
    assert_eq!(mapper.obstacle_cells().agreement(), cells.agreement());
    assert!(cells.agreement()[2] > 0);
    let anew = Esdf::with_obstacles(&tsdf, &cells, &settings);
    let field = mapper.esdf().unwrap();
    for key in anew.keys() {
        assert!(
            (0..crate::geom::block_cells::<D>()).all(|i| field.cell(key.cell(i)) == anew.cell(key.cell(i)))
        );
    }
}

#[test]
fn makes_what_its_parts_make_2d_and_3d() {
    makes_what_its_parts_make::<2>();
    makes_what_its_parts_make::<3>();
    let mut mapper = fused(MapperSettings::<3>::new(0.1));
    let tsdf = mapper.tsdf().unwrap().clone();
    assert_eq!(mapper.mesh(), marching_cubes(&tsdf, None, &MeshSettings::default()));
    let mapper = fused(MapperSettings::<2>::new(0.1));
    let tsdf = mapper.tsdf().unwrap();
    assert_eq!(mapper.contour(), marching_squares(tsdf, &ContourSettings::default()));
}

#[test]
fn maps_of_several_lattices_are_refused() {
    let maps = |resolution| fused(MapperSettings::<2>::new(resolution)).into_maps();
    let (a, b) = (maps(0.1), maps(0.2));
    let mixed = MapperMaps { occupancy: b.occupancy, tsdf: a.tsdf, attenuation: a.attenuation };
    let refused = Mapper::of_maps(MapperSettings::new(0.1), mixed);
    assert!(matches!(refused, Err(crate::map::MapError::Lattices)), "{refused:?}");
    assert!(Mapper::of_maps(MapperSettings::new(0.1), maps(0.1)).is_ok());
}

#[test]
fn memory_is_kept_by_both_maps_together() {
    fn keeps<const D: usize>(memory: usize) {
        let mut mapper = Mapper::with(MapperSettings { memory, ..MapperSettings::<D>::new(0.05) });
        let (pose, scan) = scan::<D>(0);
        assert!(mapper.integrate(&pose, &scan).is_err(), "{memory} bytes were enough");
        let held = mapper.occupancy().unwrap().memory_bytes() + mapper.tsdf().unwrap().memory_bytes();
        assert!(held <= memory, "{held} of {memory} bytes");
    }
    keeps::<2>(60_000);
    keeps::<3>(3_000_000);
}

#[test]
fn far_from_zero_the_lattice_begins_at_the_first_sensor() {
    let settings = MapperSettings::<2>::new(0.05);
    assert_eq!(settings.origin_near([40.0, -3.0]), [0.0; 2]);
    let far = settings.origin_near([500_000.013, 4_000_000.0]);
    assert_eq!(far[1], 4_000_000.0);
    assert!((far[0] - 500_000.0).abs() < 0.051 && (far[0] / 0.05).fract().abs() < 1e-6);
    let mut mapper = Mapper::with(MapperSettings { distances: false, ..settings });
    let tilted = Pose { rotation: [[0.5; 2]; 2], translation: [1.0; 2] };
    assert_eq!(mapper.integrate(&tilted, &scan::<2>(0).1).unwrap().refused_poses, 1);
    assert!(mapper.occupancy().is_none() && mapper.esdf().is_none());
    mapper.integrate(&scan::<2>(0).0, &scan::<2>(0).1).unwrap();
    assert!(mapper.occupancy().is_some() && mapper.tsdf().is_none() && mapper.contour().segments.is_empty());
}

/// All scans at once, those that are refused among them, are the same cells and counts as one by one.
fn all_at_once_is_one_by_one<const D: usize>()
where
    Scan<D>: ScanKind<D>,
{
    let mut scans: Vec<_> = (0..POSES).map(scan::<D>).collect();
    scans[1].0.translation[0] = f64::NAN;
    scans[2].0.translation[0] = 1e300;
    let mut expected = Mapper::<D>::new(0.1);
    let one_by_one: Vec<_> = scans.iter().map(|(pose, scan)| expected.integrate(pose, scan)).collect();
    let mut mapper = Mapper::<D>::new(0.1);
    let all = mapper.integrate_all(&scans, &|| 0.0);
    assert_eq!(all.iter().map(|fused| fused.clone().map(|f| f.stats())).collect::<Vec<_>>(), one_by_one);
    assert_eq!(mapper.stats(), expected.stats());
    let (ours, theirs) = (mapper.into_maps(), expected.into_maps());
    let (a, c) = (ours.occupancy.unwrap().into_store(), theirs.occupancy.unwrap().into_store());
    assert!(a.keys() == c.keys() && a.keys().iter().all(|&key| a.brick(key) == c.brick(key)));
    let (b, d) = (ours.tsdf.unwrap().into_stores().0, theirs.tsdf.unwrap().into_stores().0);
    assert!(b.keys() == d.keys() && b.keys().iter().all(|&key| b.brick(key) == d.brick(key)));
    let (e, f) = (ours.attenuation.unwrap().into_store(), theirs.attenuation.unwrap().into_store());
    assert!(e.keys() == f.keys() && e.keys().iter().all(|&key| e.brick(key) == f.brick(key)));

    // A full map ends the list.
    let mut small = Mapper::with(MapperSettings { memory: 100_000, ..MapperSettings::<D>::new(0.02) });
    let results = small.integrate_all(&scans, &|| 0.0);
    assert!(matches!(results.last(), Some(Err(MapError::Full(_)))), "{results:?}");
    assert!(results.len() < POSES && results.iter().filter(|r| r.is_err()).count() == 1, "{results:?}");
}

#[test]
fn all_at_once_is_one_by_one_2d_and_3d() {
    all_at_once_is_one_by_one::<2>();
    all_at_once_is_one_by_one::<3>();
}

#[test]
fn settings_that_are_not_possible_are_refused_before_anything_is_made() {
    let usual = MapperSettings::<2>::new(0.1);
    let (pose, scan) = scan::<2>(0);
    for max_distance in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
        let mut mapper = Mapper::with(MapperSettings { max_distance, ..usual });
        let refused = mapper.integrate(&pose, &scan);
        assert!(matches!(refused, Err(MapError::MaxDistance(_))), "{max_distance}: {refused:?}");
        assert!(mapper.esdf().is_none() && mapper.tsdf().is_none());
        assert!(Mapper::of_maps(*mapper.settings(), MapperMaps::default()).is_err());
    }
    for resolution in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = Mapper::<2>::new(resolution).integrate(&pose, &scan);
        assert!(matches!(refused, Err(MapError::Resolution(_))), "{resolution}: {refused:?}");
    }
}

/// Maps of other settings go on as they were made, and what is derived fits their weights.
fn maps_keep_their_filters<const D: usize>()
where
    Scan<D>: ScanKind<D>,
{
    let weights = WeightModel::InverseSquare;
    let made_with =
        MapperSettings { weights, w_max: 9.0, truncation: Some(0.4), ..MapperSettings::<D>::new(0.1) };
    let mut expected = fused(made_with);
    let mut mapper = Mapper::of_maps(MapperSettings::new(0.05), expected.clone().into_maps()).unwrap();
    let (pose, scan) = scan::<D>(POSES);
    let stats = [&mut mapper, &mut expected].map(|mapper| mapper.integrate(&pose, &scan).unwrap());
    assert_eq!(stats[0], stats[1]);
    let [ours, theirs] = [&mapper, &expected].map(|mapper| mapper.tsdf().unwrap().store());
    assert!(
        ours.keys() == theirs.keys() && ours.keys().iter().all(|&key| ours.brick(key) == theirs.brick(key))
    );
    let [ours, theirs] = [&mapper, &expected].map(|mapper| mapper.attenuation().unwrap().store());
    assert!(
        ours.keys() == theirs.keys() && ours.keys().iter().all(|&key| ours.brick(key) == theirs.brick(key))
    );
    assert_eq!(mapper.esdf_settings(), expected.esdf_settings());
    assert_eq!(mapper.settings().resolution, 0.1);
}

#[test]
fn maps_keep_their_filters_2d_and_3d() {
    maps_keep_their_filters::<2>();
    maps_keep_their_filters::<3>();
}
