//! What the fuzz targets share: one function a reader, and seeds for each, made by the project's own writers.
//!
//! A target that finds `PORTOLAN_SEEDS` writes its seeds into that folder before it starts, and stops where a reader does not
//! read a seed: then it would fuzz nothing but its first error.

pub mod bags;
pub mod readers;
mod seeds;

use std::path::{Path, PathBuf};

/// A reader: whether the bytes were read.
pub type Reader = fn(&[u8]) -> bool;

/// Writes the seeds of a target.
pub fn start(name: &str, reader: Reader) {
    let Some(folder) = std::env::var_os("PORTOLAN_SEEDS") else { return };
    let folder = PathBuf::from(folder);
    std::fs::create_dir_all(&folder).unwrap();
    for (i, bytes) in seeds::of(name).into_iter().enumerate() {
        assert!(reader(&bytes), "{name}: seed {i} is not read");
        std::fs::write(folder.join(format!("seed-{i}")), bytes).unwrap();
    }
}

/// A folder of this process for readers of files.
pub fn folder() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("portolan-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A file of that folder with these bytes.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder().join(name);
    write(&path, bytes);
    path
}

/// Writes a file and the folders above it.
pub fn write(path: &Path, bytes: &[u8]) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, bytes).unwrap();
}

/// Two files in one input: the length of the first in two bytes, the first, the second.
pub fn two(first: &[u8], second: &[u8]) -> Vec<u8> {
    [&u16::try_from(first.len()).unwrap().to_le_bytes()[..], first, second].concat()
}

/// [`two`] taken apart, whatever the bytes are.
pub fn apart(bytes: &[u8]) -> (&[u8], &[u8]) {
    let Some((length, rest)) = bytes.split_first_chunk::<2>() else { return (bytes, &[]) };
    rest.split_at(usize::from(u16::from_le_bytes(*length)).min(rest.len()))
}

/// A fuzz target of a reader.
#[macro_export]
macro_rules! target {
    ($name:literal, $reader:path) => {
        libfuzzer_sys::fuzz_target!(
            init: portolan_fuzz::start($name, $reader),
            |data: &[u8]| {
                $reader(data);
            }
        );
    };
}
