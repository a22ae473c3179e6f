//! Points that nobody knows the origin of: hits of occupancy, and nothing else.

use portolan::geom::Pose;
use portolan::mapper::MapperSettings;
use portolan::scan::{Frame, FrameFilter, Origin, PointScan, Way};
use portolan::{Answer, Mapper};

fn scan() -> PointScan {
    let points = (0..50).map(|i| [2.05, 0.1 * i as f32 - 2.45, 0.55]);
    PointScan { origin: Origin::Unknown, ..PointScan::new(points, [0.0; 3]) }
}

#[test]
fn they_hit_cells_and_free_nothing() {
    let mut mapper =
        Mapper::<3>::with(MapperSettings { distances: false, attenuation: None, ..MapperSettings::new(0.1) });
    let at = Pose { translation: [10.0, 0.0, 0.0], ..Pose::IDENTITY };
    let stats = mapper.integrate(&at, &scan()).unwrap();
    assert_eq!((stats.beams.hit, stats.cells, stats.ways.count(Way::Points)), (50, 50, 1));
    let map = mapper.occupancy().unwrap();
    assert_eq!(map.observed_cells(), 50);
    assert!(map.probability([12.05, 0.05, 0.55]).known() > Some(0.5));
    assert_eq!(map.probability([11.95, 0.05, 0.55]), Answer::Unknown);
}

#[test]
fn maps_of_rays_refuse_and_count_them() {
    let mut mapper = Mapper::<3>::with(MapperSettings { occupancy: None, ..MapperSettings::new(0.1) });
    let stats = mapper.integrate(&Pose::IDENTITY, &scan()).unwrap();
    assert_eq!((stats.refused.not_finite, stats.beams.hit), (50, 0));
    assert!(mapper.mesh().triangles.is_empty() && mapper.attenuation().unwrap().store().is_empty());
}

#[test]
fn a_scan_loses_its_rays_and_a_filter_keeps_what_has_no_range() {
    let with_rays =
        PointScan { free_ends: vec![[1.0, 0.0, 0.0]], ..PointScan::new([[3.0, 0.0, 0.0]], [0.0; 3]) };
    let Frame::Points(bare) = Frame::Points(with_rays).without_rays() else { panic!("points stay points") };
    assert_eq!((bare.origin, bare.points.len(), bare.free_ends.len()), (Origin::Unknown, 1, 0));
    let filter = FrameFilter { max_range: 1.0, ..FrameFilter::default() };
    let (Frame::Points(kept), counts) = filter.apply(Frame::Points(scan())) else {
        panic!("points stay points")
    };
    assert_eq!((kept.points.len(), counts.hit), (50, 50));
}
