//! What the page gets: the corridor once, the fit again and again.

use portolan_chapter::radiance::{Fit, Measurement, NAMED_SEEDS, Scene, Terms, opacity, transmittance};
use serde_json::{Value, json};

use super::run::Run;
use super::selection::Selection;
use crate::engine::{Refusal, Reply};

/// Surfaces nearer than this do not count as empty space (meters).
const MARGIN: f64 = 0.3;
/// Densities that the axis of the picture has marks at (1/m).
const MARKS: [f64; 7] = [0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];

/// What stays while a run lasts.
pub(super) fn scene(scene: &Scene, run: &mut Run) -> Value {
    // The page has drawn nothing of the run yet.
    run.curve.resend();
    let truth = scene.truth();
    let settings = run.fit.settings();
    let sent = |measured: &[Measurement], held_out: bool| -> Vec<Value> {
        let ray = |m: &Measurement| {
            json!({
                "origin": m.ray.origin, "ascending": m.ray.ascending, "held_out": held_out,
                "depth": m.depth, "at": place(m, m.depth), "reflectance": m.reflectance,
            })
        };
        measured.iter().map(ray).collect()
    };
    let rays = [sent(&run.training, false), sent(&run.held_out, true)].concat();
    json!({
        "length": scene.length,
        "bins": scene.bins,
        "resolution": truth.resolution,
        "bodies": scene.bodies.iter().map(|b| json!([b.low, b.high])).collect::<Vec<_>>(),
        "truth": { "opacity": opacities(&truth.density, truth.resolution), "reflectance": truth.reflectance },
        "marks": MARKS.map(|density| [density, opacity(density * truth.resolution).0]),
        "rays": rays,
        "noise": settings.noise,
        "far": settings.far.depth,
        "margin": MARGIN,
        "named": NAMED_SEEDS,
    })
}

/// The fit as it stands, after so many steps in so many seconds.
pub(super) fn frame(
    scene: &Scene,
    run: &mut Run,
    look: Selection,
    (made, seconds): (usize, f64),
    all: Option<Value>,
) -> Result<Reply, Refusal> {
    let progress = run.progress();
    let gradient = run.fit.gradient().to_vec();
    let (known, curve) = run.curve.news();
    let line = run.fit.line();
    let measured: Vec<Measurement> = run.training.iter().chain(&run.held_out).copied().collect();
    let body = json!({
        "all": all,
        "seed": run.seed,
        "phases": run.phases,
        "step": run.steps(),
        "made": made,
        "seconds": seconds,
        "objective": progress.objective,
        "training": progress.training,
        "held_out": progress.held_out,
        "misplaced": scene.misplaced(line, MARGIN),
        "worst": scene.worst_bin(line, MARGIN),
        "rays": measured.iter().map(|m| rendered(&run.fit, m)).collect::<Vec<_>>(),
        "look": { "ray": look.ray, "bin": look.bin },
        "bin": look.bin.map(|bin| explained(run, &gradient, bin)),
        "curve_from": known,
        "bytes": run.memory_bytes(),
    });
    let bins = line.bins();
    let reply = Reply::of(body)?
        .with("density", floats(&line.density))
        .with("opacity", floats(&opacities(&line.density, line.resolution)))
        .with("reflectance", floats(&line.reflectance))
        .with("gradient", floats(&gradient[..bins]))
        .with("curve", curve);
    Ok(match look.ray.and_then(|ray| measured.get(ray)) {
        Some(m) => {
            let light = light(&run.fit, m);
            reply.with("light_at", light.at).with("light", light.share).with("ends", light.ends)
        }
        None => reply,
    })
}

/// Where on the line something at a distance lies (meters).
fn place(m: &Measurement, depth: f64) -> f64 {
    if m.ray.ascending { m.ray.origin + depth } else { m.ray.origin - depth }
}

