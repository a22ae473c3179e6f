//! Laws of maps of sums: any split, any order, any number of threads, back again, elsewhere.

use crate::common::apartment;
use portolan::geom::Trajectory;
use portolan::ledger::{Epochs, LedgerError, LedgerSums};
use portolan::map::{MapError, ScanKind, Tsdf, TsdfConfig, least_weight};
use portolan::scan::{Frame, Scan};
use portolan::store::Store;
use portolan::{Ledger, MapperSettings, geom::Pose};
use portolan_sim::building::{
    BuildingConfig, BuildingSensor, DepthCamera, SpinningLidar, building_log, moving_lidar_frame,
};
use proptest::prelude::*;
use std::sync::LazyLock;

/// A scan and its pose.
type Taken<const D: usize, S> = (Pose<D>, S);

/// Scans of the Apartment, far apart.
static SCANS_2D: LazyLock<Vec<Taken<2, Scan<2>>>> =
    LazyLock::new(|| apartment().log.iter().step_by(17).cloned().collect());

/// Turns of a lidar that moves at 2 m/s, the motion taken out: distances see each in strips, one after the other.
static SCANS_MOVING: LazyLock<Vec<Taken<3, Frame>>> = LazyLock::new(|| {
    const TURN: f64 = 0.1;
    let lidar = SpinningLidar { columns: 180, rings: 16, ..Default::default() };
    let building = portolan_sim::building::building_world(1);
    let (start, world) = (building.path[0], &building.world);
    let pose = |t: f64| Pose::<3> {
        translation: [start[0] + 2.0 * t, start[1] + 0.3 * t, 1.2],
        ..Pose::<3>::IDENTITY
    };
    let path = Trajectory::new((0..8).map(|i| (TURN * f64::from(i), pose(TURN * f64::from(i))))).unwrap();
    (0..6u32)
        .map(|i| {
            let at = TURN * f64::from(i);
            let moving = |t: f64| pose(at + t);
            let frame = moving_lidar_frame(world, moving, &lidar, &lidar.directions(), TURN, (1, i.into()));
            let Frame::Points(mut scan) = frame else { panic!("a lidar delivers points") };
            scan.deskew(&pose(at), &mut path.motion(0.25), at).unwrap();
            assert!(scan.delivered.is_some());
            (pose(at), Frame::Points(scan))
        })
        .collect()
});

/// Turns of a lidar through the Building: images, points that have colors, and points whose rows are looked for in vain; then
/// pictures of a camera. Two of three see colors.
static SCANS_3D: LazyLock<Vec<Taken<3, Frame>>> = LazyLock::new(|| {
    let lidar = SpinningLidar { columns: 180, rings: 16, ..Default::default() };
    let sensor = BuildingSensor::Lidar(lidar);
    let log = building_log(&BuildingConfig { scans: 7, sensor, ..Default::default() });
    let as_points = |(i, (pose, frame)): (usize, (Pose<3>, Frame))| match frame {
        Frame::Points(mut scan) if i % 3 != 0 => {
            scan.image = None;
            let every = if i % 3 == 1 { 1 } else { 7 };
            scan.points = scan.points.iter().step_by(every).copied().collect();
            if every == 1 {
                scan.colors = colors(scan.points.len(), i);
            }
            (pose, Frame::Points(scan))
        }
        Frame::Points(mut scan) => {
            scan.image = scan.image.map(|image| {
                let pixels = image.values.len();
                image.with_colors(colors(pixels, i))
            });
            (pose, Frame::Points(scan))
        }
        frame => (pose, frame),
    };
    let sensor = BuildingSensor::Camera(DepthCamera::default().scaled(0.25));
    let pictures = building_log(&BuildingConfig { scans: 2, sensor, ..Default::default() }).scans;
    log.scans.into_iter().enumerate().map(as_points).chain(pictures).collect()
});

/// Colors that differ from pixel to pixel and from scan to scan.
fn colors(count: usize, scan: usize) -> Vec<[u8; 3]> {
    (0..count).map(|i| [(7 * i) as u8, (i / 13) as u8, (31 * scan) as u8]).collect()
}

fn settings<const D: usize>() -> MapperSettings<D> {
    MapperSettings { color: D == 3, ..MapperSettings::new(if D == 2 { 0.1 } else { 0.2 }) }
}

