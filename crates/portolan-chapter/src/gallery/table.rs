//! The gallery as text.

use super::Cost;
use super::build::format_ms;
use super::measured::Gallery;
use super::turned::{Accuracy, FieldAccuracy, Turned};
use portolan_sim::ErrorSummary;
use std::fmt::{self, Display, Formatter, Write};

fn bytes(n: usize, derived: bool) -> String {
    let plus = if derived { "+" } else { "" };
    match n {
        0..1_000_000 => format!("{plus}{:.1} kB", n as f64 / 1e3),
        _ => format!("{plus}{:.2} MB", n as f64 / 1e6),
    }
}

/// Seconds in the unit that suits them.
fn time(cost: Option<Cost>) -> String {
    let Some(cost) = cost else { return "-".into() };
    match cost.seconds {
        0.0 => "0".into(),
        s if s < 1e-6 => format!("{:.1} ns", s * 1e9),
        s if s < 1e-3 => format!("{:.2} us", s * 1e6),
        s => format!("{} ms", format_ms(s)),
    }
}

fn millimetres(error: Option<ErrorSummary>) -> String {
    error.map_or("-".into(), |e| format!("{:.1}", 1e3 * e.median))
}

/// What is said of accuracy, and what holds in the world as it is drawn, where that is not the same.
struct Beside {
    headline: Accuracy,
    drawn: Option<Accuracy>,
}

impl Beside {
    fn of(gallery: &Gallery) -> Self {
        Self { headline: gallery.headline(), drawn: gallery.turned.as_ref().map(|_| Accuracy::of(gallery)) }
    }

    fn told(&self, tell: impl Fn(&Accuracy) -> String) -> String {
        match (tell(&self.headline), self.drawn.as_ref().map(tell)) {
            (headline, Some(drawn)) if headline != "-" => format!("{headline} ({drawn})"),
            (headline, _) => headline,
        }
    }
}

impl Display for Gallery {
    /// The table, the winners, the crossovers, the distance fields.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        rows(self, f)?;
        winners(self, f)?;
        crossovers(self, f)?;
        writeln!(
            f,
            "median gradient norm of the raw TSDF at observed free points: {:.3}\n",
            self.headline().tsdf_gradient
        )?;
        fields(self, f)
    }
}

fn rows(gallery: &Gallery, f: &mut Formatter<'_>) -> fmt::Result {
    let header = [
        "representation",
        "memory",
        "update/scan",
        "occupancy",
        "wrong",
        "distance",
        "error mm",
        "surface",
        "error mm",
        "foretold",
        "nats",
    ];
    let mut lines = vec![header.map(String::from)];
    let beside = Beside::of(gallery);
    lines.extend(gallery.rows.iter().enumerate().map(|(i, row)| {
        [
            row.name.clone(),
            bytes(row.memory_bytes, row.derived),
            time(row.update),
            time(row.occupancy),
            beside.told(|a| a.rows[i].occupancy_wrong.map_or("-".into(), |w| format!("{:.2} %", 100.0 * w))),
            time(row.distance),
            beside.told(|a| millimetres(a.rows[i].distance_error)),
            time(row.surface),
            beside.told(|a| millimetres(a.rows[i].surface_error)),
            row.foretold.map_or("-".into(), |f| format!("{:.1} %", 100.0 * f.within_10_cm)),
            row.foretold.map_or("-".into(), |f| format!("{:.2}", f.log_density)),
        ]
    }));
    aligned(f, &lines)?;
    writeln!(
        f,
        "\n\"+\": on top of the TSDF it is derived from; its update is a full rebuild. \"-\": cannot answer."
    )?;
    writeln!(f, "Errors are medians against the true world; distances at observed free points.")?;
    if let Some(told) = gallery.rows.iter().find_map(|row| row.foretold) {
        writeln!(
            f,
            "Foretold: of {} ranges of every tenth scan, by maps without these, the share within 10 cm, and the mean log density \
             (nats a beam).",
            told.rays
        )?;
    }
    match &gallery.turned {
        Some(turned) => writeln!(f, "{}\n", worlds(turned)),
        None => writeln!(f),
    }
}

