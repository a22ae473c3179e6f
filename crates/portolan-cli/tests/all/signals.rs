//! Ctrl-C and SIGTERM: what was fused is saved, and the exit status and a sentence say so.
#![cfg(unix)]

use std::fs;
use std::io::Read as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use portolan_io::Manifest;

use crate::support::{arg, json, log_lines, map, room, succeed};

fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_portolan"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn send(signal: &str, child: &Child) {
    assert!(Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap().success());
}

/// Exit status and what was said on stderr.
fn ended(mut child: Child) -> (Option<i32>, String) {
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        assert!(start.elapsed() < Duration::from_secs(30), "it does not end");
        std::thread::sleep(Duration::from_millis(5));
    }
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    (child.wait().unwrap().code(), said)
}

const LONG: usize = 3000;

/// Maps a log of many scans and sends a signal while they are fused: how it ended, and how many scans it says to have saved.
fn interrupted(log: &Path, out: &Path, more: &[&str], signal: &str) -> (Option<i32>, String) {
    fs::write(log, log_lines(0, LONG)).unwrap();
    let call = ["map", arg(log), "--threads", "1", "--out", arg(out)];
    // On a busy machine the log is not read yet when the signal comes: then once more, later.
    for wait in [1500, 4000, 10_000, 25_000] {
        let child = start(&[&call[..], more].concat());
        std::thread::sleep(Duration::from_millis(wait));
        send(signal, &child);
        let (code, said) = ended(child);
        if said.contains(&format!(" of {LONG} scans")) {
            return (code, said);
        }
        assert!(said.contains("ended by SIG"), "{code:?}: {said}");
    }
    panic!("nothing is fused after 25 s");
}

#[test]
fn map_saves_what_was_fused() {
    for (signal, status) in [("TERM", 143), ("INT", 130)] {
        for more in [&["--resolution", "0.01"][..], &["--resolution", "0.01", "--ledger"]] {
            let (folder, _) = room();
            let out = folder.path().join("out");
            let (code, said) = interrupted(&folder.path().join("long.log"), &out, more, signal);
            assert_eq!(code, Some(status), "{said}");
            assert!(said.starts_with(&format!("portolan: ended by SIG{signal}: ")), "{said}");
            let scans: u64 = said.split(' ').nth(4).unwrap().parse().unwrap_or_else(|_| panic!("{said}"));
            assert!(said.contains(&format!("{scans} of {LONG} scans are fused and saved")), "{said}");
            assert!(0 < scans && scans < LONG as u64, "{said}");
            let about = json(["info", arg(&out), "--json"]);
            assert_eq!(about["scans"], scans);
            assert!(about["warning"].is_null(), "a map alone is a set, too: {about}");
            let set = Manifest::read(&out).unwrap();
            let files: Vec<_> = set.files.keys().map(String::as_str).collect();
            assert_eq!((set.complete, files), (true, vec!["map.portolan", "summary.json"]));
            let summary = fs::read_to_string(out.join("summary.json")).unwrap();
            assert!(summary.contains(&format!("SIG{signal} ended this run after {scans}")), "{summary}");
        }
    }
}

#[test]
fn a_map_that_was_added_to_stays_as_it_was() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    succeed(["map", arg(&log), "--resolution", "0.01", "--out", arg(&out)]);
    let read = || {
        let entries = fs::read_dir(&out).unwrap().map(|e| e.unwrap().path());
        let mut files: Vec<_> = entries.map(|path| (fs::read(&path).unwrap(), path)).collect();
        files.sort();
        files
    };
    let before = read();
    let (code, said) = interrupted(&folder.path().join("long.log"), &out, &["--append"], "TERM");
    assert_eq!(code, Some(143), "{said}");
    assert!(said.contains("map.portolan is as it was after "), "{said}");
    assert!(before == read(), "{said}");
}

/// Whoever merges parts takes them for whole.
#[test]
fn a_part_of_a_log_is_whole_or_not_there() {
    let (folder, _) = room();
    let out = folder.path().join("out");
    let part = ["--resolution", "0.01", "--shard", "1/1"];
    let (code, said) = interrupted(&folder.path().join("long.log"), &out, &part, "TERM");
    assert_eq!(code, Some(143), "{said}");
    assert!(said.contains("nothing was written after ") && said.contains("start again"), "{said}");
    assert!(!out.exists());
}

#[test]
fn every_command_ends_in_time_and_says_so() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &[]);
    for (signal, status) in [("TERM", 143), ("INT", 130)] {
        // It waits for its points.
        let child = start(&["query", arg(&out), "--points", "-"]);
        std::thread::sleep(Duration::from_millis(500));
        send(signal, &child);
        assert_eq!(ended(child), (Some(status), format!("portolan: ended by SIG{signal}\n")));
    }
}

#[test]
fn the_studio_closes() {
    for (signal, status) in [("TERM", 143), ("INT", 0)] {
        let mut child = start(&["studio", "--port", "0", "--json"]);
        // Its first line: it serves.
        let mut byte = [0];
        while byte[0] != b'\n' {
            child.stdout.as_mut().unwrap().read_exact(&mut byte).unwrap();
        }
        send(signal, &child);
        let (code, said) = ended(child);
        assert_eq!(code, Some(status), "{said}");
        assert_eq!(said.contains("ended by SIGTERM: the studio is closed"), signal == "TERM", "{said}");
    }
}
