//! One run at a time in a folder.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

const NAME: &str = ".portolan.lock";
/// Bytes of what stands in it that are shown.
const SHOWN: u64 = 300;

/// A file that this run has locked. The lock is the system's: it goes when the run ends, however it ends. What stands in the
/// file only says who holds it.
pub(super) struct FolderLock {
    path: PathBuf,
    /// `None`: this file system has no locks.
    _file: Option<File>,
}

impl FolderLock {
    /// Locks a folder, which this run can write to if that succeeds.
    ///
    /// # Errors
    /// Where another run holds it, or nothing can be written there.
    pub(super) fn take(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(NAME);
        loop {
            let cannot =
                || format!("{}: cannot write to it; name a folder that can be written to", folder.display());
            let mut file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(&path)
                .with_context(cannot)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => bail!("{}: {}", folder.display(), held_by(&mut file)),
                // Nobody else is kept out; all the rest goes on.
                Err(TryLockError::Error(_)) => return Ok(Self { path, _file: None }),
            }
            let who = who();
            file.set_len(0).and_then(|()| file.write_all(who.as_bytes())).with_context(cannot)?;
            // Whoever held it before may have removed it after it was opened here: then it keeps nobody out.
            if fs::read_to_string(&path).is_ok_and(|text| text == who) {
                return Ok(Self { path, _file: Some(file) });
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // While it is locked. A left-over would be in nobody's way.
        let _ = fs::remove_file(&self.path);
    }
}

fn who() -> String {
    let words: Vec<_> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    let call: String = words.join(" ").chars().map(|c| if c.is_control() { '?' } else { c }).collect();
    format!("process {} ({call})", std::process::id())
}

fn held_by(file: &mut File) -> String {
    let mut who = Vec::new();
    // Whoever has just taken it may not have written yet.
    let _ = file.take(SHOWN).read_to_end(&mut who);
    let who = String::from_utf8_lossy(&who);
    let who = if who.is_empty() { "another run" } else { who.trim() };
    format!("{who} is writing to this folder; wait until it has ended, or name another folder")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_run_is_told_who_writes() {
        let folder = tempfile::tempdir().unwrap();
        let held = FolderLock::take(folder.path()).unwrap();
        let refused = FolderLock::take(folder.path()).err().unwrap().to_string();
        assert!(refused.contains(&format!("process {} (", std::process::id())), "{refused}");
        drop(held);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        // Of a killed run.
        fs::write(folder.path().join(NAME), "process 1 (portolan map)").unwrap();
        drop(FolderLock::take(folder.path()).unwrap());
    }

    #[test]
    fn never_two_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let inside = std::sync::atomic::AtomicUsize::new(0);
        let taken = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..500 {
                        let Ok(lock) = FolderLock::take(folder.path()) else { continue };
                        assert_eq!(inside.fetch_add(1, std::sync::atomic::Ordering::SeqCst), 0);
                        taken.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
                        inside.fetch_sub(1, std::sync::atomic::Ordering::SeqCst);
                        drop(lock);
                    }
                });
            }
        });
        assert!(taken.into_inner() > 100);
    }
}
