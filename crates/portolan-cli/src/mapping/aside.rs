//! Maps of sums that are larger than memory: parts on the disk, added up in the end.

use anyhow::{Context, anyhow};
use portolan::Ledger;
use portolan::cell::Sign;
use portolan_io::{LedgerFile, MapFile, MapHeader, add_ledger_files, scans_of_sum};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

use crate::saved::{SavedMap, in_words_of_copies};

/// Ledgers that did not fit into memory together, in files beside the map, which go when the run ends.
pub(crate) struct Aside {
    out: PathBuf,
    folder: Option<TempDir>,
    files: Vec<PathBuf>,
    held: HashSet<(String, u64)>,
    failed: Option<anyhow::Error>,
}

impl Aside {
    /// Nothing yet, for a map in this folder.
    pub(super) fn new(out: &Path) -> Self {
        let (files, held) = Default::default();
        Self { out: out.to_owned(), folder: None, files, held, failed: None }
    }

    /// Whether a scan is in one of them.
    pub(super) fn holds(&self, log: &str, index: u64) -> bool {
        !self.held.is_empty() && self.held.contains(&(log.to_owned(), index))
    }

    /// Writes a ledger into a file.
    pub(super) fn put<const D: usize>(&mut self, ledger: Ledger<D>) -> anyhow::Result<()> {
        self.held.extend(ledger.scans().iter().map(|(log, index, _)| (log.to_owned(), index)));
        let mut part = MapFile::default();
        part.ledger = Some(ledger);
        Ok(part.write(self.next()?)?)
    }

    /// Keeps why one could not be written, for [`Aside::is_empty`] to say.
    pub(super) fn fail(&mut self, error: anyhow::Error) {
        self.failed = Some(error);
    }

    /// Whether there are none.
    ///
    /// # Errors
    /// Where one could not be written.
    pub(super) fn is_empty(&mut self) -> anyhow::Result<bool> {
        self.failed.take().map_or(Ok(self.files.is_empty()), Err)
    }

    /// Whether everything fitted into memory.
    pub(super) fn is_unused(&self) -> bool {
        self.folder.is_none()
    }

    /// A name for the next file.
    fn next(&mut self) -> anyhow::Result<PathBuf> {
        if self.folder.is_none() {
            std::fs::create_dir_all(&self.out)
                .with_context(|| format!("{}: cannot create the folder", self.out.display()))?;
            let made = tempfile::Builder::new().prefix(".portolan-parts-").tempdir_in(&self.out);
            self.folder = Some(made.with_context(|| format!("{}: cannot write to it", self.out.display()))?);
        }
        let folder = self.folder.as_ref().map_or(self.out.as_path(), TempDir::path);
        self.files.push(folder.join(format!("{}.portolan", self.files.len())));
        Ok(self.files[self.files.len() - 1].clone())
    }

    /// The sum of all, as a file with this header, which gets the names of logs and the number of scans.
    /// What is to be said of its scans is returned.
    pub(crate) fn add_up(
        &self,
        file: &mut SavedMap,
        path: &Path,
        memory: u64,
    ) -> anyhow::Result<Option<String>> {
        match file {
            SavedMap::Two(file) => self.add_up_in::<2>(&mut file.header, path, memory),
            SavedMap::Three(file) => self.add_up_in::<3>(&mut file.header, path, memory),
        }
    }

    fn add_up_in<const D: usize>(
        &self,
        header: &mut MapHeader,
        path: &Path,
        memory: u64,
    ) -> anyhow::Result<Option<String>> {
        let mut parts = Vec::new();
        for file in &self.files {
            let opened = LedgerFile::<D>::open(file, memory)?;
            parts.push((opened.ok_or_else(|| anyhow!("{}: holds no sums", file.display()))?, Sign::Plus));
        }
        let scans = scans_of_sum(&parts)?;
        header.logs = scans.logs().map(str::to_owned).collect();
        header.scans = scans.len() as u64;
        add_ledger_files(&parts, header, path)?;
        Ok(in_words_of_copies(scans.copies()))
    }
}
