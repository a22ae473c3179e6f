//! Maps of sums through the program: parts, merges, scans that are moved.

use std::path::{Path, PathBuf};

use crate::support::logs_3d::{camera_log, lidar_log};
use crate::support::{arg, fail, flaser, json, log_lines, pose, range, room, succeed};

fn map(log: &Path, out: &Path, more: &[&str]) {
    let call = ["map", arg(log), "--resolution", "0.1", "--out", arg(out), "--overwrite", "--quiet"];
    succeed(call.iter().copied().chain(more.iter().copied()));
}

fn bytes(out: &Path) -> Vec<u8> {
    std::fs::read(out.join("map.portolan")).unwrap()
}

fn merge(parts: &[&Path], out: &Path, more: &[&str]) {
    let call = ["merge", "--out", arg(out), "--overwrite", "--quiet"];
    succeed(call.iter().copied().chain(parts.iter().map(|p| arg(p))).chain(more.iter().copied()));
}

/// Parts of a log, merged in another order, are the map of the log, for any number of threads; without a part they are the rest.
fn parts_add_up(log: &Path, folder: &Path, more: &[&str]) {
    // A merged map does not know that its sensors were cameras, which the preview draws otherwise.
    let is_of_camera = log.join("camera-intrinsics.txt").exists();
    let out = |name: &str| -> PathBuf { folder.join(name) };
    let run = |name: &str, own: &[&str]| {
        map(log, &out(name), &[own, more].concat());
        bytes(&out(name))
    };
    let whole = run("whole", &["--ledger", "--threads", "1"]);
    assert!(run("again", &["--ledger", "--threads", "8"]) == whole);
    for (part, threads) in [("1/3", "2"), ("2/3", "1"), ("3/3", "8")] {
        run(&part.replace('/', "of"), &["--shard", part, "--threads", threads]);
    }
    merge(&[&out("2of3"), &out("3of3"), &out("1of3")], &out("merged"), &[]);
    assert!(bytes(&out("merged")) == whole);
    for file in ["esdf.bin", "preview.png", "map.png", "contour.geojson", "mesh.ply", "octree.bt"] {
        let [a, b] = ["whole", "merged"].map(|name| std::fs::read(out(name).join(file)).ok());
        assert!(a == b || file == "preview.png" && is_of_camera, "{file}");
    }
    merge(&[&out("merged")], &out("rest"), &["--without", arg(&out("2of3")), "--map-only"]);
    merge(&[&out("1of3"), &out("3of3")], &out("two"), &["--map-only"]);
    assert!(bytes(&out("rest")) == bytes(&out("two")));
    let names: Vec<_> = std::fs::read_dir(out("rest")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names.len(), 3, "{names:?}");
    // Nothing is left when all is taken out, and that is a map, too.
    merge(&[&out("merged")], &out("none"), &["--without", arg(&out("whole"))]);
    assert_eq!(json(["info", arg(&out("none")), "--json"])["scans"], 0);
    merge(&[&out("none"), &out("whole")], &out("back"), &["--map-only"]);
    assert!(bytes(&out("back")) == whole);
    let info = json(["info", arg(&out("whole")), "--json"]);
    assert_eq!(info["maps"]["sums"]["logs"][0]["scans"], info["scans"]);
    // A part twice would count its scans twice.
    let error = fail(1, ["merge", arg(&out("whole")), arg(&out("2of3")), "--out", arg(&out("x"))]);
    assert!(error.contains("is in the map already") && error.contains("2of3"), "{error}");
    let error =
        fail(1, ["merge", arg(&out("1of3")), "--without", arg(&out("2of3")), "--out", arg(&out("x"))]);
    assert!(error.contains("is not in the map"), "{error}");
    assert!(!out("x").exists());
}

/// A map that is larger than memory is the same map, alone, and so is one that is read back for it.
fn memory_is_enough(log: &Path, folder: &Path, memory: &str) {
    let out = |name: &str| -> PathBuf { folder.join(name) };
    map(log, &out("unlimited"), &["--ledger"]);
    let call =
        ["map", arg(log), "--resolution", "0.1", "--ledger", "--memory", memory, "--out", arg(&out("small"))]
            .map(str::to_owned);
    let text = succeed(call);
    assert!(text.contains("takes more memory than --memory allows"), "{text}");
    assert!(bytes(&out("small")) == bytes(&out("unlimited")));
    let mut names: Vec<_> =
        std::fs::read_dir(out("small")).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["manifest.json", "map.portolan", "summary.json"]);
    // So little that one scan alone has no room: said, and nothing is half done.
    let call =
        ["map", arg(log), "--resolution", "0.1", "--ledger", "--memory", "1K", "--out", arg(&out("none"))]
            .map(str::to_owned);
    let error = fail(1, call);
    assert!(error.contains("not one scan was fused") && error.contains("--memory"), "{error}");
    assert!(!out("none").exists());
}

