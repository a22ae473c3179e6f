//! `manifest.json`: which files of a folder one run wrote, so that files of two runs are never taken for one set.
//!
//! A run writes it twice: before it removes or replaces the first file, to say that the set is being made
//! ([`Manifest::complete`] is false), and after the last one, with the size and checksum of each.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::{IoError, Result, write_durable};

/// What one run wrote into a folder.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Manifest {
    /// `portolan` and its version.
    pub program: String,
    /// The command that wrote the set.
    pub command: String,
    /// Whether all files of the set are there.
    pub complete: bool,
    /// The files of a complete set, this one not among them. While a set is being made: those of the one before.
    pub files: BTreeMap<String, FileSum>,
    /// While a set is being made: names that may be written.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub writes: Vec<String>,
}

/// What tells a file from another one of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub struct FileSum {
    /// Length.
    pub bytes: u64,
    /// CRC-32C of all bytes.
    pub crc32c: u32,
}

impl FileSum {
    /// Of a file.
    ///
    /// # Errors
    /// [`IoError::Os`] where it cannot be read.
    pub fn of(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let failed = |e| IoError::os(path, "read it", e);
        let mut file = File::open(path).map_err(failed)?;
        let (mut bytes, mut crc32c, mut buffer) = (0, 0, vec![0; 1 << 16]);
        loop {
            match file.read(&mut buffer).map_err(failed)? {
                0 => return Ok(Self { bytes, crc32c }),
                n => {
                    bytes += n as u64;
                    crc32c = crc32c::crc32c_append(crc32c, &buffer[..n]);
                }
            }
        }
    }
}

impl Manifest {
    /// Its name.
    pub const NAME: &str = "manifest.json";
    /// A longer one is not ours.
    const LONGEST: u64 = 1 << 20;

    /// The manifest of a folder; `None`: it has none that a portolan wrote.
    pub fn read(folder: &Path) -> Option<Self> {
        let file = File::open(folder.join(Self::NAME)).ok()?;
        if !file.metadata().ok()?.is_file() {
            return None;
        }
        let mut text = String::new();
        file.take(Self::LONGEST).read_to_string(&mut text).ok()?;
        let manifest: Self = serde_json::from_str(&text).ok()?;
        manifest.program.starts_with("portolan ").then_some(manifest)
    }

    /// Writes it into a folder, and it is on the disk when this returns.
    ///
    /// # Errors
    /// As [`write_durable`].
    pub fn write(&self, folder: &Path) -> Result<()> {
        write_durable(folder.join(Self::NAME), |w| {
            serde_json::to_writer_pretty(&mut *w, self)?;
            writeln!(w)
        })
    }

    /// Whether the files in the folder are one set: the complete one, or, where a run ended before it touched a file, the one
    /// before.
    pub fn is_whole(&self, folder: &Path) -> bool {
        let as_listed =
            |(name, sum): (&String, &FileSum)| FileSum::of(folder.join(name)).is_ok_and(|now| now == *sum);
        self.complete || (!self.files.is_empty() && self.files.iter().all(as_listed))
    }

    /// Refuses a file of a set that is not whole, and one that is not as its run left it. Files that no run wrote, and
    /// `map.portolan`, which has checksums of its own, are what they are.
    ///
    /// # Errors
    /// [`IoError::Layout`], in words.
    pub fn check(path: &Path) -> Result<()> {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return Ok(()) };
        let Some(manifest) = Self::read(folder).filter(|_| name != MAP) else { return Ok(()) };
        let listed = manifest.files.get(name);
        if listed.is_none() && !manifest.writes.iter().any(|written| written == name) {
            return Ok(());
        }
        if !manifest.is_whole(folder) {
            let advice =
                "map again with --overwrite, or make it again from map.portolan, which is whole by itself";
            return Err(IoError::layout(path, "the set of files around it", manifest.half(), advice));
        }
        match listed {
            Some(sum) if FileSum::of(path)? != *sum => {
                let value = format!("other than {} of its set wrote it", manifest.command);
                let advice =
                    "copy the whole folder again; where the change is meant, remove manifest.json beside it";
                Err(IoError::layout(path, "its content", value, advice))
            }
            _ => Ok(()),
        }
    }

    /// That a set is not whole, in words.
    pub fn half(&self) -> String {
        format!(
            "half-written: a run of {} ended, or has not ended yet, before all of them were there",
            self.command
        )
    }

    /// Takes a file out of the set of its folder, since something else has been written in its place.
    ///
    /// # Errors
    /// As [`Manifest::write`].
    pub fn forget(path: &Path) -> Result<()> {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return Ok(()) };
        let Some(mut manifest) = Self::read(folder).filter(|manifest| manifest.complete) else {
            return Ok(());
        };
        if manifest.files.remove(name).is_none() {
            return Ok(());
        }
        manifest.write(folder)
    }
}

