//! A folder of results is one thing: nothing in it is lost by a slip, and files of two runs are never one set.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use portolan_io::Manifest;

use crate::support::{arg, fail, log_lines, map, portolan, room, succeed};

/// The names of all files, hidden ones as well.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn stderr(arguments: &[&str]) -> String {
    String::from_utf8(portolan(arguments).stderr).unwrap()
}

#[test]
fn a_map_is_replaced_only_if_that_is_asked_for() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    let call = ["map", arg(&log), "--resolution", "0.1", "--out", arg(&out)];
    succeed(call);
    let held = fs::read(out.join("map.portolan")).unwrap();
    let before = names(&out);
    let finer = ["map", arg(&log), "--resolution", "0.2", "--out", arg(&out)];
    let refused = fail(2, finer);
    assert!(refused.contains("--overwrite") && refused.contains("--append"), "{refused}");
    assert!(fail(2, ["demo", "--out", arg(&out)]).contains("a map that demo did not make"));
    assert!(fail(2, [&finer[..], &["--overwrite", "--append"]].concat()).contains("cannot be used with"));
    assert_eq!((fs::read(out.join("map.portolan")).unwrap(), names(&out)), (held.clone(), before));
    succeed([&finer[..], &["--overwrite"]].concat());
    assert_ne!(fs::read(out.join("map.portolan")).unwrap(), held);

    // A map of somebody else, and a list of something else.
    for name in ["map.yaml", "manifest.json"] {
        let other = tempfile::tempdir().unwrap();
        fs::write(other.path().join(name), "mine").unwrap();
        let call = ["map", arg(&log), "--resolution", "0.1", "--out", arg(other.path())];
        assert!(fail(2, call).contains(&format!("{name}: is there already")));
        assert_eq!(names(other.path()), [name]);
        succeed([&call[..], &["--overwrite"]].concat());
    }
}

#[test]
fn merging_replaces_only_if_that_is_asked_for() {
    let (folder, log) = room();
    let at = |name: &str| folder.path().join(name);
    map(&log, &at("a"), &["--ledger"]);
    let call = ["merge", arg(&at("a")), "--out", arg(&at("sum")), "--map-only"].map(str::to_owned);
    succeed(&call);
    let refused = fail(2, &call);
    assert!(refused.contains("--overwrite") && !refused.contains("--append"), "{refused}");
    succeed(call.iter().map(String::as_str).chain(["--overwrite"]));
    assert_eq!(names(&at("sum")), ["manifest.json", "map.portolan", "summary.json"]);
}

/// A run that takes its time, at work in its folder.
fn slow_run(folder: &Path, out: &Path, more: &[&str]) -> Child {
    let log = folder.join("long.log");
    fs::write(&log, log_lines(0, 3000)).unwrap();
    let child = Command::new(env!("CARGO_BIN_EXE_portolan"))
        .args(["map", arg(&log), "--resolution", "0.01", "--threads", "1", "--out", arg(out)])
        .args(more)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let started = Instant::now();
    while !out.join(".portolan.lock").exists() {
        assert!(started.elapsed() < Duration::from_secs(60), "it does not start");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

#[test]
fn the_second_run_is_refused_at_once_and_the_next_one_is_not_blocked() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &["--ledger"]);
    let held = fs::read(out.join("map.portolan")).unwrap();
    let mut first = slow_run(folder.path(), &out, &["--overwrite"]);
    let who = format!("process {} (", first.id());
    // Whoever has just taken it may not have written its name yet.
    while !fs::read_to_string(out.join(".portolan.lock")).unwrap().contains(&who) {}
    let start = Instant::now();
    for call in [
        vec!["map", arg(&log), "--append", "--out", arg(&out)],
        vec!["map", arg(&log), "--resolution", "0.1", "--overwrite", "--out", arg(&out)],
        vec!["merge", arg(&out), "--overwrite", "--out", arg(&out)],
        vec!["demo", "--out", arg(&out)],
    ] {
        let refused = fail(1, &call);
        assert!(refused.contains(&who) && refused.contains("--threads 1"), "{call:?}: {refused}");
    }
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    assert!(first.try_wait().unwrap().is_none(), "the first run had ended");
    // Killed as hard as can be: the lock is gone, whatever lies around.
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(fs::read(out.join("map.portolan")).unwrap(), held);
    fs::create_dir(out.join(".portolan-parts-abc123")).unwrap();
    fs::write(out.join(".map.portolan.portolan-00112233.tmp"), "half").unwrap();
    succeed(["map", arg(&log), "--resolution", "0.1", "--overwrite", "--maps", "tree", "--out", arg(&out)]);
    assert_eq!(
        names(&out),
        ["manifest.json", "map.pgm", "map.png", "map.portolan", "map.yaml", "summary.json"]
    );
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_found_before_the_log_is_fused() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    fs::create_dir_all(out.join("map.pgm")).unwrap();
    let call = ["map", arg(&log), "--resolution", "0.1", "--out", arg(&out)];
    assert!(fail(1, call).contains("map.pgm: is a folder in the place of a file"));
    fs::remove_dir(out.join("map.pgm")).unwrap();
    assert!(Command::new("mkfifo").arg(out.join("map.portolan")).status().unwrap().success());
    assert!(fail(1, call).contains("map.portolan: is a pipe or device in the place of a file"));
    assert_eq!(names(&out), ["map.portolan"]);
}

