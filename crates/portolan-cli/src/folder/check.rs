//! What is checked before a file out of a folder of results is read.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use portolan_io::Manifest;

use crate::output::Output;

/// Refuses a derived file of a set that is not whole. Of the pair of a map_server map both are looked at.
pub(crate) fn check_file(path: &Path) -> anyhow::Result<()> {
    Manifest::check(path)?;
    match other(path).filter(|other| other.is_file()) {
        Some(other) => Ok(Manifest::check(&other)?),
        None => Ok(()),
    }
}

/// The other file of a pair of image and place.
fn other(path: &Path) -> Option<PathBuf> {
    match path.extension()?.to_str()? {
        "yaml" => Some(path.with_extension("pgm")),
        "pgm" => Some(path.with_extension("yaml")),
        _ => None,
    }
}

/// The command wrote a file, which may have been one of a set.
pub(crate) fn forget(path: &Path) -> anyhow::Result<()> {
    Manifest::forget(path)?;
    match other(path) {
        Some(other) => Ok(Manifest::forget(&other)?),
        None => Ok(()),
    }
}

/// Says on stderr that the folder of a map is not whole.
pub(crate) fn warn(map: &Path, output: Output) -> anyhow::Result<()> {
    if let Some(words) = half_written(map).filter(|_| !output.quiet) {
        writeln!(io::stderr(), "portolan: warning: {}: {words}", map.display())?;
    }
    Ok(())
}

/// That the files beside a map are not of one set, in words: the map itself is whole.
pub(crate) fn half_written(map: &Path) -> Option<String> {
    let folder = if map.is_dir() { map } else { map.parent()? };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let named = map.is_dir() || map.file_name().is_some_and(|name| name == "map.portolan");
    let manifest = Manifest::read(folder).filter(|manifest| named && !manifest.is_whole(folder))?;
    Some(format!("map.portolan is whole, but the set of files around it is {}", manifest.half()))
}
