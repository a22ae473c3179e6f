//! Exercise 4: the ghost of the chair, predicted and counted.

use crate::page::check;
use portolan::map::BeamSweep;
use portolan::sweep::WeightModel;
use portolan_chapter::experiment::shown_half_life;
use portolan_chapter::ghost::{GhostGroup, GhostRun, GhostSettings, ghost};

fn runs(settings: GhostSettings) -> Vec<GhostRun> {
    ghost(&GhostSettings { noise_laps: 0, ..settings }).unwrap().per_w_max
}

fn counted(group: &GhostGroup) -> String {
    format!("{} ({} cells)", shown_half_life(group.half_life_measured), group.cells)
}

/// What all cells of the place do, the predictions, which saturated cells follow, and the cells for which they fail.
#[test]
fn exercise_4_on_the_page() {
    let mut rows = Vec::new();
    for run in runs(GhostSettings::default()) {
        let predicted = std::f64::consts::LN_2 / (1.0 / f64::from(run.w_max)).ln_1p();
        let saturated = run.saturated.half_life_measured;
        assert!((saturated / predicted - 1.0).abs() < 0.1);
        rows.push((format!("counted at `W_max` {}, all cells left", run.w_max), counted(&run.left)));
        rows.push((format!("predicted at `W_max` {}", run.w_max), format!("{predicted:.2}")));
        rows.push((format!("counted at `W_max` {}, saturated cells", run.w_max), counted(&run.saturated)));
        rows.push((format!("counted at `W_max` {}, not yet saturated", run.w_max), counted(&run.unclamped)));
        rows.push((format!("counted at `W_max` {}, seen from behind too", run.w_max), counted(&run.tapered)));
    }
    for (name, weights, sweep) in [
        ("weights of 1 / z^2", WeightModel::InverseSquare, BeamSweep::CellCentre),
        ("weights of cos theta", WeightModel::CosIncidence, BeamSweep::CellCentre),
    ] {
        let run = runs(GhostSettings { w_max: vec![4.0], weights, sweep, ..Default::default() }).remove(0);
        let m = &run.saturated;
        rows.push((format!("{name}: median weight of a carving update"), format!("{:.2}", m.weight)));
        rows.push((format!("{name}: counted at `W_max` 4, saturated cells"), counted(m)));
    }
    check(4, &rows);
}
