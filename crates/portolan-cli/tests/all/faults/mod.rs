//! Runs that are killed at every step at which a folder changes, and whose disk fails: the old files or the new ones, never
//! some of both, and the next run goes on as if nothing had been.
//!
//! The program itself knows nothing of this: a little library in C is loaded before the system's and lets calls go wrong.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use portolan_io::Manifest;

use crate::support::{arg, log_lines, portolan, succeed};

/// ENOSPC and EIO.
const FULL: &str = "28";
const BROKEN: &str = "5";

/// A folder with two logs, the files that a run makes of each, and the library that lets calls go wrong.
struct Bench {
    folder: tempfile::TempDir,
    library: PathBuf,
    first: BTreeMap<String, Vec<u8>>,
    second: BTreeMap<String, Vec<u8>>,
}

/// Files by name, hidden ones as well.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).filter(|path| path.is_file());
    entries.map(|p| (p.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(p).unwrap())).collect()
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (source, library) = (folder.path().join("shim.c"), folder.path().join("shim.so"));
        fs::write(&source, include_str!("shim.c")).unwrap();
        // Rust cannot link without one.
        let compiled = Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()))
            .args(["-shared", "-fPIC", "-O1", "-o", arg(&library), arg(&source), "-ldl"])
            .output()
            .unwrap();
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        fs::write(folder.path().join("first.log"), log_lines(0, 12)).unwrap();
        fs::write(folder.path().join("second.log"), log_lines(30, 45)).unwrap();
        let mut bench = Self { folder, library, first: BTreeMap::new(), second: BTreeMap::new() };
        succeed(bench.call("first", "a"));
        // Of one file more, and of some less.
        succeed(bench.call("second", "b"));
        (bench.first, bench.second) = (files(&bench.at("a")), files(&bench.at("b")));
        assert!(bench.first.contains_key("contour.svg") && !bench.second.contains_key("contour.svg"));
        bench
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Maps a log into a folder.
    fn call(&self, log: &str, out: &str) -> Vec<String> {
        let log_file = format!("{log}.log");
        let maps = if log == "first" { "grid,tsdf,contour" } else { "tree,tsdf,esdf" };
        let (log, out) = (self.at(&log_file), self.at(out));
        ["map", arg(&log), "--resolution", "0.1", "--out", arg(&out), "--maps", maps, "--overwrite"]
            .map(str::to_owned)
            .into()
    }

    /// Maps the second log over the first one's map, and one call goes wrong. `None`: there are not so many.
    fn fault(&self, call: &str, at: usize, what: &str) -> Option<Output> {
        let out = self.at("out");
        let _ = fs::remove_dir_all(&out);
        fs::create_dir(&out).unwrap();
        self.first.iter().for_each(|(name, bytes)| fs::write(out.join(name), bytes).unwrap());
        let run = Command::new(env!("CARGO_BIN_EXE_portolan"))
            .args(self.call("second", "out"))
            .env("LD_PRELOAD", &self.library)
            .envs([("FAULT_CALL", call), ("FAULT_AT", &at.to_string()), ("FAULT_DO", what)])
            .output()
            .unwrap();
        (!run.status.success()).then_some(run)
    }

    /// What lies in the folder is of one run, is told for what it is, and is in nobody's way. Whether it is the new map.
    fn check(&self, after: &str) -> bool {
        let out = self.at("out");
        let now = files(&out);
        let is = |set: &BTreeMap<String, Vec<u8>>, name: &str| set.get(name) == now.get(name);
        let new = is(&self.second, "map.portolan");
        assert!(new || is(&self.first, "map.portolan"), "{after}: no map at all");
        let set = if new { &self.second } else { &self.first };
        for name in now.keys().filter(|name| !name.starts_with('.') && *name != Manifest::NAME) {
            // Seconds are in the summary: it is of the log that it names.
            let of_set = match &**name {
                "summary.json" => {
                    let text = String::from_utf8(now[name].clone()).unwrap();
                    text.contains(if new { "second.log" } else { "first.log" })
                }
                _ => is(set, name),
            };
            assert!(of_set, "{after}: {name} is not of the run of map.portolan");
        }
        let manifest = Manifest::read(&out).unwrap_or_else(|| panic!("{after}: no manifest"));
        let all = set.keys().all(|name| now.contains_key(name));
        assert!(all || !manifest.is_whole(&out), "{after}: files are missing, and nothing says so");
        let map = portolan(["info", arg(&out)]);
        assert!(map.status.success(), "{after}: the map cannot be read");
        succeed(self.call("second", "out"));
        let names: Vec<_> =
            fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        assert_eq!(names.len(), self.second.len(), "{after}: something is left: {names:?}");
        let again = files(&out);
        let same = |name: &&String| !["summary.json", Manifest::NAME].contains(&name.as_str());
        assert!(self.second.keys().filter(same).all(|name| again[name] == self.second[name]), "{after}");
        new
    }
}

#[test]
fn killed_at_any_step_a_folder_is_of_one_run() {
    let bench = Bench::new();
    for (call, least) in [("rename", 8), ("unlink", 7), ("fsync", 6), ("open", 8)] {
        let mut new = Vec::new();
        for at in 1.. {
            if bench.fault(call, at, "kill").is_none() {
                break;
            }
            new.push(bench.check(&format!("killed before {call} {at}")));
        }
        assert!(new.len() >= least, "only {} times {call}", new.len());
        assert!(!new[0] && (call == "unlink" || new[new.len() - 1]), "{call}: {new:?}");
    }
}

#[test]
fn a_disk_that_fails_leaves_one_run_and_a_sentence() {
    let bench = Bench::new();
    let said = |run: &Output, after: &str| {
        let text = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(1), "{after}: {text}");
        assert!(text.starts_with("portolan: ") && text.lines().count() == 1, "{after}: {text}");
        assert!(text.contains(arg(&bench.at("out"))), "{after}: {text}");
        text
    };
    for call in ["rename", "fsync", "open"] {
        for at in 1.. {
            let Some(run) = bench.fault(call, at, BROKEN) else { break };
            let after = format!("{call} {at} failed");
            let text = said(&run, &after);
            let new = bench.check(&after);
            let told = ["map.portolan is saved", "map.portolan: cannot write it"];
            assert!(!new || told.iter().any(|words| text.contains(words)), "{after}: {text}");
        }
    }
    let mut saved = 0;
    for at in (1..8).chain((8..).step_by(5)) {
        let Some(run) = bench.fault("write", at, FULL) else { break };
        let after = format!("no room from write {at} on");
        let text = said(&run, &after);
        assert!(text.contains("No space left on device"), "{after}: {text}");
        saved += usize::from(bench.check(&after));
    }
    assert!(saved > 1, "a map is saved before what follows from it");
}
