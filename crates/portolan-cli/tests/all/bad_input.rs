//! Bad input and bad calls: the error that each gives, in one line, within seconds and without a gigabyte.

use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::support::{arg, flaser, log_lines, map, portolan, pose, room, succeed};

/// Runs under a limit of one gigabyte of memory and expects one line on stderr with all these parts.
fn refused(status: i32, arguments: &[&str], parts: &[&str]) {
    let start = Instant::now();
    let limited = "ulimit -v 1048576; exec \"$0\" \"$@\"";
    let output = std::process::Command::new("/bin/bash")
        .args(["-c", limited, env!("CARGO_BIN_EXE_portolan")])
        .args(arguments)
        .env("RAYON_NUM_THREADS", "2")
        .output()
        .unwrap();
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {err}");
    assert!(output.stdout.is_empty());
    if status == 1 {
        assert_eq!(err.lines().count(), 1, "{err}");
    }
    for part in parts {
        assert!(err.contains(part), "{part:?} is not in: {err}");
    }
    assert!(start.elapsed() < Duration::from_secs(10), "{arguments:?} took {:?}", start.elapsed());
}

fn map_refused(log: &Path, more: &[&str], status: i32, parts: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut arguments = vec!["map", arg(log), "--out", arg(&out)];
    if !more.contains(&"--resolution") {
        arguments.extend(["--resolution", "0.05"]);
    }
    arguments.extend(more);
    refused(status, &arguments, parts);
    assert!(!out.exists(), "a run that failed leaves no folder");
}

fn file(name: &str, content: impl AsRef<[u8]>) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    (folder, path)
}

#[test]
fn logs_that_are_none() {
    let (_f, empty) = file("empty.log", "");
    map_refused(&empty, &[], 1, &["empty.log", "no usable laser scan in 0 lines"]);
    let (_f, missing) = file("x", "");
    let missing = missing.with_file_name("missing.log");
    map_refused(&missing, &[], 1, &["missing.log", "check the path"]);
    let folder = tempfile::tempdir().unwrap();
    map_refused(folder.path(), &[], 1, &[arg(folder.path()), "an empty folder; give the folder or the file"]);
    let noise: Vec<u8> = (0..20_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let (_f, random) = file("random.log", noise);
    map_refused(&random, &[], 1, &["random.log", "not a log: it starts with"]);
    map_refused(&random, &["--format", "carmen"], 1, &["random.log"]);
    let (_f, zero) = file("zero.log", "FLASER 0 0 0 0 0 0 0 0 host 0\n");
    map_refused(&zero, &[], 1, &["zero.log", "zero beams"]);
    let (_f, picture) = file("m.yaml", "image: a.pgm\nresolution: 0.05\n");
    map_refused(&picture, &[], 1, &["m.yaml", "is a map_server map, not a log"]);
}

#[test]
fn a_gzip_that_is_cut_off() {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(log_lines(0, 20).as_bytes()).unwrap();
    let packed = packed.finish().unwrap();
    let (_f, cut) = file("cut.log.gz", &packed[..packed.len() / 2]);
    map_refused(&cut, &[], 1, &["cut.log.gz", "the gzip stream ends too early", "again"]);
}

#[test]
fn readings_that_are_none_are_counted() {
    let ranges = [vec![f64::NAN; 90], vec![-1.0; 45], vec![f64::INFINITY; 45]].concat();
    let (folder, bad) = file("nan.log", flaser(&ranges, pose(0), 0.0) + "\n");
    let out = folder.path().join("out");
    let text = map(&bad, &out, &[]);
    assert!(
        text.contains("135 readings could not be used (90 not finite, 45 negative, 0 too near)"),
        "{text}"
    );
    assert!(text.contains("no surface was found"), "{text}");
    let points = folder.path().join("p.csv");
    std::fs::write(&points, "5,2\n").unwrap();
    let answer = succeed(["query", arg(&out), "--points", arg(&points)]);
    assert!(answer.contains("unknown,,,,,,"), "no surface is no distance: {answer}");
}

#[test]
fn a_scan_with_a_pose_that_is_no_number_is_refused_and_counted() {
    let bad = flaser(&[1.0; 180], [f64::NAN, 0.0, 0.0], 0.0);
    let (folder, log) = file("pose.log", log_lines(0, 5) + &bad + "\n");
    let text = map(&log, &folder.path().join("out"), &[]);
    assert!(text.contains("5 of 5 scans fused") && text.contains("1 scan lines could not be used"), "{text}");
    assert!(text.contains("line 7"), "{text}");
}

#[test]
fn settings_that_cannot_be() {
    let (_folder, log) = room();
    for (option, values) in [
        ("--resolution", &["-1", "0", "NaN", "inf", "abc"][..]),
        ("--truncation", &["-0.1", "nan"]),
        ("--w-max", &["0", "-3", "nan"]),
        ("--bounds", &["1,1,0,0", "0,0,nan,1", "1,2,3"]),
        ("--every", &["0", "-1", "x"]),
        ("--hold-out", &["0", "1"]),
        ("--memory", &["0", "x", "4Q"]),
        ("--threads", &["0"]),
        ("--maps", &["cloud"]),
        ("--weights", &["heavy"]),
    ] {
        for value in values {
            map_refused(&log, &[option, value], 2, &[value, option]);
        }
    }
    refused(2, &["map", arg(&log), "--out", "never"], &["--resolution"]);
    refused(2, &["fly"], &["fly"]);
}

#[test]
fn a_resolution_that_would_need_terabytes() {
    let (_folder, log) = room();
    map_refused(
        &log,
        &["--resolution", "1e-6"],
        1,
        &["room.log", "0.000001 needs", "PB", "--bounds", "--memory allows 4.29 GB"],
    );
    map_refused(&log, &["--resolution", "1e-12"], 1, &["room.log", "too much for cells of 0.000000000001 m"]);
    map_refused(&log, &["--resolution", "1e-300"], 1, &["room.log", "--bounds"]);
    map_refused(&log, &["--memory", "100k"], 1, &["room.log", "--memory allows 102 kB"]);
}

#[test]
fn poses_a_million_kilometres_away() {
    // One scan far off makes a box that cannot be held; it is named.
    let far = flaser(&[1.0; 180], [1e9, 0.0, 0.0], 0.0);
    let (folder, log) = file("far.log", log_lines(0, 20) + &far + "\n");
    map_refused(&log, &[], 1, &["far.log", "scan 20 lies at (1.0", "--bounds"]);
    let text = map(&log, &folder.path().join("out"), &["--bounds", "-1,-1,7,5"]);
    assert!(text.contains("1 scans have a pose that cannot be used"), "{text}");
    // All of them there are a map like any other.
    let all: String =
        (0..3).map(|i| flaser(&[2.0; 180], [1e9 + f64::from(i), -1e9, 0.0], 0.0) + "\n").collect();
    let (folder, log) = file("all.log", all);
    let text = map(&log, &folder.path().join("out"), &[]);
    assert!(text.contains("3 of 3 scans fused"), "{text}");
    let (_f, log) = file("over.log", flaser(&[2.0; 180], [1e300, 0.0, 0.0], 0.0));
    map_refused(&log, &[], 1, &["over.log", "too much for cells of 0.05 m"]);
}

#[test]
fn maps_with_lengths_that_cannot_be() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &[]);
    let points = folder.path().join("p.csv");
    std::fs::write(&points, "1,1\n").unwrap();
    let good = std::fs::read(out.join("map.portolan")).unwrap();
    let index = u64::from_le_bytes(std::array::from_fn(|k| good[16 + k])) as usize;
    let huge = (1u64 << 60).to_le_bytes();
    for at in [16, index + 8, index + 16, index + 24] {
        let mut bytes = good.clone();
        bytes[at..at + 8].copy_from_slice(&huge);
        let bad = folder.path().join("bad.portolan");
        std::fs::write(&bad, bytes).unwrap();
        for command in [vec!["info", arg(&bad)], vec!["query", arg(&bad), "--points", arg(&points)]] {
            refused(1, &command, &["bad.portolan", "byte "]);
        }
    }
    let mut field = std::fs::read(out.join("esdf.bin")).unwrap();
    field[16..20].copy_from_slice(&u32::MAX.to_le_bytes());
    let bad = folder.path().join("bad.bin");
    std::fs::write(&bad, &field).unwrap();
    refused(1, &["info", arg(&bad)], &["bad.bin", "the shape", "4294967295"]);
    field[16..20].copy_from_slice(&(1u32 << 20).to_le_bytes());
    std::fs::write(&bad, &field).unwrap();
    refused(1, &["info", arg(&bad)], &["bad.bin", "byte"]);
    // Cut off, and appended to.
    std::fs::write(&bad, &good[..good.len() - 9]).unwrap();
    refused(1, &["info", arg(&bad)], &["bad.bin", "checksum"]);
    std::fs::write(out.join("map.portolan"), &good[..40]).unwrap();
    refused(1, &["map", arg(&log), "--append", "--out", arg(&out)], &["map.portolan"]);
}

