//! The numbers of a run as JSON: everything for a file, a summary for stdout.

use std::path::Path;

use crate::radiance::{Experiment, LineRay, Measurement, Outcome, Terms, transmittance};
use serde_json::{Value, json};

use super::{BEGUN, Comparison, MARGIN, Run, name};

/// Everything, fit for a file: the same bytes for the same seed, so without times.
pub(super) fn full(comparison: &Comparison) -> serde_json::Result<Vec<u8>> {
    let document = document(comparison, |fit, Run { outcome, .. }| {
        fit["density"] = json!(outcome.fit.line().density);
        fit["reflectance"] = json!(outcome.fit.line().reflectance);
        fit["density_start"] = json!(outcome.start.density);
        fit["reach"] = json!(outcome.reach);
        fit["rays"] = rays(outcome);
        fit["curve"] = curve(outcome);
    });
    let mut bytes = serde_json::to_vec_pretty(&document)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The results without the long lists, with times: for stdout.
pub(super) fn summary(comparison: &Comparison, out: &Path, files: &[&str]) -> Value {
    let mut document = document(comparison, |fit, run| {
        fit["seconds"] = json!(run.seconds);
        fit["microseconds_per_step"] = json!(per_step(&comparison.experiment, run));
    });
    document["out"] = json!(out.display().to_string());
    document["files"] = json!(files);
    document
}

/// What both have, and of each fit what `more` adds.
fn document(comparison: &Comparison, more: impl Fn(&mut Value, &Run)) -> Value {
    let Comparison { experiment, seed, explanation, runs } = comparison;
    let Experiment { scene, settings, steps } = experiment;
    let fit = |run: &Run| {
        let mut fit = summary_of(experiment, run);
        more(&mut fit, run);
        fit
    };
    json!({
        "command": "radiance",
        "seed": seed.value,
        "seed_name": seed.named.map(|named| named.name),
        "shows": seed.named.map(|named| named.shows),
        "steps": steps,
        "optimizer": settings.optimizer,
        "noise": settings.noise,
        "prior": settings.prior,
        "far": settings.far,
        "scene": {
            "bins": scene.bins,
            "resolution": scene.length / scene.bins as f64,
            "bodies": scene.bodies,
            "training": scene.training.iter().map(ray).collect::<Vec<_>>(),
            "held_out": scene.held_out.iter().map(ray).collect::<Vec<_>>(),
        },
        "terms": explanation.as_ref().map(|e| json!({
            "bin": e.bin,
            "depth_alone": e.stuck.iter().map(terms).collect::<Vec<_>>(),
            "steps_with_reflectance": BEGUN,
            "with_reflectance": e.begun.iter().map(terms).collect::<Vec<_>>(),
        })),
        "fits": runs.iter().map(fit).collect::<Vec<_>>(),
    })
}

fn summary_of(experiment: &Experiment, run: &Run) -> Value {
    let last = run.outcome.last();
    json!({
        "channels": name(run.channels),
        "objective": last.objective,
        "training": last.training,
        "held_out": last.held_out,
        "optical_depth_in_empty_space": run.outcome.misplaced(&experiment.scene, MARGIN),
        "memory_bytes": run.outcome.fit.memory_bytes(),
        "samples_per_step": run.outcome.fit.samples_per_step(),
    })
}

pub(super) fn per_step(experiment: &Experiment, run: &Run) -> f64 {
    run.seconds * 1e6 / experiment.steps.max(1) as f64
}

fn ray(ray: &LineRay) -> Value {
    json!({ "origin": ray.origin, "direction": if ray.ascending { 1 } else { -1 } })
}

fn terms(t: &Terms) -> Value {
    let ray = ray(&t.measurement.ray);
    json!({ "ray": ray, "passes": t.passes, "depth": t.depth, "reflectance": t.reflectance })
}

fn rays(outcome: &Outcome) -> Value {
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
    json!(outcome.rays().map(entry).collect::<Vec<_>>())
}

/// The curve at about two hundred steps, evenly spaced on a logarithmic axis, first and last included.
fn curve(outcome: &Outcome) -> Value {
    let points = thinned(outcome.curve.len()).into_iter().map(|step| {
        let mut point = json!(outcome.curve[step]);
        point["step"] = json!(step);
        point
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
