//! `demo` and `gallery`: the whole experiment, from the command line.

mod support;

use std::path::Path;

use serde_json::Value;
use support::{arg, fail, json, room, succeed};

const FILES: [&str; 12] = [
    "contour.geojson",
    "contour.svg",
    "esdf.bin",
    "gallery.json",
    "gallery.png",
    "gallery.txt",
    "map.pgm",
    "map.png",
    "map.portolan",
    "map.yaml",
    "report.html",
    "summary.json",
];

fn read(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn parsed(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&read(folder, name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Checks that tags close in the order in which they were opened.
fn check_html(html: &str) {
    const VOID: [&str; 5] = ["meta", "img", "br", "!doctype", "hr"];
    let mut open: Vec<&str> = Vec::new();
    for tag in html.split('<').skip(1).map(|t| &t[..t.find('>').unwrap_or(t.len())]) {
        let name = tag.split_whitespace().next().unwrap_or("");
        match name.strip_prefix('/') {
            Some(closing) => assert_eq!(open.pop(), Some(closing), "<{tag}>"),
            None if VOID.contains(&name) => {}
            None => open.push(name),
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn demo_writes_everything_and_twice_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("a"), folder.path().join("b"));
    let document = json(["demo", "--json", "--out", arg(&first)]);
    assert_eq!(document["scans"]["fused"], 200);
    assert_eq!(document["input"]["seed"], 0xC0FFEE);
    assert_eq!(document["extent"]["cells"], serde_json::json!([240, 180]));
    let mut names: Vec<_> =
        std::fs::read_dir(&first).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, FILES);
    let mut listed: Vec<_> =
        document["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap().to_owned()).collect();
    listed.sort();
    assert_eq!(listed, FILES);

    // Every file is what its name says.
    for name in ["gallery.png", "map.png"] {
        assert!(read(&first, name).starts_with(b"\x89PNG"), "{name}");
    }
    assert!(read(&first, "map.pgm").starts_with(b"P5"));
    assert_eq!(read(&first, "esdf.bin").len(), 64 + 172_800);
    assert_eq!(&read(&first, "esdf.bin")[..8], b"PORTESDF");
    assert_eq!(parsed(&first, "contour.geojson")["geometry"]["type"], "MultiLineString");
    assert_eq!(parsed(&first, "summary.json")["beams"]["total"], 72_000);
    let html = String::from_utf8(read(&first, "report.html")).unwrap();
    check_html(&html);
    assert!(!html.contains("<script") && !html.contains("src=\"http"), "the report needs nothing else");
    assert!(succeed(["info", arg(&first.join("map.portolan"))]).contains("Apartment"));

    // The gallery of the document is that of the file, and answers what it must.
    let gallery = parsed(&first, "gallery.json");
    assert_eq!(gallery, document["gallery"]);
    let rows = gallery["rows"].as_array().unwrap();
    let esdf = rows.iter().find(|r| r["name"].as_str().unwrap().starts_with("ESDF")).unwrap();
    assert!(esdf["distance_error"]["median"].as_f64().unwrap() < 0.03);
    assert_eq!(gallery["winners"].as_array().unwrap().len(), 3);
    assert!(gallery["gradient_norm"]["esdf"].as_f64().unwrap() > 0.9);

    assert_eq!(succeed(["demo", "-q", "--out", arg(&second)]), "");
    for name in ["map.portolan", "esdf.bin", "contour.geojson", "contour.svg", "map.pgm", "map.png"] {
        assert!(read(&first, name) == read(&second, name), "{name} differs between two runs");
    }
}

#[test]
fn seeds_and_scans_are_the_callers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let document = json(["demo", "--json", "--seed", "0x7", "--scans", "1", "--out", arg(&out)]);
    assert_eq!((&document["input"]["seed"], &document["scans"]["fused"]), (&7.into(), &1.into()));
    assert!(fail(2, ["demo", "--scans", "0", "--out", arg(&out)]).contains("0"));
    assert!(fail(2, ["demo", "--seed", "tea", "--out", arg(&out)]).contains("whole number"));
    let file = folder.path().join("file");
    std::fs::write(&file, "x").unwrap();
    assert!(fail(1, ["demo", "--out", arg(&file)]).contains("not a folder"));
}

#[test]
fn gallery_of_a_log_has_no_truth() {
    let (folder, log) = room();
    let out = folder.path().join("gallery");
    let document =
        json(["gallery", arg(&log), "--json", "--probes", "2000", "--resolution", "0.1", "--out", arg(&out)]);
    for row in document["rows"].as_array().unwrap() {
        for key in ["occupancy_wrong", "distance_error", "surface_error"] {
            assert_eq!(row[key], Value::Null, "{} of {}", key, row["name"]);
        }
        assert!(row["memory_bytes"].as_u64().unwrap() > 0);
    }
    assert_eq!(parsed(&out, "gallery.json"), document);
    assert!(read(&out, "gallery.png").starts_with(b"\x89PNG"));
    let table = succeed(["gallery", "demo", "--probes", "1000", "--every", "10"]);
    assert!(table.contains("never the cheapest") && table.contains("k-d tree"), "{table}");
    assert!(fail(2, ["gallery", "demo", "--poses", "x"]).contains("--poses"));
    assert_eq!(fail(1, ["gallery", "/nowhere/at/all.log"]).lines().count(), 1);
}
