//! A trajectory optimiser on the gradient of the distance field: covariant gradient descent (Zucker et al. 2013, CHOMP)
//! on smoothness and a hinge of the clearance, begun with the shortest way that A* finds, which scrapes along corners.
//!
//! ```text
//! cargo run --release -p portolan-cli --example optimise -- [LOG] [--out optimise.png]
//! ```
//!
//! Value and gradient come from one interpolant, so that the descent does not work against itself; whether the result
//! is free is then not for the optimiser to say: it is certified.

mod planning;

use std::path::PathBuf;

use anyhow::Context;
use clap::Parser;
use planning::{Drawn, Place, length, picture, resampled};
use portolan::geom::vector;
use portolan_draw::color;

/// A trajectory before and after optimisation, as a picture.
#[derive(Parser)]
struct Args {
    /// A CARMEN log; default: a lap through the simulator's apartment
    log: Option<PathBuf>,
    #[arg(long, default_value = "optimise.png")]
    out: PathBuf,
    /// Radius of the robot (meters)
    #[arg(long, default_value_t = 0.18)]
    radius: f64,
    /// Clearance beyond the radius that costs nothing (meters)
    #[arg(long, default_value_t = 0.25)]
    margin: f64,
    #[arg(long, default_value_t = 400)]
    steps: usize,
}

/// Points of a trajectory.
const POINTS: usize = 160;

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let place = Place::of(args.log.as_deref())?;
    let free = |p: &&[f64; 2]| place.clearance(**p).is_some_and(|[lower, _]| lower > args.radius + 0.1);
    // From the lowest left place where the robot was to the highest right one.
    let across = |a: &&[f64; 2], b: &&[f64; 2]| (a[0] + a[1]).total_cmp(&(b[0] + b[1]));
    let start = *place.way.iter().filter(free).min_by(across).context("the robot fits nowhere")?;
    let goal = *place.way.iter().filter(free).max_by(across).context("the robot fits nowhere")?;
    let shortest =
        place.search(start, goal, args.radius, args.radius + 1e-3, 1.0).context("there is no way")?;

    let before = resampled(&shortest, POINTS);
    let mut after = before.clone();
    for _ in 0..args.steps {
        descend(&place, &mut after, args.radius + args.margin);
    }

    let verdict = match place.certified(&after, args.radius) {
        Ok(least) => format!("certified, {:.0} cm at every point", 100.0 * least),
        Err(where_not) => where_not.to_string(),
    };
    let words = format!(
        "{}: {} steps of covariant gradient descent. Length {:.2} m before, {:.2} m after; roughness {:.2} before, {:.2} \
         after; less than {:.0} cm of clearance on {:.0} % of the way before, {:.0} % after. Afterwards: {verdict}.",
        place.name,
        args.steps,
        length(&before),
        length(&after),
        roughness(&before),
        roughness(&after),
        100.0 * (args.radius + args.margin),
        100.0 * narrow(&place, &before, args.radius + args.margin),
        100.0 * narrow(&place, &after, args.radius + args.margin),
    );
    let lines = [
        Drawn { name: "before: the shortest way", line: &before, color: color::MEASUREMENT, robot: None },
        Drawn { name: "after", line: &after, color: color::NEGATIVE, robot: Some(args.radius) },
    ];
    let png =
        picture(&place, "A trajectory pushed off the walls by the gradient", &words, &lines, args.radius);
    std::fs::write(&args.out, png).with_context(|| args.out.display().to_string())?;
    print(&format!("{words}\n{}\n", args.out.display()))
}

/// One step: the gradient of hinge and smoothness, made smooth itself by the inverse of the metric of the trajectory.
fn descend(place: &Place, line: &mut [[f64; 2]], wanted: f64) {
    const RATE: f64 = 0.02;
    const OBSTACLES: f64 = 100.0;
    let n = line.len();
    let mut gradient = vec![[0.0; 2]; n];
    for i in 1..n - 1 {
        for k in 0..2 {
            gradient[i][k] = 2.0 * line[i][k] - line[i - 1][k] - line[i + 1][k];
        }
        // Half of the square of what is missing; unknown space has no gradient and is left to the certificate.
        let Some((d, slope)) = place.field.distance_and_gradient(line[i]).known() else { continue };
        let missing = (wanted - d).max(0.0);
        // Only what is across the way: along it points would crowd where there is room.
        let tangent = vector::unit(vector::sub(line[i + 1], line[i - 1])).unwrap_or([0.0; 2]);
        let along = vector::dot(slope, tangent);
        let weight = OBSTACLES / n as f64 * missing;
        for k in 0..2 {
            gradient[i][k] -= weight * (slope[k] - along * tangent[k]);
        }
    }
    // The metric: second differences plus a little of the identity, tridiagonal (Thomas's algorithm).
    let (diagonal, off) = (2.0 + 0.02, -1.0);
    let mut c = vec![0.0; n];
    for i in 1..n - 1 {
        let m = diagonal - off * c[i - 1];
        c[i] = off / m;
        for k in 0..2 {
            gradient[i][k] = (gradient[i][k] - off * gradient[i - 1][k]) / m;
        }
    }
    for i in (1..n - 1).rev() {
        for k in 0..2 {
            gradient[i][k] -= c[i] * gradient[i + 1][k];
            line[i][k] -= RATE * gradient[i][k];
        }
    }
}

/// Sum of the angles between legs (radians) for a meter.
fn roughness(line: &[[f64; 2]]) -> f64 {
    let turn = |w: &[[f64; 2]]| {
        let [a, b] = [vector::sub(w[1], w[0]), vector::sub(w[2], w[1])];
        (a[0] * b[1] - a[1] * b[0]).atan2(vector::dot(a, b)).abs()
    };
    line.windows(3).map(turn).sum::<f64>() / length(line)
}

/// Share of the way with less than this certified (meters).
fn narrow(place: &Place, line: &[[f64; 2]], wanted: f64) -> f64 {
    let profile = place.profile(line);
    profile.iter().filter(|[_, lower]| *lower < wanted).count() as f64 / profile.len() as f64
}

fn print(text: &str) -> anyhow::Result<()> {
    Ok(std::io::Write::write_all(&mut std::io::stdout(), text.as_bytes())?)
}
