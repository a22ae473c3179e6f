//! What the maps cost, and who is cheapest for which question.

use crate::gallery::{Cost, LEVEL, Row, Workload};

use super::page::{escaped, table as html_table};
use super::{Facts, Section};
use portolan_draw::shown_seconds;

/// The rows that answer a question most cheaply, within what runs differ by.
fn cheapest(rows: &[Row], cost: impl Fn(&Row) -> Option<Cost>) -> Vec<usize> {
    let seconds = |i: usize| cost(&rows[i]).map(|c| c.seconds);
    let best = (0..rows.len()).filter_map(seconds).fold(f64::INFINITY, f64::min);
    (0..rows.len()).filter(|&i| seconds(i).is_some_and(|s| s <= LEVEL * best)).collect()
}

/// The unit that suits the middle of a column of numbers: its name, and how many of it make one.
fn unit(mut values: Vec<f64>, units: &[(&'static str, f64)]) -> (&'static str, f64) {
    values.retain(|v| *v > 0.0);
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.get(values.len() / 2).copied().unwrap_or(1.0);
    units.iter().copied().find(|(_, scale)| middle * scale < 1000.0).unwrap_or(units[units.len() - 1])
}

const TIMES: [(&str, f64); 3] = [("ns", 1e9), ("µs", 1e6), ("ms", 1e3)];
const SIZES: [(&str, f64); 2] = [("kB", 1e-3), ("MB", 1e-6)];

/// To three digits, but no digit of a whole number is left out.
fn three_digits(value: f64) -> String {
    let digits = if value > 0.0 { (2 - value.log10().floor() as i32).clamp(0, 4) } else { 0 };
    format!("{value:.*}", digits as usize)
}

pub(super) fn table(facts: &Facts) -> Section {
    let rows = &facts.scene.gallery.rows;
    let columns: [fn(&Row) -> Option<Cost>; 4] =
        [|r| r.update, |r| r.occupancy, |r| r.distance, |r| r.surface];
    let best: Vec<Vec<usize>> = columns.iter().map(|cost| cheapest(rows, cost)).collect();
    let times =
        columns.map(|cost| unit(rows.iter().filter_map(|r| Some(cost(r)?.seconds)).collect(), &TIMES));
    let bytes = |row: &Row| row.memory_bytes as f64;
    let size = unit(rows.iter().map(bytes).collect(), &SIZES);
    let least = rows.iter().filter(|row| !row.derived).map(bytes).fold(f64::INFINITY, f64::min);
    let cells = rows.iter().enumerate().map(|(i, row)| {
        let plus = if row.derived { "+" } else { "" };
        let mut cells = vec![
            format!("{}<small>{}</small>", escaped(&row.name), escaped(&row.note)),
            match format!("{plus}{}", three_digits(bytes(row) * size.1)) {
                shown if !row.derived && bytes(row) <= LEVEL * least => format!("<b>{shown}</b>"),
                shown => shown,
            },
        ];
        for (column, cost) in columns.iter().enumerate() {
            let Some(cost) = cost(row) else {
                cells.push("–".into());
                continue;
            };
            let time = three_digits(cost.seconds * times[column].1);
            let time = if best[column].contains(&i) { format!("<b>{time}</b>") } else { time };
            cells.push(format!("{time}<small>{}</small>", cost.by.unwrap_or("")));
        }
        cells
    });
    let named = ["update per scan", "occupancy probe", "distance probe", "surface"];
    let with_unit = |(name, unit): (&str, &str)| format!("{name}, {unit}");
    let header: Vec<String> = ["representation".to_owned(), with_unit(("memory", size.0))]
        .into_iter()
        .chain(named.into_iter().zip(times.map(|t| t.0)).map(with_unit))
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let body = format!(
        "<p>Measured: bytes held, seconds of one core. A dash says that the representation cannot \
         answer; nothing is faked. <b>+</b> is memory on top of the TSDF that a field is derived from, and its update is a \
         full rebuild. The cheapest in each column, and what is level with it, is set in bold; every column has one unit.</p>{}\
         <p>No row wins all columns, and none was ever going to.</p>",
        html_table(&header, &cells.collect::<Vec<_>>(), &[])
    );
    Section {
        title: "What everything costs",
        body,
        command: "portolan demo --out out   (the table alone, at the true poses: portolan gallery demo)",
    }
}

pub(super) fn winners(facts: &Facts) -> Section {
    let rows = &facts.scene.gallery.rows;
    let gallery = facts.scene.gallery;
    let mut items = String::new();
    for winner in &gallery.winners {
        let workload = winner.workload;
        let first = &winner.level;
        let names: Vec<_> = first.iter().map(|&i| escaped(&rows[i].name)).collect();
        let next = (0..rows.len())
            .filter(|i| !first.contains(i))
            .filter_map(|i| Some((workload.cost(&rows[i])?.seconds, i)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let ahead = match (next, winner.ahead) {
            (Some((_, i)), Some(ahead)) => {
                format!("; next is {} at {ahead:.1} times the cost", escaped(&rows[i].name))
            }
            (Some((seconds, _)), None) => {
                format!("; every other one first spends {}", shown_seconds(seconds))
            }
            (None, _) => String::new(),
        };
        let (task, why) = match workload {
            Workload::Occupancy => (
                "Is this point occupied? (a lidar simulator, a footprint check)",
                "One index into an array; whichever plane is read, the work is the same.",
            ),
            Workload::Distance => (
                "How far is the nearest obstacle? (a planner, a hundred thousand times a second)",
                "The distance was computed once for all cells; others have to search for it.",
            ),
            Workload::Surface => (
                "Where is the boundary? (a renderer, an operator, a file for CAD)",
                "The contour is the answer already; the others have to run marching squares first.",
            ),
        };
        items += &format!("<li><b>{task}</b><br>{}{ahead}. {why}</li>", names.join(", level with "));
    }
    let never: Vec<_> = gallery.never_win.iter().map(|&i| escaped(&rows[i].name)).collect();
    let is_tree = |i: usize| rows[i].name.starts_with("quadtree");
    let trees = (0..rows.len()).filter(|&i| is_tree(i)).all(|i| gallery.never_win.contains(&i));
    let verdict = if trees {
        "<p>Of the text's four panes the <b>quadtree</b> is the one that never takes the frame. A probe descends a level at a \
         time, one dependent load after the other, where an array takes one index; and in the plane, at this resolution, it \
         has little to save (next section). What it pays for is space that nobody has visited: with a box that is mostly \
         empty, or in three dimensions, where volume outgrows surface, that payment is what makes the map fit at all.</p>"
    } else {
        "<p>In this run a quadtree was level with the cheapest map, which the text's never was.</p>"
    };
    let cloud = match gallery.cloud_crossover.points {
        Some(n) => format!(
            "<p>The k-d tree over raw end points answers distances {}; this lap has {}. It grows with every scan, forgets nothing, knows nothing of free space: a cloud is the log, not the \
             map.</p>",
            match n {
                0 | 1 => "more slowly than the ESDF from the first points on".to_owned(),
                n => format!("faster than the ESDF only up to about {n} points"),
            },
            gallery.cloud.points().len()
        ),
        None => String::new(),
    };
    Section {
        title: "Who wins which workload",
        body: format!(
            "<p>The ranking changes with the question. Within {LEVEL} times the best is called level: that much \
             differs between runs.</p><ul>{items}</ul><p>Never the cheapest: {}.</p>{verdict}{cloud}",
            never.join("; ")
        ),
        command: "portolan demo --out out   (for machines: out/gallery.json)",
    }
}
