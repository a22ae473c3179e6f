//! Files that appear whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::{IoError, Result};

/// So many characters of a file's name (at most four bytes each) are in its temporary one.
const MOST_OF_NAME: usize = 50;
/// Temporary names that are tried where others are in the way.
const MOST_TRIED: u64 = 1 << 20;

/// Removes the temporary file unless it was renamed.
struct Temporary(Option<PathBuf>);

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(path) = self.0.take() {
            // Nothing better can be done here: the first error is the one to report.
            let _ = fs::remove_file(path);
        }
    }
}

/// Writes a file under a temporary name in the same folder and renames it when all of it is written, so that
/// a run that fails or is killed leaves no half file under `path`, and an older file stays until then.
///
/// Devices and pipes (`/dev/stdout`) are written straight to. The data is handed to the system, not forced to
/// the disk.
///
/// # Errors
/// [`IoError::IsFolder`] where `path` is a folder, [`IoError::Os`] where writing fails.
pub fn write_atomic(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<()> {
    let mut write = Some(write);
    // Not generic from here on: compiled once, not once for each thing that is written.
    replace(path.as_ref(), &mut |file| write.take().map_or(Ok(()), |write| write(file)))
}

fn replace(path: &Path, write: &mut dyn FnMut(&mut BufWriter<File>) -> io::Result<()>) -> Result<()> {
    let failed = |e| IoError::os(path, "write it", e);
    // Through a symbolic link the file behind it is replaced, not the link.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    match fs::metadata(&target) {
        Ok(about) if about.is_dir() => return Err(IoError::IsFolder { path: path.into() }),
        Ok(about) if !about.is_file() => {
            let file = OpenOptions::new().write(true).open(&target).map_err(failed)?;
            return finish(file, write).map_err(failed);
        }
        _ => {}
    }
    let Some(name) = target.file_name() else {
        let advice = "name a file in an existing folder";
        return Err(IoError::unwritable(path, "the file name", "missing", advice));
    };
    static COUNT: AtomicU64 = AtomicU64::new(0);
    // Names may have 255 bytes: of a long one the beginning is enough.
    let name: String = name.to_string_lossy().chars().take(MOST_OF_NAME).collect();
    let (file, temporary) = loop {
        let unique = COUNT.fetch_add(1, Ordering::Relaxed);
        let hidden = format!(".{name}.{}.{unique}.tmp", std::process::id());
        let temporary = target.with_file_name(hidden);
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            // Left by a run of the same number that was killed: in a container all are number 1.
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists && unique < MOST_TRIED => {}
            file => break (file.map_err(failed)?, temporary),
        }
    };
    let mut guard = Temporary(Some(temporary.clone()));
    finish(file, write).map_err(failed)?;
    fs::rename(&temporary, &target).map_err(failed)?;
    guard.0 = None;
    Ok(())
}

fn finish(file: File, write: &mut dyn FnMut(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    write(&mut writer)?;
    writer.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{says, temporary};

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let (folder, path) = temporary("map.bin");
        write_atomic(&path, |w| w.write_all(b"old")).unwrap();
        let failed = write_atomic(&path, |w| {
            w.write_all(&[0; 1 << 20])?;
            Err(io::Error::other("disk on fire"))
        });
        says(failed, "map.bin: cannot write it: disk on fire");
        assert_eq!(
            (fs::read(&path).unwrap(), names(folder.path())),
            (b"old".to_vec(), vec!["map.bin".into()])
        );
        write_atomic(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn what_a_killed_run_left_and_long_names_are_not_in_the_way() {
        let (folder, path) = temporary("map.bin");
        for i in 0..200 {
            let left = folder.path().join(format!(".map.bin.{}.{i}.tmp", std::process::id()));
            fs::write(left, b"").unwrap();
        }
        write_atomic(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        let long = folder.path().join("é".repeat(127));
        write_atomic(&long, |w| w.write_all(b"long")).unwrap();
        assert_eq!(fs::read(&long).unwrap(), b"long");
    }

    #[test]
    fn folders_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(write_atomic(folder.path(), |_| Ok(())), Err(IoError::IsFolder { .. })));
        let nowhere = folder.path().join("none").join("map.bin");
        assert!(matches!(write_atomic(nowhere, |_| Ok(())), Err(IoError::Os { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_stay_what_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, b"old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_atomic(&link, |w| w.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        write_atomic("/dev/null", |w| w.write_all(b"gone")).unwrap();
    }
}
