//! Defaults fit the map, however its scans were weighed: what was seen once is a surface, what was seen free once is known.

use portolan::explore::{FrontierMap, FrontierSettings};
use portolan::field::{Esdf, EsdfSettings};
use portolan::geom::{Grid, Pose};
use portolan::map::{DistanceMap, Tsdf2, Tsdf3, TsdfConfig};
use portolan::scan::{Frame, PointScan, RangeLimits, Scan};
use portolan::surface::{
    ContourSettings, MeshSettings, RayCast, RayCastSettings, RayCaster, marching_cubes, marching_squares,
};
use portolan::sweep::WeightModel;

const R: f64 = 0.1;

/// A map of a wall at x = 4 m that one scan from the origin saw.
trait Wall<const D: usize>: DistanceMap<D> + Sized {
    fn seen(weights: WeightModel, carve_weight: f32) -> Self;

    /// Segments or triangles, by default settings, and with this `min_weight`.
    fn elements(&self, min_weight: Option<f32>) -> usize;
}

impl Wall<2> for Tsdf2 {
    fn seen(weights: WeightModel, carve_weight: f32) -> Self {
        let bearings: Vec<f64> = (-250..=250).map(|i| 0.002 * f64::from(i)).collect();
        let ranges: Vec<f64> = bearings.iter().map(|b| 4.0 / b.cos()).collect();
        let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
        let config = TsdfConfig { truncation: 3.0 * R, weights, carve_weight, ..TsdfConfig::textbook() };
        let mut map = Tsdf2::covering(&Grid::new([-0.5, -3.0], R, [55, 60]), config).unwrap();
        map.integrate(&Pose::IDENTITY, &scan).unwrap();
        map
    }

    fn elements(&self, min_weight: Option<f32>) -> usize {
        marching_squares(self, &ContourSettings { min_weight, ..Default::default() }).segments.len()
    }
}

impl Wall<3> for Tsdf3 {
    fn seen(weights: WeightModel, carve_weight: f32) -> Self {
        let at = |i: u16| 0.03 * f32::from(i) - 2.0;
        let points = (0..133 * 133).map(|n| [4.0, at(n % 133), at(n / 133)]);
        let config = TsdfConfig {
            resolution: R,
            truncation: 3.0 * R,
            weights,
            carve_weight,
            ..TsdfConfig::textbook()
        };
        let mut map = Tsdf3::new(config).unwrap();
        map.integrate(&Pose::IDENTITY, &Frame::Points(PointScan::new(points, [0.0; 3]))).unwrap();
        map
    }

    fn elements(&self, min_weight: Option<f32>) -> usize {
        marching_cubes(self, None, &MeshSettings { min_weight, ..Default::default() }).triangles.len()
    }
}

/// How many elements there are, and how many of the points on the way to the wall have a distance.
fn default_answers<const D: usize, M: Wall<D>>(map: &M) -> [usize; 2] {
    let esdf = Esdf::of(map, &EsdfSettings::default());
    assert_eq!(esdf.settings().min_weight, EsdfSettings::of(map).min_weight);
    let known = (0..1000).filter(|&i| {
        let p = std::array::from_fn(|k| if k == 0 { 0.5 + 0.003 * f64::from(i) } else { 0.01 });
        esdf.distance(p).status().has_value()
    });
    [map.elements(None), known.count()]
}

fn defaults_fit<const D: usize, M: Wall<D>>() {
    let [elements, known] = default_answers(&M::seen(WeightModel::Constant, 1.0));
    assert!(elements > 30 && known == 1000, "{elements} {known}");
    for (weights, carve_weight) in [
        (WeightModel::InverseSquare, 1.0),
        (WeightModel::Constant, 0.3),
        (WeightModel::InverseSquareCosIncidence, 0.3),
    ] {
        let map = M::seen(weights, carve_weight);
        let [found, known] = default_answers(&map);
        let share = found as f64 / elements as f64;
        assert!(
            (0.95..1.05).contains(&share) && known == 1000,
            "{weights:?} {carve_weight}: {found} {known}"
        );

        let bricks = map.bricks();
        let ahead = std::array::from_fn(|k| f64::from(u8::from(k == 0)));
        let settings = RayCastSettings { blind: 0.5, ..RayCastSettings::of(&map) };
        let hit = RayCaster::new(&bricks, settings).cast([0.01; D], ahead);
        assert!(matches!(hit, RayCast::Hit(s) if (s - 3.99).abs() < 0.02), "{hit:?}");
        let mut frontiers = FrontierMap::new(FrontierSettings::of(&map));
        frontiers.update(&bricks);
        assert!(!frontiers.frontiers().is_empty());
        // A threshold of its own is kept; of cells alone any weight counts.
        if weights != WeightModel::Constant {
            assert_eq!(map.elements(Some(0.5)), 0);
        }
        assert_eq!(Esdf::of(&*bricks, &EsdfSettings::default()).settings().min_weight, Some(0.0));
    }
}

#[test]
fn defaults_fit_2d_and_3d() {
    defaults_fit::<2, Tsdf2>();
    defaults_fit::<3, Tsdf3>();
}
