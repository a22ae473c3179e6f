//! `demo` and `gallery`: the whole experiment, from the command line.

use std::path::Path;

use crate::support::{arg, fail, json, room, succeed};
use serde_json::Value;

const FILES: [&str; 18] = [
    "contour.geojson",
    "contour.svg",
    "esdf.bin",
    "gallery.json",
    "gallery.png",
    "gallery.txt",
    "ghost.json",
    "ghost.png",
    "manifest.json",
    "map.pgm",
    "map.png",
    "map.portolan",
    "map.yaml",
    "obstacles.csv",
    "pose_graph.g2o",
    "pose_graph.png",
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

fn check_poses(poses: &Value) {
    let number = |path: &str| poses.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}"));
    assert_eq!(poses["used"], "optimised");
    assert!(number("/odometry/translation/max") > 0.3, "the odometry does not drift");
    assert!(number("/optimised/translation/mean") < 0.03);
    assert!(number("/optimised/rotation/rms").to_degrees() < 0.5);
    assert!(number("/closures") > 100.0);
    let [truth, odometry, optimised] =
        ["true", "odometry", "optimised"].map(|set| number(&format!("/contour/{set}/median")));
    assert!(truth < 0.006 && odometry > 5.0 * truth && optimised < 2.0 * truth + 0.002);
}

/// 200 poses, 199 motions, and the closures; the poses are those of the minimum.
fn check_graph(g2o: &[u8]) {
    let file = portolan_graph::read_g2o(g2o, "pose_graph.g2o").unwrap();
    let portolan_graph::AnyGraph::Se2(mut graph) = file.graph else { panic!("not 2-D") };
    assert!(!file.vertices_made && file.unknown.is_empty());
    assert_eq!(graph.vertices().iter().filter(|v| v.fixed).count(), 1);
    assert!(graph.vertices().len() == 200 && graph.edges().len() > 199 + 100);
    let written: Vec<_> = graph.vertices().iter().map(|v| v.world_from_vertex).collect();
    let kernel = portolan_chapter::poses::CorrectionSettings::default().kernel;
    graph.optimize(&portolan_graph::Settings { kernel, ..Default::default() }).unwrap();
    for (before, after) in written.iter().zip(graph.vertices()) {
        assert!(before.translation_to(&after.world_from_vertex) < 1e-3);
    }
}

fn check_ghost(ghost: &Value) {
    let runs = ghost["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 3);
    for (run, w_max) in runs.iter().zip([4.0f64, 24.0, 64.0]) {
        let predicted = std::f64::consts::LN_2 / (1.0 / w_max).ln_1p();
        let measured = run["saturated"]["half_life"].as_f64().unwrap();
        assert!((measured / predicted - 1.0).abs() < 0.1, "{measured} instead of {predicted}");
        assert!(run["saturated"]["cells"].as_u64().unwrap() >= 8);
        let noise = &run["static_noise"];
        let ratio = noise["measured"].as_f64().unwrap() / noise["predicted"].as_f64().unwrap();
        assert!((0.9..1.5).contains(&ratio), "noise {ratio} times the prediction");
    }
}

#[test]
fn poses_and_forgetting_are_the_callers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("ghost.png"), "of an earlier run").unwrap();
    let of = |poses: &str| {
        let document = json([
            "demo",
            "--json",
            "--no-ghost",
            "--scans",
            "40",
            "--half-life",
            "10",
            "--poses",
            poses,
            "--out",
            arg(&out),
        ]);
        assert_eq!((&document["input"]["poses"], &document["poses"]["used"]), (&poses.into(), &poses.into()));
        assert_eq!(document["ghost"], Value::Null);
        assert!(!out.join("ghost.png").exists() && !out.join("ghost.json").exists());
        let html = String::from_utf8(read(&out, "report.html")).unwrap();
        check_html(&html);
        assert!(html.contains("Where the poses come from") && !html.contains("The ghost of the chair"));
        // 1 / (2^(1/10) - 1).
        let settings = &document["settings"];
        assert!((settings["w_max"].as_f64().unwrap() - 13.932_726).abs() < 1e-4);
        assert!((settings["half_life"].as_f64().unwrap() - 10.0).abs() < 1e-5);
        read(&out, "map.portolan")
    };
    let maps = ["true", "odometry", "optimised"].map(of);
    assert!(maps[0] != maps[1] && maps[1] != maps[2] && maps[0] != maps[2]);
    let clash = ["demo", "--w-max", "4", "--half-life", "3", "--out", arg(&out)];
    assert!(fail(2, clash).contains("--half-life"));
    assert!(fail(2, ["demo", "--half-life", "0", "--out", arg(&out)]).contains("observations"));
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
    for name in ["gallery.png", "map.png", "pose_graph.png", "ghost.png"] {
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

    for section in ["Where the poses come from", "The ghost of the chair"] {
        assert!(html.contains(section), "{section}");
    }
    check_poses(&document["poses"]);
    check_graph(&read(&first, "pose_graph.g2o"));
    let ghost = parsed(&first, "ghost.json");
    check_ghost(&ghost);
    assert_eq!(ghost, document["ghost"]);

    // The gallery of the document is that of the file, and answers what it must.
    let gallery = parsed(&first, "gallery.json");
    assert_eq!(gallery, document["gallery"]);
    let rows = gallery["rows"].as_array().unwrap();
    let esdf = rows.iter().find(|r| r["name"].as_str().unwrap().starts_with("ESDF")).unwrap();
    // The textbook's seeds have 20 mm and 0.977 here.
    assert!(esdf["distance_error"]["median"].as_f64().unwrap() < 0.008);
    let turned = &gallery["turned"];
    assert_eq!(turned["turns"].as_array().unwrap().len(), 5);
    let row = rows.iter().position(|r| r == esdf).unwrap();
    assert!(turned["rows"][row]["distance_error"]["median"].as_f64().unwrap() < 0.007);
    assert_eq!(gallery["winners"].as_array().unwrap().len(), 3);
    assert!(gallery["gradient_norm"]["esdf"].as_f64().unwrap() > 0.995);

    assert_eq!(succeed(["demo", "-q", "--out", arg(&second)]), "");
    let same = ["map.portolan", "esdf.bin", "contour.geojson", "contour.svg", "map.pgm", "map.png"];
    for name in same.into_iter().chain(["pose_graph.g2o", "pose_graph.png", "ghost.json", "ghost.png"]) {
        assert!(read(&first, name) == read(&second, name), "{name} differs between two runs");
    }
}

#[test]
fn seeds_and_scans_are_the_callers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let document =
        json(["demo", "--json", "--no-ghost", "--seed", "0x7", "--scans", "1", "--out", arg(&out)]);
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
    assert!(table.contains("turned by 0, 10, 17, 30, 45 degrees"), "{table}");
    let other = succeed(["gallery", "demo", "--probes", "1000", "--every", "10", "--turn", "17,-5.5"]);
    assert!(other.contains("turned by 17, -5.5 degrees"), "{other}");
    assert!(fail(2, ["gallery", arg(&log), "--turn", "17"]).contains("--turn"));
    assert!(fail(2, ["gallery", "demo", "--turn", "west"]).contains("degrees"));
    assert!(fail(2, ["gallery", "demo", "--poses", "x"]).contains("--poses"));
    assert_eq!(fail(1, ["gallery", "/nowhere/at/all.log"]).lines().count(), 1);
}
