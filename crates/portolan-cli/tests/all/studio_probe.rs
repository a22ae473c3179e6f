//! The studio's probe prints what `query` prints of the map that it exports.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::sync::Arc;

use portolan::geom::Pose;
use portolan::scan::{Beam, BeamKind, Scan};
use portolan_studio::engine::{Clock, Limits, Logs, Session, Source2d, Wire};
use serde_json::{Value, json};

use crate::support;

/// Header and arrays of an answer.
fn ask(session: &mut Session, view: &str, question: Value) -> (Value, Vec<u8>) {
    let (header, arrays) = match session
        .answer(&json!({ "id": 1, "view": view, "ask": question }).to_string())
    {
        Wire::Text(text) => (serde_json::from_str(&text).unwrap(), Vec::new()),
        Wire::Binary(bytes) => {
            let length = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
            (serde_json::from_slice::<Value>(&bytes[8..8 + length]).unwrap(), bytes[8 + length..].to_vec())
        }
    };
    assert!(header.get("error").is_none(), "{header}");
    (header["ok"].clone(), arrays)
}

/// Points all over a box, and outside of it.
fn points([x0, y0]: [f64; 2], [w, h]: [f64; 2]) -> Vec<[f64; 2]> {
    let share = |i: u32, step: f64| (f64::from(i) * step).fract() * 1.2 - 0.1;
    let some = (0..1500).map(|i| [x0 + w * share(i, 0.754_877_666), y0 + h * share(i, 0.569_840_291)]);
    some.chain([[1e12, 0.0], [-3.0, 1e6]]).collect()
}

fn compare(source_2d: Source2d, statuses: &[&str]) {
    let logs = Arc::new(Logs { source_2d, ..Logs::default() });
    let mut session = Session::new(&logs, Limits::default(), &Clock::new(|| 0.0));
    let (opened, _) = ask(&mut session, "clearance", json!({ "op": "open", "have": null }));
    let (header, mut file) = ask(&mut session, "fusion", json!({ "op": "export", "file": "map" }));
    file.truncate(header["bytes"].as_u64().unwrap() as usize);
    let folder = tempfile::tempdir().unwrap();
    let (map, csv) = (folder.path().join("map.portolan"), folder.path().join("points.csv"));
    fs::write(&map, file).unwrap();

    let grid = &opened["grid"];
    let of = |name: &str| [0, 1].map(|k| grid[name][k].as_f64().unwrap());
    let extent = of("shape").map(|n| n * grid["resolution"].as_f64().unwrap());
    let points = points(of("origin"), extent);
    let mut text = String::new();
    points.iter().for_each(|[x, y]| writeln!(text, "{x},{y}").unwrap());
    fs::write(&csv, text).unwrap();

    for unknown in ["optimistic", "pessimistic"] {
        let [map, csv] = [&map, &csv].map(|p| p.to_str().unwrap());
        let printed = support::succeed(["query", map, "--points", csv, "--unknown", unknown]);
        let rows: Vec<&str> = printed.lines().skip(1).collect();
        assert_eq!(rows.len(), points.len());
        for (p, row) in points.iter().zip(&rows) {
            let question = json!({ "op": "probe", "at": p, "unknown": unknown });
            assert_eq!(ask(&mut session, "clearance", question).0["row"].as_str(), Some(*row));
        }
        for status in statuses {
            assert!(rows.iter().any(|r| r.split(',').nth(2) == Some(status)), "no point is {status}");
        }
    }
}

#[test]
fn of_the_apartment() {
    compare(Source2d::Apartment, &["known", "unknown", "outside"]);
}

#[test]
fn of_a_plain_that_is_wider_than_distances_are_kept() {
    let beam = |i: usize| {
        let angle = TAU * i as f64 / 720.0;
        let kind = if i < 8 { BeamKind::Hit } else { BeamKind::MaxRange };
        (angle, Beam { direction: [angle.cos(), angle.sin()], range: 15.0, kind })
    };
    let (bearings, beams): (Vec<_>, Vec<_>) = (0..720).map(beam).unzip();
    let scans = vec![(Pose::<2>::new(0.0, 0.0, 0.0), Scan::from_fan(&bearings, beams))];
    compare(
        Source2d::Recorded { name: "plain".into(), scans },
        &["known", "saturated", "unknown", "outside"],
    );
}
