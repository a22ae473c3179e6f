//! Files under names that nobody else has, for as long as they are written, and those that killed runs left.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// What the names of all of them have.
const MARK: &str = ".portolan-";
const END: &str = ".tmp";
/// Names that are tried.
const MOST_TRIED: usize = 1 << 10;

/// A file that is being written. It is locked, which says that somebody writes to it, and is removed unless it gets
/// its name.
pub(super) struct Temporary {
    path: PathBuf,
    file: File,
    named: bool,
}

impl Temporary {
    /// Beside `target`, under a name that begins with `name`.
    pub(super) fn beside(target: &Path, name: &str) -> io::Result<Self> {
        for _ in 0..MOST_TRIED {
            // Not of numbers of processes: in a container all runs have number 1.
            let unique = RandomState::new().hash_one(name);
            let path = target.with_file_name(format!(".{name}{MARK}{unique:016x}{END}"));
            let file = match OpenOptions::new().write(true).create_new(true).open(&path) {
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => continue,
                file => file?,
            };
            // Until it is locked, another run may take it for a left-over: then it is gone, or about to be.
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => continue,
                // Without locks on this file system nobody sweeps there.
                Ok(()) | Err(TryLockError::Error(_)) if path.exists() => {
                    return Ok(Self { path, file, named: false });
                }
                _ => {}
            }
        }
        Err(io::Error::new(io::ErrorKind::AlreadyExists, "no name is free for the temporary file"))
    }

    pub(super) fn file(&self) -> &File {
        &self.file
    }

    /// Gives it its name, at which another file may be. Locked until then: nobody sweeps it away.
    pub(super) fn name(mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        self.named = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.named {
            // Nothing better can be done here: the first error is the one to report.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Removes what runs that were killed left in a folder. Files that somebody writes to are locked and stay.
pub(super) fn sweep(folder: &Path) {
    // Of what cannot be listed, opened or removed nothing is lost.
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let ours = name.starts_with('.') && name.contains(MARK) && name.ends_with(END);
        if !ours || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let Ok(file) = OpenOptions::new().write(true).open(entry.path()) else { continue };
        if file.try_lock().is_ok() {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Sweeps a folder unless it was the last one that was swept: not for each of thousands of files again.
pub(super) fn sweep_once(folder: &Path) {
    static LAST: Mutex<Option<PathBuf>> = Mutex::new(None);
    // Whoever panicked while holding it left a path or none.
    let mut last = LAST.lock().unwrap_or_else(|held| held.into_inner());
    if last.as_deref() != Some(folder) {
        sweep(folder);
        *last = Some(folder.to_owned());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_to_stays_and_what_was_left_goes() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let alive = Temporary::beside(&at("map.bin"), "map.bin").unwrap();
        for name in [".map.bin.portolan-0123456789abcdef.tmp", ".b.portolan-0.tmp"] {
            fs::write(at(name), b"half").unwrap();
        }
        let others = [".portolan-notes.txt", "a.portolan-1.tmp", ".map.bin.1.0.tmp", "map.bin"];
        others.iter().for_each(|name| fs::write(at(name), b"mine").unwrap());
        fs::create_dir(at(".d.portolan-2.tmp")).unwrap();
        sweep(folder.path());
        let mut left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().path()).collect();
        let mut want: Vec<_> = others.iter().map(|name| at(name)).collect();
        want.extend([alive.path.clone(), at(".d.portolan-2.tmp")]);
        left.sort();
        want.sort();
        assert_eq!(left, want);
        let path = alive.path.clone();
        drop(alive);
        assert!(!path.exists(), "what was not named is removed");
    }

    #[test]
    fn writers_and_sweepers_do_not_lose_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let done = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    while !done.load(std::sync::atomic::Ordering::Relaxed) {
                        sweep(folder.path());
                    }
                });
            }
            for i in 0..2000 {
                let target = folder.path().join(format!("{}", i % 7));
                Temporary::beside(&target, "x").unwrap().name(&target).unwrap();
            }
            done.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 7);
    }
}
