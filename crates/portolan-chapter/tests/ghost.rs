//! The chair moves, and maps forget it as fast as the filter says.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests are tests too")]

use portolan::map::BeamSweep;
use portolan::sweep::WeightModel;
use portolan_chapter::ghost::{GhostGroup, GhostRun, GhostSettings, ghost, static_noise};

/// Prints all but the curves.
fn tell(run: &GhostRun) {
    println!("W_max {}: {} laps before, {} after", run.w_max, run.laps_before, run.laps_after);
    for group in [&run.measured, &run.unclamped, &run.tapered] {
        println!("  {:?}", GhostGroup { curve: Vec::new(), ..group.clone() });
    }
    println!("  {:?}", run.static_noise);
}

#[test]
fn saturated_cells_forget_the_chair_with_the_predicted_half_life() {
    let clock = std::time::Instant::now();
    let ghost = ghost(&GhostSettings::default()).unwrap();
    println!("{:.2} s", clock.elapsed().as_secs_f64());
    for run in &ghost.per_w_max {
        tell(run);
        let m = &run.measured;
        assert!(m.cells >= 8 && m.halved == m.cells);
        assert!((m.half_life_measured / m.half_life_predicted - 1.0).abs() < 0.1);
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

/// Exercise 4: the weight of an update that carves is not always 1, and the prediction has to know it.
#[test]
fn with_weights_that_fall_with_the_range_the_received_weight_predicts() {
    for (weights, sweep) in [
        (WeightModel::InverseSquare, BeamSweep::CellCentre),
        (WeightModel::CosIncidence, BeamSweep::CellCentre),
        (WeightModel::Constant, BeamSweep::March),
    ] {
        let w_max = vec![4.0];
        let settings = GhostSettings { w_max, weights, sweep, noise_laps: 0, ..Default::default() };
        let run = ghost(&settings).unwrap().per_w_max.remove(0);
        tell(&run);
        let m = &run.measured;
        assert!(m.cells > 30);
        assert!((m.half_life_measured / m.half_life_of_gains - 1.0).abs() < 0.1);
        let with_unit_weight = std::f64::consts::LN_2 / 0.25f64.ln_1p();
        if weights == WeightModel::InverseSquare {
            assert!(m.weight < 0.5 && m.half_life_measured > 1.5 * with_unit_weight);
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
    assert!(run.measured.cells > 40);
    assert!((run.measured.half_life_measured / run.measured.half_life_predicted - 1.0).abs() < 0.1);
}
