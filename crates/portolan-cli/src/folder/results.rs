//! The way of a run through its folder.
//!
//! ```text
//! claim       lock it; refuse what cannot work before anything is computed
//! map_file    where the new map is written to, whole and on the disk
//! publish     manifest "being made"; old files of the set go; the new map gets its name
//! (the rest)  what follows from the map, file by file
//! complete    manifest with the sum of each file
//! ```
//!
//! Whenever it is killed, files of two runs are never side by side: there is the old set or a part of it, or the new map and
//! a part of what follows from it, and the manifest says that it is a part.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use portolan_io::{FileSum, Manifest, rename_durable};
use serde_json::Value;
use tempfile::TempDir;

use super::lock::FolderLock;
use crate::error::bad_call;

const MAP: &str = "map.portolan";
const SUMMARY: &str = "summary.json";
/// Before the name of a folder for what is not finished; only whoever holds the lock makes some, and may remove any.
const UNFINISHED: &str = ".portolan-parts-";

/// A folder that this run alone writes to.
pub(crate) struct Results {
    folder: PathBuf,
    command: &'static str,
    /// Whether it was not there, and goes again if nothing comes into it.
    made: bool,
    /// What the set before this one had.
    before: Option<Manifest>,
    /// Names that may be written.
    writes: Vec<String>,
    unfinished: Option<TempDir>,
    lock: Option<FolderLock>,
}

impl Results {
    /// Takes a folder for the results of a command, which may have these names.
    ///
    /// # Errors
    /// Where the folder cannot be made or written to, another run writes to it, or something that is no file has one of the
    /// names.
    pub(crate) fn claim(folder: &Path, command: &'static str, names: &[&str]) -> anyhow::Result<Self> {
        if folder.exists() && !folder.is_dir() {
            bail!("{}: is a file, not a folder; name a folder for the results", folder.display());
        }
        let made = !folder.exists();
        fs::create_dir_all(folder).with_context(|| {
            format!("{}: cannot create the folder; name one that can be written to", folder.display())
        })?;
        let mut results = Self {
            folder: folder.to_owned(),
            command,
            made,
            before: None,
            writes: names.iter().chain(&[MAP, SUMMARY]).map(|&name| name.to_owned()).collect(),
            unfinished: None,
            lock: None,
        };
        results.lock = Some(FolderLock::take(folder)?);
        results.check_kinds()?;
        results.sweep();
        results.before = Manifest::read(folder);
        Ok(results)
    }

    /// Refuses to replace a map, for commands that were not told to, or files of its names that no portolan wrote.
    pub(crate) fn refuse_to_replace(&self) -> anyhow::Result<()> {
        let shown = self.folder.display();
        if self.folder.join(MAP).exists() {
            return Err(bad_call(format!(
                "{shown}: holds a map already; give --overwrite to replace it{}, or name another folder",
                if self.command == "map" { ", --append to add the log to it" } else { "" }
            )));
        }
        self.refuse_foreign(", or give --overwrite to replace it")
    }

    /// Refuses to replace a map that another command made.
    pub(crate) fn refuse_others(&self) -> anyhow::Result<()> {
        let ours = self.before.as_ref().is_some_and(|before| before.command == self.command);
        if !ours && self.folder.join(MAP).exists() {
            return Err(bad_call(format!(
                "{}: holds a map that {} did not make; name another folder",
                self.folder.display(),
                self.command
            )));
        }
        self.refuse_foreign("")
    }

    fn refuse_foreign(&self, otherwise: &str) -> anyhow::Result<()> {
        let listed = self.listed();
        // A map of somebody else, and a list of something else.
        let foreign = |name: &&str| {
            self.folder.join(name).exists()
                && !listed.iter().any(|of_ours| of_ours == name)
                && !(*name == Manifest::NAME && self.before.is_some())
        };
        match ["map.yaml", Manifest::NAME].iter().find(|name| foreign(name)) {
            Some(name) => Err(bad_call(format!(
                "{}: is there already, and not of a map in this folder; name another folder{otherwise}",
                self.folder.join(name).display()
            ))),
            None => Ok(()),
        }
    }

    /// Files can only be replaced by files.
    fn check_kinds(&self) -> anyhow::Result<()> {
        for name in self.writes.iter().map(String::as_str).chain([Manifest::NAME]) {
            let path = self.folder.join(name);
            match fs::metadata(&path) {
                Ok(about) if !about.is_file() => bail!(
                    "{}: is {} in the place of a file; move it away, or name another folder",
                    path.display(),
                    if about.is_dir() { "a folder" } else { "a pipe or device" }
                ),
                _ => {}
            }
        }
        Ok(())
    }

