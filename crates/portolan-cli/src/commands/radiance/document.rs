//! The numbers of a run: as a JSON file, as a JSON summary, as text.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;
use portolan::radiance::{
    Channels, Experiment, LineRay, Measurement, Optimizer, Outcome, Residuals, Term, Terms, transmittance,
};
use serde_json::{Value, json};

use super::{BEGUN, Explanation, MARGIN, Run, Seed, name, title};

/// Everything, fit for a file: the same bytes for the same seed, so without times.
pub(super) fn full(
    experiment: &Experiment,
    seed: Seed,
    runs: &[Run],
    explanation: Option<&Explanation>,
) -> Result<Vec<u8>> {
    let mut document = head(experiment, seed, explanation);
    let fits: Vec<Value> = runs
        .iter()
        .map(|run| {
            let mut fit = summary_of(experiment, run);
            let outcome = &run.outcome;
            fit["density"] = json!(outcome.fit.line().density);
            fit["reflectance"] = json!(outcome.fit.line().reflectance);
            fit["density_start"] = json!(outcome.start.density);
            fit["reach"] = json!(outcome.reach);
            fit["rays"] = rays(outcome);
            fit["curve"] = curve(outcome);
            fit
        })
        .collect();
    document["fits"] = json!(fits);
    let mut bytes = serde_json::to_vec_pretty(&document)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The results without the long lists, with times: for stdout.
pub(super) fn summary(
    experiment: &Experiment,
    seed: Seed,
    runs: &[Run],
    explanation: Option<&Explanation>,
    out: &Path,
    files: &[&str],
) -> Value {
    let mut document = head(experiment, seed, explanation);
    let fits: Vec<Value> = runs
        .iter()
        .map(|run| {
            let mut fit = summary_of(experiment, run);
            fit["seconds"] = json!(run.elapsed.as_secs_f64());
            fit["microseconds_per_step"] = json!(per_step(experiment, run));
            fit
        })
        .collect();
    document["fits"] = json!(fits);
    document["out"] = json!(out.display().to_string());
    document["files"] = json!(files);
    document
}

/// For people.
pub(super) fn text(
    experiment: &Experiment,
    seed: Seed,
    runs: &[Run],
    explanation: Option<&Explanation>,
) -> String {
    let mut out = String::new();
    let shows = seed.named.map_or(String::new(), |named| format!(" ({}): {}", named.name, named.shows));
    // Writing to a string cannot fail.
    let _ = writeln!(out, "seed {}{shows}", seed.value);
    let _ = writeln!(out, "noise: depth {} m\n", experiment.settings.noise.depth);
    let _ = writeln!(
        out,
        "{:30}  {:>9}  {:>9}  {:>12}  {:>9}  {:>8}",
        "measured along a ray", "training", "held out", "in empty space", "per step", "memory"
    );
    for run in runs {
        let last = run.outcome.last();
        let _ = writeln!(
            out,
            "{:30}  {:7.3} m  {:7.3} m  {:14.2}  {:6.1} µs  {:5.1} kB",
            title(run.channels),
            last.training.depth,
            last.held_out.depth,
            run.outcome.misplaced(&experiment.scene, MARGIN),
            per_step(experiment, run),
            run.outcome.fit.memory_bytes() as f64 / 1000.0,
        );
    }
    let _ = writeln!(
        out,
        "(training, held out: root mean square residual of depth; in empty space: optical depth"
    );
    let _ = writeln!(out, "that the fit has more than {MARGIN} m from any surface)");
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
        let _ = writeln!(out, "With it: {:.3} m on the held-out rays.", three.last().held_out.depth);
    }
    out
}