fn fused<const D: usize, S: ScanKind<D> + Sync>(
    scans: &[Taken<D, S>],
    which: impl IntoIterator<Item = usize>,
) -> Ledger<D> {
    let mut ledger = Ledger::new(settings()).unwrap();
    for i in which {
        assert_eq!(ledger.add("log", i as u64, &scans[i].0, &scans[i].1).unwrap().scans, 1);
    }
    ledger
}

fn with_threads<R: Send>(count: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap().install(work)
}

/// Parts are fused in the order of `keys`, on different numbers of threads, and merged in that order, too.
fn any_split_in_any_order<const D: usize, S: ScanKind<D> + Sync>(
    scans: &[Taken<D, S>],
    parts: &[u8],
    keys: &[u64],
) {
    let n = scans.len();
    let whole = fused(scans, 0..n);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|&i| keys[i]);
    let mut merged = Ledger::new(settings()).unwrap();
    for (part, threads) in [(2, 8), (0, 1), (1, 2)] {
        let which = order.iter().copied().filter(|&i| parts[i] % 3 == part);
        let of_part = with_threads(threads, || fused(scans, which));
        merged.merge(&of_part).unwrap();
    }
    assert!(merged == whole);
    // Half of it is taken back, scan by scan, and the rest as a whole.
    let (out, rest): (Vec<usize>, Vec<usize>) = order.iter().partition(|&&i| keys[i].is_multiple_of(2));
    for &i in &out {
        merged.subtract("log", i as u64, &scans[i].1).unwrap();
    }
    let rest = fused(scans, rest);
    assert!(merged == rest);
    merged.take_out(&rest).unwrap();
    assert!(merged == Ledger::new(settings()).unwrap());
    assert!(merged.scans().is_empty());
}

