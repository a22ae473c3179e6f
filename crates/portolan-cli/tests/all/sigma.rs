//! How sure the surface is, through the program: by the beginning and the end of a log, or said to be unknown.

use std::path::{Path, PathBuf};

use crate::support::{arg, fail, flaser, json, pose, range, room, succeed};

/// Two laps of the room; poses of the second are off by this along x (meters).
fn two_laps(folder: &Path, off: f64) -> PathBuf {
    let mut log = String::new();
    for i in 0..120 {
        let [x, y, theta] = pose(i);
        let ranges: Vec<f64> = (0..180)
            .map(|b| {
                let noise = 0.004 * (f64::from(i as u32 * 180 + b) * 12.9898).sin();
                range([x, y], theta + (f64::from(b) - 90.0).to_radians()) + noise
            })
            .collect();
        let x = if i < 60 { x } else { x + off };
        log.push_str(&flaser(&ranges, [x, y, theta], i as f64 * 0.1));
        log.push('\n');
    }
    let path = folder.join("laps.log");
    std::fs::write(&path, log).unwrap();
    path
}

/// Once through a corridor of 2 m, seen up to 5 m.
fn corridor(folder: &Path) -> PathBuf {
    let mut log = String::new();
    for i in 0..120 {
        let x = 0.4 * f64::from(i);
        let ranges: Vec<f64> = (0..180)
            .map(|b| {
                let side = (f64::from(b) - 89.5).to_radians().sin().abs();
                if 1.0 / side < 5.0 { 1.0 / side } else { 81.83 }
            })
            .collect();
        log.push_str(&flaser(&ranges, [x, 0.0, 0.0], f64::from(i) * 0.1));
        log.push('\n');
    }
    let path = folder.join("corridor.log");
    std::fs::write(&path, log).unwrap();
    path
}

fn map(log: &Path, out: &Path, more: &[&str]) -> serde_json::Value {
    let call = ["map", arg(log), "--resolution", "0.015", "--out", arg(out), "--json"];
    json(call.iter().copied().chain(more.iter().copied()))
}

#[test]
fn what_two_visits_disagree_by_is_in_sigma() {
    let folder = tempfile::tempdir().unwrap();
    let where_much_was_seen = |off: f64| {
        let log = two_laps(folder.path(), off);
        let out = folder.path().join(format!("out{off}"));
        let sigma = map(&log, &out, &["--ledger"])["sigma"].clone();
        assert_eq!(sigma, sigma_of(&out));
        let within = sigma["within_95"].as_f64().unwrap();
        assert!((0.85..=0.99).contains(&within), "{sigma}");
        sigma["sigmas"].as_array().unwrap().last().unwrap().as_f64().unwrap()
    };
    // Walls across x are displaced by all of it, the others by nothing: 95 % are within the whole.
    let [still, off] = [0.0, 0.02].map(where_much_was_seen);
    assert!(still < 0.004 && (0.004..0.025).contains(&off), "{still} {off}");

    let points = folder.path().join("points.csv");
    std::fs::write(&points, "1.0,2.0\n3.0,3.2\n20,20\n").unwrap();
    let out = folder.path().join("out0.02");
    let text = succeed(["query", arg(&out), "--points", arg(&points), "--sigma"]);
    let column: Vec<&str> = text.lines().map(|line| line.rsplit_once(',').unwrap().1).collect();
    assert_eq!((column[0], column[3]), ("sigma", ""));
    for sigma in &column[1..3] {
        let sigma: f64 = sigma.parse().unwrap();
        assert!(sigma > 0.002 && sigma < 0.05, "{sigma}");
    }
    let plain = succeed(["query", arg(&out), "--points", arg(&points)]);
    assert!(plain.lines().zip(text.lines()).all(|(a, b)| b.starts_with(a)));
    // The lower bound at three of them, whose number is in its name.
    let text = succeed(["query", arg(&out), "--points", arg(&points), "--sigma=3"]);
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let [lower, sigma, at] =
        ["lower", "sigma", "lower_at_3_sigma"].map(|name| rows[0].iter().position(|n| *n == name).unwrap());
    for row in &rows[1..3] {
        let [lower, sigma, at] = [lower, sigma, at].map(|i| row[i].parse::<f64>().unwrap());
        assert!(at >= 0.0 && at <= (lower - 3.0 * sigma).max(0.0) + 1e-9 && at >= lower - 0.2, "{row:?}");
    }
    assert!(rows[1][lower].parse::<f64>().unwrap() > 0.2, "{rows:?}");
    assert_eq!(rows[3][at], "");
    let value = json(["query", arg(&out), "--points", arg(&points), "--sigma=2.5", "--json"]);
    assert!(value["answers"][0]["lower_at_2.5_sigma"].as_f64().unwrap() > 0.0, "{value}");
    for wrong in ["--sigma=0", "--sigma=-1", "--sigma=nan"] {
        fail(2, ["query", arg(&out), "--points", arg(&points), wrong]);
    }
    let error = fail(2, ["query", arg(&out), "--points", arg(&points), "--sigma=3", "--esdf", "seeded"]);
    assert!(error.contains("only accurate"), "{error}");
    // `eval` tells the same of any log, whatever the map itself is made of.
    let clamped = folder.path().join("clamped");
    let log = two_laps(folder.path(), 0.02);
    map(&log, &clamped, &[]);
    let found = json(["eval", arg(&clamped), "--scans", arg(&log), "--halves", "--json"]);
    assert_eq!(found["sigma"]["sigmas"], sigma_of(&out)["sigmas"]);
    assert_eq!(found["sigma"]["quarters"], sigma_of(&out)["quarters"]);
    // Limits that are given are those that hold.
    let near =
        json(["eval", arg(&clamped), "--scans", arg(&log), "--halves", "--max-range", "2.5", "--json"]);
    let count = |value: &serde_json::Value| value["sigma"]["displacements"].as_u64().unwrap();
    assert!(count(&near) < count(&found), "{near}");
    let text = succeed(["eval", arg(&clamped), "--scans", arg(&log), "--halves"]);
    assert!(text.contains("predicted sigma") && text.contains("within 95 %"), "{text}");
    assert!(std::fs::read(out.join("sigma.png")).unwrap().starts_with(b"\x89PNG"));
    // A file that was damaged, one of another map, and one that is no standard deviation.
    let refused = |out: &Path, part: &str| {
        let error = fail(1, ["query", arg(out), "--points", arg(&points), "--sigma"]);
        assert!(error.contains("sigma.json") && error.contains(part), "{part}: {error}");
    };
    let other = folder.path().join("other");
    map(&two_laps(folder.path(), 0.01), &other, &[]);
    std::fs::copy(out.join("sigma.json"), other.join("sigma.json")).unwrap();
    refused(&other, "was not written with the map beside it");
    std::fs::write(out.join("sigma.json"), "{\"weights\": [1, 2], \"sigmas\": [0.1, -1]}").unwrap();
    refused(&out, "of its set");
    std::fs::remove_file(out.join("manifest.json")).unwrap();
    refused(&out, "no curve");
}