/// The two tables of terms, and what they say.
fn explain(experiment: &Experiment, runs: &[Run], explanation: &Explanation) -> String {
    let mut out = String::new();
    let bin = explanation.bin;
    let x = experiment.scene.uniform(0.0).centre(bin);
    let _ =
        writeln!(out, "\nThe most density in empty space under depth alone is in bin {bin}, at {x:.2} m.");
    if let Some(run) = runs.first() {
        let line = run.outcome.fit.line();
        let depth = |density: &[f64]| density[bin] * line.resolution;
        let _ = writeln!(
            out,
            "Optical depth there: {:.2} at the start, {:.2} after {}.",
            depth(&run.outcome.start.density),
            depth(&line.density),
            title(run.channels)
        );
    }
    let _ = writeln!(
        out,
        "Its gradient, ray by ray: dv/dsigma = length x passes x contrast, with contrast = value of the bin"
    );
    let _ = writeln!(
        out,
        "less mean value behind it (far plane included); pull = residual / noise^2 x dv/dsigma, > 0: less density."
    );
    let _ = writeln!(out, "\nwhere depth alone ended:");
    table(&mut out, &explanation.stuck);
    let _ = writeln!(out, "\n{BEGUN} steps later, with reflectance in the likelihood:");
    table(&mut out, &explanation.begun);
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

fn table(out: &mut String, terms: &[Terms]) {
    let _ = writeln!(
        out,
        "  {:>12} {:>7} | {:>8} {:>9} {:>8} | {:>8} {:>9} {:>8}",
        "ray from", "passes", "z: resid", "contrast", "pull", "c: resid", "contrast", "pull"
    );
    for t in terms {
        let way = if t.measurement.ray.ascending { '>' } else { '<' };
        let _ = writeln!(
            out,
            "  {:9.2} m {way} {:7.3} | {:6.1} s {:7.2} m {:8.2} | {:6.1} s {:9.2} {:8.2}",
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
    let _ = writeln!(out, "  {:>20} | {:>8} {:>9} {z:8.2} | {:>8} {:>9} {c:8.2}", "sum", "", "", "", "");
}

fn head(experiment: &Experiment, seed: Seed, explanation: Option<&Explanation>) -> Value {
    let Experiment { scene, settings, steps } = experiment;
    let optimizer = match settings.optimizer {
        Optimizer::GradientDescent { rate } => json!({ "kind": "gradient-descent", "rate": rate }),
        Optimizer::Adam { rate, beta1, beta2, epsilon } => {
            json!({ "kind": "adam", "rate": rate, "beta1": beta1, "beta2": beta2, "epsilon": epsilon })
        }
    };
    let bodies: Vec<Value> = scene
        .bodies
        .iter()
        .map(|b| json!({ "low": b.low, "high": b.high, "low_face": b.low_face, "high_face": b.high_face }))
        .collect();
    json!({
        "command": "radiance",
        "seed": seed.value,
        "seed_name": seed.named.map(|named| named.name),
        "shows": seed.named.map(|named| named.shows),
        "steps": steps,
        "optimizer": optimizer,
        "noise": {
            "depth": settings.noise.depth,
            "reflectance": settings.noise.reflectance,
            "second_moment": settings.noise.second_moment,
        },
        "prior": {
            "density_mean": settings.prior.density_mean,
            "density_spread": settings.prior.density_spread,
            "reflectance_spread": settings.prior.reflectance_spread,
        },
        "far": { "depth": settings.far.depth, "reflectance": settings.far.reflectance },
        "scene": {
            "bins": scene.bins,
            "resolution": scene.length / scene.bins as f64,
            "bodies": bodies,
            "training": scene.training.iter().map(ray).collect::<Vec<_>>(),
            "held_out": scene.held_out.iter().map(ray).collect::<Vec<_>>(),
        },
        "terms": explanation.map(|e| json!({
            "bin": e.bin,
            "depth_alone": e.stuck.iter().map(terms).collect::<Vec<_>>(),
            "steps_with_reflectance": BEGUN,
            "with_reflectance": e.begun.iter().map(terms).collect::<Vec<_>>(),
        })),
    })
}

fn summary_of(experiment: &Experiment, run: &Run) -> Value {
    let last = run.outcome.last();
    json!({
        "channels": name(run.channels),
        "objective": last.objective,
        "training": residuals(&last.training),
        "held_out": residuals(&last.held_out),
        "optical_depth_in_empty_space": run.outcome.misplaced(&experiment.scene, MARGIN),
        "memory_bytes": run.outcome.fit.memory_bytes(),
        "samples_per_step": run.outcome.fit.samples_per_step(),
    })
}

fn per_step(experiment: &Experiment, run: &Run) -> f64 {
    run.elapsed.as_secs_f64() * 1e6 / experiment.steps.max(1) as f64
}

fn residuals(r: &Residuals) -> Value {
    json!({ "depth": r.depth, "reflectance": r.reflectance, "second_moment": r.second_moment })
}

fn ray(ray: &LineRay) -> Value {
    json!({ "origin": ray.origin, "direction": if ray.ascending { 1 } else { -1 } })
}

fn terms(t: &Terms) -> Value {
    let of = |term: &Term| json!({ "residual": term.residual, "contrast": term.contrast, "slope": term.slope, "pull": term.pull });
    json!({
        "ray": ray(&t.measurement.ray),
        "passes": t.passes,
        "depth": of(&t.depth),
        "reflectance": of(&t.reflectance),
    })
}

fn rays(outcome: &Outcome) -> Value {
    let all = outcome.training.iter().map(|m| (m, false)).chain(outcome.held_out.iter().map(|m| (m, true)));
    let entry = |(m, held_out): (&Measurement, bool)| {
        let rendered = outcome.fit.render(&m.ray);
        json!({
            "ray": ray(&m.ray),
            "held_out": held_out,
            "measured": {
                "depth": m.depth, "reflectance": m.reflectance, "second_moment": m.second_moment,
            },
            "rendered": {
                "depth": rendered.depth, "reflectance": rendered.color[0], "second_moment": rendered.color[1],
            },
            "transmittance": transmittance(outcome.fit.line(), &m.ray),
        })
    };
    json!(all.map(entry).collect::<Vec<_>>())
}

/// The curve at about two hundred steps, evenly spaced on a logarithmic axis, first and last included.
fn curve(outcome: &Outcome) -> Value {
    let points = thinned(outcome.curve.len()).into_iter().map(|step| {
        let p = &outcome.curve[step];
        json!({
            "step": step,
            "objective": p.objective,
            "training": residuals(&p.training),
            "held_out": residuals(&p.held_out),
        })
    });
    json!(points.collect::<Vec<_>>())
}

/// Indices into a list, dense at its front.
pub(super) fn thinned(count: usize) -> Vec<usize> {
    let last = count.saturating_sub(1);
    let mut out: Vec<usize> = vec![0];
    let mut next = 1.0_f64;
    while (next as usize) < last {
        if out.last() != Some(&(next as usize)) {
            out.push(next as usize);
        }
        next *= 1.05;
    }
    if last > 0 {
        out.push(last);
    }
    out
}
