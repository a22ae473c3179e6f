//! Files that appear whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::temporary::{Temporary, sweep_once};
use crate::{IoError, Result};

/// So many characters of a file's name (at most four bytes each) are in its temporary one.
const MOST_OF_NAME: usize = 50;

/// Writes a file under a temporary name in the same folder and renames it when all of it is written, so that
/// a run that fails or is killed leaves no half file under `path`, and an older file stays until then. What killed runs
/// left under temporary names in that folder is removed, and is in nobody's way.
///
/// Devices and pipes (`/dev/stdout`) are written straight to. The data is handed to the system, not forced to
/// the disk: [`write_durable`] does that.
///
/// # Errors
/// [`IoError::IsFolder`] where `path` is a folder, [`IoError::Os`] where writing fails.
pub fn write_atomic(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<()> {
    let mut write = Some(write);
    // Not generic from here on: compiled once, not once for each thing that is written.
    replace(path.as_ref(), false, &mut |file| write.take().map_or(Ok(()), |write| write(file)))
}

/// [`write_atomic`], and the file is on the disk when it has its name, and its name when this returns: of what a power
/// failure leaves, it is whole, the old or the new one.
///
/// # Errors
/// As [`write_atomic`].
pub fn write_durable(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<()> {
    let mut write = Some(write);
    replace(path.as_ref(), true, &mut |file| write.take().map_or(Ok(()), |write| write(file)))
}

/// Renames a file, and the new name is on the disk when this returns.
///
/// # Errors
/// [`IoError::Os`] where that fails.
pub fn rename_durable(from: impl AsRef<Path>, to: impl AsRef<Path>) -> Result<()> {
    let to = to.as_ref();
    fs::rename(from, to).and_then(|()| sync_folder_of(to)).map_err(|e| IoError::os(to, "write it", e))
}

/// Forces the names in the folder of a file to the disk, where the system has a way to.
fn sync_folder_of(path: &Path) -> io::Result<()> {
    #[cfg(unix)]
    {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        match File::open(folder).and_then(|folder| folder.sync_all()) {
            // Some network file systems sync files alone.
            Err(e) if matches!(e.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => {}
            synced => synced?,
        }
    }
    #[cfg(not(unix))]
    let _ = path;
    Ok(())
}

/// A file that is written and has not got its name yet.
pub(crate) struct Prepared<'a> {
    path: &'a Path,
    durable: bool,
    /// `None`: a device or pipe, which has got its bytes already.
    temporary: Option<(Temporary, PathBuf)>,
}

impl Prepared<'_> {
    /// Gives it its name.
    pub(crate) fn publish(self) -> Result<()> {
        let Some((temporary, target)) = self.temporary else { return Ok(()) };
        let synced = |()| if self.durable { sync_folder_of(&target) } else { Ok(()) };
        temporary.name(&target).and_then(synced).map_err(|e| IoError::os(self.path, "write it", e))
    }
}

/// Writes a file as [`write_atomic`] does, and leaves it without its name: what fails does so before others are replaced.
pub(crate) fn prepare(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<Prepared<'_>> {
    let mut write = Some(write);
    prepared(path, false, &mut |file| write.take().map_or(Ok(()), |write| write(file)))
}

type Writes<'a> = &'a mut dyn FnMut(&mut BufWriter<&File>) -> io::Result<()>;

fn replace(path: &Path, durable: bool, write: Writes) -> Result<()> {
    prepared(path, durable, write)?.publish()
}

fn prepared<'a>(path: &'a Path, durable: bool, write: Writes) -> Result<Prepared<'a>> {
    let failed = |e| IoError::os(path, "write it", e);
    // Through a symbolic link the file behind it is replaced, not the link.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    match fs::metadata(&target) {
        Ok(about) if about.is_dir() => return Err(IoError::IsFolder { path: path.into() }),
        Ok(about) if !about.is_file() => {
            let file = OpenOptions::new().write(true).open(&target).map_err(failed)?;
            finish(&file, write).map_err(failed)?;
            return Ok(Prepared { path, durable, temporary: None });
        }
        _ => {}
    }
    let Some(name) = target.file_name() else {
        let advice = "name a file in an existing folder";
        return Err(IoError::unwritable(path, "the file name", "missing", advice));
    };
    let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    sweep_once(folder);
    // Names may have 255 bytes: of a long one the beginning is enough.
    let name: String = name.to_string_lossy().chars().take(MOST_OF_NAME).collect();
    let temporary = Temporary::beside(&target, &name).map_err(failed)?;
    finish(temporary.file(), write).map_err(failed)?;
    if durable {
        temporary.file().sync_all().map_err(failed)?;
    }
    Ok(Prepared { path, durable, temporary: Some((temporary, target)) })
}

fn finish(file: &File, write: Writes) -> io::Result<()> {
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
        write_durable(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn what_a_killed_run_left_and_long_names_are_not_in_the_way() {
        let (folder, path) = temporary("map.bin");
        for i in 0..200 {
            for left in [format!(".map.bin.{}.{i}.tmp", std::process::id()), format!(".a.portolan-{i}.tmp")] {
                fs::write(folder.path().join(left), b"").unwrap();
            }
        }
        write_atomic(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert!(!names(folder.path()).iter().any(|name| name.contains(".portolan-")), "not swept");
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