#[test]
fn maps_may_be_larger_than_memory_in_2d() {
    let (folder, log) = room();
    memory_is_enough(&log, folder.path(), "90K");
}

#[test]
fn maps_may_be_larger_than_memory_in_3d() {
    let (folder, log) = lidar_log();
    memory_is_enough(&log, folder.path(), "4800K");
}

#[test]
fn parts_of_a_log_add_up_in_2d() {
    let (folder, log) = room();
    parts_add_up(&log, folder.path(), &[]);
}

#[test]
fn parts_of_a_log_add_up_in_3d() {
    let (folder, log) = lidar_log();
    parts_add_up(&log, folder.path(), &["--hold-out", "5"]);
}

#[test]
fn parts_of_a_log_with_colors_add_up() {
    let (folder, log) = camera_log();
    parts_add_up(&log, folder.path(), &["--max-range", "6"]);
    let mesh = |out: &Path| -> serde_json::Value {
        let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&summary).unwrap()["mesh"].take()
    };
    let at = |name: &str| folder.path().join(name);
    assert_eq!(mesh(&at("whole"))["colors"], true);
    // Those of the clamped cells, but for rounding; geometry is that of sums without colors.
    map(&log, &at("clamped"), &["--max-range", "6", "--w-max", "100000"]);
    map(&log, &at("plain"), &["--max-range", "6", "--ledger", "--no-color"]);
    assert_eq!(mesh(&at("plain"))["colors"], false);
    assert_eq!(mesh(&at("plain"))["triangles"], mesh(&at("whole"))["triangles"]);
    let mean = |name: &str| {
        let colors = portolan_io::read_mesh(at(name).join("mesh.ply")).unwrap().colors;
        let sum = |k: usize| colors.iter().map(|c| f64::from(c[k])).sum::<f64>() / colors.len() as f64;
        [sum(0), sum(1), sum(2)]
    };
    let (sums, clamped) = (mean("whole"), mean("clamped"));
    assert!((0..3).all(|k| (sums[k] - clamped[k]).abs() < 1.0), "{sums:?} {clamped:?}");
    // Sums without colors are other sums.
    map(&log, &at("third"), &["--max-range", "6", "--shard", "1/3", "--no-color"]);
    let error = fail(1, ["merge", arg(&at("third")), arg(&at("2of3")), "--out", arg(&at("x"))]);
    assert!(error.contains("color is true") && !at("x").exists(), "{error}");
}

/// Scans `0..30` of the lap, each displaced by `drift`.
fn drifting(drift: f64) -> String {
    let mut log = String::new();
    for i in 0..30 {
        let at = pose(i);
        let ranges: Vec<f64> =
            (0..180).map(|b| range([at[0], at[1]], at[2] + (b as f64 - 90.0).to_radians())).collect();
        let off = if i % 3 == 0 { drift } else { 0.0 };
        log.push_str(&flaser(&ranges, [at[0] + off, at[1] - off, at[2] + 0.1 * off], i as f64 * 0.1));
        log.push('\n');
    }
    log
}

