//! Clouds that are no scans: fused maps, surveys; and meshes as what they are.

use std::fmt::Write;
use std::path::Path;

use crate::support::{arg, fail, json, succeed};

/// Points on the walls of a box of 4 x 4 x 2 m about zero and on a wall behind it, as text, moved.
fn fused([x, y, z]: [f64; 3]) -> String {
    let mut text = String::new();
    let mut point = |p: [f64; 3]| writeln!(text, "{} {} {}", p[0] + x, p[1] + y, p[2] + z).unwrap();
    for i in 0..80 {
        for k in 0..40 {
            let (a, h) = (0.05 * f64::from(i) - 1.975, 0.05 * f64::from(k) - 0.975);
            for wall in [-2.0, 2.0, 3.0] {
                point([wall, a, h]);
                point([a, wall, h]);
            }
        }
    }
    text
}

fn map(log: &Path, out: &Path, more: &[&str]) -> String {
    let call = ["map", arg(log), "--out", arg(out), "--resolution", "0.1", "--overwrite"];
    succeed(call.iter().copied().chain(more.iter().copied()))
}

fn summary(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap()
}

fn answers(map: &Path, points: &str, more: &[&str]) -> Vec<serde_json::Value> {
    let file = map.join("points.csv");
    std::fs::write(&file, points).unwrap();
    let call = ["query", arg(map), "--points", arg(&file), "--json"];
    let answers = json(call.iter().copied().chain(more.iter().copied()));
    answers["answers"].as_array().unwrap().clone()
}

#[test]
fn a_fused_map_is_told_and_mapped_without_rays() {
    let folder = tempfile::tempdir().unwrap();
    let (log, out) = (folder.path().join("map.xyz"), folder.path().join("out"));
    std::fs::write(&log, fused([0.0; 3])).unwrap();
    let text = map(&log, &out, &["--maps", "tree"]);
    assert!(text.contains("looks like a fused map") && text.contains("--points-only"), "{text}");

    let text = map(&log, &out, &["--points-only"]);
    assert!(text.contains("as points without rays") && text.contains("no mesh, tsdf"), "{text}");
    assert!(!text.contains("looks like a fused map"), "{text}");
    let summary = summary(&out);
    assert_eq!(summary["mesh"], serde_json::Value::Null);
    assert_eq!(summary["sweeps"]["points_without_rays"], 1);
    let files = summary["files"].as_array().unwrap();
    assert!(files.iter().all(|f| f != "mesh.ply" && f != "preview.png"), "{files:?}");
    assert!(files.iter().any(|f| f == "esdf.bin"));

    // Distances are to the centers of cells with points: the wall at x = 2 lies in cells about 1.95 or 2.05.
    let found = answers(&out, "1.45,0.05,0.05\n2.05,0.05,0.05\n0.05,0.05,0.05\n", &[]);
    let near = &found[0];
    assert_eq!(near["status"], "known");
    let distance = near["distance"].as_f64().unwrap();
    assert!((0.49..0.61).contains(&distance), "{near}");
    // Nothing is known to be free.
    assert_eq!((near["lower"].as_f64(), near["occupancy"].as_f64()), (Some(0.0), None));
    assert!(near["upper"].as_f64().unwrap() >= distance - 1e-6);
    let at = found.iter().find(|a| a["occupancy"].as_f64().is_some_and(|p| p > 0.5));
    assert!(at.is_some(), "{found:?}");
    assert_ne!(found[2]["status"], "known", "the walls are 2 m away, and distances are kept up to 1 m");
    let free = answers(&out, "1.45,0.05,0.05\n", &["--unknown", "optimistic"]);
    assert!((free[0]["lower"].as_f64().unwrap() - distance).abs() < 1e-3, "{}", free[0]);

    // What cannot be made of it says why.
    let mesh = folder.path().join("mesh.ply");
    assert!(fail(1, ["mesh", arg(&out), arg(&mesh)]).contains("points without rays, which have no surface"));
    let array = folder.path().join("a.npz");
    for more in [&[][..], &["--unknown", "pessimistic"]] {
        let pessimistic = fail(1, [&["convert", arg(&out), arg(&array)], more].concat());
        assert!(pessimistic.contains("nothing is known to be free"), "{pessimistic}");
    }
    succeed(["convert", arg(&out), arg(&array), "--unknown", "optimistic"]);
    let refused = fail(
        2,
        [
            "map",
            arg(&log),
            "--out",
            arg(&folder.path().join("no")),
            "--resolution",
            "0.1",
            "--points-only",
            "--maps",
            "mesh",
        ],
    );
    assert!(refused.contains("--maps mesh is made of rays"), "{refused}");
    // More points go into the same map.
    let more = succeed(["map", arg(&log), "--out", arg(&out), "--append"]);
    assert!(more.contains("as points without rays"), "{more}");
}