/// In which worlds accuracy was measured.
fn worlds(turned: &Turned) -> String {
    let angles: Vec<String> = turned.turns.iter().map(|t| t.degrees.to_string()).collect();
    format!(
        "They are medians over worlds turned by {} degrees and shifted by parts of a cell; in parentheses the world as it is \
         drawn, whose walls lie on borders of cells.",
        angles.join(", ")
    )
}

fn winners(gallery: &Gallery, f: &mut Formatter<'_>) -> fmt::Result {
    let name = |&i: &usize| gallery.rows[i].name.as_str();
    for w in &gallery.winners {
        let ahead = w.ahead.map_or(String::new(), |a| format!(", {a:.1} times ahead of the next"));
        let level: Vec<&str> = w.level.iter().map(name).collect();
        writeln!(f, "{} probes: {}{ahead}", w.workload.name(), level.join(", level with "))?;
    }
    let never: Vec<&str> = gallery.never_win.iter().map(name).collect();
    writeln!(f, "never the cheapest: {}\n", never.join("; "))
}

fn crossovers(gallery: &Gallery, f: &mut Formatter<'_>) -> fmt::Result {
    for t in &gallery.trees {
        writeln!(
            f,
            "{}: breaks even at {:.2} cm; at {:.2} cm the formula says {:.2} times the dense array, measured {:.2}",
            t.name,
            100.0 * t.predicted_resolution,
            100.0 * t.resolution,
            t.predicted_ratio,
            t.measured_ratio
        )?;
    }
    match gallery.cloud_crossover.points {
        Some(0) => writeln!(f, "the cloud's distance query loses to the ESDF from the first point on"),
        Some(n) => writeln!(f, "the cloud's distance query loses to the ESDF from about {n} points on"),
        None => writeln!(f, "the cloud's distance query beats the ESDF at every size measured"),
    }
}

fn fields(gallery: &Gallery, f: &mut Formatter<'_>) -> fmt::Result {
    let header = [
        "distance field",
        "rebuild",
        "off the contour, mm",
        "99 %",
        "too large by",
        "off the world",
        "gradient",
    ];
    let mm = |v: Option<f64>| v.map_or("-".into(), |v| format!("{:.2}", 1e3 * v));
    let mut lines = vec![header.map(String::from)];
    let beside = Beside::of(gallery);
    lines.extend(gallery.fields.iter().enumerate().map(|(k, field)| {
        let told = |of: fn(&FieldAccuracy) -> Option<f64>| beside.told(|a| mm(of(&a.fields[k])));
        [
            field.name().into(),
            format!("{} ms", format_ms(field.seconds)),
            told(|f| Some(f.against_contour?.median)),
            told(|f| Some(f.against_contour?.p99)),
            told(|f| Some(f.against_contour?.worst_over)),
            told(|f| Some(f.against_truth?.median)),
            format!("{:.3}", beside.headline.fields[k].gradient),
        ]
    }));
    aligned(f, &lines)
}

/// Columns under their headers; the first to the left, the others to the right.
fn aligned<const N: usize>(f: &mut Formatter<'_>, lines: &[[String; N]]) -> fmt::Result {
    let width = |c: usize| lines.iter().map(|l| l[c].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    for (n, line) in lines.iter().enumerate() {
        let mut text = String::new();
        for (c, cell) in line.iter().enumerate() {
            let w = widths[c];
            if c == 0 {
                write!(text, "{cell:w$}")?
            } else {
                write!(text, "  {cell:>w$}")?
            };
        }
        writeln!(f, "{}", text.trim_end())?;
        if n == 0 {
            writeln!(f, "{}", "-".repeat(widths.iter().sum::<usize>() + 2 * (N - 1)))?;
        }
    }
    Ok(())
}