#[test]
fn scans_follow_corrected_poses() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir_all(at("true")).unwrap();
    std::fs::create_dir_all(at("off")).unwrap();
    // Logs are known by their file names.
    std::fs::write(at("true/a.log"), drifting(0.0)).unwrap();
    std::fs::write(at("off/a.log"), drifting(0.2)).unwrap();
    let poses: String = (0..30)
        .map(|i| {
            let [x, y, theta] = pose(i);
            format!("{x:.4} {y:.4} {theta:.5}\n")
        })
        .collect();
    std::fs::write(at("poses.txt"), poses).unwrap();
    map(&at("true/a.log"), &at("scratch"), &["--ledger"]);
    map(&at("off/a.log"), &at("moved"), &["--ledger"]);
    assert!(bytes(&at("scratch")) != bytes(&at("moved")));
    let call = ["map", arg(&at("off/a.log")), "--out", arg(&at("moved")), "--repose", arg(&at("poses.txt"))]
        .map(str::to_owned);
    let text = succeed(&call);
    assert!(text.contains("10 of the 30 scans of this log in the map were moved"), "{text}");
    assert!(bytes(&at("scratch")) == bytes(&at("moved")));
    for file in ["esdf.bin", "contour.geojson", "map.pgm", "map.yaml"] {
        assert!(
            std::fs::read(at("scratch").join(file)).unwrap()
                == std::fs::read(at("moved").join(file)).unwrap()
        );
    }
    // Again: nothing moves.
    assert!(succeed(&call).contains("0 of the 30 scans"));
    // Less than the tolerance stays.
    map(&at("off/a.log"), &at("stays"), &["--ledger"]);
    let before = bytes(&at("stays"));
    let far = ["map", arg(&at("off/a.log")), "--out", arg(&at("stays")), "--tolerance", "3", "--repose"]
        .map(str::to_owned);
    succeed(far.into_iter().chain([arg(&at("poses.txt")).to_owned()]));
    assert!(bytes(&at("stays")) == before);
    // Clamped cells do not give scans back, and another log's scans are not there.
    map(&at("true/a.log"), &at("clamped"), &[]);
    let refused = |log: &str, out: &str| {
        fail(1, ["map", arg(&at(log)), "--out", arg(&at(out)), "--repose", arg(&at("poses.txt"))])
    };
    assert!(refused("true/a.log", "clamped").contains("made with --ledger only"));
    std::fs::write(at("b.log"), drifting(0.2)).unwrap();
    assert!(refused("b.log", "moved").contains("no scan of this log is in the map"));
    // Readings that are not those that were mapped are not taken away.
    std::fs::write(at("a.log"), drifting(0.2).replace(" 2.0", " 2.1")).unwrap();
    assert!(refused("a.log", "stays").contains("has other readings"));
    assert!(bytes(&at("stays")) == before);
}

#[test]
fn logs_add_up_and_slips_are_told() {
    let (folder, log) = room();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("more.log"), log_lines(60, 80)).unwrap();
    map(&log, &at("a"), &["--ledger"]);
    map(&at("more.log"), &at("b"), &["--ledger"]);
    map(&log, &at("ab"), &["--ledger"]);
    succeed(["map", arg(&at("more.log")), "--out", arg(&at("ab")), "--append", "--quiet"]);
    merge(&[&at("b"), &at("a")], &at("ba"), &[]);
    assert!(bytes(&at("ab")) == bytes(&at("ba")));
    assert_eq!(json(["info", arg(&at("ab")), "--json"])["scans"], 80);
    // The same log once more would count double.
    let error = fail(1, ["map", arg(&log), "--out", arg(&at("ab")), "--append", "--quiet"]);
    assert!(error.contains("scan 0 of room.log is in the map already"), "{error}");
    assert!(bytes(&at("ab")) == bytes(&at("ba")));
    // Maps that do not fit.
    map(&log, &at("clamped"), &[]);
    assert!(
        fail(1, ["merge", arg(&at("a")), arg(&at("clamped")), "--out", arg(&at("x"))])
            .contains("clamped cells")
    );
    let coarse =
        ["map", arg(&log), "--resolution", "0.2", "--ledger", "--quiet", "--out", arg(&at("coarse"))]
            .map(str::to_owned);
    succeed(coarse);
    let error = fail(1, ["merge", arg(&at("b")), arg(&at("coarse")), "--out", arg(&at("x"))]);
    assert!(error.contains("resolution"), "{error}");
    map(&log, &at("near"), &["--ledger", "--max-range", "3"]);
    let error = fail(1, ["merge", arg(&at("b")), arg(&at("near")), "--out", arg(&at("x"))]);
    assert!(error.contains("max_range"), "{error}");
    for (more, part) in [
        (&["--ledger", "--w-max", "5"][..], "cannot be used with"),
        (&["--shard", "1/2", "--half-life", "5"], "do not forget"),
        (&["--shard", "3/2"], "3/8"),
        (&["--shard", "0/2"], "3/8"),
        (&["--tolerance", "1"], "--repose"),
    ] {
        let call = ["map", arg(&log), "--resolution", "0.1", "--out", arg(&at("x"))].map(str::to_owned);
        let error = fail(2, call.into_iter().chain(more.iter().map(|&word| word.to_owned())));
        assert!(error.contains(part), "{part}: {error}");
    }
    assert!(!at("x").exists());
}

