//! Five people walk through the building while it is mapped, a chair is moved, and poses are off by 2 cm: who is told from the walls.

use portolan::movers::Movers;
use portolan::scan::Frame;
use portolan_sim::building::{SpinningLidar, WalkersConfig, WalkersScan, walkers_log};

const POSE_SIGMA: f64 = 0.02;

#[test]
fn people_and_a_moved_chair_are_told_from_the_building() {
    let lidar = SpinningLidar { rings: 32, columns: 512, ..SpinningLidar::default() };
    let log = walkers_log(&WalkersConfig { scans: 120, lidar, pose_sigma: POSE_SIGMA, seed: 7 });
    let empty = || Movers::<3>::new(POSE_SIGMA, [0.0; 3], usize::MAX).unwrap();
    // While it is driven, only what was seen up to a scan tells what moves in it.
    let (mut movers, mut online) = (empty(), [[0; 2]; 2]);
    for seen in &log {
        movers.look(&seen.pose, &seen.frame).unwrap();
        count(&movers, seen, &mut online);
    }
    // Afterwards everything does.
    let mut offline = [[0; 2]; 2];
    for seen in &log {
        let taken = count(&movers, seen, &mut offline);
        let (rest, gone) = movers.split(&seen.pose, seen.frame.clone());
        assert_eq!((gone.len(), rest.hits()), (taken, seen.moves.len() - taken));
    }
    let shares = |counts: [[usize; 2]; 2]| counts.map(|[kept, taken]| taken as f64 / (kept + taken) as f64);
    for (name, counts) in [("while it is driven", online), ("afterwards", offline)] {
        let [still, moving] = shares(counts).map(|share| 100.0 * share);
        println!("{name} {counts:?}: of what moves {moving:.2} % are taken out, of the rest {still:.3} %");
    }
    assert!(offline[1].iter().sum::<usize>() > 50_000);
    let [still, moving] = shares(offline);
    assert!(moving >= 0.95 && still <= 0.005, "{offline:?}");
    let [still, moving] = shares(online);
    assert!(moving >= 0.8 && still <= 0.005, "{online:?}");
}

/// Counts the points of a scan, by whether they move and whether they are said to; returns how many are.
fn count(movers: &Movers<3>, seen: &WalkersScan, counts: &mut [[usize; 2]; 2]) -> usize {
    let Frame::Points(scan) = &seen.frame else { panic!("a lidar delivers points") };
    let mut taken = 0;
    for (p, moves) in scan.points.iter().zip(&seen.moves) {
        let moved = movers.moved(seen.pose.transform_point(p.map(f64::from)));
        counts[usize::from(*moves)][usize::from(moved)] += 1;
        taken += usize::from(moved);
    }
    taken
}