fn sigma_of(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(out.join("sigma.json")).unwrap()).unwrap()
}

#[test]
fn what_is_not_known_is_said() {
    let (folder, log) = room();
    let out = |name: &str| folder.path().join(name);
    let why = |summary: &serde_json::Value| summary["sigma"]["unknown"].as_str().unwrap().to_owned();
    // Two to five scans: less than there are parts, and hardly more.
    for lines in 3..7 {
        let short: String =
            std::fs::read_to_string(&log).unwrap().lines().take(lines).map(|l| format!("{l}\n")).collect();
        std::fs::write(out("short.log"), short).unwrap();
        let summary = map(&out("short.log"), &out("short"), &["--ledger", "--overwrite"]);
        assert!(why(&summary).contains("one visit"), "{lines} lines: {summary}");
        assert!(!out("short").join("sigma.json").exists());
    }
    let error = fail(1, ["eval", arg(&out("short")), "--scans", arg(&out("short.log")), "--halves"]);
    assert!(error.contains("one visit"), "{error}");
    // Where the halves of a way through a corridor meet they see the same walls, with the same poses: that is no second visit.
    let summary = map(&corridor(folder.path()), &out("corridor"), &["--ledger"]);
    assert!(why(&summary).contains("one visit"), "{summary}");
    let summary = map(&log, &out("grid"), &["--ledger", "--maps", "grid"]);
    assert!(why(&summary).contains("no signed distances"), "{summary}");
    // Clamped cells do not tell.
    let summary = map(&log, &out("clamped"), &[]);
    assert!(summary["sigma"].is_null());
    let points = out("points.csv");
    std::fs::write(&points, "1.0,2.0\n").unwrap();
    let error = fail(1, ["query", arg(&out("clamped")), "--points", arg(&points), "--sigma"]);
    assert!(error.contains("map --ledger"), "{error}");
    let error =
        fail(2, ["query", arg(&out("clamped").join("map.yaml")), "--points", arg(&points), "--sigma"]);
    assert!(error.contains("--sigma is only for a map.portolan"), "{error}");
}