#[test]
fn half_a_set_is_told_and_the_map_is_read() {
    let (folder, log) = room();
    let [out, other, points] = ["out", "other", "points.csv"].map(|name| folder.path().join(name));
    fs::write(&points, "1,1\n").unwrap();
    map(&log, &out, &[]);
    succeed(["map", arg(&log), "--resolution", "0.1", "--out", arg(&other)]);
    let mut set = Manifest::read(&out).unwrap();
    assert!(set.complete && set.files.len() == 9 && set.command == "map", "{set:?}");
    let derived = ["map.yaml", "map.pgm", "contour.geojson", "esdf.bin"].map(|name| out.join(name));
    let readable = |path: &Path| portolan(["info", arg(path)]).status.success();
    assert!(derived.iter().all(|path| readable(path)));
    assert_eq!(stderr(&["query", arg(&out), "--points", arg(&points)]), "");

    // Of another run: of the pair neither is taken.
    let own = fs::read(out.join("map.pgm")).unwrap();
    fs::copy(other.join("map.pgm"), out.join("map.pgm")).unwrap();
    for path in [&derived[0], &derived[1]] {
        let refused = fail(1, ["info", arg(path)]);
        assert!(refused.contains("map.pgm: its content is other than"), "{refused}");
    }
    assert!(readable(&derived[2]));
    // What a command was told to write there is no damage.
    succeed(["convert", arg(&out.join("map.portolan")), arg(&out.join("map.yaml"))]);
    assert!(readable(&derived[0]) && readable(&derived[1]));
    fs::write(out.join("map.pgm"), own).unwrap();

    // As a run leaves it that was killed before it had replaced anything, then after the map.
    (set.complete, set.writes) = (false, vec!["esdf.bin".into(), "map.png".into()]);
    set.files.retain(|name, _| !["map.yaml", "map.pgm"].contains(&name.as_str()));
    set.write(&out).unwrap();
    assert!(derived.iter().all(|path| readable(path)));
    fs::copy(other.join("map.portolan"), out.join("map.portolan")).unwrap();
    for path in &derived[2..] {
        let refused = fail(1, ["info", arg(path)]);
        assert!(refused.contains("half-written") && refused.contains("map.portolan"), "{refused}");
    }
    let said = "map.portolan is whole, but the set of files around it is half-written";
    assert!(stderr(&["query", arg(&out), "--points", arg(&points)]).contains(said));
    assert!(stderr(&["mesh", arg(&out), arg(&folder.path().join("c.svg"))]).contains(said));
    assert!(stderr(&["eval", arg(&out), "--scans", arg(&log)]).contains(said));
    assert!(stderr(&["convert", arg(&out), arg(&folder.path().join("c.npz"))]).contains(said));
    assert!(succeed(["info", arg(&out)]).contains(said));
}
