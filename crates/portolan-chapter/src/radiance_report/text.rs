//! The numbers of a run for people: a table of the fits, and why the worst bin stays or goes.

use crate::radiance::{Channels, Experiment, Terms};

use super::document::per_step;
use super::{BEGUN, Comparison, Explanation, MARGIN, Run, title};

/// Table, terms and what they say.
pub(super) fn report(comparison: &Comparison) -> String {
    let Comparison { experiment, seed, runs, explanation } = comparison;
    let shows = seed.named.map_or(String::new(), |named| format!(" ({}): {}", named.name, named.shows));
    let mut out = format!(
        "seed {}{shows}\nnoise: depth {} m\n\n{:30}   training   held out  in empty space   per step    memory\n",
        seed.value, experiment.settings.noise.depth, "measured along a ray"
    );
    for run in runs {
        let last = run.outcome.last();
        out += &format!(
            "{:30}  {:7.3} m  {:7.3} m  {:14.2}  {:6.1} µs  {:5.1} kB\n",
            title(run.channels),
            last.training.depth,
            last.held_out.depth,
            run.outcome.misplaced(&experiment.scene, MARGIN),
            per_step(experiment, run),
            run.outcome.fit.memory_bytes() as f64 / 1000.0,
        );
    }
    out += &format!(
        "(training, held out: root mean square residual of depth; in empty space: optical depth\n\
         that the fit has more than {MARGIN} m from any surface)\n"
    );
    if let Some(explanation) = explanation {
        out += &explain(experiment, runs, explanation);
    }
    out += &third(experiment, runs);
    out
}

/// What a third channel has to measure, where two fit all they are shown and are still wrong.
fn third(experiment: &Experiment, runs: &[Run]) -> String {
    let noise = &experiment.settings.noise;
    let find = |channels| runs.iter().find(|run| run.channels == channels).map(|run| &run.outcome);
    let Some(two) = find(Channels::DepthReflectance) else { return String::new() };
    let last = two.last();
    let fits = last.training.depth < 1.5 * noise.depth && last.training.reflectance < 1.5 * noise.reflectance;
    let worst =
        two.worst_bin(&experiment.scene, MARGIN).filter(|_| fits && last.held_out.depth > 5.0 * noise.depth);
    let Some(bin) = worst else { return String::new() };
    let line = two.fit.line();
    let [depth, reflectance, spread] = two.fit.explain(bin).iter().fold([0.0_f64; 3], |largest, t| {
        let residuals = [t.depth.residual, t.reflectance.residual, t.second_moment.residual];
        [0, 1, 2].map(|c| largest[c].max(residuals[c].abs()))
    });
    let mut out = format!(
        "\nTwo channels are at their noise on the training rays ({:.3} m, {:.3}) and {:.3} m off on the held-out ones. The most\n\
         density in empty space is in bin {bin}, at {:.2} m: optical depth {:.2}, reflectance {:.2}. With what is behind it, it has\n\
         the mean distance and the mean colour that were measured; over its rays the largest residuals are {depth:.1} s in\n\
         depth, {reflectance:.1} s in reflectance, and {spread:.1} s in the second moment, which is not used. A third channel has to\n\
         measure that: how far the return is spread along the ray. A wall has z^2, a balance of near and far has more.\n",
        last.training.depth,
        last.training.reflectance,
        last.held_out.depth,
        line.centre(bin),
        line.density[bin] * line.resolution,
        line.reflectance[bin],
    );
    if let Some(three) = find(Channels::DepthReflectanceSpread) {
        out += &format!("With it: {:.3} m on the held-out rays.\n", three.last().held_out.depth);
    }
    out
}

/// The two tables of terms, and what they say.
fn explain(experiment: &Experiment, runs: &[Run], explanation: &Explanation) -> String {
    let bin = explanation.bin;
    let x = experiment.scene.uniform(0.0).centre(bin);
    let mut out =
        format!("\nThe most density in empty space under depth alone is in bin {bin}, at {x:.2} m.\n");
    if let Some(run) = runs.first() {
        let line = run.outcome.fit.line();
        let depth = |density: &[f64]| density[bin] * line.resolution;
        out += &format!(
            "Optical depth there: {:.2} at the start, {:.2} after {}.\n",
            depth(&run.outcome.start.density),
            depth(&line.density),
            title(run.channels)
        );
    }
    out += &format!(
        "Its gradient, ray by ray: dv/dsigma = length x passes x contrast, with contrast = value of the bin\n\
         less mean value behind it (far plane included); pull = residual / noise^2 x dv/dsigma, > 0: less density.\n\
         \nwhere depth alone ended:\n{}\n{BEGUN} steps later, with reflectance in the likelihood:\n{}",
        table(&explanation.stuck),
        table(&explanation.begun)
    );
    let stuck = &explanation.stuck;
    let (net, gross) = stuck.iter().fold((0.0, 0.0), |s, t| (s.0 + t.depth.pull, s.1 + t.depth.pull.abs()));
    if stuck.iter().all(|t| t.passes < 0.01) {
        out += "\nNothing passes the bin. That factor is common to all channels of a ray: none of them repairs it.\n\
                What would: evidence of free space. That a return came from beyond says that the optical depth in front of it is\n\
                nil, and the derivative of an optical depth by sigma is the length alone, whatever passes.\n";
    } else if net.abs() < 0.1 * gross {
        out += "\nDepth has leverage (its contrast is metres) and nothing left to pull with: the bin in front and the far plane\n\
                behind, T_n t_far, average to the measured depth, and what residuals remain cancel between rays.\n";
        if explanation.begun.iter().map(|t| t.reflectance.pull).sum::<f64>() > 1.0 {
            out += "In the same bracket reflectance puts the far plane's colour, and one colour for both sides of the bin: that\n\
                    sum does not balance, and pulls.\n";
        }
    }
    out
}

fn table(terms: &[Terms]) -> String {
    let mut out =
        "      ray from  passes | z: resid  contrast     pull | c: resid  contrast     pull\n".to_owned();
    for t in terms {
        let way = if t.measurement.ray.ascending { '>' } else { '<' };
        out += &format!(
            "  {:9.2} m {way} {:7.3} | {:6.1} s {:7.2} m {:8.2} | {:6.1} s {:9.2} {:8.2}\n",
            t.measurement.ray.origin,
            t.passes,
            t.depth.residual,
            t.depth.contrast,
            t.depth.pull,
            t.reflectance.residual,
            t.reflectance.contrast,
            t.reflectance.pull,
        );
    }
    let sum = |pull: fn(&Terms) -> f64| terms.iter().map(pull).sum::<f64>();
    let (z, c) = (sum(|t| t.depth.pull), sum(|t| t.reflectance.pull));
    out + &format!("  {:>20} | {:18} {z:8.2} | {:18} {c:8.2}\n", "sum", "", "")
}
