//! The chair moves, and maps forget it as fast as the filter says.

use portolan::map::BeamSweep;
use portolan::sweep::WeightModel;
use portolan_chapter::ghost::{GhostGroup, GhostRun, GhostSettings, ghost, static_noise};

/// Prints all but the curves.
fn tell(run: &GhostRun) {
    println!("W_max {}: {} laps before, {} after", run.w_max, run.laps_before, run.laps_after);
    for group in [&run.left, &run.saturated, &run.unclamped, &run.tapered] {
        println!("  {:?}", GhostGroup { curve: Vec::new(), ..group.clone() });
    }
    println!("  {:?}", run.static_noise);
}

#[test]
fn the_chair_is_forgotten_and_saturated_cells_follow_the_gain() {
    let clock = std::time::Instant::now();
    let ghost = ghost(&GhostSettings::default()).unwrap();
    println!("{:.2} s", clock.elapsed().as_secs_f64());
    for run in &ghost.per_w_max {
        tell(run);
        // All cells of the place, the young ones and those behind surfaces too: most of what is left of the chair is young.
        let (left, m) = (&run.left, &run.saturated);
        assert!(left.cells > m.cells && left.halved > left.cells / 2);
        assert!(
            (0.25..1.3).contains(&(left.half_life_measured / m.half_life_predicted)),
            "{}",
            left.half_life_measured
        );
        // Arithmetic: they are told +tau, which is the truth.
        assert!(m.cells >= 8 && m.halved == m.cells);
        assert!((m.half_life_measured / m.half_life_predicted - 1.0).abs() < 0.01);
        let predicted = std::f64::consts::LN_2 / (1.0 / f64::from(run.w_max)).ln_1p();
        assert!((m.half_life_predicted / predicted - 1.0).abs() < 0.1);
        // The others do not obey it: less weight to overcome, or less weight in what they are told.
        assert!(run.unclamped.cells == 0 || run.unclamped.half_life_measured < 0.8 * m.half_life_predicted);
        assert!(run.tapered.half_life_measured > 1.2 * m.half_life_predicted);
        let n = run.static_noise.unwrap();
        // Lost beams make it noisier than the filter alone: see the test of a lidar that loses none.
        assert!(n.cells > 100 && (0.95..1.4).contains(&(n.measured / n.predicted)));
        // Three half-lives were followed.
        let last = m.curve.last().unwrap();
        assert!(last[0] >= 3.0 * predicted && last[1] < 0.14, "{last:?}");
    }
}

#[test]
fn a_static_map_is_as_noisy_as_the_filter_says() {
    let mut settings = GhostSettings::default();
    settings.lap.lidar.no_return_rate = 0.0;
    settings.lap.lidar.dropped_rate = 0.0;
    for n in static_noise(&settings, 12, 24).unwrap() {
        println!("{n:?}");
        assert!(n.cells > 100 && (n.measured / n.predicted - 1.0).abs() < 0.15);
    }
}

/// Exercise 4: the weight of an update that carves is not always 1, and the prediction, made of `W_max` alone, must hold
/// all the same.
#[test]
fn the_half_life_is_the_promised_one_whatever_the_weights() {
    for (weights, sweep, carve_weight) in [
        (WeightModel::InverseSquare, BeamSweep::CellCentre, 1.0),
        (WeightModel::CosIncidence, BeamSweep::CellCentre, 1.0),
        (WeightModel::InverseSquareCosIncidence, BeamSweep::CellCentre, 0.2),
        (WeightModel::Constant, BeamSweep::CellCentre, 0.2),
        (WeightModel::Constant, BeamSweep::March, 1.0),
    ] {
        let w_max = vec![4.0];
        let settings =
            GhostSettings { w_max, weights, sweep, carve_weight, noise_laps: 0, ..Default::default() };
        let run = ghost(&settings).unwrap().per_w_max.remove(0);
        tell(&run);
        let m = &run.saturated;
        assert!(m.cells > 30, "{weights:?}");
        let promised = std::f64::consts::LN_2 / 0.25f64.ln_1p();
        assert!((m.half_life_measured / promised - 1.0).abs() < 0.2, "{weights:?}: {}", m.half_life_measured);
        if weights == WeightModel::InverseSquare {
            // The looks are light ones, which at the clamp in units of weight took four times as long.
            assert!(m.weight < 0.5);
        }
    }
}

/// Cells deep in the chair see tapered weights only and need more than four laps to saturate.
#[test]
fn with_more_laps_more_cells_are_measured_and_they_obey_too() {
    let settings =
        GhostSettings { w_max: vec![64.0], max_laps_before: 12, noise_laps: 0, ..Default::default() };
    let run = ghost(&settings).unwrap().per_w_max.remove(0);
    tell(&run);
    assert!(run.saturated.cells > 40);
    assert!((run.saturated.half_life_measured / run.saturated.half_life_predicted - 1.0).abs() < 0.1);
}