#[test]
fn the_wrong_kind_of_file() {
    let (folder, log) = room();
    let points = folder.path().join("p.csv");
    std::fs::write(&points, "1,1\n2\n").unwrap();
    refused(1, &["query", arg(&log), "--points", arg(&points)], &["room.log", "is a CARMEN log"]);
    refused(1, &["mesh", arg(&log), "a.svg"], &["room.log", "is a CARMEN log"]);
    refused(1, &["convert", arg(&log), "a.svg"], &["room.log", "it can become a map, by `portolan map`"]);
    refused(1, &["query", arg(folder.path()), "--points", arg(&points)], &["a folder without map.portolan"]);
    let out = folder.path().join("out");
    map(&log, &out, &[]);
    refused(1, &["query", arg(&out), "--points", arg(&points)], &["p.csv: line 2", "number of fields is 1"]);
    std::fs::write(&points, "1,1,1\n").unwrap();
    refused(1, &["query", arg(&out), "--points", arg(&points)], &["p.csv", "the map is 2-D"]);
    refused(
        1,
        &["map", arg(&log), "--resolution", "1", "--out", arg(&log)],
        &["room.log", "is a file, not a folder"],
    );
    refused(2, &["eval", arg(&out)], &["--scans"]);
    refused(2, &["mesh", arg(&out), "a.txt"], &["a.txt", ".geojson or .svg"]);
    map(&log, &out, &["--maps", "grid"]);
    refused(1, &["mesh", arg(&out), "a.svg"], &["the map has no tsdf"]);
}

#[test]
fn who_stops_reading_is_no_error() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &[]);
    let points = folder.path().join("p.csv");
    std::fs::write(&points, "1,1\n".repeat(100_000)).unwrap();
    let line =
        format!("\"$0\" query {} --points {} | head -1; echo ${{PIPESTATUS[0]}}", arg(&out), arg(&points));
    let output = std::process::Command::new("/bin/bash")
        .args(["-c", &line, env!("CARGO_BIN_EXE_portolan")])
        .output()
        .unwrap();
    assert!(output.stderr.is_empty());
    assert!(String::from_utf8_lossy(&output.stdout).ends_with("\n0\n"));
    assert!(portolan(["--version"]).status.success());
}
