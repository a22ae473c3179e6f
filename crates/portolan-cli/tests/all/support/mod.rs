//! A small world with a log of it, and ways to run the program.

pub(crate) mod logs_3d;

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A part of the real data, at `PORTOLAN_DATA`, else `../shared/data` beside the workspace; `None`, with a loud line, where it is
/// not there.
pub(crate) fn real_data(name: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = std::env::var_os("PORTOLAN_DATA").map_or_else(beside, PathBuf::from).join(name);
    if path.exists() {
        return Some(path);
    }
    // Not `eprintln!`, which the test harness swallows: a skipped test must be seen.
    let note =
        format!("SKIPPED: {} is not there (set PORTOLAN_DATA to the folder of real data)\n", path.display());
    std::io::stderr().write_all(note.as_bytes()).unwrap();
    None
}

/// The program, run with these arguments.
pub(crate) fn portolan<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_portolan")).args(arguments).output().expect("the program can be run")
}

/// Standard output of a run that must succeed.
pub(crate) fn succeed<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> String {
    let output = portolan(arguments);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{}: {err}{out}", output.status);
    out
}

/// Standard error of a run that must fail with this status, in one line.
pub(crate) fn fail<S: AsRef<std::ffi::OsStr>>(status: i32, arguments: impl IntoIterator<Item = S>) -> String {
    let output = portolan(arguments);
    let err = text(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{err}{}", text(&output.stdout));
    assert!(output.stdout.is_empty(), "a failed run prints nothing on stdout");
    err
}

/// One JSON document and nothing else.
pub(crate) fn json<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> serde_json::Value {
    let text = succeed(arguments);
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Range from a point in the direction of an angle inside the room `[0, 6] x [0, 4]`, which holds a pillar
/// `[2.5, 3.5] x [1.5, 2.5]`.
pub(crate) fn range(p: [f64; 2], angle: f64) -> f64 {
    let d = [angle.cos(), angle.sin()];
    let mut best = f64::INFINITY;
    for (low, high, inside) in [([0.0, 0.0], [6.0, 4.0], true), ([2.5, 1.5], [3.5, 2.5], false)] {
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..2 {
            let (a, b) = ((low[k] - p[k]) / d[k], (high[k] - p[k]) / d[k]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        let hit = if inside { far } else { near };
        if near <= far && hit > 0.0 {
            best = best.min(hit);
        }
    }
    best
}

/// The pose of scan `i`: a lap around the pillar.
pub(crate) fn pose(i: usize) -> [f64; 3] {
    let a = i as f64 * 0.105;
    [3.0 + 2.0 * a.cos(), 2.0 + 1.4 * a.sin(), a + 1.5]
}

/// A line of a CARMEN log.
pub(crate) fn flaser(ranges: &[f64], [x, y, theta]: [f64; 3], time: f64) -> String {
    let mut line = format!("FLASER {}", ranges.len());
    for r in ranges {
        write!(line, " {r:.3}").unwrap();
    }
    write!(line, " {x:.4} {y:.4} {theta:.5} {x:.4} {y:.4} {theta:.5} {time:.2} host {time:.2}").unwrap();
    line
}

/// Scans `first..last` of the lap; every 20th beam has no echo.
pub(crate) fn log_lines(first: usize, last: usize) -> String {
    let mut log = String::from("# a room with a pillar\n");
    for i in first..last {
        let at = pose(i);
        let ranges: Vec<f64> = (0..180)
            .map(|b| {
                let bearing = -std::f64::consts::FRAC_PI_2 + b as f64 * std::f64::consts::PI / 180.0;
                // Without echo now and then, and a little noise that is the same everywhere.
                let noise = 0.01 * ((i * 180 + b) as f64 * 12.9898).sin();
                if b % 20 == 7 { 81.83 } else { range([at[0], at[1]], at[2] + bearing) + noise }
            })
            .collect();
        log.push_str(&flaser(&ranges, at, i as f64 * 0.1));
        log.push('\n');
    }
    log
}

/// A folder with a log of 60 scans in it, and the log.
pub(crate) fn room() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("room.log");
    std::fs::write(&log, log_lines(0, 60)).unwrap();
    (folder, log)
}

/// A path as an argument.
pub(crate) fn arg(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Fuses a log at 5 cm, over what is in the folder.
pub(crate) fn map(log: &Path, out: &Path, more: &[&str]) -> String {
    let mut arguments = vec!["map", arg(log), "--resolution", "0.05", "--overwrite", "--out", arg(out)];
    arguments.extend(more);
    succeed(arguments)
}
