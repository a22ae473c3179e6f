//! Frontiers of the Apartment and of the Building, and what a view of them would show.

use crate::common::{apartment, tsdf};
use portolan::cell::SignedDistance;
use portolan::explore::{
    Frontier, FrontierMap, FrontierSettings, GainSettings, expected_gain, expected_gains, fan, spherical,
};
use portolan::geom::{Aabb, Pose, vector};
use portolan::map::{BeamSweep, Tsdf3, TsdfConfig};
use portolan::store::{Bricks, Store};
use portolan_sim::building::{BuildingConfig, BuildingSensor, SpinningLidar, building_log};

fn frontiers<const D: usize>(store: &Bricks<SignedDistance, D>) -> Vec<Frontier<D>> {
    let mut map = FrontierMap::new(FrontierSettings::default());
    map.update(store);
    map.frontiers()
}

/// After some scans of the lap the borders are the doors of rooms not yet seen; after all of them little is left.
#[test]
fn frontiers_of_the_apartment_are_at_what_was_not_seen_yet() {
    let log = &apartment().log;
    let lengths = [10, 60, log.len()].map(|scans| {
        let tsdf = tsdf(BeamSweep::CellCentre, true, &log[..scans]);
        let store: Bricks<_, 2> = tsdf.store().into();
        let found = frontiers(&store);
        println!("after {scans} scans {} frontiers:", found.len());
        for f in found.iter().take(6) {
            println!("  {} cells about {:.2?}, towards {:.2?}", f.cells.len(), f.middle, f.normal);
        }
        // The middle of a border is seen; a cell beyond one of its cells is not.
        for f in &found {
            assert!(store.cell(tsdf.grid().lattice.cell_of(f.middle).unwrap()).is_some());
            assert!(f.cells.len() >= 10 && f.faces >= f.cells.len());
            let free =
                |c: &[i32; 2]| apartment().world.signed_distance(tsdf.grid().lattice.center(*c)) > -0.1;
            assert!(f.cells.iter().all(free), "a border of the free lies in a wall");
        }
        found.iter().map(|f| f.cells.len()).sum::<usize>()
    });
    println!("frontier cells: {lengths:?}");
    assert!(lengths[2] < lengths[1]);
}

/// The gain at a frontier is larger than where everything was seen, and what a scan from there adds is of the size that was
/// expected.
#[test]
fn the_expected_gain_is_what_a_scan_adds_and_more() {
    let world = &apartment().world;
    let mut tsdf = tsdf(BeamSweep::CellCentre, true, &apartment().log[..30]);
    let bounds = Some(Aabb::new([0.0; 2], [12.0, 9.0]));
    let settings = GainSettings { max_range: 8.0, bounds, ..Default::default() };
    let rays = fan(-3.13, 3.13, 360);
    let store: Bricks<_, 2> = tsdf.store().into();
    // One step back from each border.
    let poses: Vec<_> = frontiers(&store)
        .iter()
        .filter_map(|f| {
            let p = vector::along(f.middle, f.normal?, -0.2);
            (world.signed_distance(p) > 0.15).then(|| Pose::<2>::new(p[0], p[1], 0.0))
        })
        .collect();
    let gains = expected_gains(&store, &poses, &rays, &settings);
    let best = (0..gains.len()).max_by(|&a, &b| gains[a].cells.cmp(&gains[b].cells)).unwrap();
    let start = expected_gain(&store, &apartment().log[0].0, &rays, &settings);
    println!("at the start {start:?}, at {:.2?} {:?}", poses[best].translation, gains[best]);
    assert!(gains[best].volume > 1.5 * start.volume);
    let observed = |t: &portolan::map::Tsdf2| {
        (0..t.grid().len()).filter(|&i| t.store().at(i).is_some_and(|c| c.weight >= 0.5)).count()
    };
    let before = observed(&tsdf);
    let lidar = portolan_sim::Lidar::default();
    tsdf.integrate(&poses[best], &portolan_sim::scan_at(world, &poses[best], &lidar, 999, 1)).unwrap();
    let new = observed(&tsdf) - before;
    println!("{new} cells are new, {} were hoped for", gains[best].cells);
    // A meter of the unknown is about what lies behind a door.
    assert!((0.5..2.0).contains(&(new as f64 / gains[best].cells as f64)));
}

#[test]
fn frontiers_of_the_building_follow_its_scans() {
    let sensor = BuildingSensor::Lidar(SpinningLidar { rings: 16, columns: 256, ..Default::default() });
    let log = building_log(&BuildingConfig { scans: 12, sensor, ..Default::default() });
    let config = TsdfConfig { resolution: 0.1, truncation: 0.3, ..TsdfConfig::textbook() };
    let mut map = Tsdf3::new(config).unwrap();
    let mut kept = FrontierMap::new(FrontierSettings::default());
    for (pose, frame) in &log.scans {
        map.integrate(pose, frame).unwrap();
        let looked = kept.update(map.store()).len();
        assert!(looked <= map.store().len());
        assert_eq!(kept.frontiers(), frontiers(map.store()));
    }
    let found = kept.frontiers();
    println!("{} frontiers, the largest of {} cells", found.len(), found[0].cells.len());
    let view = expected_gain(
        map.store(),
        &log.scans[0].0,
        &spherical([-3.1, 3.1], 90, [-0.4, 0.4], 20),
        &GainSettings::default(),
    );
    println!("{view:?}");
    assert!(view.cells > 0 && view.hit > 100 && view.hit + view.unknown + view.free == 1800);
}
