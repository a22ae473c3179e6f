//! The lap with its poses corrected, and what maps of corrected poses are worth.

use portolan::geom::{Grid, Pose};
use portolan::map::{Tsdf2, TsdfConfig};
use portolan::scan::Scan;
use portolan::surface::{ContourSettings, marching_squares};
use portolan_chapter::poses::*;
use portolan_sim::*;

struct Lap {
    world: World,
    truth: Vec<Pose<2>>,
    scans: Vec<Scan<2>>,
    corrected: CorrectedLap,
}

fn corrected(seed: u64) -> Lap {
    corrected_with(seed, 1.0)
}

/// With odometry that is worse than usual by a factor, and believed to be so.
fn corrected_with(seed: u64, factor: f64) -> Lap {
    let usual = OdometryNoise::default();
    let noise = OdometryNoise {
        position_per_metre: factor * usual.position_per_metre,
        heading_per_metre: factor * usual.heading_per_metre,
        heading_per_radian: factor * usual.heading_per_radian,
        scale_bias: factor * usual.scale_bias,
        heading_bias_per_metre: factor * usual.heading_bias_per_metre,
    };
    let world = apartment().world;
    let (truth, scans): (Vec<_>, Vec<_>) =
        lap(&world, &LapConfig { seed, ..Default::default() }).into_iter().unzip();
    let motions = measure_motions(&truth, &noise, seed);
    let settings = CorrectionSettings { odometry: noise, ..Default::default() };
    let corrected = correct(truth[0], &motions, &scans, &settings).unwrap();
    Lap { world, truth, scans, corrected }
}

fn tell(lap: &Lap) -> [PoseErrors; 2] {
    let c = &lap.corrected;
    let before = PoseErrors::absolute(&c.odometry, &lap.truth);
    let after = PoseErrors::absolute(&c.poses, &lap.truth);
    for (k, r) in c.rounds.iter().enumerate() {
        println!("round {}: {} candidates, {} closures, {:?}", k + 1, r.candidates, r.closures, r.report);
    }
    let disagreeing = c.agrees.iter().filter(|a| !**a).count();
    let false_ones = c.closures.iter().filter(|f| {
        let truth = lap.truth[f.earlier].inverse() * lap.truth[f.later];
        truth.translation_to(&f.found.reference_from_scan) > 0.05
    });
    println!("{disagreeing} closures disagree with the poses, {} are more than 5 cm off", false_ones.count());
    println!("absolute, odometry:  {before}\nabsolute, optimised: {after}");
    for (name, poses) in [("odometry", &c.odometry), ("optimised", &c.poses)] {
        println!("relative over 10 scans, {name}: {}", PoseErrors::relative(poses, &lap.truth, 10));
    }
    [before, after]
}

#[test]
fn optimised_poses_are_within_centimetres() {
    for seed in (0..4).map(|k| SEED + k) {
        let clock = std::time::Instant::now();
        let lap = corrected(seed);
        println!("\nseed {seed:#x}, {:.2} s", clock.elapsed().as_secs_f64());
        let [before, after] = tell(&lap);
        assert!(before.translation.max > 0.3, "the odometry does not drift");
        assert!(after.translation.mean < 0.025 && after.translation.max < 0.1);
        assert!(after.rotation.rms.to_degrees() < 0.5);
        assert!(lap.corrected.closures.len() > 100);
    }
}

/// Distances of the vertices of the map's contour to the nearest true wall (meters).
fn map_errors(lap: &Lap, poses: &[Pose<2>]) -> ErrorMeasures {
    let grid = Grid::covering(lap.world.aabb().grown(0.5), 0.05).unwrap();
    let mut tsdf = Tsdf2::covering(&grid, TsdfConfig::textbook()).unwrap();
    for (pose, scan) in poses.iter().zip(&lap.scans) {
        tsdf.integrate(pose, scan).unwrap();
    }
    let contour = marching_squares(&tsdf, &ContourSettings::default());
    ErrorMeasures::of(contour.vertices.iter().map(|&v| lap.world.signed_distance(v).abs()).collect())
}

#[test]
fn a_map_of_optimised_poses_is_nearly_as_good_as_one_of_true_poses() {
    let lap = corrected(SEED);
    tell(&lap);
    let sets =
        [("true", &lap.truth), ("odometry", &lap.corrected.odometry), ("optimised", &lap.corrected.poses)];
    let medians = sets.map(|(name, poses)| {
        let e = map_errors(&lap, poses);
        println!("map of {name} poses: contour off by {e:?} m");
        e.median
    });
    assert!(medians[0] < 0.006 && medians[1] > 5.0 * medians[0]);
    assert!(medians[2] < 2.0 * medians[0] + 0.002);
}

#[test]
fn odometry_that_is_twice_as_bad_is_corrected_too() {
    for seed in (0..3).map(|k| SEED + k) {
        let lap = corrected_with(seed, 2.0);
        let [before, after] = tell(&lap);
        assert!(before.translation.max > 0.6);
        assert!(after.translation.mean < 0.03, "{after}");
    }
}

#[test]
fn a_seed_gives_the_same_bytes() {
    let (a, b) = (corrected(3), corrected(3));
    let bits = |lap: &Lap| -> Vec<u64> {
        let poses = lap.corrected.poses.iter();
        poses.flat_map(|p| [p.translation[0], p.translation[1], p.rotation[1][0]].map(f64::to_bits)).collect()
    };
    assert_eq!(bits(&a), bits(&b));
}

#[test]
fn without_scans_or_motions_there_is_nothing_to_correct() {
    let settings = CorrectionSettings::default();
    let nothing = correct(Pose::IDENTITY, &[], &[], &settings).unwrap();
    assert_eq!((nothing.poses.len(), nothing.closures.len()), (1, 0));
    let lost = vec![Scan::from_beams([]); 12];
    let motions = vec![Pose::<2>::new(0.1, 0.0, 0.0); 11];
    let blind = correct(Pose::IDENTITY, &motions, &lost, &settings).unwrap();
    assert!(blind.closures.is_empty() && blind.poses.len() == 12);
    for (a, b) in blind.poses.iter().zip(&blind.odometry) {
        assert!(a.translation_to(b) < 1e-9);
    }
}
