//! Exercise 7: reflectance beside depth, on named seeds. The behaviours are tested in `tests/all/radiance.rs`.

use crate::page::check;
use portolan_chapter::radiance::{Channels, Experiment, NamedSeed, Outcome, PARKED, TWO_NOT_ENOUGH, Terms};

/// What counts as near a surface when matter in empty space is looked for (meters).
const MARGIN: f64 = 0.3;
/// Steps into the second channel after which its terms are read.
const BEGUN: usize = 500;

fn run(seed: NamedSeed, channels: Channels) -> Outcome {
    Experiment::default().run(seed.seed, channels).unwrap()
}

fn optical_depth(outcome: &Outcome, bin: usize) -> f64 {
    let line = outcome.fit.line();
    line.density[bin] * line.resolution
}

#[test]
fn exercise_7_on_the_page() {
    let experiment = Experiment::default();
    let (stuck, free) = (run(PARKED, Channels::Depth), run(PARKED, Channels::DepthReflectance));
    let bin = stuck.worst_bin(&experiment.scene, MARGIN).unwrap();
    let terms = stuck.fit.explain(bin);
    let sum = |terms: &[Terms], of: fn(&Terms) -> f64| terms.iter().map(of).sum::<f64>();
    let gross = sum(&terms, |t| t.depth.pull.abs());
    let steepest = terms.iter().map(|t| t.depth.contrast).fold(f64::INFINITY, f64::min);
    let begun = Experiment { steps: BEGUN, ..experiment.clone() };
    let begun = begun.run_from(stuck.fit.line().clone(), PARKED.seed, Channels::DepthReflectance).unwrap();
    let begun = begun.fit.explain(bin);

    let two = run(TWO_NOT_ENOUGH, Channels::DepthReflectance);
    let three = run(TWO_NOT_ENOUGH, Channels::DepthReflectanceSpread);
    let parked = two.worst_bin(&experiment.scene, MARGIN).unwrap();
    let worst = |of: fn(&Terms) -> f64| {
        let seen = two.fit.explain(parked).into_iter().filter(|t| t.passes > 0.5);
        format!("{:.1} s", seen.map(|t| of(&t).abs()).fold(0.0, f64::max))
    };
    let held_out = |outcome: &Outcome| format!("{:.3} m", outcome.last().held_out.depth);
    let training = |outcome: &Outcome| format!("{:.3} m", outcome.last().training.depth);
    let rows = [
        ("seed on which depth alone parks density", PARKED.seed.to_string()),
        ("depth alone: residual of the training rays", training(&stuck)),
        ("depth alone: residual of the held-out rays", held_out(&stuck)),
        ("optical depth of the parked bin under depth alone", format!("{:.2}", optical_depth(&stuck, bin))),
        ("depth and reflectance: residual of the held-out rays", held_out(&free)),
        ("optical depth of the same bin then", format!("{:.3}", optical_depth(&free, bin))),
        ("the parked bin's largest contrast in depth", format!("{steepest:.2} m")),
        (
            "sum of its pulls in depth, over the sum of their sizes",
            format!("{:.4}", (sum(&terms, |t| t.depth.pull) / gross).abs()),
        ),
        (
            "sum of its pulls in reflectance, 500 steps into the second channel",
            format!("{:.1}", sum(&begun, |t| t.reflectance.pull)),
        ),
        ("seed on which two channels are not enough", TWO_NOT_ENOUGH.seed.to_string()),
        ("two channels: residual of the training rays", training(&two)),
        ("two channels: residual of the held-out rays", held_out(&two)),
        (
            "largest residual through the parked bin in depth (standard deviations)",
            worst(|t| t.depth.residual),
        ),
        ("the same in reflectance", worst(|t| t.reflectance.residual)),
        ("the same in the second moment of the return", worst(|t| t.second_moment.residual)),
        ("with the second moment as third channel: residual of the held-out rays", held_out(&three)),
    ];
    check(7, &rows);
}