/// What a ray renders, and rendered less measured.
fn rendered(fit: &Fit, m: &Measurement) -> Value {
    let r = fit.render(&m.ray);
    json!({
        "depth": r.depth,
        "at": place(m, r.depth),
        "residual": r.depth - m.depth,
        "reflectance": r.color[0],
        "through": r.transmittance,
    })
}

/// A ray's light on its way.
struct Light {
    /// Where on the line: the beginning of the ray, and the far border of every bin that it crosses (meters).
    at: Vec<f32>,
    /// The share of the light that comes so far.
    share: Vec<f32>,
    /// The share that ends in each bin of the line.
    ends: Vec<f32>,
}

fn light(fit: &Fit, m: &Measurement) -> Light {
    let line = fit.line();
    let crossing = line.crossing(&m.ray);
    let share = transmittance(line, &m.ray);
    let half = 0.5 * line.resolution;
    let border = |i: usize| {
        let center = line.centre(crossing.bin(i));
        if crossing.ascending { center + half } else { center - half }
    };
    let mut ends = vec![0.0; line.bins()];
    for i in 0..crossing.count {
        ends[crossing.bin(i)] = share[i] - share[i + 1];
    }
    let at: Vec<f64> = std::iter::once(m.ray.origin).chain((0..crossing.count).map(border)).collect();
    Light { at: floats(&at), share: floats(&share), ends: floats(&ends) }
}

/// The gradient of a bin's density, term by term.
fn explained(run: &Run, gradient: &[f64], bin: usize) -> Value {
    let (fit, line) = (&run.fit, run.fit.line());
    let terms = fit.explain(bin);
    let sum = fit.add_up(bin, &terms);
    let [low, high] = [bin, bin + 1].map(|i| line.origin + i as f64 * line.resolution);
    let ray = |t: &Terms| run.training.iter().position(|m| m.ray == t.measurement.ray);
    let row = |t: &Terms| {
        json!({
            "ray": ray(t), "passes": t.passes, "pull": t.pull(),
            "depth": t.depth, "reflectance": t.reflectance, "second_moment": t.second_moment,
        })
    };
    let optical_depth = line.density[bin] * line.resolution;
    json!({
        "bin": bin, "low": low, "high": high,
        "density": line.density[bin], "optical_depth": optical_depth, "opacity": opacity(optical_depth).0,
        "reflectance": line.reflectance[bin],
        "terms": terms.iter().map(row).collect::<Vec<_>>(),
        "pulls": sum.pulls, "chain": sum.chain, "prior": sum.prior, "sum": sum.gradient(),
        "gradient": gradient[bin],
        "by_reflectance": gradient[line.bins() + bin],
        "hint": hint(&terms, sum.chain * line.resolution),
    })
}

/// What is worth seeing in the terms of a bin; `free`: how much of a change of `θ` is one of `σδ`.
fn hint(terms: &[Terms], free: f64) -> Option<&'static str> {
    let pulls = || terms.iter().flat_map(|t| [t.depth.pull, t.reflectance.pull, t.second_moment.pull]);
    let (net, gross) = (pulls().sum::<f64>().abs(), pulls().map(f64::abs).sum::<f64>());
    if terms.is_empty() {
        Some("No training ray crosses this bin: only the prior speaks.")
    } else if terms.iter().all(|t| t.passes < 0.01) {
        Some(
            "Next to no light passes this bin. That factor is common to all channels of a ray: none of them can \
             tell what is behind.",
        )
    } else if net < 0.1 * gross {
        Some(
            "The pulls on its density cancel: with what is behind it, this bin has the mean that was measured along \
             its rays.",
        )
    } else if free < 0.02 {
        Some("Next to no density is here: whatever pulls, θ must move far before σ does.")
    } else {
        None
    }
}

fn opacities(density: &[f64], resolution: f64) -> Vec<f64> {
    density.iter().map(|d| opacity(d * resolution).0).collect()
}

fn floats(values: &[f64]) -> Vec<f32> {
    values.iter().map(|v| *v as f32).collect()
}
