//! The numbers of a run as JSON: everything for a file, a summary for stdout.

use std::path::Path;

use crate::radiance::{
    Experiment, LineRay, Measurement, Optimizer, Outcome, Residuals, Term, Terms, transmittance,
};
use serde_json::{Value, json};

use super::{BEGUN, Comparison, MARGIN, Run, name};

/// Everything, fit for a file: the same bytes for the same seed, so without times.
pub(super) fn full(comparison: &Comparison) -> serde_json::Result<Vec<u8>> {
    let Comparison { experiment, runs, .. } = comparison;
    let mut document = head(comparison);
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
pub(super) fn summary(comparison: &Comparison, out: &Path, files: &[&str]) -> Value {
    let Comparison { experiment, runs, .. } = comparison;
    let mut document = head(comparison);
    let fits: Vec<Value> = runs
        .iter()
        .map(|run| {
            let mut fit = summary_of(experiment, run);
            fit["seconds"] = json!(run.seconds);
            fit["microseconds_per_step"] = json!(per_step(experiment, run));
            fit
        })
        .collect();
    document["fits"] = json!(fits);
    document["out"] = json!(out.display().to_string());
    document["files"] = json!(files);
    document
}

fn head(comparison: &Comparison) -> Value {
    let Comparison { experiment: Experiment { scene, settings, steps }, seed, explanation, .. } = comparison;
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
        "terms": explanation.as_ref().map(|e| json!({
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

pub(super) fn per_step(experiment: &Experiment, run: &Run) -> f64 {
    run.seconds * 1e6 / experiment.steps.max(1) as f64
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