#[test]
fn a_survey_keeps_its_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let (log, out) = (folder.path().join("utm.xyz"), folder.path().join("out"));
    std::fs::write(&log, fused([500_000.0, 4_000_000.0, 300.0])).unwrap();
    let text = map(&log, &out, &[]);
    assert!(text.contains("km from 0,0,0") && text.contains("as points without rays"), "{text}");
    assert!(text.contains("the coordinates in them are those of the map less"), "{text}");
    let (near, _) = (answers(&out, "500001.45,4000000.05,300.05\n", &[]), ());
    let distance = near[0]["distance"].as_f64().unwrap();
    assert!((0.49..0.61).contains(&distance), "{}", near[0]);
    let summary = summary(&out);
    let shift: Vec<f64> = serde_json::from_value(summary["octree"]["shift"].clone()).unwrap();
    let octree = json(["info", arg(&out.join("octree.bt")), "--json"]);
    let low: Vec<f64> = serde_json::from_value(octree["extent"]["min"].clone()).unwrap();
    assert!((low[0] + shift[0] - 499_998.0).abs() < 0.3, "{low:?} {shift:?}");
    let whole = json(["info", arg(&out), "--json"]);
    let origin: Vec<f64> = serde_json::from_value(whole["maps"]["tree"]["origin"].clone()).unwrap();
    assert_eq!(origin, shift);
    // A place of one's own, and none.
    map(&log, &out, &["--shift", "499900,3999900,0"]);
    let whole = json(["info", arg(&out), "--json"]);
    assert_eq!(whole["maps"]["tree"]["origin"], serde_json::json!([499_900.0, 3_999_900.0, 0.0]));
    let again = answers(&out, "500001.45,4000000.05,300.05\n", &[]);
    assert!((again[0]["distance"].as_f64().unwrap() - distance).abs() < 0.11);
    map(&log, &out, &["--shift", "0"]);
    let whole = json(["info", arg(&out), "--json"]);
    assert_eq!(whole["maps"]["tree"]["origin"], serde_json::json!([0.0, 0.0, 0.0]));
    // From an origin of its own there are rays.
    let text = map(&log, &out, &["--origin", "500000,4000000,300"]);
    assert!(text.contains("mesh of") && !text.contains("without rays"), "{text}");
    let near = answers(&out, "500001.45,4000000.05,300.05\n", &[]);
    assert!((near[0]["distance"].as_f64().unwrap() - 0.55).abs() < 0.1, "{}", near[0]);
}

#[test]
fn clouds_and_meshes_are_described() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = folder.path().join("cloud.csv");
    std::fs::write(&cloud, "x,y,z,intensity,time\n1,2,3,5,10\n4,5,6,5,10.5\nnan,0,0,5,11\n").unwrap();
    let info = json(["info", arg(&cloud), "--json"]);
    let about = &info["clouds"]["cloud_0"];
    assert_eq!((&about["points"], &about["refused"]), (&serde_json::json!(2), &serde_json::json!(1)));
    assert_eq!(about["fields"], "position, intensity, time");
    assert_eq!(about["time_span"], serde_json::json!([10.0, 10.5]));
    assert_eq!(about["extent"]["max"], serde_json::json!([4.0, 5.0, 6.0]));
    assert_eq!(about["organised"], serde_json::Value::Null);

    // A mesh in each format: what the map writes, compared with itself.
    let (log, out) = (folder.path().join("scan.xyz"), folder.path().join("out"));
    std::fs::write(&log, fused([0.0; 3])).unwrap();
    map(&log, &out, &["--origin", "0,0,0"]);
    let triangles = summary(&out)["mesh"]["triangles"].clone();
    for ending in ["ply", "obj", "glb"] {
        let mesh = folder.path().join(format!("mesh.{ending}"));
        succeed(["mesh", arg(&out), arg(&mesh)]);
        let info = json(["info", arg(&mesh), "--json"]);
        assert_eq!(info["triangles"], triangles, "{ending}");
        assert!(info["kind"].as_str().unwrap().starts_with("a mesh"), "{info}");
        let compared = json(["eval", arg(&out), "--reference", arg(&mesh), "--json"]);
        assert_eq!(compared["reference"]["kind"], "mesh");
        assert!(compared["reference"]["accuracy"]["largest"].as_f64().unwrap() < 1e-4, "{compared}");
    }
    let mesh = folder.path().join("mesh.obj");
    let refused =
        fail(1, ["map", arg(&mesh), "--out", arg(&folder.path().join("no")), "--resolution", "0.1"]);
    assert!(refused.contains("is a mesh (OBJ)"), "{refused}");
}