/// Whole by itself.
const MAP: &str = "map.portolan";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::says;

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in ["map.portolan", "map.pgm", "map.yaml"] {
            std::fs::write(folder.path().join(name), name).unwrap();
        }
        folder
    }

    fn manifest(folder: &Path) -> Manifest {
        let names = ["map.portolan", "map.pgm", "map.yaml"];
        let sum = |name: &str| (name.to_owned(), FileSum::of(folder.join(name)).unwrap());
        let (program, command) = ("portolan 0.1.0".into(), "map".into());
        Manifest { program, command, complete: true, files: names.map(sum).into(), writes: Vec::new() }
    }

    #[test]
    fn files_of_another_run_are_told() {
        let folder = folder();
        let at = |name: &str| folder.path().join(name);
        Manifest::check(&at("map.pgm")).unwrap();
        let set = manifest(folder.path());
        assert_eq!(set.files["map.pgm"], FileSum { bytes: 7, crc32c: crc32c::crc32c(b"map.pgm") });
        set.write(folder.path()).unwrap();
        assert_eq!(Manifest::read(folder.path()), Some(set));
        Manifest::check(&at("map.pgm")).unwrap();
        // Of the same length.
        std::fs::write(at("map.pgm"), "MAP.pgm").unwrap();
        says(Manifest::check(&at("map.pgm")), "its content is other than map of its set wrote it");
        Manifest::check(&at("map.yaml")).unwrap();
        Manifest::forget(&at("map.pgm")).unwrap();
        Manifest::check(&at("map.pgm")).unwrap();
        assert_eq!(Manifest::read(folder.path()).unwrap().files.len(), 2);
    }

    #[test]
    fn half_a_set_is_told_unless_nothing_was_touched() {
        let folder = folder();
        let at = |name: &str| folder.path().join(name);
        let writes = vec!["map.pgm".into(), "map.yaml".into(), "mesh.ply".into()];
        let begun = Manifest { complete: false, writes, ..manifest(folder.path()) };
        begun.write(folder.path()).unwrap();
        Manifest::check(&at("map.pgm")).unwrap();
        std::fs::write(at("map.portolan"), "another map").unwrap();
        std::fs::write(at("mesh.ply"), "mesh").unwrap();
        std::fs::write(at("notes.txt"), "mine").unwrap();
        for name in ["map.pgm", "mesh.ply"] {
            says(Manifest::check(&at(name)), "half-written");
        }
        Manifest::check(&at("notes.txt")).unwrap();
        Manifest::check(&at("map.portolan")).unwrap();
        // Of the first set of a folder nothing was there before.
        Manifest { files: BTreeMap::new(), ..begun }.write(folder.path()).unwrap();
        says(Manifest::check(&at("map.pgm")), "half-written");
    }

    #[test]
    fn other_manifests_are_no_affair_of_ours() {
        let folder = folder();
        for text in ["{}", "", "\u{0}", r#"{"name": "a page", "icons": []}"#, r#"{"program": "gimp"}"#] {
            std::fs::write(folder.path().join(Manifest::NAME), text).unwrap();
            assert_eq!(Manifest::read(folder.path()), None);
            Manifest::check(&folder.path().join("map.pgm")).unwrap();
        }
    }
}