/// What would be wrong without a word.
#[test]
fn one_log_under_two_names_and_two_under_one_are_told() {
    let (folder, log) = room();
    let at = |name: &str| folder.path().join(name);
    map(&log, &at("a"), &["--ledger"]);
    std::fs::copy(&log, at("copy.log")).unwrap();
    map(&at("copy.log"), &at("b"), &["--ledger"]);
    let merged = succeed(["merge", arg(&at("a")), arg(&at("b")), "--out", arg(&at("ab"))]);
    assert!(merged.contains("60 scans have the readings and poses of scans of another log"), "{merged}");
    let appended = succeed(["map", arg(&at("copy.log")), "--out", arg(&at("a")), "--append"]);
    assert!(appended.contains("60 scans have the readings and poses"), "{appended}");
    assert!(bytes(&at("a")) == bytes(&at("ab")));
    // Another log of the same name, half of whose numbers would be new.
    std::fs::create_dir_all(at("other")).unwrap();
    std::fs::write(at("other/copy.log"), log_lines(20, 110)).unwrap();
    let before = bytes(&at("b"));
    let error = fail(1, ["map", arg(&at("other/copy.log")), "--out", arg(&at("b")), "--append"]);
    assert!(error.contains("has other readings") && error.contains("another name"), "{error}");
    assert!(bytes(&at("b")) == before);
    map(&at("other/copy.log"), &at("c"), &["--ledger"]);
    let error = fail(1, ["merge", arg(&at("b")), arg(&at("c")), "--out", arg(&at("x"))]);
    assert!(error.contains("has other readings"), "{error}");
    // A ledger cannot get another box, or maps that it was not made with.
    std::fs::write(at("more.log"), log_lines(60, 70)).unwrap();
    map(&at("more.log"), &at("flat"), &["--ledger", "--maps", "grid"]);
    for (out, more, part) in [
        ("b", &["--bounds", "0,0,2,2"][..], "--bounds: the map has others"),
        ("flat", &["--maps", "tsdf"], "--maps: the map holds no tsdf"),
    ] {
        let call = ["map", arg(&log), "--append", "--out", arg(&at(out))].map(str::to_owned);
        let error = fail(1, call.into_iter().chain(more.iter().map(|&word| word.to_owned())));
        assert!(error.contains(part), "{part}: {error}");
    }
    map(&at("more.log"), &at("thin"), &["--ledger", "--thin", "0.5"]);
    let error = fail(1, ["merge", arg(&at("b")), arg(&at("thin")), "--out", arg(&at("x"))]);
    assert!(error.contains("thin is 0.5 there"), "{error}");
    assert!(!at("x").exists());
}

/// What stands for "no echo" differs from sensor to sensor, and is no setting of their sum: any order, any way, back again.
#[test]
fn logs_of_different_sensors_add_up() {
    let (folder, log) = room();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("far.log"), log_lines(60, 90).replace(" 81.830", " 50.000")).unwrap();
    map(&log, &at("a"), &["--ledger"]);
    map(&at("far.log"), &at("b"), &["--ledger"]);
    let no_return = |out: &str| -> serde_json::Value {
        let text = std::fs::read(at(out).join("summary.json")).unwrap();
        serde_json::from_slice::<serde_json::Value>(&text).unwrap()["input"]["no_return"].clone()
    };
    assert!(no_return("a") != no_return("b"));
    merge(&[&at("a"), &at("b")], &at("ab"), &[]);
    merge(&[&at("b"), &at("a")], &at("ba"), &[]);
    assert!(bytes(&at("ab")) == bytes(&at("ba")));
    succeed(["map", arg(&at("far.log")), "--out", arg(&at("a")), "--append", "--quiet"]);
    assert!(bytes(&at("a")) == bytes(&at("ab")));
    merge(&[&at("ab")], &at("rest"), &["--without", arg(&at("b"))]);
    map(&log, &at("again"), &["--ledger"]);
    assert!(bytes(&at("rest")) == bytes(&at("again")));
}
