//! Helpers of the tests: random numbers, bad bytes, the folder of real data.

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::Result;

/// SplitMix64 *(Steele, Lea, Flood 2014)*.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    /// Uniform in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Variants of a good file that no reader may panic on or hang at: cut, with flipped, inserted and removed
/// bytes, with large lengths, and plain noise.
pub(crate) fn bad_bytes(good: &[u8], seed: u64, count: usize) -> Vec<Vec<u8>> {
    let mut random = Random(seed);
    let mut all = vec![Vec::new(), vec![0; 300], vec![0xff; 300]];
    for cut in 0..good.len().min(200) {
        all.push(good[..cut].to_vec());
    }
    for k in 0..count {
        let mut bytes = good.to_vec();
        for _ in 0..1 + random.below(4) {
            let at = random.below(bytes.len());
            match k % 6 {
                _ if bytes.is_empty() => {}
                0 => bytes.truncate(at),
                1 => bytes[at] ^= 1 << random.below(8),
                2 => bytes.insert(at, random.next() as u8),
                3 => drop(bytes.remove(at)),
                4 => {
                    let end = (at + 8).min(bytes.len());
                    bytes[at..end].fill([0xff, 0x7f, 0x00, b'9'][random.below(4)]);
                }
                _ => bytes = (0..random.below(400)).map(|_| random.next() as u8).collect(),
            }
        }
        all.push(bytes);
    }
    all
}

/// Reads variants of a good file: none may make it panic, and errors are of one line.
pub(crate) fn no_panic<T>(
    good: impl AsRef<[u8]>,
    seed: u64,
    count: usize,
    read: impl Fn(Vec<u8>) -> Result<T>,
) {
    for bytes in bad_bytes(good.as_ref(), seed, count) {
        if let Err(e) = read(bytes) {
            assert!(!e.to_string().contains('\n'), "{e}");
        }
    }
}

/// A folder that goes when it is dropped, and the path of a file in it.
pub(crate) fn temporary(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

/// The bytes that a writer makes.
pub(crate) fn written(write: impl FnOnce(&Path) -> Result<()>) -> Vec<u8> {
    let (_folder, path) = temporary("file");
    write(&path).unwrap();
    std::fs::read(path).unwrap()
}

/// Asserts an error of one line that has this part.
#[track_caller]
pub(crate) fn says<T>(result: Result<T>, part: &str) {
    let error = result.err().unwrap().to_string();
    assert!(error.contains(part) && !error.contains('\n'), "{error}");
}

/// A file of the real data, or `None` with a loud line where it is not there.
pub(crate) fn real_data(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("PORTOLAN_DATA").map(PathBuf::from);
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = folder.unwrap_or_else(beside).join(name);
    if path.exists() {
        return Some(path);
    }
    skipped(&format!("{} is not there (set PORTOLAN_DATA to the folder of real data)", path.display()));
    None
}

/// Says that a test was skipped. Not by `eprintln!`, which the test harness swallows: it must be seen.
fn skipped(why: &str) {
    writeln!(std::io::stderr(), "SKIPPED: {why}").unwrap();
}

/// A Python with a package.
pub(crate) struct Python(PathBuf);

/// The Python of `PORTOLAN_PYTHON`, else `python3`, if it has the package. Without it a loud line is printed and the
/// test is skipped.
pub(crate) fn python(package: &str) -> Option<Python> {
    let named = std::env::var_os("PORTOLAN_PYTHON").map(PathBuf::from);
    let python = Python(named.unwrap_or_else(|| "python3".into()));
    if python.run(&format!("import {package}"), &[]).is_ok() {
        return Some(python);
    }
    let shown = python.0.display();
    skipped(&format!("{shown} has no {package} (set PORTOLAN_PYTHON to a Python that has)"));
    None
}

impl Python {
    /// Runs a script; what it wrote on its error output where it failed.
    pub(crate) fn run(&self, script: &str, arguments: &[&Path]) -> Result<(), String> {
        let ran = std::process::Command::new(&self.0).arg("-c").arg(script).args(arguments).output();
        match ran {
            Ok(output) if output.status.success() => Ok(()),
            Ok(output) => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
            Err(e) => Err(e.to_string()),
        }
    }
}