fn poses_that_change<const D: usize, S: ScanKind<D> + Sync + Clone>(
    scans: &[Taken<D, S>],
    moved: &[bool],
    shift: [f64; D],
    back: bool,
) {
    let mut corrected = scans.to_vec();
    for (i, (pose, _)) in corrected.iter_mut().enumerate().filter(|(i, _)| moved[*i]) {
        (0..D).for_each(|k| pose.translation[k] += shift[k] * (1.0 + i as f64 * 0.3));
    }
    let mut ledger = fused(scans, 0..scans.len());
    for (i, (pose, scan)) in corrected.iter().enumerate().filter(|(i, _)| moved[*i]) {
        ledger.repose("log", i as u64, pose, scan).unwrap();
    }
    assert!(ledger == fused(&corrected, 0..scans.len()));
    assert_eq!(ledger == fused(scans, 0..scans.len()), !moved.iter().any(|m| *m));
    if back {
        for (i, (pose, scan)) in scans.iter().enumerate() {
            ledger.repose("log", i as u64, pose, scan).unwrap();
        }
        assert!(ledger == fused(scans, 0..scans.len()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn scans_in_2d_add_up(parts in prop::collection::vec(any::<u8>(), 12), keys in prop::collection::vec(any::<u64>(), 12)) {
        any_split_in_any_order(&SCANS_2D[..12], &parts, &keys);
    }

    #[test]
    fn scans_in_2d_move(moved in prop::collection::vec(any::<bool>(), 12), x in -0.4..0.4f64, y in -0.4..0.4f64) {
        poses_that_change(&SCANS_2D[..12], &moved, [x, y], true);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4, ..ProptestConfig::default() })]

    #[test]
    fn scans_in_3d_add_up(parts in prop::collection::vec(any::<u8>(), 9), keys in prop::collection::vec(any::<u64>(), 9)) {
        any_split_in_any_order(&SCANS_3D[..9], &parts, &keys);
    }

    #[test]
    fn scans_in_3d_move(moved in prop::collection::vec(any::<bool>(), 5), x in -0.4..0.4f64, y in -0.4..0.4f64) {
        poses_that_change(&SCANS_3D[..5], &moved, [x, y, 0.1], false);
    }
}

/// What a mean in floating point is, the quotient of the sums is, to the width of a step.
fn means_are_means<const D: usize, S: ScanKind<D> + Sync>(scans: &[Taken<D, S>]) {
    let sums = fused(scans, 0..scans.len()).mapper().unwrap();
    let config = TsdfConfig { w_max: f32::INFINITY, ..*sums.tsdf().unwrap().config() };
    let mut means = Tsdf::<D>::new(config).unwrap();
    for (pose, scan) in scans {
        means.integrate(pose, scan).unwrap();
    }
    let believed = least_weight(config.weights, config.carve_weight);
    let (mut cells, mut worst, mut total) = (0u32, [0.0f64; 3], 0.0);
    for (key, brick) in means.store().bricks_by_age() {
        for i in (0..brick.weights().len()).filter(|&i| brick.weights()[i] > 0.0) {
            let sum = sums.tsdf().unwrap().store().cell(key.cell(i)).unwrap();
            let off = f64::from(sum.distance - brick.distances()[i]).abs();
            let weight = brick.weights()[i];
            let of = &mut worst[usize::from(weight >= believed) + usize::from(weight >= 1.0)];
            *of = of.max(off);
            cells += 1;
            total += off;
        }
    }
    assert_eq!(sums.tsdf().unwrap().observed_cells(0.0), means.observed_cells(0.0));
    let (truncation, mean) = (config.truncation, total / f64::from(cells));
    let [hardly, little, well] = worst;
    println!(
        "{D}-D: {cells} cells, {:.4} mm off in the mean, at most {:.3} of weight 1 and more, {:.3} of half a look at free space and \
         more, {:.3} of less",
        1e3 * mean,
        1e3 * well,
        1e3 * little,
        1e3 * hardly
    );
    // Weights that taper off behind a surface are rounded to 1/256: where hardly anything else was seen, that shifts a mean of
    // looks that differ.
    assert!(cells > 5000 && mean < 2.5e-4 * truncation);
    assert!(well < 0.01 * truncation && little.max(hardly) < 0.05 * truncation);
}

#[test]
fn sums_are_the_weighted_means() {
    means_are_means(&SCANS_2D);
    means_are_means(&SCANS_3D);
}

/// Log odds are clamped once, hits per meter are the same numbers.
#[test]
fn occupancy_and_hits_per_meter_follow_from_the_counts() {
    let sums = fused(&SCANS_2D, 0..SCANS_2D.len());
    let maps = sums.mapper().unwrap();
    let occupancy = maps.occupancy().unwrap();
    let mut seen = 0;
    for (key, brick) in sums.occupancy_sums().unwrap().bricks_by_age() {
        for i in 0..brick.cells() {
            let [hits, misses] = brick.at(i);
            let exact = (31 * hits - 15 * misses).clamp(-73, 127);
            let cell = occupancy.store().cell(key.cell(i));
            assert_eq!(cell.map(|c| i64::from(c.0)), (hits + misses > 0).then_some(exact));
            seen += usize::from(cell.is_some());
        }
    }
    assert_eq!(seen, occupancy.observed_cells());
    let rule = portolan::cell::AttenuationRule::NEVER;
    let mut counted = portolan::map::Attenuation::<2>::new(*occupancy.store().lattice(), rule).unwrap();
    for (pose, scan) in &*SCANS_2D {
        counted.integrate(pose, scan).unwrap();
    }
    let ours = maps.attenuation().unwrap();
    assert_eq!(ours.observed_cells(), counted.observed_cells());
    for (key, brick) in counted.store().bricks_by_age() {
        assert!(ours.store().brick(key) == Some(brick));
    }
}

#[test]
fn slips_are_refused_and_change_nothing() {
    let scans = &*SCANS_2D;
    let mut ledger = fused(scans, 0..4);
    let before = ledger.clone();
    let at = |i: usize| (&scans[i].0, &scans[i].1);
    let twice = ledger.add("log", 2, at(2).0, at(2).1);
    assert_eq!(twice, Err(LedgerError::Twice { log: "log".into(), index: 2 }));
    assert_eq!(ledger.subtract("log", 7, at(7).1), Err(LedgerError::NotHeld { log: "log".into(), index: 7 }));
    assert!(matches!(ledger.subtract("log", 2, at(3).1), Err(LedgerError::OtherReadings { .. })));
    assert!(matches!(ledger.add("log", 2, at(3).0, at(3).1), Err(LedgerError::OtherReadings { .. })));
    assert!(matches!(ledger.subtract("other", 2, at(2).1), Err(LedgerError::NotHeld { .. })));
    assert!(matches!(ledger.repose("log", 9, at(2).0, at(2).1), Err(LedgerError::NotHeld { .. })));
    let nowhere = Pose { translation: [f64::NAN; 2], ..*at(2).0 };
    assert!(matches!(ledger.repose("log", 2, &nowhere, at(2).1), Err(LedgerError::Pose { .. })));
    assert!(matches!(ledger.add("log", 8, &nowhere, at(8).1), Err(LedgerError::Pose { .. })));
    assert!(matches!(ledger.merge(&fused(scans, 3..6)), Err(LedgerError::Twice { index: 3, .. })));
    assert!(matches!(ledger.take_out(&fused(scans, 3..6)), Err(LedgerError::NotHeld { index: 4, .. })));
    let mut elsewhere = Ledger::new(settings()).unwrap();
    elsewhere.add("log", 1, &Pose::<2>::new(4.0, 4.0, 0.0), at(1).1).unwrap();
    assert!(matches!(ledger.take_out(&elsewhere), Err(LedgerError::OtherPose { index: 1, .. })));
    let others = [
        MapperSettings { resolution: 0.05, ..settings() },
        MapperSettings { origin: Some([0.05, 0.0]), ..settings() },
        MapperSettings { carve_weight: 0.5, ..settings() },
        MapperSettings { truncation: Some(0.5), ..settings() },
        MapperSettings { attenuation: None, ..settings() },
        MapperSettings { occupancy: None, ..settings() },
    ];
    for other in others {
        let other = Ledger::new(other).unwrap();
        assert!(matches!(ledger.merge(&other), Err(LedgerError::Different { .. })));
    }
    assert!(ledger == before);
}

/// Colors are readings, where they are kept.
#[test]
fn other_colors_are_other_readings() {
    let (pose, Frame::Points(scan)) = &SCANS_3D[1] else { panic!("points") };
    let mut other = scan.clone();
    other.colors[17][2] ^= 1;
    let plain = MapperSettings { color: false, ..settings() };
    for how in [settings::<3>(), plain] {
        let mut ledger = Ledger::new(how).unwrap();
        ledger.add("log", 1, pose, scan).unwrap();
        let before = ledger.clone();
        let taken = ledger.subtract("log", 1, &other);
        if how.color {
            assert!(matches!(taken, Err(LedgerError::OtherReadings { index: 1, .. })) && ledger == before);
        } else {
            assert!(taken.is_ok() && ledger == Ledger::new(how).unwrap());
        }
    }
    let mut colored = Ledger::new(settings::<3>()).unwrap();
    assert!(matches!(
        colored.merge(&Ledger::new(plain).unwrap()),
        Err(LedgerError::Different { what: "colors", .. })
    ));
}

/// The same cells have colors as in a map that averages in floating point, and the same ones.
#[test]
fn colors_are_the_weighted_means() {
    let sums = fused(&SCANS_3D, 0..SCANS_3D.len()).mapper().unwrap();
    let tsdf = sums.tsdf().unwrap();
    let config = TsdfConfig { w_max: f32::INFINITY, ..*tsdf.config() };
    let mut means = Tsdf::<3>::new(config).unwrap();
    for (pose, scan) in &*SCANS_3D {
        means.integrate(pose, scan).unwrap();
    }
    let (ours, theirs) = (tsdf.colors().unwrap(), means.colors().unwrap());
    let (mut cells, mut total, mut many) = (0u32, 0.0, 0u32);
    for (key, brick) in theirs.bricks_by_age() {
        for (i, &[r, g, b, weight]) in brick.words().iter().enumerate() {
            let color = ours.cell(key.cell(i));
            assert_eq!(color.is_some(), weight > 0);
            let Some(color) = color else { continue };
            let off: f64 = [r, g, b]
                .iter()
                .zip(color.rgb)
                .map(|(&a, b)| (f64::from(a) - f64::from(b)).abs() / 257.0)
                .sum();
            (cells, total) = (cells + 1, total + off / 3.0);
            many += u32::from(color.weight() > 1.5);
        }
    }
    let observed = |b: &portolan::cell::ColorBrick| b.words().iter().filter(|w| w[3] > 0).count();
    let held: usize = ours.bricks_by_age().map(|(_, b)| observed(b)).sum();
    println!(
        "{cells} colored cells, {many} seen more than once, {:.3} of 255 off in the mean",
        total / f64::from(cells)
    );
    assert!(held == cells as usize && cells > 5000 && many > 1000 && total / f64::from(cells) < 0.3);
}

#[test]
fn copies_under_another_name_are_counted() {
    let mut ledger = fused(&SCANS_2D, 0..5);
    assert_eq!(ledger.scans().copies(), 0);
    for i in [1, 3] {
        ledger.add("copy", 10 + i as u64, &SCANS_2D[i].0, &SCANS_2D[i].1).unwrap();
    }
    assert_eq!(ledger.scans().copies(), 2);
    // A robot that stands still may read the same twice; elsewhere it is another scan.
    ledger.add("log", 77, &SCANS_2D[0].0, &SCANS_2D[0].1).unwrap();
    ledger.add("copy", 77, &SCANS_2D[4].0, &SCANS_2D[2].1).unwrap();
    assert_eq!(ledger.scans().copies(), 2);
}

#[test]
fn far_from_zero_an_origin_must_be_given() {
    let (pose, scan) = &SCANS_2D[0];
    let far =
        Pose { translation: [pose.translation[0] + 500_000.0, pose.translation[1] + 4_000_000.0], ..*pose };
    let mut ledger = Ledger::new(settings()).unwrap();
    assert!(matches!(ledger.add("log", 0, &far, scan), Err(LedgerError::Far { .. })));
    let origin = Some([500_000.0, 4_000_000.0]);
    let mut ledger = Ledger::new(MapperSettings { origin, ..settings() }).unwrap();
    ledger.add("log", 0, &far, scan).unwrap();
    let near = fused(&SCANS_2D, [0]);
    let weights = |ledger: &Ledger<2>| {
        ledger
            .distance_sums()
            .unwrap()
            .bricks_by_age()
            .map(|(_, b)| b.planes().iter().sum::<i64>())
            .sum::<i64>()
    };
    assert!((weights(&ledger) - weights(&near)).abs() < weights(&near).abs() / 1000);
}

#[test]
fn a_scan_that_has_no_room_is_left_out_whole() {
    let memory = fused(&SCANS_2D, 0..SCANS_2D.len()).memory_bytes() / 2;
    let mut ledger = Ledger::new(MapperSettings { memory, ..settings() }).unwrap();
    let mut refused = 0;
    for (i, (pose, scan)) in SCANS_2D.iter().enumerate() {
        let before = ledger.clone();
        match ledger.add("log", i as u64, pose, scan) {
            Ok(_) => assert!(ledger.memory_bytes() <= memory),
            Err(LedgerError::Map(MapError::Full(_))) => {
                refused += 1;
                assert!(ledger == before);
            }
            Err(error) => panic!("{error}"),
        }
    }
    assert!(refused > 0 && refused < SCANS_2D.len(), "{refused}");
    let which: Vec<usize> = ledger.scans().iter().map(|(_, i, _)| i as usize).collect();
    assert!(ledger == fused(&SCANS_2D, which));
}

/// A scan that comes in strips is wholly there or not at all, too, and so is one that is taken away and was not there.
#[test]
fn strips_of_a_moving_lidar_are_one_scan() {
    let scans = &*SCANS_MOVING;
    let whole = fused(scans, 0..scans.len());
    let steps = 12;
    for step in 1..steps {
        let memory = whole.memory_bytes() * step / steps;
        let mut ledger = Ledger::new(MapperSettings { memory, ..settings() }).unwrap();
        for (i, (pose, scan)) in scans.iter().enumerate() {
            if ledger.add("log", i as u64, pose, scan).is_err() {
                let held: Vec<usize> = ledger.scans().iter().map(|(_, i, _)| i as usize).collect();
                assert!(!held.contains(&i) && ledger == fused(scans, held));
            }
        }
    }
    any_split_in_any_order(scans, &[0, 1, 2, 0, 1, 2], &[9, 4, 6, 1, 8, 3]);
}

/// Sums that do not hold what their list says, as no ledger comes to be by itself.
#[test]
fn what_sums_do_not_hold_is_not_taken_from_them() {
    fn wrong<const D: usize, S: ScanKind<D> + Sync>(scans: &[Taken<D, S>]) {
        let (a, b) = (fused(scans, [0]), fused(scans, [1]));
        let sums = LedgerSums {
            occupancy: a.occupancy_sums().cloned(),
            distances: a.distance_sums().cloned(),
            colors: a.color_sums().cloned(),
            attenuation: a.attenuation_sums().cloned(),
        };
        let how = MapperSettings { origin: Some([0.0; D]), ..settings() };
        let mut forged = Ledger::from_parts(how, b.scans().clone(), sums).unwrap();
        let before = forged.clone();
        assert!(matches!(forged.subtract("log", 1, &scans[1].1), Err(LedgerError::Sums { .. })));
        assert!(forged == before);
        assert!(matches!(forged.take_out(&b), Err(LedgerError::Sums { .. })));
        assert!(forged == before);
    }
    wrong(&SCANS_2D);
    wrong(&SCANS_3D);
    wrong(&SCANS_MOVING);
}

#[test]
fn epochs_keep_the_newest_scans_exactly() {
    let mut epochs = Epochs::new(settings(), 2.0, 4.0).unwrap();
    for (i, (pose, scan)) in SCANS_2D.iter().enumerate() {
        epochs.add("log", i as u64, i as f64, pose, scan).unwrap();
        // The epoch of now, the two before it that are kept whole, and what is not yet older than the time that is kept.
        let kept: Vec<usize> = epochs.ledger().scans().iter().map(|(_, i, _)| i as usize).collect();
        assert!(kept.len() <= 8 && kept.last() == Some(&i) && kept.windows(2).all(|w| w[0] + 1 == w[1]));
        assert!(i < 5 || i - kept[0] >= 4);
        assert!(*epochs.ledger() == fused(&SCANS_2D, kept));
    }
    let (pose, scan) = &SCANS_2D[0];
    assert!(matches!(epochs.add("log", 99, 1.0, pose, scan), Err(LedgerError::Time { .. })));
    assert!(matches!(epochs.add("log", 99, f64::NAN, pose, scan), Err(LedgerError::Time { .. })));
}

/// What was taken away answers nothing, and what is derived from the rest is the rest's.
#[test]
fn the_maps_of_a_ledger_answer_like_any_other() {
    let mut ledger = fused(&SCANS_2D, 0..SCANS_2D.len());
    let mut maps = ledger.mapper().unwrap();
    let esdf = maps.esdf().unwrap();
    let p = SCANS_2D[3].0.translation;
    assert!(esdf.distance(p).known().unwrap() > 0.1);
    // Asked at once, without making the maps.
    for (_, scan) in [&SCANS_2D[3], &SCANS_2D[9]] {
        for q in scan.hits_world(&SCANS_2D[3].0).chain([p, [-50.0; 2]]).step_by(7) {
            assert_eq!(ledger.signed_distance(q), maps.tsdf().map(|map| map.signed_distance(q)));
            assert_eq!(ledger.probability(q), maps.occupancy().map(|map| map.probability(q)));
        }
    }
    assert!(maps.contour().length() > 20.0);
    for (i, (_, scan)) in SCANS_2D.iter().enumerate() {
        ledger.subtract("log", i as u64, scan).unwrap();
    }
    let empty = ledger.mapper().unwrap();
    assert_eq!(empty.tsdf().unwrap().observed_cells(0.0), 0);
    assert!(empty.tsdf().unwrap().store().is_empty());
    assert_eq!(empty.occupancy().unwrap().probability(p).known(), None);
}

/// The surface of the sums is as far from the walls as that of the clamped cells.
#[test]
fn surfaces_are_as_true_as_those_of_clamped_cells() {
    let sensor = BuildingSensor::Lidar(SpinningLidar { columns: 512, ..Default::default() });
    let log = building_log(&BuildingConfig { scans: 10, sensor, ..Default::default() });
    let how = MapperSettings { occupancy: None, attenuation: None, ..MapperSettings::<3>::new(0.1) };
    let mut clamped = portolan::Mapper::with(how);
    let mut sums = Ledger::new(how).unwrap();
    for (i, (pose, scan)) in log.scans.iter().enumerate() {
        clamped.integrate(pose, scan).unwrap();
        sums.add("log", i as u64, pose, scan).unwrap();
    }
    let median = |mapper: &mut portolan::Mapper<3>| {
        let mesh = mapper.mesh();
        let vertices = (0..mesh.vertices.len()).map(|i| mesh.vertex_world(i));
        let mut off: Vec<f64> = vertices.map(|p| log.world.signed_distance(p).abs()).collect();
        assert!(off.len() > 10_000);
        1e3 * crate::common::quantile(&mut off, 0.5)
    };
    let (clamped, sums) = (median(&mut clamped), median(&mut sums.mapper().unwrap()));
    println!("median distance of vertices from the walls: {clamped:.3} mm clamped, {sums:.3} mm of sums");
    assert!(clamped < 15.0 && (clamped - sums).abs() < 0.1);
}
