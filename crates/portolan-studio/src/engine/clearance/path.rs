//! Where a path is certified, and what the field knows along it.

use portolan::Answer;
use portolan::field::{Clearance, Esdf, UnknownSpace};
use portolan::plan::{
    Cause, Curve, Demand, PathCheck, Waypoints, check_path, clearance_profile, path_violations,
};
use serde_json::{Value, json};

use crate::engine::fusion::frame::Lines;
use crate::engine::{Refusal, Reply};

/// Points of a path, at most.
const MOST_POINTS: usize = 1000;
/// Samples of a profile, about.
const SAMPLES: f64 = 1500.0;
/// Steps of a check, about: the longer a path, the coarser.
const STEPS: f64 = 20_000.0;
/// Parts of a path with verdicts of their own, at most; what comes after them is undecided.
const MOST_PIECES: usize = 400;

/// A part of a path, from and to an arc length (meters).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) from: f64,
    pub(super) to: f64,
    /// Why it is not certified; none: it is.
    pub(super) cause: Option<Cause>,
}

/// All about a path: the check of the library, the parts beyond its first refusal, the profile.
pub(super) fn check(
    field: &Esdf<2>,
    points: Vec<[f64; 2]>,
    clearance: f64,
    unknown: UnknownSpace,
) -> Result<Reply, Refusal> {
    if points.len() > MOST_POINTS {
        return Err(Refusal::new(format!("a path has {MOST_POINTS} points at most, not {}", points.len())));
    }
    if !(0.0..=100.0).contains(&clearance) {
        return Err(Refusal::new(format!("the robot's radius is from 0 to 100 m, not {clearance}")));
    }
    let path = Waypoints::new(points).map_err(Refusal::new)?;
    let demand = demand(clearance, unknown, path.length());
    let (whole, pieces) = pieces(field, &path, &demand);
    let spacing = (0.5 * field.lattice().resolution).max(path.length() / SAMPLES);
    let profile = clearance_profile(field, &path, spacing, unknown).map_err(Refusal::new)?;
    let mut lines = Lines { points: Vec::new(), starts: vec![0] };
    for piece in &pieces {
        let inner =
            path.points().iter().zip(path.reached()).filter(|(_, s)| (piece.from..piece.to).contains(*s));
        let ends = [path.point(piece.from), path.point(piece.to)];
        let all = [ends[0]].into_iter().chain(inner.map(|(p, _)| *p)).chain([ends[1]]);
        lines.points.extend(all.flatten().map(|v| v as f32));
        lines.starts.push((lines.points.len() / 2) as u32);
    }
    let bounds: Vec<[f32; 2]> = profile.iter().map(|s| signed(s.clearance)).collect();
    let body = json!({
        "length": path.length(),
        "reached": path.reached(),
        "clearance": clearance,
        "tolerance": demand.tolerance,
        "check": verdict(&whole),
        "pieces": pieces.iter().map(Piece::as_json).collect::<Vec<_>>(),
        "lengths": {
            "certified": total(&pieces, |c| c.is_none()),
            "violated": total(&pieces, |c| c == Some(Cause::TooNear)),
            "undecided": total(&pieces, |c| c.is_some_and(|c| c != Cause::TooNear)),
        },
    });
    Ok(Reply::of(body)?
        .with("at", profile.iter().map(|s| s.at as f32).collect::<Vec<_>>())
        .with("lower", bounds.iter().map(|b| b[0]).collect::<Vec<_>>())
        .with("upper", bounds.iter().map(|b| b[1]).collect::<Vec<_>>())
        .with("points", lines.points)
        .with("starts", lines.starts))
}

/// What is demanded of a path so long: so many steps at most, each of 1 mm at least.
pub(super) fn demand(clearance: f64, unknown: UnknownSpace, length: f64) -> Demand {
    let tolerance = (length / STEPS).max(1e-3);
    Demand { unknown, tolerance, max_queries: 4 * STEPS as usize, ..Demand::new(clearance) }
}

