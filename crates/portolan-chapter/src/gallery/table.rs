//! The gallery as text.

use super::Cost;
use super::build::format_ms;
use super::measured::Gallery;
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

impl Display for Gallery {
    /// The table, the winners, the crossovers, the distance fields.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        rows(self, f)?;
        winners(self, f)?;
        crossovers(self, f)?;
        writeln!(
            f,
            "median gradient norm of the raw TSDF at observed free points: {:.3}\n",
            self.tsdf_gradient
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
    ];
    let mut lines = vec![header.map(String::from)];
    lines.extend(gallery.rows.iter().map(|row| {
        [
            row.name.clone(),
            bytes(row.memory_bytes, row.derived),
            time(row.update),
            time(row.occupancy),
            row.occupancy_wrong.map_or("-".into(), |w| format!("{:.2} %", 100.0 * w)),
            time(row.distance),
            millimetres(row.distance_error),
            time(row.surface),
            millimetres(row.surface_error),
        ]
    }));
    aligned(f, &lines)?;
    writeln!(
        f,
        "\n\"+\": on top of the TSDF it is derived from; its update is a full rebuild. \"-\": cannot answer."
    )?;
    writeln!(f, "Errors are medians against the true world; distances at observed free points.\n")
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
    let header =
        ["distance field", "rebuild", "off the contour", "99 %", "too large by", "off the world", "gradient"];
    let mm = |v: Option<f64>| v.map_or("-".into(), |v| format!("{:.2} mm", 1e3 * v));
    let mut lines = vec![header.map(String::from)];
    lines.extend(gallery.fields.iter().map(|field| {
        [
            field.name().into(),
            format!("{} ms", format_ms(field.seconds)),
            mm(field.against_contour.map(|e| e.median)),
            mm(field.against_contour.map(|e| e.p99)),
            mm(field.against_contour.map(|e| e.worst_over)),
            mm(field.against_truth.map(|e| e.median)),
            format!("{:.3}", field.gradient),
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