    /// Removes what runs that were killed had not finished.
    fn sweep(&self) {
        // What cannot be removed takes room, and nothing else.
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        for entry in entries.flatten().filter(|e| e.file_name().to_string_lossy().starts_with(UNFINISHED)) {
            let _ = fs::remove_dir_all(entry.path());
        }
    }

    /// Names that the sets before this one had. Of folders that are older than manifests the summary says it.
    fn listed(&self) -> Vec<String> {
        match &self.before {
            Some(before) => before.files.keys().chain(&before.writes).cloned().collect(),
            None => of_summary(&self.folder).unwrap_or_default(),
        }
    }

    /// A place for what is not finished.
    pub(crate) fn unfinished(&mut self) -> anyhow::Result<&Path> {
        if self.unfinished.is_none() {
            // On the disk of the map, which may be elsewhere through a link.
            let map = self.map();
            let beside = map.parent().unwrap_or(&self.folder);
            let made = tempfile::Builder::new().prefix(UNFINISHED).tempdir_in(beside);
            self.unfinished =
                Some(made.with_context(|| format!("{}: cannot write to it", self.folder.display()))?);
        }
        Ok(self.unfinished.as_ref().map_or(&self.folder, |made| made.path()))
    }

    /// Where the new map is to be written to.
    pub(crate) fn map_file(&mut self) -> anyhow::Result<PathBuf> {
        Ok(self.unfinished()?.join(MAP))
    }

    fn map(&self) -> PathBuf {
        let path = self.folder.join(MAP);
        fs::canonicalize(&path).unwrap_or(path)
    }

    /// The new map is written: says that a set is being made, removes the files of the one before, and puts the map there.
    pub(crate) fn publish(&mut self) -> anyhow::Result<()> {
        let map = self.map_file()?;
        let files = self.before.as_ref().map(|before| before.files.clone()).unwrap_or_default();
        let listed = self.listed();
        // What somebody else wrote under one of the names is not of the set until it is replaced.
        let ours = |name: &&String| listed.contains(name) || !self.folder.join(name).exists();
        let writes = self.writes.iter().filter(ours).cloned().collect();
        let begun = Manifest { complete: false, files, writes, ..self.manifest() };
        begun.write(&self.folder)?;
        // The yaml file first: an image without it is no map.
        let mut old: Vec<&String> = listed.iter().filter(|name| *name != MAP).collect();
        old.sort_by_key(|name| !name.ends_with(".yaml"));
        old.into_iter().try_for_each(|name| self.remove(name))?;
        rename_durable(map, self.map())?;
        self.made = false;
        Ok(())
    }

    fn remove(&self, name: &str) -> anyhow::Result<()> {
        // A name of a file in this folder, and not a way out of it.
        let plain = Path::new(name).file_name().is_some_and(|n| n == name);
        let path = self.folder.join(name);
        match if plain { fs::remove_file(&path) } else { Ok(()) } {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                bail!("{}: cannot remove what an earlier run left: {e}; remove it", path.display())
            }
            _ => Ok(()),
        }
    }

    fn manifest(&self) -> Manifest {
        let program = concat!("portolan ", env!("CARGO_PKG_VERSION")).to_owned();
        let command = self.command.to_owned();
        Manifest { program, command, complete: true, files: BTreeMap::new(), writes: Vec::new() }
    }

    /// All files are written.
    pub(crate) fn complete(self, files: &[&str]) -> anyhow::Result<()> {
        let mut manifest = self.manifest();
        for name in files.iter().filter(|name| **name != Manifest::NAME) {
            manifest.files.insert((*name).to_owned(), FileSum::of(self.folder.join(name))?);
        }
        Ok(manifest.write(&self.folder)?)
    }
}

impl Drop for Results {
    fn drop(&mut self) {
        self.unfinished = None;
        self.lock = None;
        if self.made {
            // Not where something is in it.
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

/// The files that a `summary.json` of this program lists.
fn of_summary(folder: &Path) -> Option<Vec<String>> {
    let summary: Value = serde_json::from_slice(&fs::read(folder.join(SUMMARY)).ok()?).ok()?;
    let ours = summary["program"].as_str().is_some_and(|p| p.starts_with("portolan "));
    let files = summary["files"].as_array().filter(|_| ours)?;
    Some(files.iter().filter_map(Value::as_str).map(str::to_owned).collect())
}