/// The library's check of the whole path, and what it says of every part.
pub(super) fn pieces(field: &Esdf<2>, path: &Waypoints<2>, demand: &Demand) -> (PathCheck, Vec<Piece>) {
    let parts = path_violations(field, path, demand);
    let whole =
        parts.first().map_or_else(|| check_path(field, path, demand), |first| PathCheck::Violated(*first));
    let (mut from, mut found) = (0.0, Vec::new());
    for part in &parts {
        if part.from > from {
            found.push(Piece { from, to: part.from, cause: None });
        }
        if found.len() >= MOST_PIECES {
            found.push(Piece { from: part.from, to: path.end(), cause: Some(Cause::Undecided) });
            return (whole, found);
        }
        name(field, path, demand, [part.from, part.to], &mut found);
        from = part.to;
    }
    if from < path.end() || parts.is_empty() {
        found.push(Piece { from, to: path.end(), cause: None });
    }
    (whole, found)
}

/// Tells the parts of what is not certified apart by their causes, half a cell at a time.
fn name(field: &Esdf<2>, path: &Waypoints<2>, demand: &Demand, [from, to]: [f64; 2], found: &mut Vec<Piece>) {
    let step = (0.5 * field.lattice().resolution).max(path.length() / SAMPLES);
    let steps = ((to - from) / step).ceil().max(1.0);
    let at = |i: usize| if i as f64 >= steps { to } else { from + (to - from) * i as f64 / steps };
    for i in 0..steps as usize {
        let (low, high) = (at(i), at(i + 1));
        let middle = Waypoints::new(vec![path.point(0.5 * (low + high))]);
        let cause = match middle.map(|p| check_path(field, &p, demand)) {
            Ok(PathCheck::Violated(v)) => v.cause,
            // The point is free, but with less to spare than a step.
            Ok(PathCheck::Certified(_)) | Err(_) => Cause::Undecided,
        };
        match found.last_mut().filter(|p| p.cause == Some(cause) && i > 0) {
            Some(piece) => piece.to = high,
            None => found.push(Piece { from: low, to: high, cause: Some(cause) }),
        }
    }
}

impl Piece {
    fn as_json(&self) -> Value {
        json!({ "from": self.from, "to": self.to, "verdict": self.verdict(), "cause": self.cause.map(word) })
    }

    fn verdict(&self) -> &'static str {
        match self.cause {
            None => "certified",
            Some(Cause::TooNear) => "violated",
            Some(_) => "undecided",
        }
    }
}

fn total(pieces: &[Piece], counts: impl Fn(Option<Cause>) -> bool) -> f64 {
    pieces.iter().filter(|p| counts(p.cause)).map(|p| p.to - p.from).sum()
}

fn verdict(check: &PathCheck) -> Value {
    match check {
        PathCheck::Certified(c) => {
            json!({ "certified": true, "lower": c.lower, "upper": c.upper, "at": c.at })
        }
        PathCheck::Violated(v) => {
            json!({ "certified": false, "from": v.from, "to": v.to, "cause": word(v.cause) })
        }
    }
}

fn word(cause: Cause) -> &'static str {
    match cause {
        Cause::TooNear => "too near",
        Cause::Unknown => "unknown space",
        Cause::Outside => "outside of the map",
        Cause::Undecided => "undecided",
    }
}

/// Both bounds, below zero inside of a surface; NaN where unknown.
fn signed(clearance: Answer<Clearance>) -> [f32; 2] {
    let (c, upper) = match clearance {
        Answer::Known(c) => (c, c.upper),
        Answer::Saturated(c) => (c, f64::NAN),
        Answer::Unknown | Answer::Outside => return [f32::NAN; 2],
    };
    let bounds = if c.inside { [-upper, -c.lower] } else { [c.lower, upper] };
    bounds.map(|v| v as f32)
}
